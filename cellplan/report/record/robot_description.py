"""What a robot's file says, in printed units."""

import math
from typing import Any

from cellplan.geometry.transforms import rpy_from_rotation
from cellplan.model.robot import RobotModel
from cellplan.model.robot_description import DescribedJoint, DescribedMimic, RobotDescription
from cellplan.model.units import DEG, MM, joint_unit
from cellplan.report.record.controller import zero_record


def description_record(described: RobotDescription, reach: float | None) -> dict[str, Any]:
    """A description, with the unit in the keys.

    Args:
        described: What the file says.
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
                "link": each.link,
                "shapes": list(each.shapes),
                "size_mm": [round(MM * float(edge), 1) for edge in each.size],
            }
            for each in described.links
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
