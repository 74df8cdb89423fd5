"""The rows of a program with the poses of its tools, for its wide table: of a solution, or of a verified run."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import JointTable, Motion, Schedule
from cellplan.model.report.report import Report
from cellplan.model.report.verified_run import VerifiedMotion, VerifiedRun
from cellplan.programs.formats.wide import PhaseRows, WideRows, file_name, read_wide, render_wide
from cellplan.scene.kinematics.screw_chain import ScrewChain

if TYPE_CHECKING:
    from cellplan.runs.solution import Solution

Checked = tuple[Cell, Schedule, Report]  # a phase: the cell as it is in it, its schedule and its report


def solution_rows(solution: "Solution") -> WideRows:
    """All rows of a solution, gaps between its phases included."""
    checked = [(run.cell, run.schedule, run.report) for run in solution.runs]
    return _program_rows(solution.cell, solution.motion, checked)


def verified_rows(run: VerifiedRun) -> WideRows:
    """All rows of a verified run, gaps between its phases included."""
    return _program_rows(run.cell, run.motion, [_checked(motion) for motion in run.motions])


def render_wide_tables(run: VerifiedRun) -> dict[str, str]:
    """Text of every wide table, by its path in the folder of the export: one for each program of the run."""
    return {file_name(name): render_wide(rows) for name, rows in _programs(run)}


def read_wide_tables(run: VerifiedRun, files: Mapping[str, str]) -> tuple[dict[str, JointTable], ...]:
    """Read what ``render_wide_tables`` gives back, strictly: the joint tables of each motion of their run, by robot."""
    return run.by_phase([read_wide(run.cell, files[path], path) for path in map(file_name, run.programs)])


def _programs(run: VerifiedRun) -> Iterator[tuple[str | None, WideRows]]:
    """The rows of every program of a run, by its name."""
    sigma, process = run.motion.sigma, run.motion.plan.process
    for piece, tables in zip(run.motion.pieces, run.programs.values(), strict=True):
        times = next(iter(tables.values())).times
        phases = [
            _phase_rows(phase.name, rows, _checked(run.motions[place % len(run.motions)]))
            for place, phase, rows in piece.phases
        ]
        yield piece.name, WideRows(cell=run.cell, times=times, sigma=sigma[piece.rows], phases=phases, process=process)


def _program_rows(cell: Cell, motion: Motion, checked: Sequence[Checked]) -> WideRows:
    """All rows of a program; cycles after the first one repeat the phases of the first."""
    phases = [
        _phase_rows(phase.name, motion.rows(phase), checked[place % len(checked)])
        for place, phase in enumerate(motion.plan.program)
    ]
    return WideRows(cell=cell, times=motion.times, sigma=motion.sigma, phases=phases, process=motion.plan.process)


def _phase_rows(name: str, rows: slice, checked: Checked) -> PhaseRows:
    """A phase with the poses of its tools."""
    cell, schedule, report = checked
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    X_WT = {robot: chain.tool_poses(report.q[robot]) for robot, chain in chains.items()}
    X_WP = part_poses(cell, chains, report.q)
    return PhaseRows(name=name, rows=rows, schedule=schedule, report=report, X_WT=X_WT, X_WP=X_WP)


def _checked(motion: VerifiedMotion) -> Checked:
    return motion.cell, motion.schedule, motion.report
