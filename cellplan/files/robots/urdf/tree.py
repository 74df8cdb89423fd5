"""How the links of a URDF hang together, and what each joint does: driven, following, held still."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import did_you_mean, listed
from cellplan.files.robots.urdf.document.document import UrdfDocument, UrdfJoint, UrdfLink
from cellplan.geometry.transforms import Array, pose_from, rotation_about
from cellplan.model.robot.robot import BASE
from cellplan.model.units import DisplayUnit, joint_unit

SHOWN_NAMES: Final = 12  # more names than these make a message unreadable
MAX_DRIVEN: Final = 64  # joints between base and flange: more are no arm


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfTree:
    """A document whose links form one tree."""

    document: UrdfDocument  # links and joints
    root: str  # name of the link that carries all others: the base frame B
    joints: tuple[UrdfJoint, ...]  # every joint after the one that carries it
    above: Mapping[str, UrdfJoint]  # the joint that carries each link but the root

    def path_to(self, link: str) -> list[UrdfJoint]:
        """Joints from the root to a link."""
        path: list[UrdfJoint] = []
        while link != self.root:
            path.append(self.above[link])
            link = path[-1].parent
        return path[::-1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Roles:
    """What each joint does."""

    driven: tuple[UrdfJoint, ...]  # the joints between base and flange that the planner moves, from the base on
    followers: tuple[UrdfJoint, ...]  # joints that a driven one moves through a linkage
    still: Mapping[str, float]  # position in [rad] or [m] of every other joint, by name; zero for fixed ones


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ZeroConfiguration:
    """Where everything is when all driven joints read zero."""

    X_BL: Mapping[str, Array]  # pose of each link in the root link's frame, by link name
    X_BJ: Mapping[str, Array]  # pose of each joint frame, by joint name
    carrier: Mapping[str, int]  # index of the driven or following joint that carries each link, by link name


def build_tree(document: UrdfDocument) -> UrdfTree:
    """Put the joints in order from the one root; links are known, hang on one joint each, and in no cycle."""
    above: dict[str, UrdfJoint] = {}
    below: dict[str, list[UrdfJoint]] = {name: [] for name in document.links}
    for joint in document.joints.values():
        for end, link in (("parent", joint.parent), ("child", joint.child)):
            if link not in document.links:
                raise joint.error(f"unknown {end} link '{link}'{_known(link, document.links)}")
        if joint.child in above:
            first = above[joint.child]
            raise joint.error(
                f"link '{joint.child}' already hangs on joint '{first.name}' in line {first.element.line}"
            )
        above[joint.child] = joint
        below[joint.parent].append(joint)
    roots = [name for name in document.links if name not in above]
    if len(roots) > 1:
        raise InputError(f"{document.file}: expected one root link, got {len(roots)}: {listed(roots)}")
    ordered: list[UrdfJoint] = []
    waiting = [joint for root in roots for joint in below[root]]
    while waiting:
        ordered.append(waiting.pop(0))
        waiting = below[ordered[-1].child] + waiting
    lost = [joint for joint in document.joints.values() if joint not in ordered]
    if lost:
        raise lost[0].error(f"its links form a cycle: {listed(joint.child for joint in lost)}")
    return UrdfTree(document=document, root=roots[0], joints=tuple(ordered), above=above)


def joints_to(tree: UrdfTree, link: str) -> list[UrdfJoint]:
    """Joints that move a link, in the order of the tree: those on its way, and for a mimic joint the one it follows."""
    passed = [joint for joint in tree.path_to(link) if not joint.is_fixed]
    leaders = [
        tree.document.joints[it.mimic.leader] for it in passed if it.mimic and it.mimic.leader in tree.document.joints
    ]
    moving = [joint for joint in (*passed, *leaders) if joint.mimic is None]
    return [joint for joint in tree.joints if joint in moving]


def moving_leaves(tree: UrdfTree) -> list[str]:
    """Links that carry no other link and are moved by a joint other than a mimic, in the order of the file."""
    parents = {joint.parent for joint in tree.joints}
    return [name for name in tree.document.links if name not in parents and _moves(tree, name)]


def assign_roles(tree: UrdfTree, flange: str, locked: Mapping[str, float]) -> Roles:
    """Say for every joint whether it is driven, follows a driven one or stands still.

    ``locked`` has the position in [rad] or [m] of every joint that is held still, those off the chain included.
    ``InputError`` for an unsound mimic, and for no driven joint or too many.
    """
    driven: list[UrdfJoint] = []
    followers: list[UrdfJoint] = []
    still: dict[str, float] = {}
    for joint in tree.joints:
        if joint.is_fixed:
            still[joint.name] = 0.0
        elif joint.mimic:
            leader = _leader(joint, tree.document)
            if leader.name in locked:
                still[joint.name] = joint.mimic.multiplier * locked[leader.name] + joint.mimic.offset
            else:
                followers.append(joint)
        elif joint.name in locked:
            still[joint.name] = locked[joint.name]
        else:
            driven.append(joint)
    if not 1 <= len(driven) <= MAX_DRIVEN:
        what, got = ("a", "none") if not driven else (f"at most {MAX_DRIVEN}", len(driven))
        between = f"movable joint{'s' if driven else ''} between '{tree.root}' and '{flange}'"
        raise InputError(f"{tree.document.file}: expected {what} {between}, got {got}")
    return Roles(driven=tuple(driven), followers=tuple(followers), still=still)


def zero_configuration(tree: UrdfTree, roles: Roles) -> ZeroConfiguration:
    """Poses of all links with every driven joint at zero, its followers where that puts them, all others held."""
    moving = [joint.name for joint in (*roles.driven, *roles.followers)]
    X_BL: dict[str, Array] = {tree.root: np.eye(4)}
    X_BJ: dict[str, Array] = {}
    carrier = {tree.root: BASE}
    for joint in tree.joints:
        X_BJ[joint.name] = X_BL[joint.parent] @ joint.X_PJ
        at_zero = joint.mimic.offset if joint.mimic is not None else 0.0
        X_BL[joint.child] = X_BJ[joint.name] @ _travel(joint, roles.still.get(joint.name, at_zero))
        is_moving = joint.name in moving
        carrier[joint.child] = moving.index(joint.name) if is_moving else carrier[joint.parent]
    return ZeroConfiguration(X_BL=X_BL, X_BJ=X_BJ, carrier=carrier)


def known_joint(document: UrdfDocument, name: str, key: str) -> UrdfJoint:
    """The joint that an option names."""
    if name not in document.joints:
        raise InputError(f"{document.file}: {key}: unknown joint '{name}'{_known(name, document.joints)}")
    return document.joints[name]


def known_link(tree: UrdfTree, name: str, key: str) -> str:
    """The name of a link that an option names."""
    links = tree.document.links
    if name not in links:
        raise InputError(f"{tree.document.file}: {key}: unknown link '{name}'{_known(name, links)}")
    return name


def links_in_order(tree: UrdfTree) -> list[UrdfLink]:
    """All links in the order of the file."""
    return list(tree.document.links.values())


def _known(word: str, names: Collection[str]) -> str:
    """The nearest name, or all of them when none is near and they are few."""
    few = f", expected one of: {listed(names)}" if len(names) <= SHOWN_NAMES else ""
    return did_you_mean(word, names) or few


def _moves(tree: UrdfTree, link: str) -> bool:
    """Whether a joint other than a mimic moves a link."""
    return any(not joint.is_fixed and joint.mimic is None for joint in tree.path_to(link))


def unit_of(joint: UrdfJoint) -> DisplayUnit:
    """Unit in which a cell writes the position of a joint, and messages show it."""
    return joint_unit(is_revolute=joint.kind != "prismatic")


def in_user_unit(joint: UrdfJoint, value: float, per: str = "") -> str:
    """A position in [rad] or [m] as a message says it: in degrees or mm."""
    unit = unit_of(joint)
    return f"{unit.scale * value:.6g} {unit.name}{per}"


def _leader(joint: UrdfJoint, document: UrdfDocument) -> UrdfJoint:
    """The joint that drives a mimic joint."""
    name = joint.mimic.leader if joint.mimic else ""
    if name not in document.joints:
        raise joint.error(f"mimics the unknown joint '{name}'{_known(name, document.joints)}")
    leader = document.joints[name]
    if leader is joint:
        raise joint.error("mimics itself")
    if leader.is_fixed:
        raise joint.error(f"mimics '{name}', which is fixed")
    if leader.mimic:
        raise joint.error(f"mimics '{name}', which mimics '{leader.mimic.leader}': name the leading joint")
    return leader


def _travel(joint: UrdfJoint, position: float) -> Array:
    """Motion of a joint's child from zero to a position, in the joint frame."""
    if joint.kind == "prismatic":
        return pose_from(np.eye(3), position * joint.axis_J)
    return pose_from(rotation_about(joint.axis_J, position), np.zeros(3))
