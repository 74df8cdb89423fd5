"""Plan a program from home to home: the stages with tasks first, then homes, then the transfer moves between them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import scene_of_run
from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.idle import idle_robots
from cellplan.model.motion.branches import Branches, MovedStart
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.model.motion.plan import Hold, Phase
from cellplan.model.progress import Progress, silent
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import Service, ViaPoint, configuration_of
from cellplan.planning.modes import standing
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.sequence.near_starts import near_start
from cellplan.planning.sequence.part_moves import PartMove
from cellplan.planning.sequence.scenes import StageScenes
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.planning.timing.schedule import TIME_DECIMALS, clock_paths
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.planning.transfer.plan import plan_transfer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.runs.plan.given_starts import with_chosen_start, with_placed_starts
from cellplan.runs.plan.homes import depends_on_homes, find_homes, with_homes
from cellplan.runs.plan.program_faults import (
    located,
    named_transfer,
    refuse_crowded_homes,
    refuse_hanging_parts,
    refuse_sunk_parts,
    refuse_touching_configurations,
    refuse_unnamed_supports,
)
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.runs.plan.run import PlannedRun, plan_run
from cellplan.runs.plan.start import chosen_start
from cellplan.scene.scene import Scene

CLOSED: Final = 1e-9  # [rad] or [m] within which co-holders are back where they began


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedStage:
    """One stage of a program with its motion, nothing of it verified yet."""

    stage: Stage  # the stage of the solved cell
    scene: Scene  # the scene that it is judged in
    schedule: Schedule  # desired tool poses; no task in transfer moves and dwells
    motion: Motion  # what all joints do
    rungs: Mapping[str, str]  # how the transfer move of each robot was found, by robot


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedProgram:
    """One cycle of a program from home to home."""

    cell: Cell  # the solved cell: starts, homes and the starts of all tasks filled in
    scenes: StageScenes
    stages: tuple[PlannedStage, ...]  # in their order: all, each beginning where the one before ends; or with tasks
    remarks: tuple[str, ...]  # notes on starts that were found, where no trial was without fault
    moved: Mapping[str, tuple[MovedStart, ...]]  # how far starts were moved, by the name of the phase
    far: tuple[str, ...] = ()  # tasks whose stated starts were too far off, so that others were searched for


def plan_program(cell: Cell, *, near: Branches | None = None, progress: Progress = silent) -> PlannedProgram:
    """Plan all stages of one cycle.

    Raises:
        InputError: The tasks cannot be worked with, or in no order.
        NoSolutionError: No start or home was found, a tool lost its path, or a robot finds no way.
    """
    work = plan_work(cell, near=near, progress=progress)
    return replace(work, stages=tuple(_joined(work.cell, work.scenes, work.stages, progress=progress)))


def plan_work(
    cell: Cell, *, near: Branches | None = None, drops_far: bool = False, progress: Progress = silent
) -> PlannedProgram:
    """Plan the stages with tasks alone, in the cell with all starts and homes; nothing leads from one to the next.

    Args:
        near: The run of which the branches are kept, where starts are missing.
        drops_far: Whether starts too far off their tasks are searched for, not refused.

    Raises:
        InputError: The tasks cannot be worked with, or in no order.
        NoSolutionError: No start or home was found, or a tool lost its path.
    """
    _refuse_other_paths(cell)
    scenes = StageScenes.of(cell)
    refuse_sunk_parts(scenes)
    refuse_hanging_parts(scenes)
    refuse_unnamed_supports(scenes)
    refuse_touching_configurations(scenes.held)
    search = WorkedStages(cell, scenes, progress, near, drops_far=drops_far)
    runs = search.runs()
    started = search.cell
    at_home = _everyone_at_home(started, runs[0])
    around_held = [at_home, *(run for run in runs if run.scene is None)]
    others = [run for run in runs if run.scene is not None]
    known = {} if near is None else near.homes
    all_runs = [*around_held, *others]
    homes = find_homes(replace(scenes.held, cell=started), all_runs, known=known, progress=progress)
    solved = _with_all_homes(with_homes(started, homes, given=cell))
    if depends_on_homes(started, runs):
        runs = WorkedStages(solved, scenes, progress, near).runs()
    worked_on = [stage for stage in program_stages(solved) if stage.phase.tasks]
    stages = (_worked(scenes, stage, run) for stage, run in zip(worked_on, runs, strict=True))
    return PlannedProgram(
        cell=solved,
        scenes=scenes,
        stages=tuple(stages),
        remarks=tuple(search.remarks),
        moved=search.moved,
        far=tuple(search.far),
    )


def _worked(scenes: StageScenes, stage: Stage, run: PlannedRun) -> PlannedStage:
    """A stage with tasks, its idle robots at their homes."""
    motion = replace(run.motion, q=standing(stage.cell, stage.phase, run.motion.q))
    return PlannedStage(stage=stage, scene=scenes.of_stage(stage), schedule=run.schedule, motion=motion, rungs={})


def _refuse_other_paths(cell: Cell) -> None:
    """Refuse paths and times of all tasks that cannot be worked with, the last ones too, before anything is planned."""
    for stage in program_stages(cell):
        if stage.phase.tasks:
            clock_paths(stage.cell, [build_toolpath(task, stage.cell.part) for task in stage.cell.tasks])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BegunStage:
    """A stage with tasks, from whose start all of them can be carried out; nothing moves yet."""

    scene: Scene  # the scene that it is judged in, with the cell of the stage, every start filled in
    paths: Mapping[str, ClockedPath]  # path of every task on the common clock, by task


class WorkedStages:
    """Stages with tasks, begun or planned one after the other.

    Attributes:
        cell: The cell with the starts that were found so far.
        remarks: Notes on starts without a faultless trial.
        moved: How far starts were moved, by the name of the phase.
        far: Tasks whose stated starts were too far off, so that others were searched for.
    """

    def __init__(
        self, cell: Cell, scenes: StageScenes, progress: Progress, near: Branches | None, *, drops_far: bool = False
    ) -> None:
        """Begin with the cell as it was written; see ``plan_work``."""
        self._drops_far, self.far = drops_far, list[str]()
        self.moved, self._near = dict[str, tuple[MovedStart, ...]](), near
        self.cell, self.remarks, self._given = cell, list[str](), cell
        self._scenes, self._progress, self._last = scenes, progress, dict[str, Array]()
        self._standing = {*cell.positioners, *idle_robots(cell, [task.name for task in cell.tasks])}

    def runs(self) -> list[PlannedRun]:
        """The motions of all stages with tasks."""
        return [run for stage in program_stages(self.cell) if (run := self.run(stage)) is not None]

    def run(self, stage: Stage) -> PlannedRun | None:
        """The motion of a stage; None of one without tasks."""
        if not stage.phase.tasks:
            return None
        begun = self.begun(stage)
        with located(stage, self.cell, self._given):
            planned = plan_run(begun.scene.cell, begun.paths, stage.phase, progress=self._progress)
        self.leave(stage, planned.motion.q[-1])
        return planned if stage.move is None else replace(planned, scene=begun.scene)

    def begun(self, stage: Stage) -> BegunStage:
        """A stage with tasks, its starts given or near where the robots were before, or else searched for."""
        cell = self._with_known_starts(stage)
        scene = replace(self._scenes.of_stage(stage), cell=cell)
        toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
        paths = clock_paths(cell, toolpaths.values())
        drops = self._drops_far
        stated = [task for task in cell.tasks if cell.robot(task.robot).start is not None]
        cell, moved = with_placed_starts(cell, toolpaths, scene.chains, near=self._near, drops_far=drops)
        self.far += [task.name for task in stated if cell.robot(task.robot).start is None]
        scene = replace(scene, cell=cell)
        start = near_start(scene, paths, self._last) if self._last else None
        if start is None:
            with located(stage, self.cell, self._given):
                choice = chosen_start(scene, paths, progress=self._progress)
            start = choice.start
            if choice.warning is not None:
                self.remarks.append(f"{stage.phase.name}: {choice.warning}")
        started, more = with_chosen_start(cell, start, toolpaths)
        self._record(stage, started)
        self.moved[stage.phase.name] = (*moved, *more)
        return BegunStage(scene=replace(scene, cell=started), paths=paths)

    def leave(self, stage: Stage, q: Array) -> None:
        """Go on from where a stage ends, in [rad] or [m], shape (nq,): the robots that worked in it are there."""
        at_work = set(stage.phase.roles) - set(stage.phase.idle)
        self._last |= {name: q[self.cell.columns(name)] for name in sorted(at_work)}

    def _with_known_starts(self, stage: Stage) -> Cell:
        """The cell of a stage with starts that earlier stages found or lead to."""
        cell = stage.cell
        is_continued = stage.move in (PartMove.LIFT, PartMove.RELEASE)
        robots = []
        for robot in cell.robots:
            known = self.cell.robot(robot.name)
            start = robot.start
            if is_continued and robot.name in self.cell.positioners[:1]:
                start = self._last[robot.name]
            elif start is None and robot.name in self._standing and stage.move is None:
                start = known.start
            robots.append(replace(robot, start=start))
        return replace(cell, robots=tuple(robots))

    def _record(self, stage: Stage, started: Cell) -> None:
        """Keep the starts of a block: of holders and robots without tasks, of each task, of each robot in its first."""
        if stage.move is not None:
            return
        at_work = {task.robot: task.name for task in started.tasks}
        robots = []
        for robot in self.cell.robots:
            is_new = robot.start is None and (robot.name in at_work or robot.name in self._standing)
            robots.append(replace(robot, start=started.robot(robot.name).start) if is_new else robot)
        tasks = [
            replace(task, start_posture=started.robot(task.robot).start) if task.name in at_work.values() else task
            for task in self.cell.tasks
        ]
        self.cell = replace(self.cell, robots=tuple(robots), tasks=tuple(tasks))


def _everyone_at_home(cell: Cell, run: PlannedRun) -> PlannedRun:
    """A moment in which all operators are at their homes and the holders where they begin."""
    robots = (replace(robot, start=robot.home if robot.start is None else robot.start) for robot in cell.robots)
    cell_at_home = replace(cell, robots=tuple(robots), tasks=())
    roles = {robot.name: Hold(at_home=robot.name not in cell.positioners) for robot in cell.robots}
    times = np.array([0.0, cell.motion.step])
    start = np.concatenate(
        [
            run.motion.q[0, cell.columns(robot.name)] if robot.start is None else robot.start
            for robot in cell_at_home.robots
        ]
    )
    motion = Motion(times=times, q=np.stack([start, start]))
    return PlannedRun(phase=Phase(name="home", roles=roles), schedule=Schedule(times=times, tasks=()), motion=motion)


def _with_all_homes(cell: Cell) -> Cell:
    """The cell with the homes of holders too: their starts where nothing else is given."""
    return replace(
        cell,
        robots=tuple(robot if robot.home is not None else replace(robot, home=robot.start) for robot in cell.robots),
    )


def _joined(
    cell: Cell, scenes: StageScenes, work: Sequence[PlannedStage], *, progress: Progress
) -> Iterator[PlannedStage]:
    """The stages of a solved cell, with the transfer moves and dwells between the planned ones."""
    stages, left = program_stages(cell), list(work)
    home = np.concatenate([robot.home for robot in cell.robots if robot.home is not None])
    last = home
    for stage in stages[:1] + stages[-1:]:
        refuse_crowded_homes(scenes.of_stage(stage), home)
    for number, stage in enumerate(stages):
        scene = scenes.of_stage(stage)
        if stage.phase.tasks:
            made = left.pop(0)
        elif stage.dwell is not None:
            made = _dwelling(stage, scene, last)
        else:
            progress("planning transfer moves", number / len(stages))
            goal = left[0].motion.q[0] if left else home
            with named_transfer(stages, number):
                ends = via_points(stages, number, (last, goal), home)
                made = _transferred(stage, scene, ends, home, progress)
        yield made
        last = made.motion.q[-1]


def _dwelling(stage: Stage, scene: Scene, q: Array) -> PlannedStage:
    """All robots at rest for the time of a dwell, rounded up to whole steps."""
    times = stage.dwell_times
    motion = Motion(times=times, q=np.tile(q, (len(times), 1)))
    return PlannedStage(stage=stage, scene=scene, schedule=Schedule(times=times, tasks=()), motion=motion, rungs={})


Pass = tuple[Array, float]  # a stacked configuration, shape (nq,), and the time in [s] for which all stand in it


def via_points(stages: Sequence[Stage], number: int, ends: tuple[Array, Array], home: Array) -> list[Pass]:
    """What the transfer moves of a stage pass, both ends among it.

    Robots first pass what is stated after their last tasks while the others stand. Then all go together, those that
    have something to pass before their next tasks as far as that; they go on while the others stand. All stand while a
    tool is cleaned.
    """
    before = stages[number - 1].cell.tasks if number else ()
    after = next((stage.cell.tasks for stage in stages[number + 1 :] if stage.cell.tasks), ())
    leaving, coming = ({task.robot: task.via_after for task in before}, {task.robot: task.via_before for task in after})

    def moved(q: Array, via: Mapping[str, Sequence[ViaPoint]], place: int) -> Pass:
        q, stays = q.copy(), 0.0
        for robot, points in via.items():
            if place < len(points):
                point, columns = points[place], stages[number].cell.columns(robot)
                stays = max(stays, point.takes if isinstance(point, Service) else 0.0)
                q[columns] = configuration_of(point, home[columns])
        return q, stays

    passed: list[Pass] = [(ends[0], 0.0)]
    for place in range(max(map(len, leaving.values()), default=0)):
        passed.append(moved(passed[-1][0], leaving, place))
    passed += [moved(ends[1], coming, place) for place in range(max(map(len, coming.values()), default=0))]
    passed = [passed[0], *(it for other, it in pairwise(passed) if it[1] or np.any(it[0] != other[0]))]
    return [*passed, (ends[1], 0.0)] if len(passed) == 1 or np.any(passed[-1][0] != ends[1]) else passed


def _transferred(stage: Stage, scene: Scene, ends: Sequence[Pass], home: Array, progress: Progress) -> PlannedStage:
    """The transfer moves of one stage, from one stacked configuration to the next, at rest in each of them.

    Raises:
        InputError: Co-holders would have to move by themselves.
        BlockedTransferError: No way was found.
    """
    cell, start, goal = scene.cell, ends[0][0], ends[-1][0]
    for name in cell.positioners if len(cell.positioners) > 1 else ():
        columns = cell.columns(name)
        if np.any(np.abs(goal[columns] - start[columns]) > CLOSED):
            raise InputError(
                f"{cell.origin.at('program')}: expected holders that begin and end at their starts, as '{name}' and "
                "the other holders of the part cannot be moved one by one; set motion.cyclic: true, and no home of "
                "theirs"
            )
    alone, retimer = scene_of_run(scene, ()), transfer_retimer(scene)
    legs, rungs = list[Array](), dict[str, list[str]]()
    for number, ((a, _), (b, stays)) in enumerate(pairwise(ends), start=1):
        query = TransferQuery.of(alone, a, b, seed=cell.solver.seed, home=home)
        try:
            transfer = plan_transfer(query, retimer=retimer, progress=progress)
        except BlockedTransferError as error:
            if len(ends) == 2:
                raise
            leg = f"leg {number} of {len(ends) - 1} over its via points"
            raise BlockedTransferError(error.place, f"{leg}: {error.what}", error.best) from error
        legs.append(transfer.q if not legs else transfer.q[1:])
        legs.append(np.tile(b, (int(np.ceil(stays / cell.motion.step - CLOSED)), 1)))
        for robot, rung in transfer.rungs.items():
            rungs.setdefault(robot, []).append(rung.words)
    q = np.concatenate(legs)
    times = np.round(np.arange(len(q)) * retimer.step, TIME_DECIMALS)
    return PlannedStage(
        stage=stage,
        scene=scene,
        schedule=Schedule(times=times, tasks=()),
        motion=Motion(times=times, q=q),
        rungs={robot: _over_via_points(words) for robot, words in rungs.items()},
    )


def _over_via_points(words: Sequence[str]) -> str:
    """How a robot moves in all legs in which it does."""
    how = " then ".join(dict.fromkeys(words))
    return how if len(words) == 1 else f"{how} over {len(words) - 1} via point{'s' * (len(words) > 2)}"
