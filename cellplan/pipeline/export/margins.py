r"""How far targets may leave the straight motion of the joints between rows: at rounded corners, and on cubics.

A target that rounds a row C between the rows A and B leaves the two segments within a share :math:`\beta` of each and
stays within the triangle of the two points where it does so and C. With the times h of both segments, the speeds
:math:`v_1 = (C - A) / h_1` and :math:`v_2 = (B - C) / h_2` and the times :math:`a_i \le \beta h_i` for which it is off
them, a point of the triangle is :math:`C - \lambda a_1 v_1 + \mu a_2 v_2` with :math:`\lambda + \mu \le 1`. Straight
motion is at :math:`C - (\lambda a_1 - \mu a_2) v_1` or :math:`v_2` at the time :math:`\mu a_2 - \lambda a_1`, which is
off by the smaller one of :math:`\lambda a_1` and :math:`\mu a_2` times :math:`v_2 - v_1`, so by no more than

.. math:: \beta \, \frac{h_1 h_2}{h_1 + h_2} \, | v_2 - v_1 |

The distance from the two segments is no more than that whatever the pace is.
"""

from typing import Final

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.arrays import Array
from cellplan.model.cell import Relation
from cellplan.model.exported import Interpolation, RobotRows
from cellplan.model.task import Frame, Task
from cellplan.pipeline.export.played import Played
from cellplan.pipeline.export.rows import times_of
from cellplan.scene.scene import Scene

SHORTEST: Final = 1e-6  # [s] between two rows


def off_chords(played: Played, times: Array) -> Array:
    """No joint is farther from the straight motion between times in [s], shape (M,), in [rad] or [m], (M - 1, nq).

    Args:
        played: A program.
        times: Times that hold all its rows within them.
    """
    off = []
    for robot in played.run.cell.robots:
        rows = played.rows[robot.name]
        own = np.zeros((len(times) - 1, rows.q.shape[1]))
        if robot.name in played.exported and rows.times is not None:
            middle = 0.5 * (times[:-1] + times[1:])
            step = np.clip(np.searchsorted(rows.times, middle, side="right") - 1, 0, len(rows) - 2)
            own += _corners(rows, played.shares[robot.name])[step]
            if played.interpolation is Interpolation.CUBIC:
                parts = np.diff(rows.times)[:, None] / played.parts(robot.name)
                own += (played.curve(robot.name).largest_accelerations() * parts**2 / 8.0)[step]
        off.append(own)
    return np.concatenate(off, axis=1)


def tool_margin(arms: LeverArms, scene: Scene, relation: Relation, off: Array) -> tuple[float, float]:
    """No tool point moves on the part by more in [m], nor turns by more in [rad], when joints are off.

    Args:
        arms: Lever arms of the cell.
        scene: The cell made computable.
        relation: The task or the grasp.
        off: How far all joints may be off, in [rad] or [m], shape (M, nq).
    """
    reach, turn = tool_margins(arms, scene, relation, off).max(axis=0, initial=0.0)
    return float(reach), float(turn)


def tool_margins(arms: LeverArms, scene: Scene, relation: Relation, off: Array) -> Array:
    """As ``tool_margin`` in each step, shape (M, 2)."""
    in_world = isinstance(relation, Task) and relation.relative_to is Frame.WORLD
    holders = scene.cell.part.held_by
    chain = arms.tool(relation.robot, seen_by=holders[0].robot if holders and not in_world else None)
    axes = axes_off(arms, off)
    return np.stack([chain.reach(axes), axes[:, chain.axes] @ chain.turns], axis=1)


def body_margin(arms: LeverArms, scene: Scene, off: Array) -> float:
    """No two points of bodies come nearer by more in [m] when joints are off, shape (M, nq)."""
    axes = axes_off(arms, off)
    reach = [float(arms.chain(None, index).reach(axes).max(initial=0.0)) for index in range(len(scene.engine.bodies))]
    largest = sorted([0.0, 0.0, *reach])[-2:]
    return sum(largest)


def axes_off(arms: LeverArms, off: Array) -> Array:
    """How far all axes of a scene may be off, followers too, shape (M, axes)."""
    both = np.zeros((2 * len(off), off.shape[1]))
    both[1::2] = off
    return arms.steps(both)[::2]


def _corners(rows: RobotRows, shares: Array) -> Array:
    """How far each joint may be off in the steps of a robot by its rounded corners, shape (N - 1, n).

    Args:
        rows: The rows.
        shares: Of the shorter neighbouring segment within which each row is rounded, shape (N,).
    """
    h = np.maximum(np.diff(times_of(rows)), SHORTEST)
    v = np.diff(rows.q, axis=0) / h[:, None]
    time = shares[1:-1] * h[:-1] * h[1:] / (h[:-1] + h[1:])
    corner = time[:, None] * np.abs(np.diff(v, axis=0))
    at_rows = np.zeros_like(rows.q)
    at_rows[1:-1] = corner
    steps: Array = np.maximum(at_rows[:-1], at_rows[1:])
    return steps
