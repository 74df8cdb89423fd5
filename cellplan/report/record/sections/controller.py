"""From which zero the joint positions of a robot count, in words."""

from typing import Annotated, TypedDict

from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import RobotModel

UNKNOWN = "joint positions count from the model's zero, taken as the controller's; not confirmed"
SAME = "joint positions count from the model's zero, which is the controller's"
OTHER = "joint positions count from the model's zero; on the controller "


class ZeroRecord(TypedDict):
    """From which zero the joint positions of a robot count."""

    line: Annotated[str, "the zero as one line of text"]
    is_stated: Annotated[bool, "whether the counting of the controller is known"]
    controller: Annotated[dict[str, str], "by joint that the controller counts otherwise: its position there"]
    source: Annotated[str, "source of that"]


def zero_record(model: RobotModel) -> ZeroRecord:
    """The zero of one robot."""
    zero = model.controller
    return {
        "line": zero_text(model),
        "is_stated": zero is not None,
        "controller": {} if zero is None else _terms(model, zero),
        "source": "not stated" if zero is None else zero.source,
    }


def zero_text(model: RobotModel) -> str:
    """From which zero the joint positions of a robot count, and those of its controller, as one line."""
    zero = model.controller
    if zero is None:
        return UNKNOWN
    if zero.is_identity:
        return SAME
    return OTHER + ", ".join(f"{joint} = {term}" for joint, term in _terms(model, zero).items())


def _terms(model: RobotModel, zero: ControllerZero) -> dict[str, str]:
    """Position on the controller by joint, for the joints that it counts otherwise: ``model - 90 deg``."""
    terms = {}
    for index, joint in enumerate(model.joints):
        unit, scale = joint.display_unit
        text = "-model" if zero.sign[index] < 0.0 else "model"
        text += _signed(scale * float(zero.zero[index]), f" {unit}")
        for other, factor in zip(model.joint_names, zero.coupling[index], strict=True):
            text += _signed(float(factor), f" {other}")
        if text != "model":
            terms[joint.name] = text
    return terms


def _signed(value: float, what: str) -> str:
    """A term of a sum; nothing for zero."""
    return f" {'-' if value < 0.0 else '+'} {abs(value):.9g}{what}" if value else ""
