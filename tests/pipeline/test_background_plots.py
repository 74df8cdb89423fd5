"""Plots drawn in the background are those drawn here, byte for byte, whatever becomes of the child."""

import threading
from dataclasses import replace
from pathlib import Path

import pytest
from builders import crashing_jobs

from cellplan.checks.clearance.check import UNKNOWN
from cellplan.checks.verify import verify_motion, with_clearance
from cellplan.guard import BackgroundProcess
from cellplan.io.cell.load import load_cell
from cellplan.io.run.joint_tables import parse_table
from cellplan.pipeline.background_plots import BackgroundPlots
from cellplan.pipeline.overrides import with_overrides
from cellplan.pipeline.solution import Solution
from cellplan.pipeline.solve import solve, solve_with_plots
from cellplan.pipeline.write_run import write_run
from cellplan.report.plots.run import draw_plots
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("two_processors")


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def cell_file(sound: Path) -> Path:
    return sound / "cell" / "small.yaml"


@pytest.fixture(scope="module")
def solution(cell_file: Path) -> Solution:
    return solve(load_cell(cell_file))


@pytest.mark.parametrize("mode", [pytest.param("simultaneous", marks=pytest.mark.slow), "pairwise"])
def test_a_run_folder_is_the_same_with_and_without_a_child(cell_file: Path, tmp_path: Path, mode: str) -> None:
    cell = with_overrides(load_cell(cell_file), mode=mode)
    write_run(solve(cell), tmp_path / "foreground")
    with BackgroundProcess() as background:
        plots = BackgroundPlots(background)
        write_run(solve_with_plots(cell, plots), tmp_path / "background", plots=plots)

    assert files(tmp_path / "background") == files(tmp_path / "foreground")
    assert any(name.endswith("clearance.png") for name in files(tmp_path / "foreground"))


def test_plots_are_drawn_here_when_the_child_has_crashed(solution: Solution) -> None:
    report, cell = solution.runs[0].report, solution.cell
    with BackgroundProcess() as background:
        plots = BackgroundPlots(background)
        background.begin(crashing_jobs.leave)
        plots.begin(report, cell=cell)
        drawn = plots.pictures(report, cell=cell)()

    assert drawn == draw_plots(report, cell=cell)


def test_plots_begun_with_other_figures_are_not_taken_for_these(solution: Solution) -> None:
    report, cell = solution.runs[0].report, solution.cell
    other = replace(report, q={robot: 0.5 * values for robot, values in report.q.items()})
    with BackgroundProcess() as background:
        plots = BackgroundPlots(background)
        plots.begin(other, cell=cell)
        plots.begin(report, cell=cell)
        drawn = plots.pictures(report, cell=cell)

        assert drawn() == draw_plots(report, cell=cell)
        assert plots.pictures(other, cell=cell)() == draw_plots(other, cell=cell) != drawn()


def test_plots_without_a_child_starts_nothing(solution: Solution) -> None:
    before = threading.active_count()
    plots = BackgroundPlots()
    plots.begin(solution.runs[0].report, cell=solution.cell)

    assert threading.active_count() == before
    assert plots.pictures(solution.runs[0].report, cell=solution.cell)() == draw_plots(
        solution.runs[0].report, cell=solution.cell
    )


def test_the_clearance_completes_a_report_that_had_none(solution: Solution) -> None:
    run = solution.runs[0]
    scene = Scene.from_cell(solution.cell)
    tables = [parse_table(text, robot) for robot, text in run.program.tables.items()]

    motion = verify_motion(scene, run.schedule, tables, moving=run.moving)
    assert motion.clearance is UNKNOWN
    assert not {"clearance", "collision"} & {check.name for check in motion.checks}

    whole = with_clearance(motion, scene, run.schedule)
    assert whole.checks == run.report.checks
    assert whole.clearance.minima == run.report.clearance.minima
