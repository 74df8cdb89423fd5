"""Payload: loads in a run."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.settings.robot import PayloadEntry


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisUse:
    """Moment and inertia of the load about one of the last axes over a run."""

    joint: str  # name of the joint
    static_moment: float  # largest moment about its axis by gravity alone in [N m]
    static_at_s: float  # its instant in [s]
    moment: float  # largest moment about its axis by gravity and by the accelerations of the written motion in [N m]
    moment_at_s: float  # its instant in [s]
    inertia: float  # largest moment of inertia about its axis in [kg m^2]
    inertia_at_s: float  # its instant in [s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LoadUse:
    """What one robot carries."""

    robot: str  # name of the robot
    tool_mass: float | None  # mass of its tool in [kg]; None when it is not stated
    part_mass: float | None  # its share of the part in [kg], 0 when it does not hold it; None when it is not stated
    holders: int  # number of robots that share the part
    limits: PayloadEntry | None  # what it may carry; None when it is not stated
    # centre of the load in the flange frame in [m], shape (3,); None when a mass is not stated or nothing is carried
    centre_F: Array | None = None
    # largest force that moves and holds the load, as the mass in [kg] that weighs as much; None likewise
    felt: float | None = None
    felt_at_s: float | None = None  # its instant in [s]
    axes: tuple[AxisUse, ...] = ()  # the last three turning axes; empty likewise

    @property
    def known_mass(self) -> float:
        """The masses that are stated, added, in [kg]."""
        return (self.tool_mass or 0.0) + (self.part_mass or 0.0)

    @property
    def is_known(self) -> bool:
        """Whether the masses of all that it carries are stated."""
        return self.tool_mass is not None and self.part_mass is not None

    @property
    def across(self) -> float:
        """Distance of the centre of mass of the load from the flange's z axis in [m]."""
        return 0.0 if self.centre_F is None else float(np.hypot(self.centre_F[0], self.centre_F[1]))

    @property
    def along(self) -> float:
        """Distance of the centre of mass of the load from the flange plane in [m]."""
        return 0.0 if self.centre_F is None else float(abs(self.centre_F[2]))
