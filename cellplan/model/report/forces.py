"""Static forces of a run: torques of joints by processes and weights, what holders exert on the part, and grips."""

from dataclasses import dataclass

from cellplan.model.robot.base_reaction import PeakLoad
from cellplan.model.units import DisplayUnit

TORQUE: DisplayUnit = DisplayUnit("Nm", 1.0)
FORCE: DisplayUnit = DisplayUnit("N", 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLoad:
    """Torque in [N m], or force in [N], with which a joint balances processes and weights; its links not counted."""

    robot: str  # name of the robot
    joint: str  # name of the joint
    is_revolute: bool
    total: PeakLoad  # by both together, as far as they are stated
    moving: PeakLoad  # likewise, and by the accelerations of tool and part in the written motion
    by_process: PeakLoad  # by forces of processes alone
    by_weight: PeakLoad | None  # by weights of tool and part alone; None where one of these is not stated
    limit: float | None  # of the joint, which its links load too; None when it is not stated
    by_closure: float | None  # at most by the stated errors of closure; None without these or a stiffness

    @property
    def unit(self) -> DisplayUnit:
        """Unit in which it is printed."""
        return TORQUE if self.is_revolute else FORCE


@dataclass(frozen=True, slots=True, kw_only=True)
class InternalLoad:
    """What errors of closure make a holder exert on the part, by the stiffness of all holders."""

    force: PeakLoad  # by the errors that the tables have
    moment: PeakLoad  # likewise, about the tip
    force_at_error: float  # in [N], at most by the errors that are stated
    moment_at_error: float  # in [N m], likewise


@dataclass(frozen=True, slots=True, kw_only=True)
class HolderLoad:
    """What the tool of a holder exerts on the part at its tip, by processes and the weight of the part, at rest."""

    robot: str  # name of the holder
    force: PeakLoad
    moment: PeakLoad  # about the tip
    internal: InternalLoad | None  # None for a single holder, or where no stiffness is stated


@dataclass(frozen=True, slots=True, kw_only=True)
class GripUse:
    """How much of its friction a grip needs, where that is most: at one instant but for ``across``."""

    robot: str  # name of the holder
    share: float  # of what friction bears, 0..1; more than 1 where the part slides
    at_s: float  # its instant in [s]
    tangential: float  # force along the pads in [N]
    torsion: float  # moment about their normal in [N m]
    normal: float  # force along their normal in [N]
    across: float  # largest moment across the normal in [N m], which friction is not judged by


@dataclass(frozen=True, slots=True, kw_only=True)
class ForceReport:
    """Static forces of a run."""

    joints: tuple[JointLoad, ...] = ()  # of robots on which a stated force or weight acts
    holders: tuple[HolderLoad, ...] = ()  # that bear anything, in the order of the cell
    grips: tuple[GripUse, ...] = ()  # of holders with a stated grip, where the mass of the part is stated
    length: float | None = None  # that moments are divided by where several holders share a load, in [m]


NO_FORCES = ForceReport()
