"""Home candidates: configurations in which an idle robot may stand out of the way, the nearest to its start first.

How far a configuration is from the start is measured by the time that the slowest joint takes to it at top speed;
so turning and sliding joints, quick and slow ones, can be compared.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, inverse, skew
from cellplan.model.robot.robot import RobotModel
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.scene.kinematics.screw_chain import ScrewChain

RETREATS: Final = (0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.7)  # [m] by which the tool is drawn back
SHARES: Final = (0.02, 0.04, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5)  # of its range by which a single joint moves
BOXES: Final = (0.05, 0.1, 0.2, 0.4, 1.0)  # half-widths of the boxes round the start, as shares of the joint ranges
DRAWS: Final = 80  # configurations drawn from each box
ITERATIONS: Final = 6  # Newton steps from one retreat to the next: they need not converge
DAMPING: Final = 0.02  # [-] keeps the steps finite where the arm is stretched
LONGEST_MOVE: Final = 0.3  # [rad, m] of a joint in one step
SAME: Final = 1e-9  # [s] displacements that differ by less are equal, whatever the rounding


def home_candidates(model: RobotModel, chain: ScrewChain, start: Array, rng: np.random.Generator) -> Array:
    """Configurations within the joint limits, the start first, then by their displacement from it, shape (K, n).

    There are retreats of the tool against its axis, towards the robot's foot and upwards, moves of single joints, and
    configurations drawn from boxes round the start; of equal displacements this order counts.

    Args:
        start: Its start in [rad] or [m], shape (n,).
    """
    endless = np.isinf(model.lower) | np.isinf(model.upper)
    lower, upper = np.where(endless, start + np.array([[-np.pi], [np.pi]]), finite_limits(model))
    inside = np.clip(start, lower, upper)
    configurations = [
        inside,
        *_retreats(chain, inside),
        *_single_joints(inside, lower, upper),
        *_random_homes(inside, lower, upper, rng),
    ]
    q = np.clip(np.array(configurations), lower, upper)
    rank = np.round(displacements(model, inside, q) / SAME)
    return q[np.argsort(rank, kind="stable")]


def displacements(model: RobotModel, start: Array, q: Array) -> Array:
    """Time in [s] that the slowest joint needs from the start to each configuration at top speed, shape (K,)."""
    return (np.abs(q - start) / model.velocity).max(axis=-1)


def _retreats(chain: ScrewChain, start: Array) -> Iterator[Array]:
    """The tool drawn back in a straight line, as well as the arm can: it need not arrive."""
    X_WT = chain.tool_poses(start[None])[0]
    to_foot = chain.axis_points(start[None])[0, 0] - X_WT[:3, 3]
    to_foot[2] = 0.0
    length = np.linalg.norm(to_foot)
    directions = [-X_WT[:3, 2], *([to_foot / length] if length > 0.0 else []), np.array([0.0, 0.0, 1.0])]
    for direction in directions:
        q = start
        for distance in RETREATS:
            goal = X_WT.copy()
            goal[:3, 3] += distance * direction
            q = _towards(chain, q, goal)
            yield q


def _towards(chain: ScrewChain, q: Array, X_WT_goal: Array) -> Array:
    """A few damped Newton steps of the tool towards a pose."""
    for _ in range(ITERATIONS):
        X_WT, screws = chain.tool_motion(q[None])
        error = pose_errors(np.eye(4)[None], inverse(X_WT_goal) @ X_WT, [False])[0]
        R = X_WT_goal[:3, :3].T
        J = np.concatenate([R @ (screws[0, :3] - skew(X_WT[0, :3, 3]) @ screws[0, 3:]), R @ screws[0, 3:]])
        move = J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(6), error)
        q = q + move * min(1.0, LONGEST_MOVE / max(float(np.abs(move).max()), LONGEST_MOVE))
    return q


def _single_joints(start: Array, lower: Array, upper: Array) -> Iterator[Array]:
    """One joint moved by shares of its range, to either side, as far as its limits let it."""
    for joint in range(len(start)):
        for share in SHARES:
            for side in (-1.0, 1.0):
                q = start.copy()
                q[joint] += side * share * (upper[joint] - lower[joint])
                if lower[joint] <= q[joint] <= upper[joint]:
                    yield q


def _random_homes(start: Array, lower: Array, upper: Array, rng: np.random.Generator) -> Iterator[Array]:
    """Configurations drawn from growing boxes round the start."""
    for share in BOXES:
        half = share * (upper - lower)
        yield from rng.uniform(np.maximum(lower, start - half), np.minimum(upper, start + half), (DRAWS, len(start)))
