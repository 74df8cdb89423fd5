"""What a robot's file says, before a cell adds what is missing: flanges, joints, bodies and their size."""

from dataclasses import dataclass, field

from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedJoint:
    """A driven joint with its limits, as far as they are known."""

    name: str  # name of the joint
    kind: str  # ``revolute``, ``continuous`` or ``prismatic``
    lower: float | None  # lowest position in [rad] or [m]; None where there is none
    upper: float | None  # highest position; None where there is none
    velocity: float | None  # largest speed in [rad/s] or [m/s]; None where there is none
    missing: tuple[str, ...] = ()  # keys of the limits that a cell has to state, such as ``velocity_deg_s``
    reason: str = ""  # why it has to; empty where nothing is missing

    @property
    def is_revolute(self) -> bool:
        """Whether the joint turns rather than slides."""
        return self.kind != "prismatic"


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedMimic:
    """A joint that follows another one: ``q = ratio q_leader + offset``, the offset in [rad] or [m]."""

    name: str
    leader: str
    ratio: float
    offset: float
    is_revolute: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FlangeChoice:
    """A link that may be the flange."""

    link: str  # its name
    joints: tuple[str, ...]  # the driven joints that lead to it, from the base on
    note: str = ""  # how it is oriented, where its z is not along the last axis


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkSize:
    """The bodies of a link and the box round all of them."""

    link: str  # name of the link
    shapes: tuple[str, ...]  # kind of each body: ``mesh``, ``box``, ``cylinder``, ``capsule`` or ``sphere``
    size: Array  # edges of the box in [m], shape (3,), along the axes of the link


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotDescription:
    """What a robot's file says."""

    name: str  # name of the model
    source: str  # where the figures come from
    base: str = ""  # link that is placed in the cell; empty where it has no name
    flange: str = ""  # link that is taken as the flange
    is_usual: bool = True  # whether this flange is taken where a cell names none
    flanges: tuple[FlangeChoice, ...] = ()  # all links that may be the flange; none where there is no choice
    X_BF: Array  # pose of the flange in the base while all joints read zero
    joints: tuple[DescribedJoint, ...]  # the driven joints
    mimics: tuple[DescribedMimic, ...] = ()  # joints that follow others
    # joints off the chain with zero, or the nearest position within their limits, as a cell states them
    locked: dict[str, float] = field(default_factory=dict)
    links: tuple[LinkSize, ...]  # the links that have bodies
    cell_lines: str  # what to write into a cell, as YAML
    model: RobotModel | None  # the robot; None where limits are missing
    remarks: tuple[str, ...] = ()  # what was not read, one line for each kind
