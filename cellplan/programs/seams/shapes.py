r"""Lines and arcs: where a controller moves a tool between two of its poses, and how far its rules may differ.

The place is shared; the orientation between two ends depends on the rule of the controller: a turn about one axis, two
angles (a swing of the tool axis and a turn about it), or three angles. With the turns A and B of a swing and a spin the
first two differ by :math:`\tfrac{1}{2} u (1 - u) [A, B]` to second order, which is 0.22 deg at 10 deg of each; all that
is stated here as the *rule margin* is the largest difference of any of them from the turn about one axis.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.transforms import (
    Array,
    pose_from,
    rotation_exp,
    rotation_from_rpy,
    rotation_vector,
    rpy_from_rotation,
)

# [rad] longer arcs are divided: their plane is known worse from three points; a third of a ring is one, with a row more
LARGEST_ARC: Final = np.deg2rad(121.0)
FLAT: Final = 1e-6  # [m] three points that are nearer to a line than this define no circle
STANDS: Final = 1e-7  # [m] shorter moves have no direction
RULE_RESERVE: Final = 1.1  # [-] the rules differ most in the middle, but for terms of third order


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shape:
    """A line or an arc of a tool in the frame of a part.

    Attributes:
        start: Pose of the tool at its start in [m], shape (4, 4).
        turn: Rotation vector from the orientation at its start to the one at its end, in the frame of the part, in
            [rad], shape (3,).
        ahead: The line to its end in [m], shape (3,); for an arc the radius at its start, from the centre.
        normal: Axis about which an arc leads, shape (3,); None for a line.
        angle: Angle of an arc in [rad].
        rule_margin: No rule of orientation differs from the turn about one axis by more, in [rad].
    """

    start: Array
    turn: Array
    ahead: Array
    normal: Array | None = None
    angle: float = 0.0
    rule_margin: float = 0.0

    @property
    def length(self) -> float:
        """Length of its path in [m]."""
        radius = float(np.linalg.norm(self.ahead))
        return radius if self.normal is None else radius * self.angle

    def shares(self, p: Array) -> Array:
        """Shares of its length, 0 to 1, at which it is nearest to points of the part in [m], shape (N, 3) to (N,)."""
        offset = p - self.start[:3, 3]
        if self.length < STANDS:
            return np.zeros(len(p))
        if self.normal is None:
            along: Array = offset @ self.ahead / (self.ahead @ self.ahead)
            return np.clip(along, 0.0, 1.0)
        from_centre = offset + self.ahead
        side = np.cross(self.normal, self.ahead)
        angles = np.arctan2(from_centre @ side, from_centre @ self.ahead)
        rest = 0.5 * (2.0 * np.pi - self.angle)  # what lies behind the start is nearer to it than to the end
        angles = np.where(angles < -rest, angles + 2.0 * np.pi, angles)
        return np.clip(angles / self.angle, 0.0, 1.0)

    def poses(self, shares: Array) -> Array:
        """Poses of the tool at shares of its length, shape (N,), with the turn about one axis, shape (N, 4, 4)."""
        u = shares[:, None]
        if self.normal is None:
            offset = u * self.ahead
        else:
            offset = np.einsum("nij,j->ni", rotation_exp(u * self.angle * self.normal), self.ahead) - self.ahead
        return pose_from(rotation_exp(u * self.turn) @ self.start[:3, :3], self.start[:3, 3] + offset)

    def rule_margins(self, shares: Array) -> Array:
        """Largest difference of any rule of orientation at shares of its length in [rad], shape (N,)."""
        return 4.0 * shares * (1.0 - shares) * self.rule_margin


def line(start: Array, end: Array) -> Shape:
    """The line between two poses of a tool in the frame of a part, shape (4, 4)."""
    turn = rotation_vector(end[:3, :3] @ start[:3, :3].T)
    margin = rule_difference(start[:3, :3].T @ end[:3, :3])
    return Shape(start=start, turn=turn, ahead=end[:3, 3] - start[:3, 3], rule_margin=margin)


def arc(start: Array, middle: Array, end: Array) -> Shape | None:
    """The arc through three poses of a tool in the frame of a part, shape (4, 4); None where there is none.

    Controllers differ in whether the orientation in the middle counts: by how much it is off the turn about one axis
    is part of the rule margin.
    """
    first, second = middle[:3, 3] - start[:3, 3], end[:3, 3] - start[:3, 3]
    across = np.cross(first, second)
    area = float(np.linalg.norm(across))
    if area <= FLAT * float(np.linalg.norm(second)):
        return None
    centre = (np.cross(across, first) * (second @ second) + np.cross(second, across) * (first @ first)) / (
        2.0 * area**2
    )
    normal = across / area
    radius, last = -centre, second - centre
    angle = float(np.arctan2(np.cross(radius, last) @ normal, radius @ last)) % (2.0 * np.pi)
    if angle > LARGEST_ARC:
        return None
    chord = line(start, end)
    shape = Shape(start=start, turn=chord.turn, ahead=radius, normal=normal, angle=angle)
    share = shape.shares(middle[None, :3, 3])
    off = rotation_vector(shape.poses(share)[0, :3, :3] @ middle[:3, :3].T)
    margin = chord.rule_margin + float(np.linalg.norm(off))
    return Shape(start=start, turn=chord.turn, ahead=radius, normal=normal, angle=angle, rule_margin=margin)


class CornerCut(NamedTuple):
    """By how much a corner is cut."""

    cut: float  # in [m]
    turn: float  # in [rad]
    swing: float  # in [rad], without the turn about the axis of the tool


def corner_cut(one: Shape, other: Shape, radius: float) -> CornerCut:
    """By how much a corner that is rounded within a distance in [m] of its row is cut.

    Whatever the curve, it stays in the triangle of the corner and the two places at which it leaves both paths. Where
    these meet smoothly, as arcs of one circle do, the cut is the square of the distance over the diameter.
    """
    ends = one.poses(np.array([max(1.0 - radius / one.length, 0.0), 1.0]))
    after = other.poses(np.array([min(radius / other.length, 1.0)]))[0]
    chord, offset = (after - ends[0])[:3, 3], (ends[1] - ends[0])[:3, 3]
    length = float(chord @ chord)
    height = offset - chord * (float(offset @ chord) / length if length > 0.0 else 0.0)
    turns = [rotation_vector(end[:3, :3] @ ends[1][:3, :3].T) for end in (ends[0], after)]
    turn, axis = 0.5 * (turns[0] + turns[1]), ends[1][:3, 2]
    return CornerCut(*map(float, map(np.linalg.norm, (height, turn, turn - axis * (turn @ axis)))))


def rule_difference(R: Array) -> float:
    """Largest difference in [rad] of the rules of orientation in the middle of a turn, shape (3, 3).

    The rules are the turn about one axis, a swing of the tool axis z with an even turn about it, and even angles about
    the fixed axes x, y and z, and about the turned ones, in the order of each.
    """
    middle = rotation_exp(0.5 * rotation_vector(R))
    swing = np.cross([0.0, 0.0, 1.0], R[:, 2])
    sine = float(np.linalg.norm(swing))
    swing = swing * (np.arctan2(sine, R[2, 2]) / sine) if sine > 0.0 else np.zeros(3)
    spin = rotation_vector(rotation_exp(swing).T @ R)
    halves = [
        rotation_exp(0.5 * swing) @ rotation_exp(0.5 * spin),
        rotation_from_rpy(0.5 * rpy_from_rotation(R)),
        rotation_from_rpy(0.5 * rpy_from_rotation(R.T)).T,
    ]
    return RULE_RESERVE * max(float(np.linalg.norm(rotation_vector(middle.T @ half))) for half in halves)
