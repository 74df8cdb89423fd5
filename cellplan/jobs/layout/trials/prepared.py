"""A cell made ready for a layout search: its variables, its bodies, and its job at as many nodes as are asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.joint_path import NullSpaceSearch, PathSearch, resolving, without_path
from cellplan.jobs.layout.trials.phases import ProgramPhases, starts_of
from cellplan.jobs.layout.trials.searched import refuse_unsearchable, searched_cell
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.cell.layout import VariableKind
from cellplan.model.motion.motion import Schedule
from cellplan.planning.layout_screening import Candidates, screen_layouts
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.runs.greatest_feeds import OpenFeed, open_feeds, with_first_feeds
from cellplan.runs.plan.sequence import plan_work
from cellplan.runs.plan.start import chosen_start
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import MOST, Job, enough_nodes
from cellplan.search.kernel.singular_values import usual_values
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.measures import law_loads
from cellplan.search.programs.objective import CycleTiming, Demands, Objective
from cellplan.search.programs.problem import Point
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.spline_path.spline_problem import SplineProblem
from cellplan.search.starts.generator import StartGenerator
from cellplan.search.starts.problem import StartProblem
from cellplan.search.variables.variables import Variables

NODES: Final = 65  # [-] of the trials: with parabolas through them speeds are good to 0.5 %, margins to 0.1 deg
RESOLVED: Final = 0.02  # [-] by which twice as many nodes may change the shortest cycle of the given layout
UNLIMITED: Final = 1e6  # [s] that motions may last which are timed when they are solved
NOT_FOLLOWED: Final = "a tool loses its path at the nodes of the search"  # of a layout that solve may yet follow
# [-] times as many of a motion along a spline, no parabolas
ALONG_SPLINE: Final = {CycleTiming.LAWS: 4, CycleTiming.RETIMED: 2}
SINGULAR_SHARE: Final = 0.1  # [-] of usual singular values: a wrist a few degrees from straight
NEARLY: Final = 0.99  # [-] of demanded singular values: kept
SINGULAR_EVERYWHERE: Final = 1e-6  # usual singular value in [m] and [rad] below which it says nothing


@dataclass(frozen=True, kw_only=True, eq=False)
class PreparedSearch:
    """A cell whose layout is searched."""

    request: LayoutRequest  # what is searched for
    cell: Cell  # the cell, with what the request sets in it
    variables: Variables  # what may change
    scene: Scene  # the bodies of the cell
    bodies: CellDistances  # their distances, wherever the layout puts them
    schedule: Schedule  # the tasks on the common clock
    moving: tuple[str, ...]  # names of the robots that move
    unled: "PreparedSearch | None" = None  # the same without the joint path; None where no path varies
    solved_start: Array | None = None  # start of the given layout that a solve finds, shape (nq,); or None
    opened: tuple[OpenFeed, ...] = ()  # feeds that are sought; the cell states others
    phases: ProgramPhases | None = (
        None  # of a program from home to home; ``schedule`` and ``moving`` are its first block's
    )

    @classmethod
    def of(cls, request: LayoutRequest, cell: Cell) -> "PreparedSearch":
        """Make a cell ready."""
        if cell.program.is_home_to_home:
            return _of_program(request, cell)
        opened, cell = open_feeds(cell), with_first_feeds(cell)
        unled = without_path(cell)
        variables = Variables.of(cell, without=() if unled is None else resolving(cell))
        scene = Scene.from_cell(variables.base)
        paths = clock_paths(variables.base, [build_toolpath(task, cell.part) for task in cell.tasks])
        phase = plan_phases(variables.base).program[0]
        prepared = cls(
            request=request,
            cell=cell,
            variables=variables,
            scene=scene,
            bodies=CellDistances.of(scene, variables),
            schedule=schedule_paths(variables.base, [paths[name] for name in phase.tasks]),
            moving=tuple(phase.moving),
            unled=None if unled is None else cls.of(request, unled),
            opened=tuple(opened),
        )
        needs_start = any(
            variable.kind is VariableKind.START and variable.given is None for variable in variables.tied.ranges
        )
        return _with_solved_start(prepared) if needs_start else prepared

    def problem(self, nodes: int = NODES) -> LayoutProblem | ProgramProblem | SplineProblem:
        """The problem at about so many nodes: of the layout, or of the joint path and whatever else varies."""
        if self.phases is not None:
            return self.phases.problem(nodes // 2 + 1)
        variables, acceleration = self.variables, acceleration_limits(self.scene.cell)
        if self.unled is None:
            enough = enough_nodes(self.schedule, nodes)
            job = Job.of(variables.base, self.schedule, moving=self.moving, nodes=enough)
            return LayoutProblem(job=job, variables=variables, bodies=self.bodies, acceleration=acceleration)
        nodes *= ALONG_SPLINE[self.request.timing] if self.variables.settings.paths else 1
        return self.path_search.problem(nodes, bodies=self.bodies, acceleration=acceleration)

    @property
    def coarse(self) -> LayoutProblem | ProgramProblem | SplineProblem:
        """The problem of the trials."""
        return self.resolution.problem

    @cached_property
    def resolution(self) -> "Resolution":
        """The problem of the trials at as many nodes as the given layout needs."""
        return _resolution(self, self.problem())

    @cached_property
    def is_followed(self) -> bool:
        """Whether the tools follow their paths in the given layout, by the method of ``solve``."""
        given = Candidates.of([self.variables.base], self.given_start[None])
        return bool(screen_layouts(self.variables.base, self.schedule, given, moving=self.moving).is_followed[0])

    @cached_property
    def path_search(self) -> PathSearch:
        """Joint paths of this search, which has one that may change."""
        if self.unled is None:
            raise ValueError("expected a cell whose joint path may change")
        try:
            start = self.given_start
        except NoSolutionError:
            start = np.concatenate([0.5 * np.add(*finite_limits(robot.model)) for robot in self.variables.base.robots])
        settings = self.variables.settings
        kind = PathSearch if settings.null_space is None else NullSpaceSearch
        return kind(
            settings=settings.null_space or settings.paths[0],
            layout_variables=self.variables,
            unled=self.unled.variables,
            schedule=self.schedule,
            start=start,
        )

    @property
    def given_start(self) -> Array:
        """The start posture of the given layout in [rad] or [m], shape (nq,); found where the cell gives none.

        Of a program it is that of all its phases, shape (P nq,).

        Raises:
            NoSolutionError: There is none.
        """
        start = self._given_start
        if isinstance(start, NoSolutionError):
            raise start
        return start

    @cached_property
    def _given_start(self) -> Array | NoSolutionError:
        """See ``given_start``; or why there is none."""
        if self.solved_start is not None:
            return self.solved_start
        try:
            return self.start_of(self.variables.base)
        except NoSolutionError as error:
            return error

    def start_of(self, cell: Cell) -> Array:
        """The start posture of a cell with this job; see ``given_start``."""
        if self.phases is not None:
            return starts_of(plan_work(cell, drops_far=True))
        if all(robot.start is not None for robot in cell.robots):
            return np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
        scene = self.scene if cell is self.variables.base else Scene.from_cell(cell)
        paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
        return chosen_start(scene, paths).start

    @cached_property
    def starts(self) -> StartGenerator:
        """Starts of the search: the given layout with other branches, then sampled ones."""
        problem = StartProblem.of(self.variables.base, self.variables, margin=self.variables.margin)
        return StartGenerator(problem, seed=self.request.seed)

    @property
    def duration(self) -> float:
        """Duration of the job in [s], as the cell has it; of a program that of its phases with work."""
        return float(self.schedule.times[-1]) if self.phases is None else self.phases.duration

    def demands(self, **changes: Any) -> Demands:
        """What is demanded of a layout."""
        values: dict[str, Any] = {
            "objective": self.request.objective,
            "margin": self.variables.margin,
            "singular": _singular(self),
        }
        return Demands(**(values | _clock(self) | changes))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Resolution:
    """The problem of the trials: where ``solve`` follows the paths, tools follow them at its nodes.

    Where the shortest cycle is sought, more of them would not change that of the given layout by much.
    """

    problem: LayoutProblem | ProgramProblem | SplineProblem
    nodes: int  # how many were asked for
    smooth: LayoutProblem | None  # at fewer nodes, where trials begin as less is rough there; None without any


def _resolution(ready: PreparedSearch, problem: LayoutProblem | ProgramProblem | SplineProblem) -> Resolution:
    """The resolution of a search whose problem at the fewest nodes is given."""
    if not isinstance(problem, LayoutProblem):
        return Resolution(problem=problem, nodes=NODES, smooth=None)
    try:
        start, nodes, smooth = ready.given_start, enough_nodes(ready.schedule, NODES), None
    except NoSolutionError:
        return Resolution(problem=problem, nodes=NODES, smooth=None)
    least = least_cycle(ready, problem, problem.given, start)
    while nodes < MOST and (ready.is_followed if least is None else least > 0.0):
        finer = problem.finer(ready.schedule, nodes=2 * nodes - 1)
        longer = least_cycle(ready, finer, finer.given, start)
        if least is not None and (longer is None or longer <= (1.0 + RESOLVED) * least):
            break
        smooth = None if least is None else smooth or problem
        problem, nodes, least = finer, 2 * nodes - 1, longer
    return Resolution(problem=problem, nodes=nodes, smooth=smooth)


def least_cycle(ready: PreparedSearch, problem: LayoutProblem, x: Array, start: Array) -> float | None:
    """Cycle in [s] that the nodes of a problem allow, 0 where none is sought by time laws; None without a motion.

    Args:
        x: The variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
    """
    point = problem.evaluate(x, start)
    if point is None or ready.request.objective is not Objective.CYCLE or ready.request.timing is CycleTiming.RETIMED:
        return None if point is None else 0.0
    return law_loads(problem, point)[2] * ready.duration


def _of_program(request: LayoutRequest, cell: Cell) -> PreparedSearch:
    """A program made ready."""
    variables = Variables.of(cell)
    base, scene = variables.base, Scene.from_cell(variables.base)
    bodies = CellDistances.of(scene, variables)
    phases = ProgramPhases.of(base, variables, bodies)
    robots = [replace(robot, start=phases.work.cell.robot(robot.name).start) for robot in base.robots]
    variables = replace(variables, given=variables.read_from(replace(base, robots=tuple(robots))))
    first = next(planned for planned in phases.work.stages if planned.stage.move is None)
    return PreparedSearch(
        request=request,
        cell=cell,
        variables=variables,
        scene=scene,
        bodies=bodies,
        schedule=first.schedule,
        moving=tuple(first.stage.phase.moving),
        solved_start=phases.start,
        phases=replace(phases, variables=variables),
    )


def is_fastest(ready: PreparedSearch) -> bool:
    """Whether the motions go as fast along their paths as the limits allow, not as time laws have it."""
    return ready.request.timing is CycleTiming.RETIMED or ready.cell.motion.timing is Timing.FASTEST


def _clock(ready: PreparedSearch) -> dict[str, Any]:
    """How the motions are timed, and what they may last.

    Of a program as it is written, and of one whose tasks have demanded speeds, the transfers alone become shorter.
    """
    is_cycle, timing = ready.request.objective is Objective.CYCLE, ready.request.timing
    if ready.phases is None:
        return {"duration": None if is_cycle else ready.duration, "timing": timing}
    has_speeds = any(task.feed is not None or task.process is not None for task in ready.cell.tasks)
    if is_fastest(ready) and is_cycle and not has_speeds:
        return {"duration": None, "timing": CycleTiming.RETIMED}
    return {"duration": UNLIMITED if is_fastest(ready) else ready.duration, "timing": CycleTiming.LAWS}


def demands_near(ready: PreparedSearch, point: Point, **changes: Any) -> Demands:
    """What is demanded of a layout near one that was improved.

    The usual share of the singular values is demanded only where the point keeps it, one that the cell states always.
    """
    demands, layout = ready.demands(**changes), ready.cell.layout
    if demands.singular is None or (layout is not None and layout.singular is not None):
        return demands
    is_met = bool(np.all(ready.coarse.arms(point).values >= NEARLY * demands.singular))
    return demands if is_met else replace(demands, singular=None)


def _singular(ready: PreparedSearch) -> Array | None:
    """Least singular values that the arms are to keep, shape (A,); None where none are demanded."""
    share = SINGULAR_SHARE if ready.request.objective is Objective.CYCLE else 0.0
    if (layout := ready.cell.layout) is not None and layout.singular is not None:
        share = layout.singular
    if not share > 0.0:
        return None
    problem = ready.coarse
    if isinstance(problem, ProgramProblem):
        usual = np.concatenate([_usual(phase.job) for phase in problem.phases])
    else:
        usual = _usual(problem.nodes.job if isinstance(problem, SplineProblem) else problem.job)
    return np.where(usual > SINGULAR_EVERYWHERE, share * usual, 0.0)


@lru_cache(maxsize=32)
def _usual(job: Job) -> Array:
    """What is usual of the singular values of the arms."""
    return usual_values(job)


def values_of(ready: PreparedSearch, x: Array, start: Array) -> dict[str, object]:
    """What to write into the given cell file for a point of its problem: values by address, rounded.

    Args:
        x: The variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,); see ``PreparedSearch.given_start``.
    """
    if ready.phases is not None:
        return ready.phases.values(x, start)
    problem = ready.coarse
    return (problem if isinstance(problem, SplineProblem) else ready.variables).values(x, start)


def _with_solved_start(ready: PreparedSearch) -> PreparedSearch:
    """The search with the start posture that a solve finds as the given one; unchanged where there is none."""
    try:
        start = ready.given_start
    except NoSolutionError:
        return ready
    base, variables = ready.variables.base, ready.variables
    robots = [replace(robot, start=start[base.columns(robot.name)]) for robot in base.robots]
    given = variables.read_from(replace(base, robots=tuple(robots)))
    return replace(ready, variables=replace(variables, given=given), solved_start=start)


def prepared(
    request: LayoutRequest, choice: Mapping[str, object] | None = None, detours: Sequence[float] = ()
) -> PreparedSearch:
    """The cell of a request, with the discrete choices and detours of one trial; made once in each process."""
    return _prepared(request, tuple(sorted((choice or {}).items())), tuple(detours))


@lru_cache(maxsize=8)
def _prepared(
    request: LayoutRequest, choice: tuple[tuple[str, object], ...], detours: tuple[float, ...]
) -> PreparedSearch:
    """See ``prepared``."""
    if detours:
        ready = _prepared(request, choice, ())
        return ready if ready.phases is None else replace(ready, phases=replace(ready.phases, detours=detours))
    cell = searched_cell(request)
    if choice:
        cell = cell.with_values(dict(choice))
        refuse_unsearchable(request, cell)
    return PreparedSearch.of(request, cell)
