"""One attempt of a repair: the least change that it takes, solved and verified in full."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.cell.changes import plain_values
from cellplan.geometry.arrays import Array
from cellplan.jobs.fastest.timed_program import refuse_fixed_times, scaled_values, whole_steps
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.limits import LimitRecord, standing_of
from cellplan.jobs.layout.trials.prepared import NOT_FOLLOWED, PreparedSearch
from cellplan.jobs.repair.attempts import CONTINUOUS, Attempt, RemedyKind
from cellplan.jobs.repair.neat import changed_values, far_starts, neat
from cellplan.jobs.repair.prepare import begins, ready_cell, start_posture, with_attempt
from cellplan.jobs.repair.solved import SolvedCell, demanded_margin, required_time
from cellplan.model.cell.cell import Cell
from cellplan.model.report.check_kinds import DISTANCES, JOINT_LIMITS, PASSED_BY_TIME
from cellplan.model.report.report import Check
from cellplan.model.units import MM
from cellplan.runs.solve import solve
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.measures import reserves
from cellplan.search.programs.objective import Demands, Effort, Reserve
from cellplan.search.programs.problem import Point, Problem
from cellplan.search.variables.written import written_starts
from cellplan.study.trial import TrialOutcome, TrialStatus, Variant

EFFORT: Final = Effort(iterations=25, keys=17)
BEGINNINGS: Final = 3  # [-] from which the least change of a layout is sought
FEWER: Final = 1  # [-] of other attempts
SAME_START: Final = 1e-3  # [rad] or [m] by which start postures of one branch differ
TENTHS: Final = 10.0  # [-] cost of a motion that lasts twice as long
SLOWEST: Final = 100.0  # [-] times as long as the given motion
FACTOR: Final = "factor"  # in the values of an attempt: how many times as long a motion is to last at least
DIGITS: Final = 9  # of a time in [s]
ATTEMPT: Final = "attempt"  # the value of a variant
NO_MOTION: Final = "no layout nearby was found in which all tools follow their paths"
SOLVES: Final = 4  # [-] times that a layout is corrected and solved before it is given up
NODES: Final = 129  # [-] of a correction
KEYS: Final = 33  # [-] configurations at which it asks for distances
ITERATIONS: Final = 20
SHARE_LEFT: Final = 0.5  # [-] share of the room beyond a demanded distance that every node is to have
REFINEMENTS: Final = 4  # [-] local optimisations until no distance between the configurations is too small
MORE_ANGLE: Final = float(np.radians(0.05))  # [rad] asked for beyond what is missed
MORE_LENGTH: Final = 0.0005  # [m] likewise
MORE_TIME: Final = 0.002  # [-] likewise


def evaluate(request: LayoutRequest, variant: Variant) -> TrialOutcome:
    """The least change of one attempt that passes every check, or why there is none; the cell as given for none."""
    ready, attempt = ready_cell(request), variant.values[ATTEMPT]
    if not isinstance(attempt, Attempt):
        return _outcome(_of_values(ready, {}, 0.0))
    try:
        return _outcome(_least(ready, attempt))
    except (InputError, NoSolutionError) as error:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=str(error).splitlines()[0], figures={})


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Confirmed:
    """What came of a change when it was solved in full."""

    values: Mapping[str, object]  # what changes, by address of the cell file
    cost: float  # size of the change
    solved: SolvedCell | None  # the last solution; None where there is none
    reason: str  # why it is no remedy; empty where it passed
    solves: int  # how often it was solved


def _least(ready: PreparedSearch, attempt: Attempt) -> Confirmed | str:
    """The least change of an attempt, or why there is none."""
    match attempt.kind:
        case RemedyKind.BRANCH:
            return _of_branch(ready, attempt)
        case RemedyKind.FREE_SPIN:
            return _of_spin(ready, attempt)
        case RemedyKind.DURATION:
            return _slower(ready, float(attempt.values[FACTOR]))
        case kind if kind in CONTINUOUS:
            return _of_variables(with_attempt(ready, attempt), start_posture(ready)[0], attempt)
        case _:
            return _of_values(ready, attempt.values, 0.0)


def _of_variables(ready: PreparedSearch, start: Array, attempt: Attempt) -> Confirmed | str:
    """The least change of variables."""
    count = BEGINNINGS if attempt.kind is RemedyKind.LAYOUT else FEWER
    candidates: list[Improved] = []
    for begin in begins(ready, start, seed=ready.request.seed, count=count):
        improved = improve(ready.coarse, *begin, ready.demands(), EFFORT)
        if improved is not None:
            candidates.append(improved)
    if not candidates:
        return NO_MOTION
    reason = ""
    for candidate in sorted(candidates, key=lambda one: (one.violation, one.objective)):
        if not candidate.is_conforming:
            return reason or _shortfall(ready, candidate)
        done = confirmed(ready, candidate.x, candidate.start)
        if not done.reason:
            return done
        reason = reason or done.reason
    return reason


def violations(ready: PreparedSearch, point: Point) -> list[LimitRecord]:
    """What a motion breaks at the nodes of a search, the worst first."""
    return standing_of(ready.coarse, point, ready.demands(), EFFORT).violations()


def _shortfall(ready: PreparedSearch, improved: Improved) -> str:
    """What the best layout of a search still breaks."""
    left = violations(ready, improved.point)
    return f"at best {left[0]['text']}" if left else "at best less room than is asked for beyond the demands"


def _of_branch(ready: PreparedSearch, attempt: Attempt) -> Confirmed | str:
    """The start posture of one robot sought anew, the others as they are; or all that are too far off their tasks."""
    given, reason = start_posture(ready)
    if reason:
        return reason
    cell = ready.cell.with_values(attempt.values)
    start = ready.start_of(cell)
    if np.abs(start - given).max() < SAME_START and not far_starts(ready):
        return "the given one is the best that was found"
    point = ready.coarse.evaluate(ready.variables.given, start)
    if point is None:
        return f"{NOT_FOLLOWED} from there"
    if left := violations(ready, point):
        return left[0]["text"]
    cost = float(np.abs(start - given).sum() / np.radians(10.0))
    if ready.phases is not None:
        return _of_values(ready, changed_values(ready, ready.variables.given, start), cost)
    key = next(iter(attempt.values))
    values = written_starts(ready.cell, ready.variables.settings, start)
    return _of_values(ready, {key: values[key]}, cost)


def _of_spin(ready: PreparedSearch, attempt: Attempt) -> Confirmed | str:
    """The rotation of one tool about its own axis left open."""
    opened = PreparedSearch.of(ready.request, ready.cell.with_values(attempt.values))
    point = opened.coarse.evaluate(opened.variables.given, start_posture(ready)[0])
    if point is None:
        return NOT_FOLLOWED
    left = violations(opened, point)
    return left[0]["text"] if left else _of_values(ready, attempt.values, 0.0)


def _slower(ready: PreparedSearch, factor: float) -> Confirmed:
    """The same motion so much slower, and more where that is not enough."""
    cell, longer_than = ready.cell, 1.0
    refuse_fixed_times(cell)
    while True:
        factor = whole_steps(cell, factor, longer_than=longer_than)
        values = {key: round(float(str(value)), DIGITS) for key, value in scaled_values(cell, factor).items()}
        done = _of_values(ready, values, TENTHS * (factor - 1.0))
        required = 1.0 if done.solved is None else required_time(done.solved.figures["failed"])
        if not done.reason or required <= 1.0 or factor > SLOWEST:
            return done
        factor, longer_than = factor * required, factor


def _of_values(ready: PreparedSearch, values: Mapping[str, object], cost: float) -> Confirmed:
    """Values solved once."""
    solved, reason = solved_cell(ready.cell, values)
    return Confirmed(values=values, cost=cost, solved=solved, reason=reason, solves=1)


def _outcome(confirmation: Confirmed | str) -> TrialOutcome:
    """What came of an attempt, as plain data."""
    if isinstance(confirmation, str):
        return TrialOutcome(status=TrialStatus.FAILED, reason=confirmation, figures={})
    solved: SolvedCell | None = confirmation.solved
    figures: dict[str, Any] = {
        "values": plain_values(confirmation.values),
        "cost": confirmation.cost,
        "solves": confirmation.solves,
    }
    if solved is None:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=confirmation.reason, figures=figures)
    status = TrialStatus.FAILED if confirmation.reason else TrialStatus.PASSED
    return TrialOutcome(status=status, reason=confirmation.reason, figures={**figures, **solved.figures})


def confirmed(ready: PreparedSearch, x: Array, start: Array) -> Confirmed:
    """A layout of the search, corrected until it passes every check with the demanded margins.

    Args:
        x: Values of the variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
    """
    problem, demands = ready.problem(NODES), ready.demands()
    effort = Effort(iterations=ITERATIONS, keys=KEYS, trust=0.2)
    done = Confirmed(values={}, cost=0.0, solved=None, reason=NOT_FOLLOWED, solves=0)
    for solves in range(1, SOLVES + 1):
        improved, effort = _refined(problem, (x, start), demands, effort)
        if improved is None or not (improved.is_conforming or solves == 1):
            break
        x, start = neat(ready, improved.x, improved.start)
        values, cost = changed_values(ready, x, start), float(np.abs(x - problem.given) @ problem.cost)
        solved, reason = solved_cell(ready.cell, values)
        done = Confirmed(values=values, cost=cost, solved=solved, reason=reason, solves=solves)
        tighter = _tightened(solved, demands, effort) if solved is not None and reason else None
        if tighter is None:
            break
        demands, effort = tighter
    return done


def _refined(
    problem: Problem, begin: tuple[Array, Array], demands: Demands, effort: Effort
) -> tuple[Improved | None, Effort]:
    """A local optimum with a little more than the demanded distances at every node, and the effort that this takes."""
    x, start = begin
    improved: Improved | None = None
    for _ in range(REFINEMENTS):
        improved = improve(problem, x, start, demands, effort)
        if improved is None:
            break
        near = problem.distances(improved.point, np.arange(len(problem.times), dtype=np.intp), effort.reserve.distance)
        shortfalls = near.demands + SHARE_LEFT * reserves(near, effort.reserve) - near.values
        worst = {int(near.pairs[row]): int(near.nodes[row]) for row in np.argsort(shortfalls) if shortfalls[row] > 0.0}
        if not worst:
            break
        also_at = {*effort.also_at, *(float(problem.times[node]) for node in worst.values())}
        effort, x, start = replace(effort, also_at=tuple(sorted(also_at))), improved.x, improved.start
    return improved, effort


def solved_cell(cell: Cell, values: Mapping[str, object]) -> tuple[SolvedCell | None, str]:
    """A changed cell solved in full, and why it is no remedy; empty where it passes with the demanded margins."""
    try:
        changed = cell.with_values(values) if values else cell
        solved = SolvedCell(solution=solve(changed, is_reported=False), margin=demanded_margin(cell))
    except (InputError, NoSolutionError) as error:
        return None, str(error).splitlines()[0]
    failed = solved.failed
    return solved, failed[0].message if failed else ""


def _tightened(solved: SolvedCell, demands: Demands, effort: Effort) -> tuple[Demands, Effort] | None:
    """Demands that ask for what the verified motion lacks; None where it lacks something else."""
    failed = solved.failed
    names = {check.name for check in failed}
    if not names <= JOINT_LIMITS | PASSED_BY_TIME | DISTANCES:
        return None
    shortfalls = solved.violations
    margin = demands.margin + np.where(shortfalls > 0.0, shortfalls + MORE_ANGLE, 0.0)
    near = [check for check in failed if check.name in DISTANCES]
    reserve = replace(
        effort.reserve, distance=effort.reserve.distance + _missing(near), time=effort.reserve.time + _late(failed)
    )
    is_program = len(solved.solution.runs) > 1  # whose phases have clocks of their own
    at = (check.at_s for check in near if check.at_s is not None and not is_program)
    also_at = tuple(sorted({*effort.also_at, *at}))
    return replace(demands, margin=margin), replace(effort, reserve=_most(reserve), also_at=also_at)


def _missing(near: Sequence[Check]) -> float:
    """Distance in [m] to ask for beyond what is asked for already."""
    lengths = [check.limit - check.value for check in near if check.unit == "mm" and check.name == "clearance"]
    return max(0.0, max(lengths, default=0.0)) / MM + MORE_LENGTH if near else 0.0


def _late(failed: Sequence[Check]) -> float:
    """Share of the time to ask for beyond what is asked for already."""
    shares = [check.kind.more_time(check.value, check.limit) - 1.0 for check in failed if check.name in PASSED_BY_TIME]
    return max(shares) + MORE_TIME if shares else 0.0


def _most(reserve: Reserve) -> Reserve:
    """The room, within reason: what asks for more is not corrected any further."""
    return replace(reserve, distance=min(reserve.distance, 0.05), time=min(reserve.time, 0.5))
