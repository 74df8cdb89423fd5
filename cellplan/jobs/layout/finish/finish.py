"""Finish: a layout of the search improved at more nodes, then solved and verified until it passes or is given up.

Nodes and keys are added where the solved motion asks for more time, or comes nearer, than those that there are.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import count
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.timed_program import TimedProgram
from cellplan.jobs.layout.finish.cycles import (
    distances_missed_at,
    draft,
    exceeded_at,
    is_scaled,
    load_of,
    margins_missed_at,
    nodes_of,
    shortest,
    time_of,
)
from cellplan.jobs.layout.misplacement_record import MisplacementRecord
from cellplan.jobs.layout.trials.limits import Standing, standing_of
from cellplan.jobs.layout.trials.prepared import NOT_FOLLOWED, PreparedSearch, demands_near, prepared, values_of
from cellplan.jobs.layout.trials.proposals import choice_of
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.model.report.report import ClearanceClass
from cellplan.model.units import DEG, MM
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.scene.collision.hull_cache import keep_hulls, without_hull
from cellplan.scene.collision_pairs import cut_tools
from cellplan.search.programs.improve import improve
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.spline_path.null_space import NullSpaceProblem
from cellplan.search.variables.variables import Variables
from cellplan.study.trial import StudyTrial
from cellplan.study.workers import Workers

if TYPE_CHECKING:
    from cellplan.search.misplacement.robust import Robust, RobustSearch

NODES: Final = 129  # [-] of the finish, or more where trials need more
LED_NODES: Final = 257  # [-] likewise of motion in the null space, which makes peaks between fewer of them
FINISH: Final = Effort(iterations=25, keys=25, trust=0.2)  # of a layout that is nearly at its best
FINER: Final = (2, 4)  # [-] times as many nodes of a program whose tools lose their paths
DENSER: Final = (LayoutProblem, NullSpaceProblem)  # problems that can have more nodes about some times
REFINED: Final = 3  # [-] times that nodes are added for a shorter cycle before it is certified
GAIN: Final = 0.001  # [-] share of the cycle that each of them must gain
LEARNED: Final = 4  # [-] times that a program is improved with the detours of its transfers
SHORTER: Final = 0.005  # [-] share of its cycle that each of them must gain
ROUNDS: Final = 4  # [-] times that a layout is improved and solved before it is given up
MORE_ANGLE: Final = np.radians(0.05)  # [rad] asked for beyond what was missed
MORE_LENGTH: Final = 0.0005  # [m] likewise
MORE_WITHIN: Final = 0.00002  # [m] and of a robot's own bodies
MORE_TIME: Final = 0.002  # [-] likewise
ROUNDING: Final = 1e-9  # [deg] by which a margin may be missed: of printed numbers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CandidateResult:
    """A layout that solve passed, or why it did not.

    Attributes:
        trial: Number of the trial that it comes from.
        x: Variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
        program: The program, solved and verified; None where there is none.
        reason: Why it is rejected; empty where it passed.
        standing: How it stands at the nodes of the finish.
        solves: How often it was solved in full.
        misplacement: What came of it with displaced bases; None where none are asked for, or where it is rejected.
    """

    trial: int
    x: Array
    start: Array
    program: TimedProgram | None
    reason: str
    standing: Standing
    solves: int
    misplacement: MisplacementRecord | None = None

    @property
    def passed(self) -> bool:
        """Whether every check and every demand of the search was passed."""
        return self.program is not None and not self.reason

    @property
    def cycle(self) -> float:
        """Its cycle in [s]; infinite without a program."""
        return np.inf if self.program is None else self.program.cycle

    @property
    def margin(self) -> float | None:
        """Smallest verified distance of a turning joint from its limits in [deg]; None without one."""
        return None if self.program is None else margin_of(self.program)

    @property
    def clearance(self) -> float | None:
        """Smallest certified distance in [mm]; None without pairs."""
        return None if self.program is None else clearance_of(self.program)

    @property
    def apart(self) -> float | None:
        """The same of bodies that do not belong to one robot."""
        return None if self.program is None else clearance_of(self.program, within_robot=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Refinement:
    """Effort, reserves and nodes, as verified motions have shown to be needed."""

    effort: Effort = FINISH  # of the local optimisation
    nodes: int = NODES
    denser: tuple[float, ...] = ()  # times in [s] about which there are more

    def denser_at(self, times: Sequence[float], span: float) -> "_Refinement | None":
        """With more nodes about times in [s] of a motion of so many seconds; None where there are more already."""
        step = span / (self.nodes - 1)
        new = [time for time in times if all(abs(time - other) > step for other in self.denser)]
        return replace(self, denser=(*self.denser, *new)) if new else None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Timed:
    """A layout at more nodes and its motion, verified but for its clearance; or why there is none."""

    x: Array
    start: Array
    standing: Standing
    demands: Demands
    refinement: _Refinement
    early: EarlyClearance
    program: TimedProgram | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Finalist:
    """A trial that is to be finished."""

    trial: StudyTrial
    begun: "tuple[RobustSearch, Robust | None] | None" = None  # the layout with displaced bases, where it is begun


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Finish:
    """The finish of layouts of one cell."""

    ready: PreparedSearch  # the cell
    progress: Progress  # called with the stage and the fraction done
    workers: int | Executor = 1  # processes that help where they are idle; or how many each study begins
    choice: Mapping[str, object] = field(default_factory=dict)  # discrete choices that the cell is made ready with

    def ordered(self, trials: Sequence[StudyTrial]) -> Sequence[Finalist]:
        """Trials that conform by the search, best first, in the order in which they are finished."""
        return [Finalist(trial) for trial in trials]

    def certified(self, finalist: Finalist) -> CandidateResult:
        """A layout of the search, certified or with the reason why not."""
        trial = finalist.trial
        return self._with_choice_of(trial)._certified(trial.number, *layout_of(trial))

    def learned(self, trial: StudyTrial, result: CandidateResult) -> CandidateResult:
        """A certified program improved again with the detours that its transfers take, while it becomes shorter."""
        finish, best = self._with_choice_of(trial), result
        for _ in range(LEARNED):
            phases, problem = finish.ready.phases, finish.ready.coarse
            point = problem.evaluate(best.x, best.start)
            if phases is None or not isinstance(problem, ProgramProblem) or point is None or best.program is None:
                break
            phases = phases.with_detours(problem, point, best.program.solution)
            finish = replace(finish, ready=replace(finish.ready, phases=phases))
            self.progress(f"certifying trial {result.trial} with the detours of its transfers", 1.0)
            again = finish._certified(result.trial, best.x, best.start)
            again = replace(again, solves=best.solves + again.solves)
            if not again.passed or again.cycle > (1.0 - SHORTER) * best.cycle:
                return min(again, replace(best, solves=again.solves), key=lambda one: (not one.passed, one.cycle))
            best = again
        return best

    def _with_choice_of(self, trial: StudyTrial) -> Self:
        """The finish of layouts with the discrete choices of a trial."""
        choice = choice_of(trial)
        return replace(self, ready=prepared(self.ready.request, choice), choice=choice)

    def _certified(self, trial: int, x: Array, start: Array) -> CandidateResult:
        """See ``certified``; the cell is made ready with the choices of the trial."""
        fewest = NODES if self.ready.variables.settings.null_space is None else LED_NODES
        refinement = _Refinement(nodes=nodes_of(self.ready, x, start, fewest))
        for solves in count(1):
            timed = self._refined(x, start, refinement, is_first=solves == 1)
            x, start, program, reason = timed.x, timed.start, timed.program, timed.reason
            if program is not None:
                program = program.certified(self.progress, timed.early)
                reason = rejection_of(program, self.ready.variables) or too_singular(
                    self.ready, timed.standing, program
                )
            result = CandidateResult(
                trial=trial, x=x, start=start, program=program, reason=reason, standing=timed.standing, solves=solves
            )
            more = None if result.passed or program is None or solves >= ROUNDS else _enlarged(timed, program)
            if more is None:
                break
            refinement = more
        return result

    def _refined(self, x: Array, start: Array, refinement: _Refinement, *, is_first: bool) -> _Timed:
        """The layout and its motion, improved again with more nodes where it asks for more time than the others do."""
        best = self._drafted(x, start, refinement, is_first=is_first)
        for _ in range(REFINED if is_scaled(self.ready) else 0):
            if best.program is None:
                return best
            problem, measures = best.standing.problem, best.standing.measures
            peaks = exceeded_at(best.program, measures.cycle, measures.span)
            denser = refinement.denser_at(peaks, measures.span)
            if not isinstance(problem, DENSER) or denser is None:
                break
            refinement = denser
            refined = self._drafted(best.x, best.start, refinement, is_first=False)
            if refined.program is None or time_of(refined.program) > (1.0 - GAIN) * time_of(best.program):
                break
            best = refined
        return self._shortest(replace(best, refinement=refinement))

    def _drafted(self, x: Array, start: Array, refinement: _Refinement, *, is_first: bool) -> _Timed:
        """The layout improved at more nodes, with its motion in the cycle that it has there."""
        x, start, standing, demands = self._improved(x, start, refinement, is_first=is_first)
        is_once = self.ready.phases is not None or self.ready.request.objective is not Objective.CYCLE
        helping = self.workers if isinstance(self.workers, Workers) else None
        early = EarlyClearance(helping.begin if is_once and helping is not None else None)
        timed = _Timed(x=x, start=start, standing=standing, demands=demands, refinement=refinement, early=early)
        try:
            cell = self._cell(x, start)
            program = draft(self.ready, cell, standing.measures.cycle, self.progress, early)
            return replace(timed, program=program)
        except (InputError, NoSolutionError) as error:
            return replace(timed, reason=str(error).splitlines()[0])

    def _shortest(self, timed: _Timed) -> _Timed:
        """The layout with its motion in the shortest cycle that its limits allow."""
        if timed.program is None or not is_scaled(self.ready):
            return timed
        try:
            cell = self._cell(timed.x, timed.start)
            return replace(timed, program=shortest(self.ready, cell, timed.program, self.progress))
        except (InputError, NoSolutionError) as error:
            return replace(timed, program=None, reason=str(error).splitlines()[0])

    def _cell(self, x: Array, start: Array) -> Cell:
        """The cell of a layout, as its file has it; a worker begins with hulls of tools that are new."""
        cell = self.ready.variables.given_cell.with_values(values_of(self.ready, x, start))
        if isinstance(self.workers, Workers) and (new := without_hull(cut_tools(cell))):
            self.workers.attempt(keep_hulls, new)
        return cell

    def _improved(
        self, x: Array, start: Array, refinement: _Refinement, *, is_first: bool
    ) -> tuple[Array, Array, Standing, Demands]:
        """The layout improved at more nodes; one that only has to conform is taken as it is at first."""
        demands, problem = self._demands(x, start), problem_of(self.ready, refinement.nodes, refinement.denser)
        if is_first and demands.objective is Objective.CONFORMING:
            problem, effort = self.ready.coarse, Effort()
            point = problem.evaluate(x, start)
            if point is not None:
                return x, start, standing_of(problem, point, demands, effort), demands
        improved = improve(problem, x, start, demands, refinement.effort)
        for finer in FINER if self.ready.phases is not None else ():
            if improved is None:
                problem = problem_of(self.ready, finer * refinement.nodes)
                improved = improve(problem, x, start, demands, refinement.effort)
        if improved is None:
            problem = self.ready.coarse
            point = problem.evaluate(x, start)
            if point is None:
                raise NoSolutionError(NOT_FOLLOWED)
            return x, start, standing_of(problem, point, demands, refinement.effort), demands
        return improved.x, improved.start, standing_of(problem, improved.point, demands, refinement.effort), demands

    def _demands(self, x: Array, start: Array) -> Demands:
        """What is demanded of a layout of the search."""
        point = self.ready.coarse.evaluate(x, start)
        return self.ready.demands() if point is None else demands_near(self.ready, point)


def layout_of(trial: StudyTrial) -> tuple[Array, Array]:
    """Variables and start posture of a layout of the search, shapes (n,) and (nq,)."""
    return np.array(trial.figures["x"], dtype=float), np.array(trial.figures["start"], dtype=float)


@lru_cache(maxsize=8)
def problem_of(ready: PreparedSearch, nodes: int, denser: tuple[float, ...] = ()) -> Any:
    """The layout problem at about so many nodes, and more about some times in [s] on their clock."""
    problem = ready.problem(nodes)
    if denser and isinstance(problem, DENSER):
        return problem.finer(ready.schedule, nodes=nodes, denser=denser)
    return problem


def rejection_of(program: TimedProgram, variables: Variables) -> str:
    """Why a program is rejected; empty where it passed every check and keeps the margins of the search."""
    failed = [check.message for run in program.solution.runs for check in run.report.checks if not check.passed]
    if failed:
        return failed[0]
    demanded, margin = DEG * float(variables.margin.max(initial=0.0)), margin_of(program)
    if margin is not None and margin < demanded - ROUNDING:
        return f"smallest margin {margin:.4g} deg, {demanded:.4g} deg demanded"
    return ""


def too_singular(ready: PreparedSearch, standing: Standing, program: TimedProgram) -> str:
    """Which arm comes nearer to a singular configuration than the cell allows, by the report; empty for none."""
    arms, demanded, layout = standing.measures.arms, standing.demands.singular, ready.cell.layout
    if arms is None or demanded is None or layout is None or layout.singular is None:
        return ""
    for run in program.solution.runs:
        values = {} if run.report.conditioning is None else run.report.conditioning.robots
        for name, least in zip(arms.names, demanded.tolist(), strict=True):
            singular = values.get(name, np.zeros(0))
            if singular.max(initial=0.0) > 0.0 and singular.min() < least:
                return f"smallest singular value {singular.min():.4g} of {name}, {least:.4g} demanded"
    return ""


def certified_cell(result: CandidateResult) -> Cell:
    """The cell file's cell of a certified layout: what ``solve`` read.

    Raises:
        ValueError: The layout has no program.
    """
    if result.program is None:
        raise ValueError("expected a layout with a program, got one without")
    return result.program.solution.cell


def _enlarged(timed: _Timed, program: TimedProgram) -> _Refinement | None:
    """Reserves for what the verified motion missed, nodes and keys there; None where it missed nothing of the kind."""
    problem, span, times = timed.standing.problem, timed.standing.measures.span, list[float]()
    demanded, effort = float(timed.demands.margin.max(initial=0.0)), timed.refinement.effort
    margin, load, reserve = margin_of(program), load_of(program), effort.reserve
    missed_margin = margin is not None and margin < DEG * demanded
    if margin is not None and missed_margin:
        reserve = replace(reserve, margin=reserve.margin + (demanded - np.radians(margin) + MORE_ANGLE))
        times += margins_missed_at(program, demanded, span)
    required = program.solution.cell.checks.clearance_mm
    others, inner = (clearance_of(program, within_robot=within_robot) for within_robot in (False, True))
    keys = list[float]()
    if others is not None and others < required:
        reserve = replace(reserve, distance=reserve.distance + ((required - others) / MM + MORE_LENGTH))
        keys += distances_missed_at(program, span, within_robot=False)
    if inner is not None and inner < required:
        reserve = replace(reserve, within_robot=reserve.within_robot + ((required - inner) / MM + MORE_WITHIN))
        keys += distances_missed_at(program, span, within_robot=True)
    if load > 1.0:
        reserve = replace(reserve, time=reserve.time + (load - 1.0 + MORE_TIME))
        times += exceeded_at(program, program.cycle, span)
    if not (missed_margin or keys or load > 1.0):
        return None
    effort = replace(effort, reserve=reserve, also_at=(*effort.also_at, *keys))
    refined = replace(timed.refinement, effort=effort)
    denser = refined.denser_at([*times, *keys], span) if isinstance(problem, DENSER) else None
    if denser is not None:
        return denser
    more_keys = replace(effort, keys=2 * effort.keys - 1) if keys else effort
    return replace(refined, nodes=2 * refined.nodes - 1, effort=more_keys)


def margin_of(program: TimedProgram) -> float | None:
    """Smallest distance of a turning joint from its limits in [deg]; None without one."""
    margins = [use.margin for run in program.solution.runs for use in run.report.joints if use.is_revolute]
    return DEG * min(margins) if margins else None


def clearance_of(program: TimedProgram, *, within_robot: bool | None = None) -> float | None:
    """Smallest certified distance in [mm], of a robot's own bodies or of others only if asked; None without pairs."""
    distances = [
        minimum.minimum
        for run in program.solution.runs
        for kind, minimum in run.report.clearance.minima.items()
        if minimum.minimum is not None and within_robot in {None, kind is ClearanceClass.SELF}
    ]
    return MM * min(distances) if distances else None
