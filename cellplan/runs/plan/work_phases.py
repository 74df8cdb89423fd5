"""Phases of work of a cell: each with the cell meanwhile and the start of its motion."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cellplan.certify.run_pairs import scene_of_run
from cellplan.errors import InputError, NoSolutionError
from cellplan.files.input.findings import listed
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.motion import Schedule
from cellplan.model.motion.plan import Hold, Phase
from cellplan.model.progress import Progress, silent
from cellplan.planning.modes import plan_phases, standing
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.planning.start.trial_motion import present_pairs
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.runs.plan.run import plan_run
from cellplan.runs.plan.sequence import BegunStage, WorkedStages
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WorkPhase:
    """A phase in which tasks are worked on."""

    name: str  # its tasks, or the straight move that it is, in words; empty for the only phase
    phase: Phase  # who does what
    scene: Scene  # the cell meanwhile, every start filled in; without pairs that depend on a home that is to be found
    schedule: Schedule  # its tasks on the clock
    start: Array  # where its motion begins in [rad] or [m], idle robots at their homes, shape (nq,)


def work_phases(cell: Cell, robot: str, progress: Progress = silent) -> Iterator[WorkPhase]:
    """The phases of work in their order, each begun near where the one before ends.

    Where a robot, which may stand elsewhere, cannot begin its task, the others begin without it, and it is where it was
    or mid-range.

    Raises:
        NoSolutionError: The others cannot begin their tasks.
    """
    scenes, is_program = StageScenes.of(cell), cell.program.is_home_to_home
    worked = WorkedStages(cell, scenes, progress, None)
    first = plan_phases(cell).program if not is_program else ()
    for stage in program_stages(cell) or (Stage(phase=first[0], cell=cell),):
        if not stage.phase.tasks:
            continue
        begun = _begun(worked, scenes, stage, robot)
        made = [_work_phase(stage, begun, phase) for phase in first or (stage.phase,)]
        if len(made) == 1 and not is_program:
            made = [replace(made[0], name="")]
        yield from made
        if is_program:
            worked.leave(stage, _end(begun, made[0]))


def _work_phase(stage: Stage, begun: BegunStage, phase: Phase) -> WorkPhase:
    cell, scene = begun.scene.cell, scene_of_run(begun.scene, phase.tasks)
    is_present = present_pairs(scene, phase)
    pairs = tuple(pair for pair, present in zip(scene.pairs, is_present, strict=True) if present)
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    return WorkPhase(
        name=str(stage.move or listed(phase.tasks)),
        phase=phase,
        scene=replace(scene, pairs=pairs),
        schedule=schedule_paths(cell, [begun.paths[name] for name in phase.tasks]),
        start=standing(cell, phase, start),
    )


def _begun(worked: WorkedStages, scenes: StageScenes, stage: Stage, name: str) -> BegunStage:
    """A stage whose robots begin their tasks, all of them or all but one."""
    try:
        return worked.begun(stage)
    except (InputError, NoSolutionError):
        if name not in stage.phase.roles or name in stage.phase.idle:
            raise
    cell, scene = stage.cell, scenes.of_stage(stage)
    robots = [replace(robot, start=None, home=None) if robot.name == name else robot for robot in cell.robots]
    others = replace(cell, robots=tuple(robots), tasks=tuple(task for task in cell.tasks if task.robot != name))
    if others.tasks:
        phase = replace(stage.phase, roles={**stage.phase.roles, name: Hold(at_home=True)})
        others = worked.begun(replace(stage, cell=others, phase=phase)).scene.cell
    begun = [cell.robot(name) if robot.name == name else robot for robot in others.robots]
    starts = [_somewhere(robot, worked.cell.robot(robot.name).start) for robot in begun]
    robots = [replace(robot, start=start) for robot, start in zip(begun, starts, strict=True)]
    whole = replace(cell, robots=tuple(robots))
    paths = clock_paths(whole, [build_toolpath(task, whole.part) for task in whole.tasks])
    return BegunStage(scene=replace(scene, cell=whole), paths=paths)


def _somewhere(robot: Robot, known: Array | None) -> Array:
    """Where a robot begins, or was before; else its home, or mid-range, shape (n,)."""
    middle: Array = 0.5 * np.add(*finite_limits(robot.model))
    return next(q for q in (robot.start, known, robot.home, middle) if q is not None)


def _end(begun: BegunStage, work: WorkPhase) -> Array:
    """Where the motion of a phase ends, shape (nq,); where it begins if a tool loses its path."""
    try:
        return plan_run(begun.scene.cell, begun.paths, work.phase).motion.q[-1]
    except NoSolutionError:
        return work.start
