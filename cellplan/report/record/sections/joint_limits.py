"""Joints of a data sheet in printed units."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cellplan.model.robot.robot import Joint


def joint_record(joint: Joint) -> dict[str, Any]:
    """Name, type, limits and speed of one joint, with the unit in the keys."""
    unit, scale = joint.display_unit
    return {
        "name": joint.name,
        "type": str(joint.kind),
        f"lower_{unit}": _figure(scale * joint.lower),
        f"upper_{unit}": _figure(scale * joint.upper),
        f"velocity_{unit}_s": _figure(scale * joint.velocity),
    }


def limits_text(record: dict[str, Any]) -> tuple[str, str]:
    """Range and largest speed of one joint as text."""
    unit = "deg" if "lower_deg" in record else "mm"
    lower, upper = record[f"lower_{unit}"], record[f"upper_{unit}"]
    limits = "endless" if lower is None or upper is None else f"{lower:g} … {upper:g} {unit}"
    return limits, f"{record[f'velocity_{unit}_s']:g} {unit}/s"


def _figure(value: float) -> float | None:
    """The value of the data sheet; None for an endless joint."""
    return float(f"{value:.9g}") if math.isfinite(value) else None
