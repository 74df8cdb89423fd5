"""Plots painted aside are those painted here, byte for byte, whatever becomes of the child."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest
from builders import crashing_jobs

from cellplan.guard import BackgroundProcess
from cellplan.io.cell.load import load_cell
from cellplan.pipeline.background_plots import BackgroundPlots
from cellplan.pipeline.overrides import with_overrides
from cellplan.pipeline.solution import Solution
from cellplan.pipeline.solve import solve
from cellplan.pipeline.write_run import write_run
from cellplan.report.plots.run import draw_plots


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def cell_file(sound: Path) -> Path:
    return sound / "cell" / "small.yaml"


@pytest.fixture(scope="module")
def solution(cell_file: Path) -> Solution:
    return solve(load_cell(cell_file))


@pytest.mark.parametrize("mode", ["simultaneous", "pairwise"])
def test_a_run_folder_is_the_same_with_and_without_a_child(cell_file: Path, tmp_path: Path, mode: str) -> None:
    cell = with_overrides(load_cell(cell_file), mode=mode)
    write_run(solve(cell), tmp_path / "alone")
    with BackgroundProcess() as aside:
        drawing = BackgroundPlots(aside)
        write_run(solve(cell, drawing=drawing), tmp_path / "aside", drawing=drawing)

    assert files(tmp_path / "aside") == files(tmp_path / "alone")
    assert any(name.endswith("clearance.png") for name in files(tmp_path / "alone"))


def test_plots_are_painted_here_when_the_child_has_crashed(solution: Solution) -> None:
    report, cell = solution.runs[0].report, solution.cell
    with BackgroundProcess() as aside:
        drawing = BackgroundPlots(aside)
        aside.begin(crashing_jobs.leave)
        drawing.begin(report, cell=cell)
        painted = drawing.pictures(report, cell=cell)()

    assert painted == draw_plots(report, cell=cell)


def test_plots_begun_with_other_figures_are_not_taken_for_these(solution: Solution) -> None:
    report, cell = solution.runs[0].report, solution.cell
    other = replace(report, q={robot: 0.5 * values for robot, values in report.q.items()})
    with BackgroundProcess() as aside:
        drawing = BackgroundPlots(aside)
        drawing.begin(other, cell=cell)
        drawing.begin(report, cell=cell)
        painted = drawing.pictures(report, cell=cell)

        assert painted() == draw_plots(report, cell=cell)
        assert drawing.pictures(other, cell=cell)() == draw_plots(other, cell=cell) != painted()


def test_drawing_without_a_child_starts_nothing(solution: Solution) -> None:
    before = threading.active_count()
    drawing = BackgroundPlots()
    drawing.begin(solution.runs[0].report, cell=solution.cell)

    assert threading.active_count() == before
    assert drawing.pictures(solution.runs[0].report, cell=solution.cell)() == draw_plots(
        solution.runs[0].report, cell=solution.cell
    )
