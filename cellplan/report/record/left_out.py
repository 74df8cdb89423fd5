"""What a report says of everything that was not judged in full, and of what is judged by its depth."""

from collections.abc import Iterable

from cellplan.model.left_out import LeftOut, left_out_lines
from cellplan.report.record.run import Record


def left_out_record(left_out: Iterable[LeftOut]) -> list[Record]:
    """Everything that was not judged in full, but for two links of one robot's file."""
    return [{"kind": str(each.kind), "bodies": list(each.bodies), "reason": each.reason} for each in left_out]


def told_left_out(record: Record) -> list[str]:
    """One line for each kind, from a record; or that nothing was left out. No line where the record is silent on it."""
    if "left_out" not in record:
        return []
    return left_out_lines((each["kind"], tuple(each["bodies"]), each["reason"]) for each in record["left_out"])


def grips_told(record: Record) -> list[str]:
    """How deep each holder reaches into the part: the messages of these checks, each once."""
    return list(dict.fromkeys(check["message"] for check in record["checks"] if check.get("name") == "grip_depth"))
