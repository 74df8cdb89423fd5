"""Judgement of a live cell at rest: planned and checked as ``solve`` does, on a coarser clock, piece by piece.

The motion between two rows is linear in the joints, on a clock of a thousand rows as on the finer one of the cell, and
the certificate holds at all times between rows. So the verdict is that of ``solve`` up to what a tool, which is on its
path at every row, is beside it between two of them: some micrometres.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import scene_of_run, with_straight_move
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.checks.clearance.phase_ends import JudgedPhase, with_phase_ends
from cellplan.checks.joints.joins import with_joins
from cellplan.checks.task_rules import with_task_rules
from cellplan.checks.verify import verify_motion, with_clocks
from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.view.write import placed_scene
from cellplan.model.cell.cell import Cell, stacked_positions
from cellplan.model.motion.motion import JointTable, Schedule
from cellplan.model.progress import silent
from cellplan.model.report.check_kinds import CHECK_KINDS
from cellplan.model.report.report import Report
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.planning.timing.schedule import clock_paths
from cellplan.runs.plan.run import plan_run
from cellplan.runs.solve import solve_motion
from cellplan.scene.scene import Scene
from cellplan.session.blocks import Block
from cellplan.session.motion import coarser

ROWS_AT_ONCE: Final = 250  # [-] of which the certificate is asked in one piece
NEAR: Final = 0.05  # [m] within which the pair is looked for that a failed certificate is about


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judgement:
    """What is known of a block at rest."""

    is_done: bool = False  # whether everything was asked
    lines: tuple[str, ...] = ()  # what fails, as reports word it
    lost: str = ""  # why there is no motion; empty where there is one
    report: Report | None = None  # of the block
    times: Array = field(default_factory=lambda: np.empty(0))  # of its rows in [s], shape (N,)
    q: Array = field(default_factory=lambda: np.empty((0, 0)))  # its rows in [rad] or [m], shape (N, nq)
    is_clear: bool | None = None  # whether the certificate holds; None while that is not known

    @property
    def passed(self) -> bool:
        """Whether nothing fails that was asked."""
        return not self.lost and not self.lines


def judged(cell: Cell, block: Block, first: Scene) -> Iterator[Judgement]:
    """What is known of a block, more from piece to piece; nothing of the straight moves that grip or put down a part.

    Args:
        cell: The cell as it would be saved.
        block: The block of the live cell that is shown.
        first: The scene of the given layout.
    """
    if block.stage.move is not None:
        return
    try:
        phase = _planned(cell, block, first)
    except (InputError, NoSolutionError) as error:
        yield Judgement(is_done=True, lost=reason(cell, error))
        return
    q = stacked_positions(cell, phase.report.q)
    known = Judgement(report=phase.report, times=phase.schedule.times, q=q, lines=_failed([phase.report]))
    yield known
    unclear = ""
    for unclear in _unclear(phase.scene, phase.schedule, q):
        if unclear:
            break
        yield known
    reports = _of_program_rules(cell, phase) if _is_single(cell) else [phase.report]
    lines = (*_failed(reports), *([unclear] if unclear else ()))
    yield replace(known, is_done=True, is_clear=not unclear, lines=lines)


def _of_program_rules(cell: Cell, phase: JudgedPhase) -> list[Report]:
    """The report of the only phase with what is judged of clocks, of its ends and of all tasks together."""
    timed = replace(phase, report=with_clocks(phase.report, phase.scene, phase.schedule, is_reported=False))
    return list(with_task_rules(cell, [timed], with_joins(cell, with_phase_ends(cell, [timed]))))


def reason(cell: Cell, error: Exception) -> str:
    """Why there is no motion, in one line that names the file without its folder."""
    file = cell.origin.file
    return str(error).splitlines()[0].replace(file, PurePath(file).name)


def _failed(reports: Sequence[Report]) -> tuple[str, ...]:
    """What fails, each once."""
    return tuple(dict.fromkeys(check.message for report in reports for check in report.checks if not check.passed))


def _planned(cell: Cell, block: Block, first: Scene) -> JudgedPhase:
    """The shown block on a coarser clock; on that of the cell where only the time between two rows makes it fail."""
    for factor in dict.fromkeys((coarser(cell, len(block.schedule.times) - 1), 1)):
        phase = _of_cell(cell, factor) if _is_single(cell) else _of_block(cell, block, first, factor)
        failed = [check.name for check in phase.report.checks if not check.passed]
        if not failed or not all(CHECK_KINDS[name].shrinks_with_step for name in failed):
            break
    return phase


def _is_single(cell: Cell) -> bool:
    """Whether the whole job is one block, which is then judged as ``solve`` has it."""
    return not cell.program.is_home_to_home and len(plan_phases(cell).program) == 1


def _of_cell(cell: Cell, factor: int) -> JudgedPhase:
    """The only phase of a cell, all but its clearance."""
    motion = replace(cell.motion, step=factor * cell.motion.step)
    _, solution = solve_motion(replace(cell, motion=motion) if factor > 1 else cell, task=None, progress=silent)
    run = solution.runs[0]
    return _with_depths(run.scene, run.schedule, run.report)


def _of_block(cell: Cell, block: Block, first: Scene, factor: int) -> JudgedPhase:
    """One of several blocks, from the starts of the cell; what is idle stands where it does in the given layout."""
    stages = program_stages(cell) or [Stage(phase=it, cell=cell) for it in plan_phases(cell).program]
    stage = next(it for it in stages if it.phase.name == block.name)
    moving, idle = stage.phase.moving, stage.phase.idle
    robots = [
        replace(robot, start=known.start, home=known.home) if robot.start is None or robot.name in idle else robot
        for robot, known in zip(stage.cell.robots, block.cell.robots, strict=True)
    ]
    motion = replace(stage.cell.motion, step=factor * stage.cell.motion.step)
    placed = replace(stage.cell, robots=tuple(robots), motion=motion)
    paths = clock_paths(placed, [build_toolpath(task, placed.part) for task in placed.tasks])
    planned = plan_run(placed, paths, stage.phase)
    scene = replace(placed_scene(first, placed), cell=placed)
    tables = [
        JointTable(
            robot=robot.name,
            joints=robot.model.joint_names,
            times=planned.motion.times,
            q=planned.motion.q[:, placed.columns(robot.name)],
        )
        for robot in placed.robots
    ]
    report = verify_motion(scene, planned.schedule, tables, moving=moving, idle=idle)
    return _with_depths(scene, planned.schedule, replace(report, phase=block.name))


def _with_depths(scene: Scene, schedule: Schedule, report: Report) -> JudgedPhase:
    """A phase with the depth of what holds or stands."""
    depths = check_mounting(scene, stacked_positions(scene.cell, report.q), schedule.times)
    return JudgedPhase(scene=scene, schedule=schedule, report=replace(report, checks=(*report.checks, *depths)))


def _unclear(scene: Scene, schedule: Schedule, q: Array) -> Iterator[str]:
    """For each piece of a motion which bodies are too near; an empty line for one that is certified."""
    scene = scene_of_run(scene, schedule.names)
    scene, times, q = with_straight_move(scene, schedule.times, q)
    for begin in range(0, len(q) - 1, ROWS_AT_ONCE):
        rows = slice(begin, min(begin + ROWS_AT_ONCE, len(q) - 1) + 1)
        yield "" if certify(scene, q[rows], with_minimum=False).is_met else _nearest(scene, times[rows], q[rows])


def _nearest(scene: Scene, times: Array, q: Array) -> str:
    """The pair that is nearest to its demand at some rows, in words."""
    places = np.unique(np.linspace(0, len(q) - 1, 33).round().astype(np.intp))
    near = scene.near(q[places], NEAR)
    short = near.distances - np.array([scene.pairs[row].demand for row in near.rows.tolist()])
    if not len(short):
        return f"clearance: not certified from {times[0]:.3f} s to {times[-1]:.3f} s"
    worst = int(np.argmin(short))
    names, pair = scene.names(scene.pairs[near.rows[worst]]), scene.pairs[near.rows[worst]]
    distance, at = 1e3 * float(near.distances[worst]), float(times[places[near.samples[worst]]])
    apart = f"{distance:.3g} mm apart" if distance > 0.0 else "touch"
    return f"clearance: {names[0]} and {names[1]} {apart} at {at:.3f} s, {1e3 * pair.demand:g} mm demanded"
