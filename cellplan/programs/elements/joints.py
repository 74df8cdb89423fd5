"""Joint positions as the numbers of a controller: its zero, its units, its decimals, and never beyond a limit."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import Joint
from cellplan.model.units import MM

ARM: Final = 6  # axes that a controller counts as those of the arm; the axes before them are external
NUDGES: Final = 4  # last decimals by which coupled axes move inwards before a position counts as unwritable
LARGEST: Final = 1e6  # [deg], [mm] or [s]: beyond it nine decimals are more than a number holds


class Angle(StrEnum):
    """Unit of turning joints in a file; sliding ones are in [mm] beside degrees, in [m] beside radians."""

    DEGREES = "deg"
    RADIANS = "rad"


@dataclass(frozen=True, slots=True, kw_only=True)
class Axes:
    """Which joints a controller counts as axes of the arm, and which as external axes."""

    arm: tuple[int, ...]  # places of the axes of the arm among the joints of the model; empty for a positioner
    external: tuple[int, ...]  # places of all others: a rail before the arm, or the axes of a positioner

    @classmethod
    def of(cls, robot: Robot) -> "Axes":
        """The axes of a robot: the last six of six joints or more are its arm."""
        count = len(robot.model.joints)
        first = count - ARM if count >= ARM else count
        return cls(arm=tuple(range(first, count)), external=tuple(range(first)))


def on_one_controller(one: Robot, other: Robot) -> bool:
    """Whether two robots are connected to the same controller."""
    return one.control is not None and other.control is not None and one.control.id == other.control.id


def unit_of(cell: Cell, robot: str) -> tuple[str, ...]:
    """A robot and those whose axes one program moves in step with it, the arm first; as a rule itself alone.

    On a KUKA controller the axes of positioners beside one arm are external axes of that arm.
    """
    control = cell.robot(robot).control
    controller = None if control is None else cell.controllers.get(control.id)
    if control is None or controller is None or controller.kind != "kuka":
        return (robot,)
    others = [one for one in cell.robots if on_one_controller(one, cell.robot(robot))]
    arms = [one.name for one in others if Axes.of(one).arm]
    return (*arms, *(one.name for one in others if one.name not in arms)) if len(arms) == 1 else (robot,)


def in_step(frame: ExportFrame, robot: str) -> tuple[str, ...]:
    """Robots of an export that pass the same rows as one of them at the same time, itself among them."""
    if frame.promise is Promise.SYNCHRONISED:
        return frame.robots
    return tuple(name for name in unit_of(frame.cell, robot) if name in frame.robots)


def require_counted(robot: Robot, kind: str) -> None:
    """Refuse an arm on a controller that counts axis 3 its own way while nothing states how."""
    if kind == "fanuc" and robot.model.controller is None and Axes.of(robot).arm:
        raise InputError(
            f"robots.{robot.name}.controller_zero: expected how the controller counts axis 3, which is counted "
            f"against the horizontal there, got none"
        )


def to_numbers(robot: Robot, q: Array, *, decimals: int, angle: Angle = Angle.DEGREES) -> Array:
    """Positions of the controller as numbers of a file, rounded, none beyond a limit when they are read back.

    Positions of the model in [rad] or [m], shape (N, n), become exact multiples of the last decimal but for the last
    bit; ``InputError`` where one cannot be written with the decimals.
    """
    joints, quantum = robot.model.joints, 10.0**decimals
    numbers = exact_numbers(robot, q, angle=angle)
    if not np.all(np.abs(numbers) < LARGEST):
        raise InputError(f"robot '{robot.name}': expected positions below {LARGEST:g}, got one that is too large")
    quanta = np.rint(numbers * quantum)
    lower, upper = robot.model.lower, robot.model.upper
    sign = np.sign(_zero(robot).sign)
    for _ in range(NUDGES):
        read = from_numbers(robot, quanta / quantum + 0.0, angle=angle)
        beyond = (read > upper).astype(float) - (read < lower)
        if not np.any(beyond):
            return quanta / quantum + 0.0
        quanta -= beyond * sign
    at = joints[int(np.argmax(np.any(beyond != 0.0, axis=0)))].name
    raise InputError(
        f"robot '{robot.name}': joint {at}: no number with {decimals} decimals near its limit lies within its limits"
    )


def exact_numbers(robot: Robot, q: Array, *, angle: Angle = Angle.DEGREES) -> Array:
    """Positions of the controller in the units of a file, not rounded, of the model in [rad] or [m], shape (N, n)."""
    joints = robot.model.joints
    scale = np.array([1.0 if angle is Angle.RADIANS else joint.display_unit.scale for joint in joints])
    return _zero(robot).from_model(q) * scale


def from_numbers(robot: Robot, numbers: Array, *, angle: Angle = Angle.DEGREES) -> Array:
    """Positions of the model in [rad] or [m] for numbers of a file, shape (N, n)."""
    positions = np.empty_like(numbers, dtype=np.float64)
    for place, joint in enumerate(robot.model.joints):
        column = numbers[:, place]
        positions[:, place] = column if angle is Angle.RADIANS else from_file_unit(joint, column)
    return _zero(robot).to_model(positions)


def _zero(robot: Robot) -> ControllerZero:
    """How the controller of a robot counts its joints; as the model does where it is not stated."""
    count = len(robot.model.joints)
    stated = robot.model.controller
    if stated is not None:
        return stated
    return ControllerZero(
        zero=np.zeros(count), sign=np.ones(count), coupling=np.zeros((count, count)), source="not stated"
    )


def to_file_unit(joint: Joint, q: Array) -> Array:
    """Positions of a joint in degrees or millimetres, shape (N,)."""
    return q * joint.display_unit.scale


def from_file_unit(joint: Joint, written: Array) -> Array:
    """Positions in [rad] or [m] that a reader makes of degrees or millimetres, shape (N,)."""
    return np.deg2rad(written) if joint.is_revolute else written / MM


def rounded_inside(joint: Joint, q: Array, decimals: int) -> Array:
    """Positions in degrees or millimetres with a fixed number of decimals, none beyond a limit when read back.

    Each is the nearest one, unless that lies outside: 169.99996 does not become 170.0000 where the limit is 169.99999.

    The positions are in [rad] or [m], shape (N,). ``InputError`` where no number with so few decimals lies within the
    limits, or a number is too large for them.
    """
    quanta = rounded_quanta(to_file_unit(joint, q), decimals, what=f"joint {joint.name}")
    scale = 10.0**decimals
    quanta -= from_file_unit(joint, quanta / scale) > joint.upper
    quanta += from_file_unit(joint, quanta / scale) < joint.lower
    written: Array = quanta / scale + 0.0
    read = from_file_unit(joint, written)
    if not np.all((read >= joint.lower) & (read <= joint.upper)):
        raise InputError(f"joint {joint.name}: no number with {decimals} decimals lies within its limits")
    return written


def rounded_quanta(values: Array, decimals: int, *, what: str) -> Array:
    """Whole numbers of the last decimal nearest to the values, shape (N,), which are finite and not too large."""
    if not np.all(np.abs(values) < LARGEST):
        raise InputError(f"{what}: expected numbers below {LARGEST:g}, got one that is too large for its decimals")
    return np.rint(values * 10.0**decimals)
