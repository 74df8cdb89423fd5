"""What a layout search may change of a cell, in SI units."""

import math
from collections.abc import Container, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from cellplan.geometry.shapes import Box, Cylinder
from cellplan.geometry.transforms import Array
from cellplan.model.settings.layout import MisplacementEntry


class VariableKind(StrEnum):
    """What a number of a layout belongs to."""

    BASE = "base"
    TOOL = "tool"
    START = "start"
    WEIGHT = "weight"
    SPIN = "spin"
    GRASP = "grasp"
    PART = "part"


class ChoiceKind(StrEnum):
    """What a discrete choice is about."""

    ROBOT = "robot"
    MODE = "mode"
    BRANCH = "branch"


@dataclass(frozen=True, slots=True, kw_only=True)
class VaryRange:
    """A number of the cell file that may change.

    Attributes:
        address: Its address in the file: ``robots.kuka.base.x_mm``.
        kind: What it belongs to.
        name: Robot or task; empty for the part at rest.
        index: Which component: x, y, z, roll, pitch, yaw of a pose; length, tilt, roll of a rod; the joint of
            weights or of a start posture.
        is_angle: Whether it is an angle, in [rad]; a length in [m] or a number otherwise.
        lower: Lowest value.
        upper: Highest value.
        given: Value in the file; None where it is to be found.
    """

    address: str
    kind: VariableKind
    name: str
    index: int
    is_angle: bool
    lower: float
    upper: float
    given: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class PathRange:
    """The joint path of a positioner, as a spline that may change.

    Attributes:
        robot: Name of the positioner.
        coefficients: Coefficients of each joint.
        degree: Degree of the spline, 3 or 5.
    """

    robot: str
    coefficients: int = 14
    degree: int = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutChoice:
    """A discrete choice.

    Attributes:
        address: Its address in the file: ``tasks.circle.robot``.
        kind: What it is about.
        name: Task or robot; empty for the mode.
        options: What may be chosen; empty for all branches of a robot.
    """

    address: str
    kind: ChoiceKind
    name: str
    options: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Mirrored:
    """Two bases of which the second is the mirror image of the first.

    Attributes:
        robots: Names of both robots.
        axis: Component of the positions that changes its sign: 0 for the plane yz, 1 for xz.
        at: Where the plane stands along this axis in [m].
    """

    robots: tuple[str, str]
    axis: int
    at: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeepOut:
    """An area of the floor without bases: the footprint of an upright box or cylinder; its height does not count."""

    name: str
    shape: Box | Cylinder
    X_WS: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayoutSettings:
    """What a layout search may change, and within which bounds.

    Attributes:
        ranges: Numbers that may change.
        paths: Joint paths of positioners that may change.
        choices: Discrete choices.
        equal: Addresses of ranges that have one value.
        mirrored: Pairs of bases that are placed symmetrically.
        keep_out: Areas without bases.
        floor: Lowest and highest x and y of all bases in [m], shape (2, 2); infinite where there is no bound.
        margin: Distance from its limits in [rad] that every turning joint is to keep.
        margin_sliding: Distance from its limits in [m] that every sliding joint is to keep.
        cost: Cost of a change by 0.1 m, by 10 deg or by a factor of 10, by the address of the range; 1 when absent.
        singular: Least singular values of the arms that are to be kept, as shares of what is usual; None for the usual
            share, as far as the job allows it.
        misplacement: By how much every base may be off while all demands are kept; None where it need not be asked.
        is_default: Whether the file says nothing of what may change.
    """

    ranges: tuple[VaryRange, ...]
    paths: tuple[PathRange, ...] = ()
    choices: tuple[LayoutChoice, ...] = ()
    equal: tuple[tuple[str, ...], ...] = ()
    mirrored: tuple[Mirrored, ...] = ()
    keep_out: tuple[KeepOut, ...] = ()
    floor: Array | None = None
    margin: float = 0.0
    margin_sliding: float = 0.0
    cost: Mapping[str, float] = field(default_factory=dict)
    singular: float | None = None
    misplacement: MisplacementEntry | None = None
    is_default: bool = True

    def without(self, addresses: Container[str]) -> "LayoutSettings":
        """The same without some numbers, which stay as they are, and what has one value with them."""
        return replace(
            self,
            ranges=tuple(variable for variable in self.ranges if variable.address not in addresses),
            equal=tuple(group for group in self.equal if not any(address in addresses for address in group)),
        )

    def among(self, addresses: Container[str]) -> "LayoutSettings":
        """The same with only some of the numbers, and what ties these."""
        ranges = tuple(variable for variable in self.ranges if variable.address in addresses)
        names = {variable.name for variable in ranges}
        return replace(
            self,
            ranges=ranges,
            equal=tuple(group for group in self.equal if all(address in addresses for address in group)),
            mirrored=tuple(pair for pair in self.mirrored if names.issuperset(pair.robots)),
        )


def mirror_image(pair: Mirrored, index: int) -> tuple[float, float]:
    """How a component of the second base follows from that of the first: factor, and term in [m] or [rad].

    The components are x, y, z, roll, pitch, yaw.

    A robot is its own mirror image in the xz plane of its base, so that only roll and yaw change their signs; in the
    world's plane yz it then stands half a turn about the vertical away.
    """
    if index == pair.axis:
        return -1.0, 2.0 * pair.at
    if index == 5:
        return -1.0, 0.0 if pair.axis == 1 else math.pi
    return (-1.0, 0.0) if index == 3 else (1.0, 0.0)
