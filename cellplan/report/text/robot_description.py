"""What a robot's file says, as text for the screen."""

from collections.abc import Iterator, Sequence
from typing import Any


def description_lines(record: dict[str, Any]) -> list[str]:
    """A description as lines, the lines for a cell last."""
    return [
        record["name"],
        f"  {_reach(record)}{record['source']}",
        *([] if record["zero"] is None else [f"  {record['zero']['line']}"]),
        *_flange_lines(record),
        *_block("joints from base to flange:", [_joint_row(joint) for joint in record["joints"]]),
        *_block("joints that follow others:", [_mimic_row(mimic) for mimic in record["mimics"]]),
        *_block("off the chain, to be locked:", [(key, f"{value:g}") for key, value in record["locked"].items()]),
        *_block("bodies and the box round them in mm:", [_link_row(link) for link in record["links"]]),
        *(f"  note: {remark}" for remark in record["remarks"]),
        f"entry for a cell file in this folder{_blanks(record)}:",
        "",
        record["cell_lines"].rstrip("\n"),
    ]


def _reach(record: dict[str, Any]) -> str:
    """The reach, where it is known."""
    return "" if record["reach_mm"] is None else f"reach {record['reach_mm']:g} mm from the first axis; "


def _blanks(record: dict[str, Any]) -> str:
    """What the user has to fill in."""
    return ", with a number for each …" if any(joint["missing"] for joint in record["joints"]) else ""


def _flange_lines(record: dict[str, Any]) -> Iterator[str]:
    """Base, flange and the other links that may be the flange."""
    xyz, rpy = (", ".join(f"{value:.4g}" for value in record["flange_at"][key]) for key in ("xyz_mm", "rpy_deg"))
    at = f"[{xyz}] mm, turned [{rpy}] deg, with all joints at zero"
    yield f"  base {record['base']}, flange {record['flange']} at {at}" if record["flange"] else f"  flange at {at}"
    rows = [
        (
            each["link"],
            _joint_count(each["joints"]),
            each["note"],
            "*" if each["link"] == record["flange"] else "",
        )
        for each in record["flanges"]
    ]
    head = "possible flanges:" if record["flange_is_usual"] else "possible flanges (none is usual: --flange chooses):"
    yield from _block(head, rows)


def _joint_count(joints: list[str]) -> str:
    """The joints that lead to a flange, in short."""
    return f"1 joint, {joints[0]}" if len(joints) == 1 else f"{len(joints)} joints, {joints[0]} … {joints[-1]}"


def _joint_row(joint: dict[str, Any]) -> tuple[str, ...]:
    """Kind, range, speed and what is missing of a driven joint."""
    unit = "deg" if "lower_deg" in joint else "mm"
    lower, upper, speed = joint[f"lower_{unit}"], joint[f"upper_{unit}"], joint[f"velocity_{unit}_s"]
    is_ranged = lower is not None and upper is not None
    limits = f"{lower:g} … {upper:g} {unit}" if is_ranged else "no range" if joint["missing"] else "endless"
    kind = "continuous" if joint["is_continuous"] else joint["type"]
    endless = ", or wrap: true for no end" if kind == "continuous" and not is_ranged else ""
    lacks = f"missing: {', '.join(joint['missing'])} ({joint['reason']}{endless})" if joint["missing"] else ""
    return joint["name"], kind, limits, "no speed" if speed is None else f"{speed:g} {unit}/s", lacks


def _mimic_row(mimic: dict[str, Any]) -> tuple[str, ...]:
    """A joint and the position of the one that it follows."""
    unit = "deg" if "offset_deg" in mimic else "mm"
    offset = mimic[f"offset_{unit}"]
    return mimic["name"], f"{mimic['ratio']:g} times {mimic['leader']}" + (f" + {offset:g} {unit}" if offset else "")


def _link_row(link: dict[str, Any]) -> tuple[str, ...]:
    """Size of a link and the kinds of its bodies."""
    counts = {shape: link["shapes"].count(shape) for shape in link["shapes"]}
    shapes = ", ".join(shape if count == 1 else f"{count} {shape}" for shape, count in counts.items())
    return link["link"], " x ".join(f"{edge:g}" for edge in link["size_mm"]), shapes


def _block(head: str, rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Rows below their head, in columns; nothing where there are none."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
    texts = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True) if width).rstrip() for row in rows
    ]
    return [f"  {head}", *(f"    {text}" for text in texts)] if rows else []
