"""The given layout of a search, as the record has it and its page draws it."""

from typing import Annotated, Any, Final, NamedTuple, TypedDict

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.drawing import drawing
from cellplan.jobs.fastest.timed_program import TimedProgram
from cellplan.jobs.layout.finish.cycles import draft, is_scaled, shortest
from cellplan.jobs.layout.finish.finish import CandidateResult, clearance_of, margin_of, rejection_of, too_singular
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.limits import LimitRecord, Standing, standing_of
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared, values_of
from cellplan.jobs.layout.trials.trial import EFFORT
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import silent
from cellplan.report.record.common import Number, number
from cellplan.scene.kinematics.reach import arm_reach
from cellplan.search.programs.objective import Objective


class GivenRecord(TypedDict):
    """The layout as it was given."""

    status: Annotated[str, "`conforming` or `violating`, as `solve` has it"]
    reason: Annotated[str, "why it has no motion; empty where it has one"]
    cycle_s: Annotated[Number, "shortest verified cycle of the same motion; null where another objective is sought"]
    margin_deg: Annotated[Number, "smallest distance of a turning joint from its limits; negative beyond them"]
    clearance_mm: Annotated[Number, "smallest certified distance of bodies"]
    violations: Annotated[list[LimitRecord], "what it breaks, worst first"]


NOT_SOLVED: Final[GivenRecord] = {
    "status": "violating",
    "reason": "",
    "cycle_s": None,
    "margin_deg": None,
    "clearance_mm": None,
    "violations": [],
}
FINE: Final = 6  # decimals: far above rounding
REACH: Final = 5  # [-] rounds that the reach of an arm is sought in: to some millimetres


class Given(NamedTuple):
    """What is shown of the given layout."""

    record: GivenRecord
    drawing: dict[str, Any]  # its floor plan
    reach: dict[str, float]  # reach of each arm, without its tool, in [m]


def given_layout(request: LayoutRequest, program: TimedProgram | None = None) -> Given:
    """What is shown of the given layout of a search, whatever comes of the search; its program where it is solved."""
    ready = prepared(request)
    return Given(
        record=given_record(ready, program),
        drawing=drawing(ready.scene, _shown_start(ready), ready.schedule),
        reach={robot.name: float(arm_reach(robot.model, rounds=REACH)) for robot in ready.cell.robots},
    )


def standing_of_given(ready: PreparedSearch) -> Standing | None:
    """How the given layout stands; None where a tool cannot follow."""
    ready = _searched(ready)
    try:
        point = ready.coarse.evaluate(ready.coarse.given, ready.given_start)
    except NoSolutionError:
        return None
    return None if point is None else standing_of(ready.coarse, point, ready.demands(), EFFORT)


def given_program(ready: PreparedSearch) -> TimedProgram:
    """The program of the given layout, certified.

    Raises:
        InputError, NoSolutionError: It has none.
    """
    searched = _searched(ready)
    return draft(searched, _given_cell(searched), searched.duration, silent).certified(silent)


def given_result(ready: PreparedSearch, trial: int, program: TimedProgram | None = None) -> CandidateResult | None:
    """The given layout as what came of a trial; None where a tool loses its path at the nodes of the search.

    Raises:
        InputError, NoSolutionError: It has no program.
    """
    standing = standing_of_given(ready)
    if standing is None:
        return None
    solved = given_program(ready) if program is None else program
    if is_scaled(ready):
        solved = shortest(ready, _given_cell(ready), solved, silent).certified(silent)
    return CandidateResult(
        trial=trial,
        x=ready.coarse.given,
        start=ready.given_start,
        program=solved,
        reason=rejection_of(solved, ready.variables),
        standing=standing,
        solves=1,
    )


def given_record(ready: PreparedSearch, program: TimedProgram | None = None) -> GivenRecord:
    """The given layout as ``solve`` has it; where it is rejected, what it breaks at the nodes of the search too."""
    searched = _searched(ready)
    standing, cycle = standing_of_given(searched), None
    try:
        program = given_program(ready) if program is None else program
        if is_scaled(searched):
            cycle = shortest(searched, _given_cell(searched), program, silent).cycle
        elif searched.request.objective is Objective.CYCLE:
            cycle = program.cycle
    except (InputError, NoSolutionError) as error:
        return {**NOT_SOLVED, "reason": str(error).splitlines()[0]}
    rejected = rejection_of(program, searched.variables)
    if not rejected and standing is not None:
        rejected = too_singular(searched, standing, program)
    return {
        "status": "violating" if rejected else "conforming",
        "reason": "",
        "cycle_s": None if cycle is None else number(round(cycle, FINE)),
        "margin_deg": _rounded(margin_of(program)),
        "clearance_mm": _rounded(clearance_of(program)),
        "violations": _violations(searched, standing, rejected) if rejected else [],
    }


def _searched(ready: PreparedSearch) -> PreparedSearch:
    """The search in which the given layout is a point: without the joint path where the cell gives none."""
    return ready.unled if ready.unled is not None and not ready.path_search.is_given else ready


def _given_cell(ready: PreparedSearch) -> Cell:
    """The given layout as a point of the search."""
    return ready.variables.given_cell.with_values(values_of(ready, ready.coarse.given, ready.given_start))


def _violations(ready: PreparedSearch, standing: Standing | None, rejected: str) -> list[LimitRecord]:
    """What a rejected layout breaks, the worst first: at the nodes of the search, else why it is rejected."""
    limits = list[LimitRecord]()
    if standing is not None:
        demands = ready.demands(objective="conforming", **({} if ready.phases else {"duration": ready.duration}))
        limits = standing_of(standing.problem, standing.measures.point, demands, EFFORT).violations()
    return limits or [{"kind": "check", "subject": "", "text": rejected}]


def _rounded(value: float | None) -> Number:
    """A figure as it is recorded."""
    return None if value is None else number(round(value, FINE))


def _shown_start(ready: PreparedSearch) -> Array:
    """The configuration in which the given layout is drawn: its start, or all joints at zero without one."""
    try:
        return ready.given_start[: ready.cell.joint_count]
    except NoSolutionError:
        return np.zeros(ready.cell.joint_count)
