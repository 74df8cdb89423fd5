r"""How far targets may leave the straight motion of the joints between rows: at rounded corners, and on cubics.

A target that rounds a row C between the rows A and B leaves the two segments within a share :math:`\beta` of each and
stays within the triangle of the two points where it does so and C. With the times h of both segments, the speeds
:math:`v_1 = (C - A) / h_1` and :math:`v_2 = (B - C) / h_2` and the times :math:`a_i \le \beta h_i` for which it is off
them, a point of the triangle is :math:`C - \lambda a_1 v_1 + \mu a_2 v_2` with :math:`\lambda + \mu \le 1`. At the time
:math:`t = \mu a_2 - \lambda a_1` from the row straight motion is at :math:`C + t v_1` or :math:`C + t v_2`: the point
is off by :math:`v_2 - v_1` times the smaller one of :math:`\lambda a_1` and :math:`\mu a_2`, so by a multiple of **one
vector**,

.. math::
    m \, (v_2 - v_1), \qquad 0 \le m \le \beta \, \frac{h_1 h_2}{h_1 + h_2}
    \Bigl( 1 - \frac{|t|}{\beta h} \Bigr)

with the time h of the segment in which t lies. It is largest at the row and nothing where the rounding begins and ends.
The distance from the two segments is no more than that whatever the pace is.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Relation
from cellplan.model.report.exported import Interpolation, RobotRows
from cellplan.model.task.task import Frame, Task
from cellplan.programs.rows.played import ExecutedProgram
from cellplan.programs.rows.rows import times_of
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

SHORTEST: Final = 1e-6  # [s] between two rows
FIRST: Final = ((0, 1), (0, 0))  # steps at the rows at which they begin
LAST: Final = ((1, 0), (0, 0))  # and end
NO_TIPS: Final[Mapping[str, Array]] = {}  # joints alone say how far bodies may be off


def corner_vectors(rows: RobotRows, shares: Array) -> Array:
    """Signed distance of a robot from each of its rows by rounding, in [rad] or [m], shape (N, n).

    Each row is rounded within a share of the shorter neighbouring segment, shape (N,).
    """
    vectors = np.zeros_like(rows.q)
    h = np.maximum(np.diff(times_of(rows)), SHORTEST)
    v = np.diff(rows.q, axis=0) / h[:, None]
    time = shares[1:-1] * h[:-1] * h[1:] / (h[:-1] + h[1:])
    vectors[1:-1] = time[:, None] * np.diff(v, axis=0)
    return vectors


def corners_at(rows: RobotRows, shares: Array, times: Array) -> Array:
    """Signed distance of a robot from its rows at times in [s], shape (M,), by rounding, in [rad] or [m].

    It may be off by any share of that, and falls evenly from each row to where its rounding begins and ends.

    The result has the shape (M, n). Each row is rounded within a share of the shorter neighbouring segment, shape (N,).
    """
    marks, largest = times_of(rows), corner_vectors(rows, shares)
    step = np.clip(np.searchsorted(marks, times, side="right") - 1, 0, len(marks) - 2)
    u = np.clip((times - marks[step]) / np.maximum(np.diff(marks), SHORTEST)[step], 0.0, 1.0)
    before, after = (
        np.where(share > 0.0, 1.0 - offset / np.maximum(share, SHORTEST), 0.0)
        for share, offset in ((shares[step], u), (shares[step + 1], 1.0 - u))
    )
    return np.maximum(before, 0.0)[:, None] * largest[step] + np.maximum(after, 0.0)[:, None] * largest[step + 1]


def all_corners(played: ExecutedProgram, times: Array) -> Array:
    """As ``corners_at`` of all robots of a program, shape (M, nq)."""
    corners = []
    for robot in played.run.cell.robots:
        rows, shares = played.rows[robot.name], played.shares.get(robot.name)
        is_rounded = robot.name in played.exported and shares is not None and bool(np.any(shares > 0.0))
        empty = np.zeros((len(times), rows.q.shape[1]))
        corners.append(corners_at(rows, shares, times) if is_rounded and shares is not None else empty)
    return np.concatenate(corners, axis=1)


def robot_corners(played: ExecutedProgram) -> dict[str, Array]:
    """How far each exported robot may be off at its rows: by rounding, and in its tube.

    First how far the tip of its tool may be in [m], and turned in [rad], infinite where this follows from its joints
    alone, then its joints in [rad] or [m], shape (N, 2 + n), by robot.
    """
    corners = {}
    for name in played.exported:
        rows = played.rows[name]
        joints = np.abs(corner_vectors(rows, played.shares[name]))
        off = row_tube(rows)
        off[np.any(joints > 0.0, axis=1), :2] = np.inf
        corners[name] = off + np.pad(joints, ((0, 0), (2, 0)))
    return corners


def row_tube(rows: RobotRows) -> Array:
    """How far the tip of its tool and the joints of a robot may be off at its rows in its tube, shape (N, 2 + n)."""
    if rows.tube is None:
        return np.zeros((len(rows), 2 + rows.q.shape[1]))
    return np.max([np.pad(rows.tube[:, 2:], ends) for ends in (FIRST, LAST)], axis=0)


def tubes_at(played: ExecutedProgram, times: Array) -> dict[str, Array]:
    """The tube of each robot that has one, in each step between times in [s], shape (M,), shape (M - 1, 4 + n)."""
    middle = 0.5 * (times[:-1] + times[1:])
    tubes = {}
    for name in played.exported:
        rows = played.rows[name]
        if rows.tube is not None:
            step = np.searchsorted(times_of(rows), middle, side="right") - 1
            tubes[name] = rows.tube[np.clip(step, 0, len(rows.tube) - 1)]
    return tubes


def off_chords(played: ExecutedProgram, times: Array) -> Array:
    """How far joints that run a cubic may be off straight motion between times, in [rad] or [m], shape (M - 1, nq).

    The times are in [s], shape (M,), and hold all its rows within them.
    """
    off = []
    for robot in played.run.cell.robots:
        rows = played.rows[robot.name]
        off_chord = np.zeros((len(times) - 1, rows.q.shape[1]))
        if robot.name in played.exported and played.interpolation is Interpolation.CUBIC:
            middle = 0.5 * (times[:-1] + times[1:])
            step = np.clip(np.searchsorted(times_of(rows), middle, side="right") - 1, 0, len(rows) - 2)
            parts = np.diff(times_of(rows))[:, None] / played.parts(robot.name)
            off_chord += (played.curve(robot.name).largest_accelerations() * parts**2 / 8.0)[step]
        off.append(off_chord)
    return np.concatenate(off, axis=1)


def in_steps(corners: Array) -> Array:
    """No joint is off by more in each step, from what it may be off at the times, shape (M, nq), shape (M - 1, nq)."""
    return np.maximum(np.abs(corners[:-1]), np.abs(corners[1:]))


def tool_margins(arms: LeverArms, scene: Scene, relation: Relation, off: Array) -> Array:
    """No tool point moves on the part by more in [m], nor turns by more in [rad], in each step, shape (M, 2).

    All joints may be off, each by itself, by so much in [rad] or [m], shape (M, nq).
    """
    chain = arms.tool(relation.robot, seen_by=holder_of(scene, relation))
    axes = axes_off(arms, off)
    return np.stack([chain.reach(axes), axes[:, chain.axes] @ chain.turns], axis=1)


def tool_corners(arms: LeverArms, scene: Scene, relation: Relation, q: Array, corners: Array) -> Array:
    r"""By how much rounding may move a tool point on the part in [m], and turn it in [rad], at each time, shape (M, 2).

    Between two times it is no more than the value between both values. With :math:`\delta` what a robot may be off, its
    tool moves by :math:`J \delta`, with the Jacobian at a place no farther away than the step and :math:`\delta`; by as
    much as that changes J, the second derivatives are added. Of two robots that take part each may be off or not: the
    largest of the three sums counts.

    The straight motion is in [rad] or [m], shape (M, nq), and so are the corners, see ``corners_at``.
    """
    largest = np.zeros((len(q), 2))
    near = np.flatnonzero(np.any(corners != 0.0, axis=1))
    if not len(near):
        return largest
    twists = _twists(scene, relation, q[near], corners[near])
    sums = [*twists, np.sum(twists, axis=0)]
    lengths = [
        np.stack([np.linalg.norm(total[:, part], axis=1) for part in (slice(3), slice(3, 6))], 1) for total in sums
    ]
    largest[near] = np.max(lengths, axis=0)
    return largest + _changes(arms, scene, relation, q, corners)


def _twists(scene: Scene, relation: Relation, q: Array, corners: Array) -> list[Array]:
    """Motion of a tool on the part by what each robot that takes part may be off, tip then turn, shape (M, 6) each."""
    cell, holder = scene.cell, holder_of(scene, relation)
    p = scene.chains[relation.robot].tool_poses(q[:, cell.columns(relation.robot)])[:, :3, 3]
    twists = []
    for sign, robot in ((1.0, relation.robot), (-1.0, holder)):
        if robot is not None:
            columns = cell.columns(robot)
            screw = np.einsum("nij,nj->ni", scene.chains[robot].flange_screws(q[:, columns]), corners[:, columns])
            twists.append(sign * np.concatenate([screw[:, :3] + np.cross(screw[:, 3:], p), screw[:, 3:]], axis=1))
    return twists


def _changes(arms: LeverArms, scene: Scene, relation: Relation, q: Array, corners: Array) -> Array:
    """What the change of the Jacobian within the steps at each time adds, in [m] and [rad], shape (M, 2)."""
    chain, off = arms.tool(relation.robot, seen_by=holder_of(scene, relation)), axes_off(arms, in_steps(corners))
    moved = arms.steps(q) + off
    mixed = [0.5 * (bend(moved + off) - bend(moved) - bend(off)) for bend in (chain.bend, chain.turn_bend)]
    steps = np.pad(np.stack(mixed, axis=1), ((1, 1), (0, 0)))
    return np.maximum(steps[:-1], steps[1:])


def holder_of(scene: Scene, relation: Relation) -> str | None:
    """The robot that carries what a tool is seen from; None for the world, or a part that is fixed in it."""
    in_world = isinstance(relation, Task) and relation.relative_to is Frame.WORLD
    holders = scene.cell.part.held_by
    return holders[0].robot if holders and not in_world else None


def movers_of(scene: Scene, relation: Relation) -> frozenset[str]:
    """Robots that move a tool, or the part under it."""
    return frozenset(filter(None, (relation.robot, holder_of(scene, relation))))


def body_reach(arms: LeverArms, scene: Scene, off: Array, tips: Mapping[str, Array] = NO_TIPS) -> Array:
    """No point of an engine's body moves by more in [m] when joints are off, shape (M, nq), shape (bodies, M).

    Bodies on the flange of a robot move with its tool, whose tip may be off by so much in [m] and turned in [rad],
    shape (M, 2), by robot.
    """
    axes = axes_off(arms, off)
    reach = np.array([arms.chain(None, index).reach(axes) for index in range(len(scene.engine.bodies))])
    for name, tip in tips.items():
        for index in range(len(reach)):
            body = scene.carrier(index)
            if body.robot == name and body.link == scene.cell.robot(name).model.flange_link:
                reach[index] = np.minimum(reach[index], tip @ np.array([1.0, arms.from_tip(name, index)]))
    return reach


def raised(
    arms: LeverArms, scene: Scene, off: Array, tips: Mapping[str, Array] = NO_TIPS, *, in_step: bool = True
) -> Scene:
    """A scene in which every pair is to keep as much more as joints may bring it nearer.

    Pairs that need not keep a distance are to keep this much.

    All joints may be off by so much in [rad] or [m], shape (M, nq), and tips of tools as for ``body_reach``: both
    bodies of a pair in the same step, or else each in any.
    """
    is_off = np.any(off > 0.0, axis=1)
    if not np.any(is_off):
        return scene
    off, tips = off[is_off], {name: tip[is_off] for name, tip in tips.items()}
    reach, axes = body_reach(arms, scene, off, tips), axes_off(arms, off)
    if not in_step:
        reach, axes = reach.max(axis=1, keepdims=True), axes.max(axis=0, keepdims=True)
    return replace(scene, pairs=tuple(_raised(pair, _nearer(arms, pair, reach, axes)) for pair in scene.pairs))


def _nearer(arms: LeverArms, pair: ScenePair, reach: Array, axes: Array) -> float:
    """By how much in [m] a pair may come nearer: by the way of both bodies, or by that of one as the other sees it."""
    if pair.solids is None:
        return float(reach[pair.first].max()) if pair.first < len(reach) else 0.0
    first, second = pair.solids
    approach = reach[first] + reach[second]
    if np.all(reach[first] > 0.0) and np.all(reach[second] > 0.0):
        chains = (arms.chain(first, second), arms.chain(second, first))
        approach = np.minimum(approach, np.minimum(*(chain.reach(axes) for chain in chains)))
    return float(approach.max())


def _raised(pair: ScenePair, by: float) -> ScenePair:
    """A pair that is to keep more."""
    if by <= 0.0:
        return pair
    demand = pair.demand if pair.rule is Rule.CLEARANCE else 0.0
    return replace(pair, rule=Rule.CLEARANCE, demand=demand + by)


def axes_off(arms: LeverArms, off: Array) -> Array:
    """How far all axes of a scene may be off, followers too, shape (M, axes)."""
    both = np.zeros((2 * len(off), off.shape[1]))
    both[1::2] = off
    return arms.steps(both)[::2]
