"""Robot: joint axes and link bodies at the reference configuration, where every joint reads zero."""

from collections.abc import Container, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import count
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.shapes import Solid
from cellplan.geometry.transforms import is_rigid
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.inertia import LinkInertia
from cellplan.model.settings.units import Deg, Mm, in_si
from cellplan.model.units import DisplayUnit, joint_unit

if TYPE_CHECKING:  # robots are read by processes of their own, without schemas of files
    from cellplan.model.settings.robot import BodyAccuracyEntry, PayloadEntry, ReachEntry

ROUNDING = 1e-9  # [rad] of written angles
BASE = -1  # index of the link that does not move, where a link is named by the joint that carries it


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSum:
    """A range of the sum of some joint angles of a robot."""

    joints: tuple[str, ...]  # names of the joints
    columns: tuple[int, ...]  # their numbers
    lower: float  # least sum in [rad]
    upper: float  # largest sum in [rad]

    def of(self, q: Array) -> Array:
        """The sum at configurations of shape (..., n) in [rad], shape (...)."""
        return q[..., list(self.columns)].sum(axis=-1)

    def holds(self, q: Array) -> Flags:
        """Whether configurations of shape (..., n) have it in its range, shape (...)."""
        total = self.of(q)
        return np.logical_and(total >= self.lower - ROUNDING, total <= self.upper + ROUNDING)


class JointKind(StrEnum):
    """How a joint moves."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Joint:
    """One driven axis, given at the reference configuration in the robot's base frame B."""

    name: str  # name in tables and reports
    kind: JointKind  # revolute ([rad]) or prismatic ([m])
    # index of the link that carries it, counted over joints first and followers after them; ``BASE`` for the first of a
    # chain
    parent: int
    axis_B: Array  # unit direction, shape (3,)
    point_B: Array  # a point on the axis in [m], shape (3,)
    lower: float  # lowest allowed position in [rad] or [m]; -inf for a joint that may turn without end
    upper: float  # highest allowed position; +inf for a joint that may turn without end
    velocity: float  # largest allowed speed in [rad/s] or [m/s]
    acceleration: float | None = None  # largest allowed acceleration, if known
    jerk: float | None = None  # largest allowed jerk, if known
    torque: float | None = None  # largest torque in [N m] or force in [N] of its drive, behind the gears, if known
    # top speed of the arm itself, where the cell allows less; None where it does not
    rated_velocity: float | None = None

    @property
    def top_speed(self) -> float:
        """Speed that the drive is made for in [rad/s] or [m/s], whatever the cell allows."""
        return self.velocity if self.rated_velocity is None else self.rated_velocity

    @property
    def is_revolute(self) -> bool:
        """Whether the joint turns rather than slides."""
        return self.kind == JointKind.REVOLUTE

    @property
    def display_unit(self) -> DisplayUnit:
        """Unit in which its positions are printed."""
        return joint_unit(is_revolute=self.is_revolute)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FollowerJoint:
    """A joint that another one drives through a linkage (a mimic joint): ``q = ratio q_leader + offset``."""

    name: str  # name in messages
    kind: JointKind  # revolute or prismatic
    parent: int  # index of the link that carries it, counted over joints first and followers after them
    axis_B: Array  # unit direction at the reference configuration, shape (3,)
    point_B: Array  # a point on the axis in [m], shape (3,)
    leader: int  # index of the driving joint in ``RobotModel.joints``
    ratio: float  # follower's motion per leader's motion
    offset: float  # follower's position in [rad] or [m] when the leader reads zero

    @property
    def is_revolute(self) -> bool:
        """Whether the joint turns rather than slides."""
        return self.kind == JointKind.REVOLUTE


class Drive(NamedTuple):
    """How a driven joint moves an axis: ``q_axis = ratio q_joint + offset``; a joint drives itself as it is."""

    joint: int  # index of the driven joint in ``RobotModel.joints``
    ratio: float = 1.0  # motion of the axis per motion of the joint
    offset: float = 0.0  # position of the axis in [rad] or [m] when the joint reads zero


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Body:
    """A solid fixed to one link."""

    name: str  # name in reports, unique within its robot
    link: int  # index of the joint that carries it, followers counted after joints; ``BASE`` for the foot of the robot
    shape: Solid  # the solid, in its own frame
    X_BS: Array  # pose of the shape's frame in B at the reference configuration (for tools: in F; for parts: in P)
    # how far the real link may stick out of it in [m]; None for what the robot states for all its bodies
    accuracy: float | None = None
    # the link that it belongs to as the robot's file names it; None for bodies that a cell adds
    link_name: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Link:
    """A link by name, so that things can be mounted on it."""

    name: str  # name as the robot's file has it
    index: int  # index of the joint that carries it; ``BASE`` for the foot of the robot
    X_BL: Array  # the frame in which poses on it are given, in B while all joints read zero


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotModel:
    """A robot model: the content of its data sheet."""

    name: str  # model name
    source: str  # where the figures come from
    joints: tuple[Joint, ...]  # the driven joints, each after the driven one that carries it
    flange_link: int  # index of the joint that carries the flange
    X_BF: Array  # flange (mechanical interface) in B at the reference configuration, z out of the flange
    bodies: tuple[Body, ...]  # link bodies
    # joints driven through linkages; they come after all joints in link numbering
    followers: tuple[FollowerJoint, ...] = ()
    links: tuple[Link, ...] = ()  # links on which something can be mounted, by the names of the robot's file
    # how good the link bodies are that do not say it themselves; None when it is not stated
    body_accuracy: "BodyAccuracyEntry | None" = None
    payload: "PayloadEntry | None" = None  # what it may carry; None when it is not stated
    # pairs of link bodies, by name, that its SRDF leaves out of collision checks, with the reason
    disabled: tuple[tuple[str, str, str], ...] = ()
    controller: ControllerZero | None = None  # how its controller counts the joints; None when it is not stated
    reach: "ReachEntry | None" = None  # reach as the maker publishes it; None when it is not stated
    # masses of the links, one for each that has some; None when they are not stated
    inertias: tuple[LinkInertia, ...] | None = None
    inertia_source: str = ""  # where they come from

    def __post_init__(self) -> None:
        """Check the order of the joints and the frames once, so that no later stage has to."""
        for index, axis in enumerate(self.axes):
            is_after_joint = BASE <= axis.parent < index or len(self.joints) <= axis.parent < len(self.axes)
            if not is_after_joint or index not in self.carried_order:
                raise ValueError(f"robot '{self.name}': joint '{axis.name}' must come after the joint that carries it")
            if abs(np.linalg.norm(axis.axis_B) - 1.0) > 1e-9:  # rounding only: readers normalise
                raise ValueError(f"robot '{self.name}': joint '{axis.name}' needs a unit axis")
        if not is_rigid(self.X_BF):
            raise ValueError(f"robot '{self.name}': the flange frame is not a rigid pose")

    def accuracy_of(self, body: Body) -> float | None:
        """How far the real arm may stick out of one of its bodies in [m]; None when it is not stated."""
        if body.accuracy is not None or self.body_accuracy is None:
            return body.accuracy
        return self.body_accuracy.accuracy_mm.si

    def bodies_named(self, name: str) -> tuple[Body, ...]:
        """All bodies of a link of the robot's file, or else the body that reports show under a name."""
        of_link = tuple(body for body in self.bodies if body.link_name == name)
        return of_link or tuple(body for body in self.bodies if body.name == name)

    @property
    def axes(self) -> tuple[Joint | FollowerJoint, ...]:
        """All axes by the number of the link that they move: driven joints, then followers."""
        return (*self.joints, *self.followers)

    def drive(self, link: int) -> Drive:
        """What drives the axis that moves a link."""
        if link < len(self.joints):
            return Drive(link)
        follower = self.followers[link - len(self.joints)]
        return Drive(follower.leader, follower.ratio, follower.offset)

    @property
    def carried_order(self) -> tuple[int, ...]:
        """All links, each after the one that carries it: as numbered, unless a follower carries a driven joint."""
        waiting, order = list(range(len(self.axes))), [BASE]
        while ready := next((link for link in waiting if self.axes[link].parent in order), BASE) + 1:
            order.append(ready - 1)
            waiting.remove(ready - 1)
        return tuple(order[1:])

    @property
    def links_to_flange(self) -> tuple[int, ...]:
        """Links from the base to the one that carries the flange, in order, the base left out."""
        axes, links, link = self.axes, list[int](), self.flange_link
        while link != BASE:
            links.append(link)
            link = axes[link].parent
        return tuple(reversed(links))

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the driven joints."""
        return tuple(joint.name for joint in self.joints)

    @property
    def lower(self) -> Array:
        """Lower joint limits, shape (n,)."""
        return np.array([joint.lower for joint in self.joints])

    @property
    def upper(self) -> Array:
        """Upper joint limits, shape (n,)."""
        return np.array([joint.upper for joint in self.joints])

    @property
    def velocity(self) -> Array:
        """Speed limits, shape (n,)."""
        return np.array([joint.velocity for joint in self.joints])


def free_name(name: str, taken: Container[str]) -> str:
    """The name of a body, numbered from 2 where it is taken: ``forearm``, ``forearm_2``, …."""
    numbered = (name if number == 1 else f"{name}_{number}" for number in count(1))
    return next(word for word in numbered if word not in taken)


def start_keys(model: RobotModel) -> tuple[str, ...]:
    """Keys of a start posture by joint name: ``a1_deg``, ``rail_mm``."""
    return tuple(f"{joint.name}_{'deg' if joint.is_revolute else 'mm'}" for joint in model.joints)


def configuration_in_si(model: RobotModel, given: Iterable[float] | Mapping[str, float]) -> Array:
    """Joint positions in [rad] or [m] from degrees and millimetres, in order or by key, shape (n,)."""
    values = [given[key] for key in start_keys(model)] if isinstance(given, Mapping) else given
    pairs = zip(model.joints, values, strict=True)
    return in_si(Deg(value) if joint.is_revolute else Mm(value) for joint, value in pairs)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLimits:
    """Limits of n joints, in the order of a stacked joint vector."""

    lower: Array  # lowest positions in [rad] or [m], shape (n,); -inf where there is none
    upper: Array  # highest positions in [rad] or [m], shape (n,); inf where there is none
    velocity: Array  # largest speeds in [rad/s] or [m/s], shape (n,)
    acceleration: Array  # largest accelerations in [rad/s^2] or [m/s^2], shape (n,); inf where none is known
    is_revolute: NDArray[np.bool_]  # whether a joint is revolute rather than prismatic, shape (n,)

    @classmethod
    def of(cls, joints: Iterable[Joint]) -> "JointLimits":
        """The limits of given joints."""
        listed = tuple(joints)
        known = [np.inf if joint.acceleration is None else joint.acceleration for joint in listed]
        return cls(
            lower=_frozen([joint.lower for joint in listed]),
            upper=_frozen([joint.upper for joint in listed]),
            velocity=_frozen([joint.velocity for joint in listed]),
            acceleration=_frozen(known),
            is_revolute=np.array([joint.is_revolute for joint in listed], dtype=bool),
        )

    @property
    def is_bounded(self) -> NDArray[np.bool_]:
        """Whether a joint has both position limits, shape (n,)."""
        return np.isfinite(self.lower) & np.isfinite(self.upper)


def _frozen(values: list[float]) -> Array:
    """A read-only array, as it is shared."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array


def on_rail(model: RobotModel, rail: Joint) -> RobotModel:
    """The robot on a rail; its base frame is the one it has while the rail reads zero, which states its axis there."""
    return replace(
        model,
        joints=(rail, *(replace(joint, parent=joint.parent + 1) for joint in model.joints)),
        followers=tuple(replace(it, parent=it.parent + 1, leader=it.leader + 1) for it in model.followers),
        bodies=tuple(replace(body, link=body.link + 1) for body in model.bodies),
        links=tuple(replace(link, index=link.index + 1) for link in model.links),
        inertias=None if model.inertias is None else tuple(replace(it, link=it.link + 1) for it in model.inertias),
        flange_link=model.flange_link + 1,
        controller=None if model.controller is None else _after_rail(model.controller),
    )


def _after_rail(arm: ControllerZero) -> ControllerZero:
    """The counting of an arm behind a rail, which counts as its joint does."""
    return replace(
        arm,
        zero=np.concatenate([[0.0], arm.zero]),
        sign=np.concatenate([[1.0], arm.sign]),
        coupling=np.pad(arm.coupling, ((1, 0), (1, 0))),
        limits=None if arm.limits is None else np.concatenate([[[-np.inf, np.inf]], arm.limits]),
    )
