"""Which bodies must keep apart, in which class, and which pairs are left out for what reason."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from enum import StrEnum
from itertools import combinations
from typing import Final

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.left_out import LeftOutKind
from cellplan.model.report.report import ClearanceClass
from cellplan.model.robot.robot import BASE, FollowerJoint, Joint, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.units import MM
from cellplan.scene.bodies import Kind, SceneBody, is_ground
from cellplan.scene.collision.distance import APART_TOL
from cellplan.scene.mounting import Mount, grasp_of, keeps_out_of_grip, left_out_kind, mounted_pair

NO_BODY: Final = BASE - 1  # stands for "no link before this one has a body"
MOUNTED = (Kind.ATTACHMENT, Kind.PEDESTAL)  # bodies that the user puts on or below a robot: nothing excuses them


class LinkTree:
    """The links of one robot that have bodies, each joined to the nearest one before it."""

    def __init__(self, model: RobotModel) -> None:
        """Take the joints and the links that have bodies."""
        axes: tuple[Joint | FollowerJoint, ...] = (*model.joints, *model.followers)
        self._parents = [axis.parent for axis in axes]
        self._names = [axis.name for axis in axes]
        self._bars = set(range(len(model.joints), len(axes))) - set(model.links_to_flange)
        self._with_body = {body.link for body in model.bodies}

    def carrier(self, link: int) -> int:
        """The link itself when it has a body, else the nearest before it that has one; ``NO_BODY`` when none has."""
        while link != BASE and link not in self._with_body:
            link = self._parents[link]
        return link if link in self._with_body else NO_BODY

    def parent(self, link: int) -> int:
        """The nearest link with a body before a link; ``NO_BODY`` when there is none."""
        return NO_BODY if link in (BASE, NO_BODY) else self.carrier(self._parents[link])

    def is_bar(self, link: int) -> bool:
        """Whether a link is moved through a linkage and does not carry the flange: a bar that closes a loop."""
        return link in self._bars

    def joint_name(self, link: int) -> str:
        """Name of the joint that moves a link."""
        return self._names[link]

    def joints_between(self, first: int, second: int) -> int:
        """Number of joints between two links that have bodies, joints that carry none left out."""
        up_first, up_second = self._path_down(first), self._path_down(second)
        return min(i + j for i, link in enumerate(up_first) for j, other in enumerate(up_second) if link == other)

    def _path_down(self, link: int) -> list[int]:
        """The link, the ones before it, and ``NO_BODY`` last."""
        path = [link]
        while path[-1] != NO_BODY:
            path.append(self.parent(path[-1]))
        return path


class Rule(StrEnum):
    """What is demanded of a pair."""

    CLEARANCE = "clearance"  # keep the distance that the cell demands
    CONTACT = "contact"  # do not touch; the distance between them is the robot's own design
    PROCESS = "process"  # touch inside the contact zone only
    GRIP = "grip"  # touch where a further holder grips only


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenePair:
    """Two bodies that are watched."""

    first: int  # index of the one body of the scene
    second: int  # index of the other; a half-space is always the second
    # the engine's bodies that must not touch: the two bodies themselves, or what lies outside a contact zone and the
    # part. None for a half-space, and where all of a tool lies inside its zone.
    solids: tuple[int, int] | None
    is_ground: bool  # whether the second body is a half-space
    clearance_class: ClearanceClass  # classes of pairs of bodies
    rule: Rule  # what is demanded of them
    reason: str = ""  # why less than the clearance is demanded; empty for the rule ``clearance``
    demand: float = 0.0  # distance in [m] that a pair with the rule ``clearance`` is to keep
    samples: tuple[int, int] | None = None  # between which it is watched, two solids only; None for all of a motion
    where: str = ""  # where it must not touch, added to the words on a contact of it

    @property
    def least_distance(self) -> float:
        """Distance in [m] that it is to keep: where only contact is forbidden, more than rounding."""
        return max(APART_TOL, self.demand) if self.rule is Rule.CLEARANCE else APART_TOL


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StraightMotion:
    """A straight move of a tool to a place or away from it, in which some pairs are watched for a part of the way."""

    robot: str  # whose tool it is
    p_WT: Array  # the place of the tool tip in the world in [m], shape (3,)
    pairs: tuple[tuple[ScenePair, float, float], ...]  # each with the two distances of the tool in [m] in between


@dataclass(frozen=True, slots=True)
class Excluded:
    """Two bodies that are not watched, and why; ``kind`` is None for two links of one robot's own file."""

    first: int
    second: int
    reason: str
    kind: LeftOutKind | None = None


def sort_pairs(cell: Cell, bodies: Sequence[SceneBody]) -> tuple[list[ScenePair], list[Excluded]]:
    """All pairs of bodies, those that are joined or mounted and those the user named left out."""
    trees = {robot.name: LinkTree(robot.model) for robot in cell.robots}
    by_user, by_file = _user_exclusions(cell, bodies), _disabled(cell, bodies)
    watched, excluded = [], []
    for i, j in _index_pairs(bodies):
        mounting = _mounting(bodies[i], bodies[j], cell=cell, trees=trees)
        if (i, j) in by_user:
            excluded.append(Excluded(i, j, by_user[i, j], LeftOutKind.EXCLUDED))
        elif mounting:
            excluded.append(Excluded(i, j, mounting, left_out_kind(bodies[i], bodies[j])))
        elif (i, j) in by_file:
            excluded.append(Excluded(i, j, by_file[i, j], LeftOutKind.SRDF))
        else:
            watched.append(_watched(cell.checks, bodies, i, j))
    return watched, excluded


def _watched(checks: ChecksEntry, bodies: Sequence[SceneBody], i: int, j: int) -> ScenePair:
    """A pair that is to keep the clearance of the cell, and the accuracy of both bodies where it is added."""
    first, second, on_ground = bodies[i], bodies[j], is_ground(bodies[j])
    added = (first.accuracy or 0.0, second.accuracy or 0.0) if checks.adds_accuracy else (0.0, 0.0)
    return ScenePair(
        first=i,
        second=j,
        solids=None if on_ground else (i, j),
        is_ground=on_ground,
        clearance_class=clearance_class(first, second),
        rule=Rule.CLEARANCE,
        demand=checks.clearance_mm.si + added[0] + added[1],
    )


def clearance_class(first: SceneBody, second: SceneBody) -> ClearanceClass:
    """Class of a pair: anything against the surroundings, then the part, then the robot itself, then robots."""
    kinds = (first.kind, second.kind)
    if Kind.OBSTACLE in kinds:
        return ClearanceClass.ENVIRONMENT
    if Kind.PART in kinds:
        return ClearanceClass.PART
    return ClearanceClass.SELF if first.robot == second.robot else ClearanceClass.ROBOT_ROBOT


def near_in_chain(pair: ScenePair, bodies: Sequence[SceneBody], *, cell: Cell) -> bool:
    """Whether a pair belongs to one robot and moves against each other by no more than two joints.

    What the user mounts on a link or puts below the base is never near: no contact of it is the robot's own design.

    A bar of a linkage counts as near to every link: the loop it closes is not in the chain of joints, so the bars of a
    parallelogram meet links that are three or more joints away.
    """
    a, b = bodies[pair.first], bodies[pair.second]
    if a.robot is None or a.robot != b.robot or a.kind in MOUNTED or b.kind in MOUNTED:
        return False
    tree = LinkTree(cell.robot(a.robot).model)
    first, second = _joined_to(a, tree), _joined_to(b, tree)
    return tree.is_bar(first) or tree.is_bar(second) or tree.joints_between(first, second) <= 2


def stands_on(pair: ScenePair, bodies: Sequence[SceneBody], *, cell: Cell) -> bool:
    """Whether a pair is a thing of the surroundings and the first link with a body of a robot without a foot."""
    a, b = bodies[pair.first], bodies[pair.second]
    if a.kind is not Kind.LINK or b.kind is not Kind.OBSTACLE or a.robot is None or a.link == BASE:
        return False
    return LinkTree(cell.robot(a.robot).model).parent(a.link) == NO_BODY


def _index_pairs(bodies: Sequence[SceneBody]) -> Iterator[tuple[int, int]]:
    """Indices of all pairs but those of two things of the surroundings."""
    for i, j in combinations(range(len(bodies)), 2):
        if not bodies[i].kind is bodies[j].kind is Kind.OBSTACLE:
            yield i, j


def _user_exclusions(cell: Cell, bodies: Sequence[SceneBody]) -> dict[tuple[int, int], str]:
    """Reasons of the pairs that the cell leaves out, by their indices in order."""
    index = _named_bodies(cell, bodies)
    reasons: dict[tuple[int, int], str] = {}
    for number, exclusion in enumerate(cell.checks.exclude):
        where = cell.origin.at(f"checks.exclude[{number}].bodies")
        for name in exclusion.bodies:
            if name not in index:
                near = get_close_matches(name, index, n=1)
                hint = f"; did you mean '{near[0]}'?" if near else f"; the bodies are {', '.join(index)}"
                raise InputError(f"{where}: expected names of two bodies, got '{name}'{hint}")
        first, second = (index[name] for name in exclusion.bodies)
        if first == second:
            raise InputError(f"{where}: expected two different bodies, got '{exclusion.bodies[0]}' twice")
        reasons |= {(min(i, j), max(i, j)): exclusion.reason for i in first for j in second if i != j}
    return reasons


def _named_bodies(cell: Cell, bodies: Sequence[SceneBody]) -> dict[str, tuple[int, ...]]:
    """Indices by name: of one body, of all bodies of a link by the name of the link, of all of a robot by its own."""
    index: dict[str, tuple[int, ...]] = {robot.name: () for robot in cell.robots}
    for robot in cell.robots:
        robot_bodies = [(i, body) for i, body in enumerate(bodies) if body.robot == robot.name]
        index[robot.name] = tuple(i for i, _ in robot_bodies)
        for link in robot.model.links:
            pieces = tuple(i for i, body in robot_bodies if body.kind is Kind.LINK and body.link == link.index)
            index |= {f"{robot.name}/{link.name}": pieces} if pieces else {}
    return {body.name: (i,) for i, body in enumerate(bodies)} | index


def _disabled(cell: Cell, bodies: Sequence[SceneBody]) -> dict[tuple[int, int], str]:
    """Reasons of the pairs that the SRDF of a robot leaves out, by their indices in order: links of that robot only."""
    index = {body.name: i for i, body in enumerate(bodies) if body.kind is Kind.LINK}
    reasons = {}
    for robot in cell.robots:
        for first, second, reason in robot.model.disabled:
            i, j = sorted(index[f"{robot.name}/{name}"] for name in (first, second))
            reasons[i, j] = reason
    return reasons


def _mounting(a: SceneBody, b: SceneBody, *, cell: Cell, trees: Mapping[str, LinkTree]) -> str | None:
    """Why two bodies are joined by their mounting, or None."""
    mounted = mounted_pair(a, b, (0, 0), cell)
    if mounted is not None and mounted.mount is Mount.STANDING:
        return f"both are fixed: may touch, at most {MM * mounted.limit:g} mm deep"
    if mounted is not None:
        is_first = grasp_of(a, b, cell) is cell.part.held_by[0]
        return f"holds the part: may touch, at most {MM * mounted.limit:g} mm deep" if is_first else None
    if a.robot is None or a.robot != b.robot or keeps_out_of_grip(a, b, cell):
        return None
    return _joined(a, b, trees[a.robot])


def _joined(a: SceneBody, b: SceneBody, tree: LinkTree) -> str | None:
    """Why two bodies of one robot cannot come apart, or None."""
    if a.link == b.link:
        return "mounted on it" if a.kind in MOUNTED or b.kind in MOUNTED else "fixed to the same link"
    if a.kind in MOUNTED or b.kind in MOUNTED:
        return _stands_below(a, b, tree)
    if a.kind is b.kind is Kind.LINK:
        child, parent = (a, b) if tree.parent(a.link) == b.link else (b, a)
        return f"joined by joint {tree.joint_name(child.link)}" if tree.parent(child.link) == parent.link else None
    return None


def _stands_below(a: SceneBody, b: SceneBody, tree: LinkTree) -> str | None:
    """Whether a pedestal carries the first link of a robot whose foot has no body."""
    pedestal, other = (a, b) if a.kind is Kind.PEDESTAL else (b, a)
    is_first = other.kind is Kind.LINK and tree.parent(other.link) == NO_BODY
    return "stands on it, as the foot has no body" if pedestal.kind is Kind.PEDESTAL and is_first else None


def _joined_to(body: SceneBody, tree: LinkTree) -> int:
    return body.link if body.kind is Kind.LINK else tree.carrier(body.link)
