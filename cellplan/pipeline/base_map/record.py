"""The record of a map: what JSON, page, picture and console show."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from cellplan.io.cell.changes import plain_values
from cellplan.io.yaml.writer import flow_text
from cellplan.model.units import DEG, MM, joint_unit
from cellplan.report.record.common import Record, number
from cellplan.search.base_map.verdicts import MapJob, PlaceVerdict, Verdict, counts

SCHEMA: Final = "cellplan.map/1"
FINE: Final = 6  # decimals of figures: far below what 65 nodes are good for, far above rounding
START: Final = 9  # decimals of start postures: far below the tolerance of any task


def map_record(
    asked: MapJob,
    found: Sequence[PlaceVerdict],
    *,
    best: Sequence[tuple[int, Mapping[str, Any]]],
    certified: Sequence[Mapping[str, Any]],
    drawn: Mapping[str, Any],
    versions: Mapping[str, str],
) -> Record:
    """The map in printed units.

    Args:
        asked: The job and the places.
        found: The verdict of every place.
        best: The best places with their settings, best first.
        certified: What came of the first of them when they were solved.
        drawn: Outlines and paths.
        versions: Version by package.
    """
    cell, places = asked.scene.cell, asked.places
    base = cell.robot(asked.robot).X_WB
    listed = []
    for rank, (place, settings) in enumerate(best):
        options = [f"{address}={flow_text(value)}" for address, value in plain_values(settings).items()]
        outcome = certified[rank] if rank < len(certified) else None
        listed.append({"place": place, "settings": plain_values(settings), "options": options, "certified": outcome})
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "robot": asked.robot,
        "duration_s": number(float(asked.job.times[-1])),
        "present": {
            "x_mm": number(MM * base[0, 3]),
            "y_mm": number(MM * base[1, 3]),
            "z_mm": number(MM * base[2, 3]),
            "yaw_deg": number(DEG * float(np.arctan2(base[1, 0], base[0, 0]))),
        },
        "x_mm": [number(x) for x in places.x.tolist()],
        "y_mm": [number(y) for y in places.y.tolist()],
        "counts": {str(verdict): count for verdict, count in counts(found).items()},
        "best": listed,
        "places": [_place(asked, each, place) for place, each in enumerate(found)],
        "drawing": dict(drawn),
        "inputs": dict(cell.inputs),
        "versions": dict(versions),
    }


def _place(asked: MapJob, found: PlaceVerdict, place: int) -> dict[str, Any]:
    """One place."""
    places = asked.places
    return {
        "x_mm": number(MM * places.X_WB[place, 0, 3]),
        "y_mm": number(MM * places.X_WB[place, 1, 3]),
        "yaw_deg": number(round(DEG * places.yaw[place], FINE)),
        "verdict": str(found.verdict),
        "reason": _reason(asked, found),
        "start": _start(asked, found),
        "figures": _figures(asked, found),
    }


def _start(asked: MapJob, found: PlaceVerdict) -> list[float] | None:
    """Start posture of the robot in [deg], of sliding joints in [mm]; None where there is none."""
    if found.start is None:
        return None
    joints = asked.scene.cell.robot(asked.robot).model.joints
    scales = [joint_unit(is_revolute=joint.is_revolute).scale for joint in joints]
    return [round(scale * value, START) + 0.0 for scale, value in zip(scales, found.start.tolist(), strict=True)]


def _figures(asked: MapJob, found: PlaceVerdict) -> dict[str, Any]:
    """Figures of a place; none where there is no motion."""
    if found.cycle is None or found.speed is None or found.acceleration is None or found.fast is None:
        return {}
    value, unit = (None, "") if found.joint is None else _margin(asked, found)
    return {
        "cycle_s": round(found.cycle, FINE),
        "margin": None if value is None else round(value, FINE),
        "margin_unit": unit,
        "margin_joint": "/".join(found.joint or ()),
        "max_velocity_ratio": round(found.speed, FINE),
        "max_acceleration_ratio": round(found.acceleration, FINE),
        "fastest_joint": "/".join(found.fast),
    }


def _margin(asked: MapJob, found: PlaceVerdict) -> tuple[float, str]:
    """Smallest distance of the joint that leaves least from its limits, and its unit."""
    robot, name = found.joint or ("", "")
    joint = next(each for each in asked.scene.cell.robot(robot).model.joints if each.name == name)
    unit = joint_unit(is_revolute=joint.is_revolute)
    return unit.scale * (found.margin or 0.0), unit.name


def _reason(asked: MapJob, found: PlaceVerdict) -> str:
    """Why a place does not pass; empty where it does."""
    if found.verdict is Verdict.OUT_OF_REACH:
        if found.start is None:
            return "no start posture reaches the path"
        return f"a tool loses its path at {found.lost_at:.3g} s"
    if found.verdict is Verdict.LIMIT:
        value, unit = _margin(asked, found)
        where = " at the start" if found.cycle is None else ""
        return f"{'/'.join(found.joint or ())} is {-value:.3g} {unit} beyond its limit{where}"
    if found.verdict is Verdict.SPEED:
        speed, rate = found.speed or 0.0, found.acceleration or 0.0
        what = "speed" if speed >= np.sqrt(rate) else "acceleration"
        share = 100.0 * (speed if what == "speed" else rate)
        return f"{'/'.join(found.fast or ())} at {share:.4g} % of its {what} limit"
    if found.verdict is Verdict.COLLISION and found.pair is not None:
        distance = MM * (found.distance or 0.0)
        how = f"{distance:.3g} mm apart" if distance > 0.0 else f"{-distance:.3g} mm into each other"
        return f"{found.pair[0]} and {found.pair[1]} {how} at {found.at or 0.0:.3g} s"
    return found.reason
