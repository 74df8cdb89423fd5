"""Cell errors: deviations of the real cell from the nominal one, as stated and as sampled."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import BASE, FollowerJoint, Joint, RobotModel
from cellplan.model.settings.cell_errors import Amount, MeasurementEntry, PoseErrorEntry, RobotErrorsEntry, Spread
from cellplan.model.settings.simulation import SimulationEntry
from cellplan.model.settings.units import si_or_none

SHORTEST_LINK: Final = 1e-9  # [m] axis points nearer than this give a link no direction


@dataclass(frozen=True, slots=True, kw_only=True)
class CellErrors:
    """Everything that is stated about a real cell."""

    # errors by robot; robots that are not named are exact
    robots: Mapping[str, RobotErrorsEntry] = field(default_factory=dict)
    # the real part seen from where it should be, by the robot that holds it
    grasps: Mapping[str, PoseErrorEntry] = field(default_factory=dict)
    measurement: MeasurementEntry = field(default_factory=MeasurementEntry)  # the measuring system
    simulation: SimulationEntry | None = None  # arms with masses; None where joints reach what they are commanded
    seed: int = 0  # seed of all samples
    trials: int = 1  # number of real cells that are drawn
    file: str = "<errors>"  # file name as the user gave it
    digest: str = ""  # SHA-256 of the file; empty when there is none

    @property
    def amounts(self) -> tuple[Amount, ...]:
        """All stated amounts, in no promised order."""
        poses = [*self.grasps.values()]
        amounts: list[Amount] = []
        for errors in self.robots.values():
            amounts += [*errors.joint_offsets.values(), *errors.link_lengths_mm.values()]
            poses += [errors.base, errors.tool]
        return (*amounts, *(amount for placed in poses for amount in (*placed.xyz_mm, *placed.rpy_deg)))

    @property
    def is_random(self) -> bool:
        """Whether two trials differ: an amount is a distribution."""
        return any(isinstance(amount, Spread) for amount in self.amounts)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotDraw:
    """The errors of one robot in one trial."""

    joint_offsets: Array  # in [rad] or [m], shape (n,)
    link_lengths: Array  # lengthening of the link before each joint in [m], shape (n,)
    X_base: Array  # the real base seen from the written one, shape (4, 4)
    X_tool: Array  # the real tool tip seen from the written one, shape (4, 4)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Draw:
    """The errors of one trial: by robot, and by the robot that holds the part."""

    robots: Mapping[str, RobotDraw]
    X_grasps: Mapping[str, Array]


def sample(amount: Amount, rng: np.random.Generator) -> float:
    """A value in [m] or [rad]; a fixed amount takes no number from the generator."""
    if not isinstance(amount, Spread):
        return amount.si
    if amount.normal is not None:
        return amount.normal.si * float(rng.standard_normal())
    return (si_or_none(amount.uniform) or 0.0) * float(rng.uniform(-1.0, 1.0))


def link_vector(model: RobotModel, joint: int) -> Array:
    """From the axis point of the joint before (the base frame's origin before the first) to a joint's own, in [m]."""
    axes: list[Joint | FollowerJoint] = [*model.joints, *model.followers]
    axis = model.joints[joint]
    before = np.zeros(3) if axis.parent == BASE else axes[axis.parent].point_B
    return axis.point_B - before
