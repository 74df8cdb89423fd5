"""One attempt of a repair: the least change that it takes, solved and verified in full."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.io.cell.changes import plain_values
from cellplan.pipeline.fastest.scaling import refuse_fixed_times, scaled_values, whole_steps
from cellplan.pipeline.layout.limits import standing_of
from cellplan.pipeline.layout.prepared import NOT_FOLLOWED, PreparedSearch
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.repair.attempts import CONTINUOUS, Attempt, RemedyKind
from cellplan.pipeline.repair.confirm import Confirmed, confirmed, solved_cell
from cellplan.pipeline.repair.prepare import begins, ready_cell, start_posture, with_attempt
from cellplan.pipeline.repair.solved import SolvedCell, required_time
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.objective import Effort
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
GIVEN: Final = "given"
NO_MOTION: Final = "no layout nearby was found in which all tools follow their paths"


def evaluate(request: LayoutRequest, variant: Variant) -> TrialOutcome:
    """The least change of one attempt that passes every check, or why there is none; the cell as given for none."""
    ready = ready_cell(request)
    if variant.values.get("kind") == GIVEN:
        return _outcome(_of_values(ready, {}, 0.0))
    attempt = Attempt.from_record(variant.values)
    try:
        return _outcome(_least(ready, attempt))
    except (InputError, NoSolutionError) as error:
        return TrialOutcome(status=TrialStatus.NO_SOLUTION, reason=str(error).splitlines()[0], figures={})


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


def _shortfall(ready: PreparedSearch, improved: Improved) -> str:
    """What the best layout of a search still breaks."""
    left = standing_of(ready.coarse, improved.point, ready.demands(), EFFORT).violations()
    return f"at best {left[0]['text']}" if left else "at best less room than is asked for beyond the demands"


def _of_branch(ready: PreparedSearch, attempt: Attempt) -> Confirmed | str:
    """The start posture of one robot sought anew, the others as they are."""
    given, reason = start_posture(ready)
    if reason:
        return reason
    cell = ready.cell.with_values(attempt.values)
    start = ready.start_of(cell)
    if np.abs(start - given).max() < SAME_START:
        return "the given one is the best that was found"
    point = ready.coarse.evaluate(ready.variables.given, start)
    if point is None:
        return f"{NOT_FOLLOWED} from there"
    left = standing_of(ready.coarse, point, ready.demands(), EFFORT).violations()
    if left:
        return left[0]["text"]
    key = next(iter(attempt.values))
    values = written_starts(ready.cell, ready.variables.settings, start)
    cost = float(np.abs(start - given).sum() / np.radians(10.0))
    return _of_values(ready, {key: values[key]}, cost)


def _of_spin(ready: PreparedSearch, attempt: Attempt) -> Confirmed | str:
    """The rotation of one tool about its own axis left open."""
    opened = PreparedSearch.of(ready.request, ready.cell.with_values(attempt.values))
    point = opened.coarse.evaluate(opened.variables.given, start_posture(ready)[0])
    if point is None:
        return NOT_FOLLOWED
    left = standing_of(opened.coarse, point, opened.demands(), EFFORT).violations()
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
