"""What the file of a robot says, as record and as text."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from cellplan.geometry.transforms import rpy_from_rotation
from cellplan.model.robot.robot import RobotModel
from cellplan.model.robot.robot_description import DescribedJoint, DescribedMimic, RobotDescription
from cellplan.model.units import DEG, MM, joint_unit
from cellplan.report.record.sections.rests_on import zero_record
from cellplan.report.text.columns import aligned

# Record


def description_record(described: RobotDescription, reach: float | None) -> dict[str, Any]:
    """A description, with the unit in the keys.

    Args:
        reach: Largest distance of the flange from the first axis in [m]; None where it is not known.
    """
    X, model = described.X_BF, described.model
    return {
        "name": described.name,
        "source": described.source,
        "reach_mm": None if reach is None else round(MM * reach, 1),
        "published_reach": None if model is None else published_reach(model),
        "bodies": sum(len(link.shapes) for link in described.links),
        "zero": None if model is None else zero_record(model),
        "joints": [_joint(joint) for joint in described.joints],
        "base": described.base,
        "flange": described.flange,
        "flange_is_usual": described.is_usual,
        "flange_at": {
            "xyz_mm": [_rounded(MM * value) for value in X[:3, 3]],
            "rpy_deg": [_rounded(DEG * value) for value in rpy_from_rotation(X[:3, :3])],
        },
        "flanges": [{"link": it.link, "joints": list(it.joints), "note": it.note} for it in described.flanges],
        "mimics": [_mimic(mimic) for mimic in described.mimics],
        "locked": described.locked,
        "links": [
            {
                "link": link.link,
                "shapes": list(link.shapes),
                "size_mm": [round(MM * float(edge), 1) for edge in link.size],
            }
            for link in described.links
        ],
        "cell_lines": described.cell_lines,
        "remarks": list(described.remarks),
    }


def published_reach(model: RobotModel) -> dict[str, Any] | None:
    """The reach as it is published; None where it is not."""
    if model.reach is None:
        return None
    return {"mm": round(float(model.reach.distance_mm), 1), "to": model.reach.to, "source": model.reach.source}


def _joint(joint: DescribedJoint) -> dict[str, Any]:
    """Limits of a driven joint; null where there is none."""
    unit, scale = joint_unit(is_revolute=joint.is_revolute)
    return {
        "name": joint.name,
        "type": "revolute" if joint.is_revolute else "prismatic",
        f"lower_{unit}": _figure(joint.lower, scale),
        f"upper_{unit}": _figure(joint.upper, scale),
        f"velocity_{unit}_s": _figure(joint.velocity, scale),
        "is_continuous": joint.kind == "continuous",
        "missing": list(joint.missing),
        "reason": joint.reason,
    }


def _mimic(mimic: DescribedMimic) -> dict[str, Any]:
    """A joint that follows another one."""
    unit, scale = joint_unit(is_revolute=mimic.is_revolute)
    return {
        "name": mimic.name,
        "leader": mimic.leader,
        "ratio": mimic.ratio,
        f"offset_{unit}": _figure(mimic.offset, scale),
    }


def _rounded(value: float) -> float:
    """A place or an angle to four decimals, zero without a sign."""
    return round(float(value), 4) + 0.0


def _figure(value: float | None, scale: float) -> float | None:
    """A value of a data sheet in printed units; None where there is none or no end."""
    return None if value is None or not math.isfinite(value) else float(f"{scale * value:.9g}")


# Text


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
            flange["link"],
            _joint_count(flange["joints"]),
            flange["note"],
            "*" if flange["link"] == record["flange"] else "",
        )
        for flange in record["flanges"]
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
    missing = f"missing: {', '.join(joint['missing'])} ({joint['reason']}{endless})" if joint["missing"] else ""
    return joint["name"], kind, limits, "no speed" if speed is None else f"{speed:g} {unit}/s", missing


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
    return [f"  {head}", *aligned(rows, "    ")] if rows else []
