"""What each variable of a layout search is and does, and the joint path, as the record has them."""

from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.finish.finish import CandidateResult
from cellplan.jobs.layout.trials.limits import Standing, effects
from cellplan.jobs.layout.trials.prepared import PreparedSearch
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Number, number

FINE: Final = 6  # decimals: far above rounding
LENGTH_STEP: Final = 0.1  # [m] that effects are stated for
ANGLE_STEP: Final = float(np.radians(10.0))  # [rad] likewise


class VariableRecord(TypedDict):
    """A variable of the search."""

    name: Annotated[str, "its address in the cell file"]
    unit: Annotated[str, "`mm`, `deg` or empty"]
    lower: Annotated[Number, "lower bound"]
    upper: Annotated[Number, "upper bound"]
    given: Annotated[Number, "value in the given cell"]
    best: Annotated[Number, "value in the best layout; null without one"]
    step: Annotated[Number, "step that the effects are stated for"]
    cycle_s: Annotated[Number, "effect of a step on the cycle, by the joint that decides it"]
    margin_deg: Annotated[Number, "effect on the smallest margin of a turning joint"]
    clearance_mm: Annotated[Number, "effect on the smallest distance of bodies"]


class PathRecord(TypedDict):
    """The joint path of the best layout, or its motion in the null space."""

    robot: Annotated[str, "whose joints follow it; empty for motion of all robots in the null space of the tasks"]
    coefficients: Annotated[int, "number of coefficients of each joint"]
    degree: Annotated[int, "degree of the spline"]
    is_given: Annotated[bool, "whether the given cell has a path; else the given motion is that without one"]
    departure_deg: Annotated[Number, "by how much a turning joint leaves the given motion at most; null without one"]
    departure_mm: Annotated[Number, "by how much a sliding joint does; null without one"]


def variable_records(
    ready: PreparedSearch, standing: Standing | None, best: CandidateResult | None
) -> list[VariableRecord]:
    """The variables in the units of the file, with their effects."""
    variables, names = ready.variables, ready.variables.names
    before = len(ready.coarse.names) - len(names)  # coefficients of a joint path have no rows
    units = [_unit(name) for name in names]
    steps = np.array([{"mm": LENGTH_STEP, "deg": ANGLE_STEP, "": float(np.log(2.0))}[unit] for unit in units])
    of = effects(standing, np.append(np.zeros(before), steps)) if standing is not None else {}
    shown: list[VariableRecord] = []
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        values = (variables.lower, variables.upper, variables.given)
        lower, upper, given = (_in_file_units(float(value[place]), unit) for value in values)
        shown.append(
            {
                "name": name,
                "unit": unit,
                "lower": lower,
                "upper": upper,
                "given": given,
                "best": None if best is None else _in_file_units(float(best.x[before + place]), unit),
                "step": {"mm": MM * LENGTH_STEP, "deg": DEG * ANGLE_STEP, "": 2.0}[unit],
                "cycle_s": of["cycle_s"][before + place] if of else None,
                "margin_deg": of["margin_deg"][before + place] if of else None,
                "clearance_mm": of["clearance_mm"][before + place] if of else None,
            }
        )
    return shown


def path_record(ready: PreparedSearch, x: Array) -> PathRecord:
    """The joint path at variables of shape (n,), beside the given motion."""
    search = ready.path_search
    departures = search.departures(x)
    joints = [joint for name in search.robots for joint in ready.variables.base.robot(name).model.joints]
    turning = np.array([joint.is_revolute for joint in joints])
    in_deg, in_mm = (departures[is_selected].max(initial=-1.0) for is_selected in (turning, ~turning))
    return {
        "robot": search.settings.robot,
        "coefficients": search.settings.coefficients,
        "degree": search.settings.degree,
        "is_given": search.is_given,
        "departure_deg": number(round(DEG * in_deg, FINE)) if in_deg >= 0.0 else None,
        "departure_mm": number(round(MM * in_mm, FINE)) if in_mm >= 0.0 else None,
    }


def _unit(name: str) -> str:
    """Unit of a variable; empty for a weight."""
    if ".weights" in name:
        return ""
    return "mm" if "_mm" in name else "deg"


def _in_file_units(value: float, unit: str) -> float | None:
    """A value in the unit of the file; None where it is infinite."""
    if not np.isfinite(value):
        return None
    return number(
        round({"mm": MM * value, "deg": DEG * value, "": float(np.exp(value)) if not unit else 0.0}[unit], FINE)
    )
