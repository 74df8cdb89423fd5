"""Blocks of a live cell: tasks that are worked on together, made ready for motions near the one that is known."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.trials.phases import ProgramPhases
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.motion.motion import Schedule
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.planning.modes import homeless, plan_phases, standing
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.sequence.stages import Stage, program_stages
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.runs.plan.given_starts import with_chosen_start, with_placed_starts
from cellplan.runs.plan.homes import find_homes, with_homes
from cellplan.runs.plan.run import plan_run
from cellplan.runs.plan.sequence import plan_work
from cellplan.runs.plan.start import chosen_start
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import MOST, Job, Layouts, enough_nodes
from cellplan.search.kernel.run import run
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.variables.phase_variables import PhaseVariables
from cellplan.session.variables import LiveVariables

NODES: Final = 65  # [-] of a motion at least: with parabolas through them speeds are good to 0.5 %, margins to 0.1 deg
LIVE_NODES: Final = 300  # [-] of a motion that an answer does not wait for longer than some hundredths of a second


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Block:
    """Tasks that are worked on together."""

    name: str  # name of its phase
    stage: Stage  # its phase, and the cell meanwhile with every start filled in
    start: Array  # where its motion begins in the layout that is kept to, in [rad] or [m], shape (nq,)
    paths: Mapping[str, ClockedPath]  # its tasks on the clock
    schedule: Schedule  # likewise, sampled
    variables: PhaseVariables  # what may be changed, as the kernel sees it in this block
    bodies: CellDistances  # distances of the bodies
    problem: LayoutProblem | None  # its motion by the kernel; None where the cell is none for it

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of its tasks."""
        return tuple(self.stage.phase.tasks)

    @property
    def live(self) -> LayoutProblem | None:
        """Its motion by the kernel where every change is answered with it; None of a motion that takes long."""
        return self.problem if self.problem is not None and len(self.problem.job.times) <= LIVE_NODES else None

    @property
    def cell(self) -> Cell:
        """The cell meanwhile."""
        return self.stage.cell


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LiveCell:
    """A cell made ready to be changed."""

    cell: Cell  # the cell as it was read, or with obstacles elsewhere
    variables: LiveVariables
    scene: Scene  # its bodies, the part held or fixed, with the cell that was started
    blocks: tuple[Block, ...] = ()
    phases: ProgramPhases | None = None  # of a program from home to home whose given layout can be planned
    is_planned: bool = False  # whether the given layout was planned, as far as it can be

    @classmethod
    def of(cls, cell: Cell) -> Self:
        """The given layout before it is planned: robots without a start stand at home, or mid-range."""
        variables, scene = LiveVariables.of(cell), Scene.from_cell(cell)
        bodies = CellDistances.of(scene, variables.layout)
        blocks = (_block(stage, bodies, variables) for stage in _stages(_mid_range(cell)))
        return cls(cell=cell, variables=variables, scene=scene, blocks=tuple(blocks))

    def planned(self) -> Iterator[Self]:
        """The same once its layout is planned; where it has no start robots stay where they stand."""
        cell, variables, scene, bodies = self.cell, self.variables, self.scene, self.blocks[0].bodies
        try:
            if cell.program.is_home_to_home:
                phases = ProgramPhases.of_work(plan_work(cell, drops_far=True), variables.layout, bodies)
                blocks = tuple(_of_program(phases))
                yield replace(self, phases=phases, blocks=blocks, is_planned=True)
                return
            started = _started(scene)
        except (InputError, NoSolutionError):
            started = _mid_range(cell)
        blocks = tuple(_with_problem(_block(stage, bodies, variables)) for stage in _stages(started))
        yield replace(self, scene=replace(scene, cell=started), blocks=blocks, is_planned=True)

    def on(self, cell: Cell, scene: Scene) -> Self:
        """The same in a cell that differs by its obstacles."""
        variables = self.variables.on(cell)
        bodies = CellDistances.of(scene, variables.layout)
        if self.phases is not None:
            phases = ProgramPhases.of_work(self.phases.work, variables.layout, bodies)
            pairs = zip(self.blocks, phases.bodies, strict=True)
            blocks = tuple(_in_place(it, of_phase, variables) for it, of_phase in pairs)
            return replace(self, cell=cell, variables=variables, scene=scene, phases=phases, blocks=blocks)
        blocks = tuple(_in_place(it, bodies, variables) for it in self.blocks)
        return replace(self, cell=cell, variables=variables, scene=scene, blocks=blocks)


def _in_place(block: Block, bodies: CellDistances, variables: LiveVariables) -> Block:
    """A block with other bodies."""
    varied = replace(block.variables, whole=variables.layout)
    problem = None if block.problem is None else replace(block.problem, bodies=bodies, variables=varied)
    return replace(block, bodies=bodies, variables=varied, problem=problem)


def _started(scene: Scene) -> Cell:
    """The cell of a single block with every start filled in, as ``solve`` finds it."""
    cell = scene.cell
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    paths = clock_paths(cell, toolpaths.values())
    placed, _ = with_placed_starts(cell, toolpaths, scene.chains, drops_far=True)
    start = chosen_start(replace(scene, cell=placed), paths).start
    started = with_chosen_start(placed, start, toolpaths)[0]
    phases = plan_phases(started).program
    if not any(homeless(started, phase) for phase in phases):
        return started
    planned = [plan_run(started, paths, phase) for phase in phases]
    return with_homes(started, find_homes(replace(scene, cell=started), planned), given=placed)


def _mid_range(cell: Cell) -> Cell:
    """The cell with robots without a start at their homes, or mid-range."""
    robots = [robot if robot.start is not None else replace(robot, start=_somewhere(robot)) for robot in cell.robots]
    return replace(cell, robots=tuple(robots))


def _block(stage: Stage, bodies: CellDistances, variables: LiveVariables) -> Block:
    """A block of a started cell."""
    cell, phase = stage.cell, stage.phase
    toolpaths = [build_toolpath(task, cell.part) for task in cell.tasks]
    paths = clock_paths(cell, toolpaths)
    schedule = schedule_paths(cell, [paths[name] for name in phase.tasks])
    start = standing(cell, phase, np.concatenate([robot.start for robot in cell.robots if robot.start is not None]))
    return Block(
        name=phase.name,
        stage=stage,
        start=start,
        paths=paths,
        schedule=schedule,
        variables=PhaseVariables(whole=variables.layout, begins_there=True, tasks=tuple(phase.tasks)),
        bodies=bodies,
        problem=None,
    )


def _with_problem(block: Block) -> Block:
    """A block with its motion by the kernel, where its cell is one for that."""
    if not is_for_kernel(block.cell):
        return block
    job = _job(block.cell, block.schedule, block.stage.phase.moving, block.start)
    acceleration = acceleration_limits(block.cell)
    problem = LayoutProblem(job=job, variables=block.variables, bodies=block.bodies, acceleration=acceleration)
    return replace(block, problem=problem)


def _of_program(phases: ProgramPhases) -> Iterator[Block]:
    """The blocks of a planned program, its straight moves among them."""
    is_kernel = is_for_kernel(phases.work.cell)
    problems = phases.problem(NODES).phases if is_kernel else [None] * len(phases.bodies)
    for planned, bodies, problem in zip(phases.work.stages, phases.bodies, problems, strict=True):
        stage = planned.stage
        lying = None if stage.place is None else stage.cell.part
        begins_there = stage.move is None and all(task.holder_posture is None for task in stage.cell.tasks)
        varied = PhaseVariables(
            whole=phases.variables, begins_there=begins_there, lying=lying, tasks=tuple(stage.phase.tasks)
        )
        yield Block(
            name=stage.phase.name,
            stage=stage,
            start=planned.motion.q[0],
            paths={path.task.name: path for path in planned.schedule.paths},
            schedule=planned.schedule,
            variables=varied,
            bodies=bodies,
            problem=problem,
        )


def is_for_kernel(cell: Cell) -> bool:
    """Whether the motion is one that the kernel works out: by the pseudo-inverse, without a path or a failed joint."""
    motion = cell.motion
    has_path = any(robot.path is not None for robot in cell.robots)
    return not (motion.locked or motion.cyclic or has_path or cell.solver.nonminimal_keys)


def _stages(cell: Cell) -> list[Stage]:
    """What is worked on together in a started cell, one after the other."""
    if cell.program.is_home_to_home:  # that could not be planned: its tasks have no starts
        stages = [stage for stage in program_stages(cell) if stage.phase.tasks and stage.move is None]
        return [replace(stage, cell=_mid_range(stage.cell)) for stage in stages]
    return [Stage(phase=phase, cell=cell) for phase in plan_phases(cell).program]


def _job(cell: Cell, schedule: Schedule, moving: tuple[str, ...], start: Array) -> Job:
    """The job of a block, its nodes doubled until the given motion is followed, or lost at the same time again."""
    nodes, lost_before = enough_nodes(schedule, NODES), np.nan
    while True:
        job = Job.of(cell, schedule, moving=moving, nodes=nodes)
        lost_at = float(run(job, Layouts.of([cell], start[None])).lost_at[0])
        is_certain = lost_at == lost_before or abs(lost_at - lost_before) <= job.times[-1] / nodes
        if is_certain or not np.isfinite(lost_at) or nodes >= MOST:
            return job
        nodes, lost_before = 2 * nodes - 1, lost_at


def _somewhere(robot: Robot) -> Array:
    """Where a robot without a start stands: at its home, or mid-range, shape (n,)."""
    return 0.5 * np.add(*finite_limits(robot.model)) if robot.home is None else robot.home
