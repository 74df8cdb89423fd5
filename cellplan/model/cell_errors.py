"""Cell errors: deviations of the real cell from the nominal one, as stated and as sampled."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.robot import BASE, FollowerJoint, Joint, RobotModel

SHORTEST_LINK: Final = 1e-9  # [m] axis points nearer than this give a link no direction


class Spread(StrEnum):
    """How an amount is meant."""

    FIXED = "fixed"
    NORMAL = "normal"
    UNIFORM = "uniform"


@dataclass(frozen=True, slots=True)
class Amount:
    """One stated error in [m] or [rad].

    Attributes:
        spread: Fixed, or a distribution with its centre at zero.
        size: The error itself, the standard deviation, or the half width.
    """

    spread: Spread = Spread.FIXED
    size: float = 0.0

    def drawn(self, rng: np.random.Generator) -> float:
        """A value; a fixed amount takes no number from the generator."""
        if self.spread is Spread.NORMAL:
            return self.size * float(rng.standard_normal())
        if self.spread is Spread.UNIFORM:
            return self.size * float(rng.uniform(-1.0, 1.0))
        return self.size


EXACT: Final = Amount()


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseAmounts:
    """Pose of the real frame seen from the written one: position in [m]; roll, pitch and yaw in [rad]."""

    xyz: tuple[Amount, Amount, Amount] = (EXACT, EXACT, EXACT)
    rpy: tuple[Amount, Amount, Amount] = (EXACT, EXACT, EXACT)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotErrors:
    """Deviations of one robot from its data sheet and its pose.

    Attributes:
        joint_offsets: Actual minus commanded joint position in [rad] or [m], by joint name.
        link_lengths: Lengthening of the link before a joint in [m], by joint name.
        base: Pose of the actual base in the nominal base frame.
        tool: The real tool tip seen from the written one.
    """

    joint_offsets: Mapping[str, Amount] = field(default_factory=dict)
    link_lengths: Mapping[str, Amount] = field(default_factory=dict)
    base: PoseAmounts = PoseAmounts()
    tool: PoseAmounts = PoseAmounts()


@dataclass(frozen=True, slots=True, kw_only=True)
class CellErrors:
    """Everything that is stated about a real cell.

    Attributes:
        robots: Errors by robot; robots that are not named are exact.
        grasps: The real part seen from where it should be, by the robot that holds it.
        position_noise: Standard deviation of each measured coordinate of a tool tip on the part in [m].
        orientation_noise: Standard deviation of each measured small turn of a tool on the part in [rad].
        seed: Seed of all samples.
        trials: Number of real cells that are drawn.
        file: File name as the user gave it.
        digest: SHA-256 of the file; empty when there is none.
    """

    robots: Mapping[str, RobotErrors] = field(default_factory=dict)
    grasps: Mapping[str, PoseAmounts] = field(default_factory=dict)
    position_noise: float = 0.0
    orientation_noise: float = 0.0
    seed: int = 0
    trials: int = 1
    file: str = "<errors>"
    digest: str = ""

    @property
    def amounts(self) -> tuple[Amount, ...]:
        """All stated amounts, in no promised order."""
        poses = [*self.grasps.values()]
        found: list[Amount] = []
        for errors in self.robots.values():
            found += [*errors.joint_offsets.values(), *errors.link_lengths.values()]
            poses += [errors.base, errors.tool]
        return (*found, *(amount for placed in poses for amount in (*placed.xyz, *placed.rpy)))

    @property
    def is_random(self) -> bool:
        """Whether two trials differ: an amount is a distribution."""
        return any(amount.spread is not Spread.FIXED for amount in self.amounts)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotDraw:
    """The errors of one robot in one trial.

    Attributes:
        joint_offsets: In [rad] or [m], shape (n,).
        link_lengths: Lengthening of the link before each joint in [m], shape (n,).
        X_base: The real base seen from the written one, shape (4, 4).
        X_tool: The real tool tip seen from the written one, shape (4, 4).
    """

    joint_offsets: Array
    link_lengths: Array
    X_base: Array
    X_tool: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Draw:
    """The errors of one trial: by robot, and by the robot that holds the part."""

    robots: Mapping[str, RobotDraw]
    X_grasps: Mapping[str, Array]


def link_vector(model: RobotModel, joint: int) -> Array:
    """From the axis point of the joint before (the base frame's origin before the first) to a joint's own, in [m]."""
    axes: list[Joint | FollowerJoint] = [*model.joints, *model.followers]
    own = model.joints[joint]
    before = np.zeros(3) if own.parent == BASE else axes[own.parent].point_B
    vector: Array = own.point_B - before
    return vector
