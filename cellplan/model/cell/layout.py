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
    """A number of the cell file that may change."""

    address: str  # its address in the file: ``robots.kuka.base.x_mm``
    kind: VariableKind  # what it belongs to
    name: str  # robot or task; empty for the part at rest
    # which component: x, y, z, roll, pitch, yaw of a pose; length, tilt, roll of a rod; the joint of weights or of a
    # start posture
    index: int
    is_angle: bool  # whether it is an angle, in [rad]; a length in [m] or a number otherwise
    lower: float  # lowest value
    upper: float  # highest value
    given: float | None  # value in the file; None where it is to be found


@dataclass(frozen=True, slots=True, kw_only=True)
class PathRange:
    """The joint path of a positioner, or motion of all robots in the null space, as splines that may change."""

    robot: str  # name of the positioner; empty for the null space
    coefficients: int = 14  # coefficients of each joint
    degree: int = 5  # degree of the spline, 3 or 5


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutChoice:
    """A discrete choice."""

    address: str  # its address in the file: ``tasks.circle.robot``
    kind: ChoiceKind  # what it is about
    name: str  # task or robot; empty for the mode
    options: tuple[str, ...] = ()  # what may be chosen; empty for all branches of a robot


@dataclass(frozen=True, slots=True, kw_only=True)
class Mirrored:
    """Two bases of which the second is the mirror image of the first."""

    robots: tuple[str, str]  # names of both robots
    axis: int  # component of the positions that changes its sign: 0 for the plane yz, 1 for xz
    at: float = 0.0  # where the plane stands along this axis in [m]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeepOut:
    """An area of the floor without bases: the footprint of an upright box or cylinder; its height does not count."""

    name: str
    shape: Box | Cylinder
    X_WS: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayoutSettings:
    """What a layout search may change, and within which bounds."""

    ranges: tuple[VaryRange, ...]  # numbers that may change
    paths: tuple[PathRange, ...] = ()  # joint paths of positioners that may change
    null_space: PathRange | None = None  # motion in the null space that may change
    choices: tuple[LayoutChoice, ...] = ()  # discrete choices
    equal: tuple[tuple[str, ...], ...] = ()  # addresses of ranges that have one value
    mirrored: tuple[Mirrored, ...] = ()  # pairs of bases that are placed symmetrically
    keep_out: tuple[KeepOut, ...] = ()  # areas without bases
    # lowest and highest x and y of all bases in [m], shape (2, 2); infinite where there is no bound
    floor: Array | None = None
    margin: float = 0.0  # distance from its limits in [rad] that every turning joint is to keep
    margin_sliding: float = 0.0  # distance from its limits in [m] that every sliding joint is to keep
    # cost of a change by 0.1 m, by 10 deg or by a factor of 10, by the address of the range; 1 when absent
    cost: Mapping[str, float] = field(default_factory=dict)
    # least singular values of the arms that are to be kept, as shares of what is usual; None for the usual share, as
    # far as the job allows it
    singular: float | None = None
    # by how much every base may be off while all demands are kept; None where it need not be asked
    misplacement: MisplacementEntry | None = None
    is_default: bool = True  # whether the file says nothing of what may change

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
