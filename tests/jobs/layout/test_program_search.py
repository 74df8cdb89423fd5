"""A search of a program from end to end, and what is refused of programs."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from builders.home_to_home import PICK_AND_PLACE
from builders.study_trials import InThisProcess

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve
from cellplan.errors import InputError
from cellplan.jobs.layout.search import _Search
from cellplan.jobs.layout.trials.searched import searched_cell
from cellplan.model.progress import silent
from cellplan.search.programs.objective import CycleTiming, Objective

VARIANT = SimpleNamespace(values={"kind": "given"})
CELL = Path(__file__).resolve().parents[3] / "cells" / "three_tasks_each.yaml"


@pytest.mark.slow
def test_a_program_becomes_shorter_by_moved_bases_and_passes_solve(tmp_path: Path) -> None:
    request = LayoutRequest(cell=CELL, settings=("motion.timing=fastest",))

    result = search_layout(request, tmp_path / "study", stop=Stop(trials=1), workers=InThisProcess())

    best, given = result.record["best"], result.record["given"]
    assert best is not None
    cell = load_cell(tmp_path / "study" / "best.yaml")
    solution = solve(cell)
    assert solution.passed
    assert solution.motion.times[-1] == pytest.approx(best["cycle_s"])
    assert best["cycle_s"] < 0.95 * given["cycle_s"]
    for section in ("environment", "program"):  # tables and columns stay, and where the part comes from
        assert cell.origin.document[section] == load_cell(CELL).origin.document[section]
    assert all(task.start_posture is not None for task in cell.tasks)
    assert all(variable["cycle_s"] is not None for variable in result.record["variables"])


@pytest.mark.slow
def test_a_program_as_it_is_written_gets_shorter_transfers(tmp_path: Path) -> None:
    request = LayoutRequest(cell=CELL, settings=("motion.duration_s=3",))

    result = search_layout(request, tmp_path / "study", stop=Stop(trials=1), workers=InThisProcess())

    best, given = result.record["best"], result.record["given"]
    assert best is not None
    assert best["cycle_s"] < given["cycle_s"]
    works = [phase for phase in result.best.program.solution.runs if phase.phase.name.startswith("work")]
    assert [phase.report.cycle_time for phase in works] == pytest.approx([3.0] * 3)


@pytest.mark.slow
def test_a_program_keeps_its_demands_with_misplaced_bases(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.jobs.layout.finish.misplacement.OF_PROGRAM", 2)
    monkeypatch.setattr("cellplan.search.misplacement.robust.MOST", 1)
    path = tmp_path / "cell.yaml"
    path.write_text(PICK_AND_PLACE)
    request = LayoutRequest(cell=path, objective=Objective.CONFORMING, misplacement=(2.0, 0.2))

    result = search_layout(request, tmp_path / "study", stop=Stop(trials=1), workers=InThisProcess())

    record = result.record["misplacement"]
    assert record is not None
    assert (record["seeded_kept"], record["ends_kept"]) == (2, 14)
    assert record["by_derivatives_kept"] == record["by_derivatives"] > 0
    best = load_cell(tmp_path / "study" / "best.yaml")
    limit = next(it for it in record["tolerances"] if (it["robot"], it["direction"]) == ("pen", "x"))
    assert limit["plus"] >= 2.0
    for sign in (1.0, -1.0):  # transfers and homes are planned with the displaced base too
        x = 1e3 * float(best.robot("pen").X_WB[0, 3]) + 2.0 * sign
        displaced = solve(best.with_values({"robots.pen.base.x_mm": x}))
        assert displaced.passed
        assert displaced.motion.times[-1] <= record["cycle_s"] + 1e-9


def test_a_program_whose_estimate_is_longer_than_a_certified_one_is_not_solved() -> None:
    certified = {0: 9.0, 1: 8.5, 2: 8.2}
    finalists = [
        SimpleNamespace(trial=SimpleNamespace(number=number, passed=True, figures={"cycle_s": cycle}, variant=VARIANT))
        for number, cycle in enumerate([8.0, 8.8, 8.9, 8.95])
    ]
    finish = SimpleNamespace(
        ordered=lambda _: finalists,
        certified=lambda finalist: SimpleNamespace(
            trial=finalist.trial.number, passed=True, cycle=certified[finalist.trial.number]
        ),
        learned=lambda _, result: result,
    )
    ready = SimpleNamespace(phases=True, variables=SimpleNamespace(settings=SimpleNamespace(misplacement=None)))
    nothing: Any = None
    search = _Search(
        request=LayoutRequest(cell=CELL),
        folder=nothing,
        ready=cast("Any", ready),
        workers=1,
        stop=Stop(trials=1),
        progress=silent,
        finish=cast("Any", finish),
        proposals=nothing,
    )
    finished = SimpleNamespace(trials=[it.trial for it in finalists])

    best = search._best(cast("Any", finished))

    assert best is not None
    assert best.trial == 1
    assert sorted(search.tried) == [0, 1]


def _refusal(**changes: object) -> str:
    with pytest.raises(InputError) as caught:
        searched_cell(LayoutRequest(cell=CELL, **changes))
    return str(caught.value)


def test_what_a_search_cannot_change_in_a_program_is_one_line() -> None:
    assert "got robots.holder.path; leave it out" in _refusal(free=("path",))
    assert "got robots.left.branch; leave it out" in _refusal(vary=("left.branch",))
    assert "write fastest" in _refusal(settings=("motion.timing={cycle_s: 20}",))


def test_programs_may_be_retimed_and_may_only_have_to_conform() -> None:
    several: tuple[dict[str, Any], ...] = (
        {"timing": CycleTiming.RETIMED},
        {"objective": Objective.CONFORMING},
        {"free": ("start", "spin")},
        {"misplacement": (1.0, 1.0)},
        {"vary": ("tasks.left_edge.robot=[left, right]",)},
    )
    for changes in several:
        assert searched_cell(LayoutRequest(cell=CELL, **changes)).program.is_home_to_home
