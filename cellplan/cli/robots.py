"""``cellplan robots``: the bundled robots with their reach, limits and source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cellplan.cli.options import AsJson
from cellplan.cli.output import json_failure, say, say_json

if TYPE_CHECKING:
    from cellplan.model.robot import RobotModel

SCHEMA = "cellplan.robots/1"


def robots(as_json: AsJson = False) -> None:
    """List the bundled robots with reach, limits and source."""
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.robots.bundled import bundled_names, load_bundled

        records = [_record(name, load_bundled(name)) for name in bundled_names()]
    if as_json:
        say_json({"schema": SCHEMA, "robots": records})
    else:
        say("\n\n".join("\n".join(_lines(record)) for record in records))


def _record(name: str, model: RobotModel) -> dict[str, Any]:
    """One robot in printed units."""
    from cellplan.kinematics.reach import arm_reach
    from cellplan.report.record.controller import zero_record
    from cellplan.report.record.joint_limits import joint_record

    return {
        "name": name,
        "source": model.source,
        "reach_mm": round(1e3 * arm_reach(model), 1),
        "published_reach": None
        if model.reach is None
        else {"mm": round(1e3 * model.reach.distance, 1), "to": model.reach.to, "source": model.reach.source},
        "bodies": len(model.bodies),
        "zero": zero_record(model),
        "joints": [joint_record(joint) for joint in model.joints],
    }


def _lines(record: dict[str, Any]) -> list[str]:
    """One robot as text: joint, range, largest speed."""
    from cellplan.report.record.joint_limits import limits_text

    lines = [record["name"], f"  reach {record['reach_mm']:g} mm from the first axis; {record['source']}"]
    if (published := record["published_reach"]) is not None:
        to = "" if published["to"] is None else f" to {published['to']}"
        lines.append(f"  published reach {published['mm']:g} mm{to} ({published['source']})")
    for joint in record["joints"]:
        limits, speed = limits_text(joint)
        lines.append(f"  {joint['name']:<10} {limits:<22} {speed}")
    zero = record["zero"]
    return [*lines, f"  {zero['line']}" + (f" ({zero['source']})" if zero["is_stated"] else "")]
