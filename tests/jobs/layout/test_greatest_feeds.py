"""The greatest feed over a layout: what is improved is the feed, and what comes of it holds."""

import re
from pathlib import Path

import pytest
from builders.layout_search import CELL
from builders.study_trials import InThisProcess

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve
from cellplan.errors import InputError
from cellplan.search.programs.objective import CycleTiming, Objective

pytestmark = pytest.mark.usefixtures("stored_solutions")

PROCESS = "    process: {feed_mm_s: greatest, ramp_mm: 60}\n    tolerance: {position_mm: 0.1, orientation_deg: 0.1}\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    text = re.sub(r"    tolerance: .*\n", PROCESS, CELL.read_text(encoding="utf-8"))
    text = re.sub(r"motion: .*\nacceleration: .*\n", "motion: {mode: simultaneous, step_s: 0.004}\n", text)
    written = tmp_path / "given.yaml"
    written.write_text(text, encoding="utf-8")
    return written


def feed_of(file: Path) -> float:
    (run,) = solve(load_cell(file)).runs
    (answer,) = run.report.greatest_feeds
    assert run.report.passed
    return answer.feed


@pytest.mark.slow
def test_a_better_layout_has_a_greater_feed_that_its_file_states(file: Path) -> None:
    request = LayoutRequest(cell=file, vary=("right.base={x_mm: [1500, 2300], y_mm: [0, 600]}",))

    result = search_layout(request, file.parent / "study", stop=Stop(trials=1), workers=InThisProcess())

    assert result.record["status"] == "certified"
    best = file.parent / "study" / "best.yaml"
    assert re.search(r"feed_mm_s: \d+", best.read_text(encoding="utf-8"))
    assert feed_of(best) > 1.02 * feed_of(file)
    (remark,) = [it for it in result.record["remarks"] if "greatest feed" in it]
    assert re.fullmatch(r"task circle: greatest feed \S+ mm/s; .+ at \S+ mm", remark)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objective": Objective.CONFORMING}, "expected a number beside --objective conforming, got a feed to seek"),
        ({"timing": CycleTiming.RETIMED}, "expected a number beside --timing retimed, got a feed to seek"),
        ({"misplacement": (5.0, 0.5)}, "expected a number where bases are misplaced, got a feed to seek"),
        (
            {"settings": ("tasks.circle.process.ramp_mm=null",)},
            "process.ramp_s: expected ramp_mm where the greatest feed is sought over a layout",
        ),
    ],
)
def test_a_search_that_does_not_scale_with_the_feed_is_refused(
    file: Path, changes: dict[str, object], message: str
) -> None:
    request = LayoutRequest(cell=file, **changes)  # type: ignore[arg-type]

    with pytest.raises(InputError, match=re.escape(message)):
        search_layout(request, file.parent / "study", stop=Stop(trials=1), workers=InThisProcess())
