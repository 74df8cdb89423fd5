"""Checks on a page: how many of each kind passed, and the failed ones, most severe first."""

from typing import Any, Final

from cellplan.model.report.check_kinds import CHECK_KINDS, GRAVITY
from cellplan.report.record.common import Entries, Record
from cellplan.report.record.numbers import against, floored, small, stated

MAX_LISTED: Final = 3  # failed checks of one kind on the first screen; the others are folded


def check_groups(record: Record) -> Entries:
    """Number of checks of each kind and of those that passed, in their order."""
    groups: dict[str, dict[str, Any]] = {}
    for check in record["checks"]:
        name = check["name"]
        group = groups.setdefault(name, {"title": CHECK_KINDS[name].holds, "count": 0, "passed": 0})
        group["count"] += 1
        group["passed"] += check["passed"]
    return list(groups.values())


def failure_groups(record: Record) -> Entries:
    """The failed checks of a record by kind, most severe kind first and the worst of each first.

    Each group has a ``title``, all its ``rows`` and the number of those ``listed`` on the first screen; a row has the
    check as ``message``, and what of it as ``where``, ``amount``, ``when`` (the word before it), ``at_s``, ``phase``.
    """
    groups: dict[str, list[Record]] = {}
    for check in record["checks"]:
        if not check["passed"]:
            groups.setdefault(check["name"], []).append(check)
    return [
        {
            "title": CHECK_KINDS[name].fails,
            "rows": [_row(check, record) for check in sorted(groups[name], key=_severity, reverse=True)],
            "listed": MAX_LISTED,
        }
        for name in sorted(groups, key=GRAVITY.__getitem__)
    ]


def _row(check: Record, record: Record) -> dict[str, Any]:
    """What fails, by how much and when."""
    return {
        "where": _where(check, record),
        "amount": _amount(check),
        "when": "from" if check["name"] == "collision" else "at",
        "at_s": check["at_s"],
        "phase": check.get("phase", ""),
        "message": check["message"],
    }


def _severity(check: Record) -> float:
    """Grows with the excess of a check over others of its kind."""
    return CHECK_KINDS[check["name"]].severity(check["value"] or 0.0, check["limit"] or 0.0)


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
