"""The given layout of a search, as the record has it and its page draws it."""

from typing import Any, Final, NamedTuple

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.kinematics.reach import arm_reach
from cellplan.pipeline.drawing import drawing
from cellplan.pipeline.layout.limits import Standing, standing_of
from cellplan.pipeline.layout.prepared import Prepared, prepared
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.layout.trial import EFFORT
from cellplan.report.record.common import number
from cellplan.report.record.layout import GivenRecord

FINE: Final = 6  # decimals: far above rounding
REACH: Final = 5  # [-] rounds that the reach of an arm is sought in: to some millimetres


class Given(NamedTuple):
    """What is shown of the given layout."""

    record: GivenRecord
    drawing: dict[str, Any]  # its floor plan
    reach: dict[str, float]  # reach of each arm, without its tool, in [m]


def given_layout(request: LayoutRequest) -> Given:
    """What is shown of the given layout of a search, whatever comes of the search."""
    ready = prepared(request)
    return Given(
        record=given_record(standing_of_given(ready), ready),
        drawing=drawing(ready.scene, _shown_start(ready), ready.schedule),
        reach={robot.name: float(arm_reach(robot.model, rounds=REACH)) for robot in ready.cell.robots},
    )


def standing_of_given(ready: Prepared) -> Standing | None:
    """How the given layout stands; None where a tool cannot follow."""
    if ready.unled is not None and not ready.path_search.is_given:
        return standing_of_given(ready.unled)
    try:
        point = ready.coarse.evaluate(ready.coarse.given, ready.given_start)
    except NoSolutionError:
        return None
    return None if point is None else standing_of(ready.coarse, point, ready.demands(), EFFORT)


def given_record(standing: Standing | None, ready: Prepared) -> GivenRecord:
    """The given layout."""
    if standing is None:
        return {"status": "violating", "cycle_s": None, "margin_deg": None, "clearance_mm": None, "violations": []}
    at_duration = standing_of(
        standing.problem,
        standing.measures.point,
        ready.demands(objective="conforming", duration=ready.duration),
        EFFORT,
    )
    violations = at_duration.violations()
    return {
        "status": "violating" if violations else "conforming",
        "cycle_s": number(round(standing.measures.cycle, FINE)),
        "margin_deg": None if standing.margin is None else number(round(standing.margin, FINE)),
        "clearance_mm": None if standing.clearance is None else number(round(standing.clearance, FINE)),
        "violations": violations,
    }


def _shown_start(ready: Prepared) -> Array:
    """The configuration in which the given layout is drawn: its start, or all joints at zero without one."""
    try:
        return ready.given_start
    except NoSolutionError:
        return np.zeros(ready.cell.joint_count)
