"""Checks on a page: how many of each kind passed, and the failed ones, most severe first."""

from collections.abc import Iterable
from typing import Any, Final

from cellplan.model.report import Check
from cellplan.report.page.filters import against, floored, small, stated
from cellplan.report.record.common import Entries, Record
from cellplan.report.record.failures import FAILURES

CHECKS: Final = {
    "joint_position": "joint positions within their limits",
    "joint_velocity": "joint velocities within their limits",
    "joint_acceleration": "joint accelerations within their limits",
    "joint_acceleration_assumed": "joint accelerations within assumed limits",
    "joint_acceleration_between_phases": "joint accelerations where phases meet within their limits",
    "joint_jerk": "joint jerk within its limits",
    "part_acceleration": "acceleration of the part within its limit",
    "tool_speed": "speed of the tools within its limit",
    "process_feed": "demanded feeds within their tolerances",
    "process_on_delay": "delays of processes at the start of their paths",
    "process_off_delay": "delays of processes at the end of their paths",
    "locked_joint": "failed joints at rest",
    "home": "idle robots at their homes",
    "position_error": "tool position on the part within tolerance",
    "orientation_error": "tool orientation on the part within tolerance",
    "position_error_between_rows": "tool position within tolerance between the rows",
    "orientation_error_between_rows": "tool orientation within tolerance between the rows",
    "closure_position_error_between_rows": "tools of co-holders on their grasps between the rows",
    "closure_orientation_error_between_rows": "orientation of co-holders' tools between the rows",
    "closure_position_error": "tools of co-holders on their grasps",
    "closure_orientation_error": "orientation of co-holders' tools",
    "tool_depth": "tool depth in the part within its limit",
    "joint_drift": "joints return after each cycle",
    "clearance": "required clearance kept",
    "payload": "tool and part within the payload",
    "payload_centre": "centre of mass of the load within its limits",
    "payload_moment": "moments of the load on the wrist within their limits",
    "payload_inertia": "inertia of the load on the wrist within its limits",
    "collision": "no collision",
    "grip_depth": "depth of holders in the part within the depth of their grip",
    "mount_depth": "depth of tools in the arm within the depth of their mounting",
    "standing_depth": "depth of mounted bodies in their supports within its limit",
}
MAX_LISTED: Final = 3  # failed checks of one kind on the first screen; the others are folded


def check_groups(checks: Iterable[Check]) -> Entries:
    """Number of checks of each kind and of those that passed, in their order."""
    groups: dict[str, dict[str, Any]] = {}
    for check in checks:
        title = CHECKS.get(check.name, check.name.replace("_", " "))
        group = groups.setdefault(check.name, {"title": title, "count": 0, "passed": 0})
        group["count"] += 1
        group["passed"] += check.passed
    return list(groups.values())


def failure_groups(record: Record) -> Entries:
    """The failed checks of a record by kind, most severe kind first and the worst of each first.

    Each group has a ``title``, all its ``rows`` and the number of those ``listed`` on the first screen; a row has the
    check as ``message``, and what of it as ``where``, ``amount``, ``when`` (the word before it), ``at_s`` and ``run``.
    """
    groups: dict[str, list[Record]] = {}
    for check in record["checks"]:
        if not check["passed"]:
            groups.setdefault(check["name"], []).append(check)
    order = [*(name for name in FAILURES if name in groups), *(name for name in groups if name not in FAILURES)]
    return [
        {
            "title": FAILURES.get(name, name.replace("_", " ").capitalize()),
            "rows": [_row(check, record) for check in sorted(groups[name], key=_severity, reverse=True)],
            "listed": MAX_LISTED,
        }
        for name in order
    ]


def _row(check: Record, record: Record) -> dict[str, Any]:
    """What fails, by how much and when."""
    return {
        "where": _where(check, record),
        "amount": _amount(check),
        "when": "from" if check["name"] == "collision" else "at",
        "at_s": check["at_s"],
        "run": check.get("run", ""),
        "message": check["message"],
    }


def _severity(check: Record) -> float:
    """Grows with the excess of a check over others of its kind."""
    value, limit = check["value"] or 0.0, check["limit"] or 0.0
    if check["name"] == "collision":
        return float(value)  # time in contact
    if check["name"] in ("clearance", "joint_position"):
        return abs(float(value - limit))
    return abs(float(value / limit)) if limit else abs(float(value))


def _where(check: Record, record: Record) -> str:
    """The subject of a check; of a clearance its pair where that is the one of the record."""
    minimum = record["clearance"].get(check["subject"]) if check["name"] == "clearance" else None
    if minimum and minimum["pair"] and minimum["at_s"] == check["at_s"]:
        return " – ".join(minimum["pair"])
    return str(check["subject"]).replace(" - ", " – ")


def _amount(check: Record) -> str:
    """By how much a check fails."""
    value, limit, unit = check["value"], check["limit"], str(check["unit"]).replace("s2", "s²").replace("s3", "s³")
    if value is None or limit is None:
        return "–"
    if check["name"] == "collision":
        return f"in contact for {small(value)} s"
    if check["name"] == "clearance":
        return f"{floored(value)} {unit}, required {stated(limit)} {unit}"
    if check["name"] == "joint_position":
        return f"{small(abs(value - limit))} {unit} beyond {stated(limit)} {unit}"
    return f"{against(value, limit)} {unit}, allowed {stated(limit)} {unit}"
