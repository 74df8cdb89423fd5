"""Assignment and layout in turn: when it ends, what is the best, and a whole alternation."""

from pathlib import Path

import pytest

from cellplan import LayoutRequest, Stop, load_cell, solve
from cellplan.jobs.alternate import AlternationStep, alternate, alternation_lines, alternation_record, best_step, gains

DRAFT = Path(__file__).resolve().parents[2] / "examples" / "open_tasks" / "open_frame.yaml"


def _steps(*cycles: float | None) -> list[AlternationStep]:
    kinds = ("assign", "layout")
    return [
        AlternationStep(kind=kinds[place % 2], folder=Path(f"{place // 2 + 1}-{kinds[place % 2]}"), cycle=cycle)
        for place, cycle in enumerate(cycles)
    ]


def test_it_goes_on_while_the_cycle_falls_by_half_a_percent() -> None:
    assert gains(_steps(50.0))
    assert gains(_steps(50.0, 49.0))
    assert not gains(_steps(50.0, 49.9))
    assert not gains(_steps(50.0, 49.0, None))


def test_an_assignment_that_does_not_pass_still_has_its_layout_searched() -> None:
    assert gains(_steps(None))
    assert gains(_steps(None, 60.0))


def test_the_best_is_the_shortest_that_passed() -> None:
    steps = _steps(50.0, 48.0, 48.5)
    best = best_step(steps)
    assert best is steps[1]
    assert alternation_record(steps)["best"] == "1-layout"
    lines = alternation_lines(steps)
    assert lines[0] == "CERTIFIED: cycle 48 s"
    assert lines[-1] == "cell: 1-layout/best.yaml"
    assert alternation_lines(_steps(None))[0] == "NOTHING CERTIFIED"


@pytest.mark.slow
def test_a_draft_becomes_a_program_with_moved_bases_that_passes_solve(tmp_path: Path) -> None:
    steps = alternate(LayoutRequest(cell=DRAFT), tmp_path / "steps", stop=Stop(trials=1))
    best = best_step(steps)
    assert best is not None
    assert steps[0].kind == "assign"
    assert best.cycle is not None
    assert best.cycle <= (steps[0].cycle or 0.0)
    solution = solve(load_cell(best.folder / "best.yaml"))
    assert solution.passed
    assert solution.motion.times[-1] == pytest.approx(best.cycle)
