"""What a robot's file says, before a cell adds what is missing: flanges, joints, bodies and their size."""

from dataclasses import dataclass

from cellplan.geometry.transforms import Array
from cellplan.model.robot import RobotModel


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedJoint:
    """A driven joint with its limits, as far as they are known.

    Attributes:
        name: Name of the joint.
        kind: ``revolute``, ``continuous`` or ``prismatic``.
        lower: Lowest position in [rad] or [m]; None where there is none.
        upper: Highest position; None where there is none.
        velocity: Largest speed in [rad/s] or [m/s]; None where there is none.
        missing: Keys of the limits that a cell has to state, such as ``velocity_deg_s``.
        reason: Why it has to; empty where nothing is missing.
    """

    name: str
    kind: str
    lower: float | None
    upper: float | None
    velocity: float | None
    missing: tuple[str, ...] = ()
    reason: str = ""

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
    """A link that may be the flange.

    Attributes:
        link: Its name.
        joints: The driven joints that lead to it, from the base on.
        obstacle: Why it cannot be the flange; empty where it can.
    """

    link: str
    joints: tuple[str, ...]
    obstacle: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinkSize:
    """The bodies of a link and the box round all of them.

    Attributes:
        link: Name of the link.
        shapes: Kind of each body: ``mesh``, ``box``, ``cylinder``, ``capsule`` or ``sphere``.
        size: Edges of the box in [m], shape (3,), along the axes of the link.
    """

    link: str
    shapes: tuple[str, ...]
    size: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotDescription:
    """What a robot's file says.

    Attributes:
        name: Name of the model.
        source: Where the figures come from.
        base: Link that is placed in the cell; empty where it has no name.
        flange: Link that is taken as the flange.
        is_usual: Whether this flange is taken where a cell names none.
        flanges: All links that may be the flange; none where there is no choice.
        X_BF: Pose of the flange in the base while all joints read zero.
        joints: The driven joints.
        mimics: Joints that follow others.
        locked: Joints off the chain with zero, or the nearest position within their limits, as a cell states them.
        links: The links that have bodies.
        cell_lines: What to write into a cell, as YAML.
        model: The robot; None where limits are missing.
    """

    name: str
    source: str
    base: str
    flange: str
    is_usual: bool
    flanges: tuple[FlangeChoice, ...]
    X_BF: Array
    joints: tuple[DescribedJoint, ...]
    mimics: tuple[DescribedMimic, ...]
    locked: dict[str, float]
    links: tuple[LinkSize, ...]
    cell_lines: str
    model: RobotModel | None
