"""Judgement of a live cell at rest: planned and checked as ``solve`` does, on a coarser clock.

The motion between two rows is linear in the joints, on a clock of a thousand rows as on the finer one of the cell, and
the certificate holds at all times between rows. So the verdict is that of ``solve`` up to what a tool, which is on its
path at every row, is beside it between two of them: some micrometres.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import PurePath
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.run_pairs import scene_of_run, with_straight_move
from cellplan.checks.clearance.check import check_clearance
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
from cellplan.model.motion.plan import ALL_TASKS
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
from cellplan.session.motion import coarser

NEARER: Final = "clearance: bodies are nearer than demanded"  # until it is known which, when and by how much
JOB: Final = ""  # in place of the name of a phase: what holds for the whole job

Judgements = Mapping[str, "Judgement"]  # by the name of a phase, or ``JOB``


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Judgement:
    """What is known of a phase at rest."""

    is_done: bool = False  # whether everything was asked
    lines: tuple[str, ...] = ()  # what fails, as reports word it
    lost: str = ""  # why there is no motion; empty where there is one
    report: Report | None = None  # of the phase
    times: Array = field(default_factory=lambda: np.empty(0))  # of its rows in [s], shape (N,)
    q: Array = field(default_factory=lambda: np.empty((0, 0)))  # its rows in [rad] or [m], shape (N, nq)
    is_clear: bool | None = None  # whether the certificate holds; None while that is not known

    @classmethod
    def of(cls, phase: JudgedPhase) -> "Judgement":
        """A phase of which all was judged but the clearance."""
        q = stacked_positions(phase.scene.cell, phase.report.q)
        return cls(report=phase.report, times=phase.schedule.times, q=q, lines=_failed(phase.report))

    @property
    def passed(self) -> bool:
        """Whether nothing fails that was asked."""
        return not self.lost and not self.lines


def judged_block(cell: Cell, given: Stage, steps: int, first: Scene) -> Iterator[Judgements]:
    """What is known of one of several blocks by itself, before the whole job is judged.

    Args:
        cell: The cell as it would be saved.
        given: The block of the given layout, every start filled in.
        steps: Number of its steps.
        first: The scene of the given layout.
    """
    name = given.phase.name
    try:
        [phase] = _coarsely(cell, [steps], partial(_of_block, given, first))
    except (InputError, NoSolutionError) as error:
        yield {name: Judgement(lost=reason(cell, error))}
        return
    known = Judgement.of(phase)
    yield {name: known}
    yield from ({name: more} for more in _cleared(phase, known))


def judged_job(cell: Cell, steps: Sequence[int]) -> Iterator[Judgements]:
    """What is known of the whole job as ``solve`` has it: of each phase, the more the later.

    Args:
        cell: The cell as it would be saved.
        steps: Numbers of steps of its blocks.
    """
    try:
        phases = _coarsely(cell, steps, _of_cell)
    except (InputError, NoSolutionError) as error:
        yield {JOB: Judgement(lost=reason(cell, error))}
        return
    known = [Judgement.of(phase) for phase in phases]
    names = [ALL_TASKS if phase.report.phase is None else phase.report.phase for phase in phases]
    yield dict(zip(names, known, strict=True))
    for place, phase in enumerate(phases):
        for of_phase in _cleared(phase, known[place]):
            known[place] = of_phase
            yield {names[place]: of_phase}
    timed = [replace(it, report=with_clocks(it.report, it.scene, it.schedule, is_reported=False)) for it in phases]
    reports = with_task_rules(cell, timed, with_joins(cell, with_phase_ends(cell, timed)))
    lines = (tuple(dict.fromkeys((*_failed(it), *of.lines))) for it, of in zip(reports, known, strict=True))
    done = (replace(of, is_done=True, lines=more) for of, more in zip(known, lines, strict=True))
    yield dict(zip(names, done, strict=True))


def reason(cell: Cell, error: Exception) -> str:
    """Why there is no motion, in one line that names the file without its folder."""
    file = cell.origin.file
    return str(error).splitlines()[0].replace(file, PurePath(file).name)


def _failed(report: Report) -> tuple[str, ...]:
    """What fails, each once."""
    return tuple(dict.fromkeys(check.message for check in report.checks if not check.passed))


def _coarsely(cell: Cell, steps: Sequence[int], judged: Callable[[Cell], list[JudgedPhase]]) -> list[JudgedPhase]:
    """Phases on a coarser clock; on that of the cell where only the time between two rows makes them fail."""
    for factor in dict.fromkeys((coarser(cell, *steps), 1)):
        motion = replace(cell.motion, step=factor * cell.motion.step)
        phases = judged(replace(cell, motion=motion) if factor > 1 else cell)
        failed = [check.name for phase in phases for check in phase.report.checks if not check.passed]
        if not failed or not all(CHECK_KINDS[name].shrinks_with_step for name in failed):
            break
    return phases


def _of_cell(cell: Cell) -> list[JudgedPhase]:
    """All phases of a cell, but for their clearance."""
    _, solution = solve_motion(cell, task=None, progress=silent)
    return [_with_depths(run.scene, run.schedule, run.report) for run in solution.runs]


def _of_block(given: Stage, first: Scene, cell: Cell) -> list[JudgedPhase]:
    """One of several blocks, from the starts of the cell; what is idle stands where it does in the given layout."""
    stages = program_stages(cell) or [Stage(phase=it, cell=cell) for it in plan_phases(cell).program]
    stage = next(it for it in stages if it.phase.name == given.phase.name)
    moving, idle = stage.phase.moving, stage.phase.idle
    robots = [
        replace(robot, start=known.start, home=known.home) if robot.start is None or robot.name in idle else robot
        for robot, known in zip(stage.cell.robots, given.cell.robots, strict=True)
    ]
    placed = replace(stage.cell, robots=tuple(robots))
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
    return [_with_depths(scene, planned.schedule, replace(report, phase=given.phase.name))]


def _with_depths(scene: Scene, schedule: Schedule, report: Report) -> JudgedPhase:
    """A phase with the depth of what holds or stands."""
    depths = check_mounting(scene, stacked_positions(scene.cell, report.q), schedule.times)
    return JudgedPhase(scene=scene, schedule=schedule, report=replace(report, checks=(*report.checks, *depths)))


def _cleared(phase: JudgedPhase, known: Judgement) -> Iterator[Judgement]:
    """What is known of a phase with its clearance; at first only whether it is certified."""
    scene, _, q = with_straight_move(scene_of_run(phase.scene, phase.schedule.names), phase.schedule.times, known.q)
    if certify(scene, q, with_minimum=False).is_met:
        yield replace(known, is_clear=True)
        return
    yield replace(known, is_clear=False, lines=(*known.lines, NEARER))
    _, checks = check_clearance(phase.scene, phase.schedule, known.q, with_curves=False)
    lines = tuple(check.message for check in checks if not check.passed)
    yield replace(known, is_clear=not lines, lines=(*known.lines, *lines))
