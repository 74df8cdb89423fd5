"""A search for the shortest retimed cycle from end to end."""

from pathlib import Path

import pytest
from builders.layout_search import searched_pair

from cellplan import LayoutResult, load_cell, solve
from cellplan.search.programs.objective import CycleTiming

pytestmark = [pytest.mark.usefixtures("stored_solutions"), pytest.mark.slow]
SETTINGS = (
    "tasks.circle.tolerance={position_mm: 0.1, orientation_deg: 0.05, between_rows_mm: 20, between_rows_deg: 20}",
    "acceleration={full_speed_in_s: 0.25}",
    "motion.jerk_build_up_s=unlimited",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("retimed")


@pytest.fixture(scope="module")
def searched(folder: Path) -> LayoutResult:
    return searched_pair(folder, *SETTINGS, timing=CycleTiming.RETIMED)


def test_the_result_is_retimed_and_passes_solve(searched: LayoutResult, folder: Path) -> None:
    cell = load_cell(folder / "study" / "best.yaml")
    solution = solve(cell)

    best = searched.record["best"]
    assert best is not None
    assert "timing: fastest" in (folder / "study" / "best.yaml").read_text()
    assert solution.passed
    assert solution.motion.times[-1] == best["cycle_s"]


def test_the_search_and_the_program_agree_about_the_cycle(searched: LayoutResult) -> None:
    best = searched.best
    assert best is not None
    assert best.program is not None
    step = best.program.solution.cell.motion.step
    assert best.program.cycle == pytest.approx(best.standing.measures.cycle, rel=0.02, abs=1.5 * step)


def test_effects_of_the_variables_are_derivatives_of_the_retimed_cycle(searched: LayoutResult) -> None:
    effects = [variable["cycle_s"] for variable in searched.record["variables"]]
    assert all(effect is not None for effect in effects)
