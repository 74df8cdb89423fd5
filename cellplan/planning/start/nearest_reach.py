"""Nearest reach: how near a robot brings its tool to a pose that it cannot reach."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, inverse
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.cell import Relation, Robot
from cellplan.planning.start.inverse_kinematics import finite_limits, tip_jacobian
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.planning.tracking.task_constraints import constraint_rows

Flags = NDArray[np.bool_]

ATTEMPTS: Final = 120  # iterations from each seed; the nearest pose is approached linearly, beyond reach
LONGEST_MOVE: Final = 0.4  # [rad, m] largest change of a joint in one iteration
SHARE: Final = 0.5  # of error times lever: damping that keeps the linear model honest beyond reach


def nearest_reach(
    robot: Robot, relation: Relation, X_PT: Array, *, X_WP: Array, seeds: Array, tip_only: bool
) -> tuple[float, float]:
    r"""Smallest error that any of many attempts of the inverse kinematics leaves within the joint limits.

    Each attempt minimizes ``|e|`` by Levenberg-Marquardt's method, joints held at their limits on the way:

    .. math:: \Delta q = J^T (J J^T + \lambda^2 I)^{-1} e, \qquad \lambda^2 = \tfrac{1}{2} |e| \, l

    with the lever ``l`` from the base to the goal, which bounds the curvature of the tip's way beyond reach.

    Args:
        relation: The task or grasp, which says which components of the pose count.
        X_PT: Reference tool tip in P, shape (4, 4).
        X_WP: The part, shape (4, 4).
        seeds: Configurations to start from, shape (B, n).
        tip_only: Whether the direction of the tool is ignored.

    Returns:
        Distance of the tip in [m] and angle in [rad] that are left; the angle is nil when it is ignored.
    """
    chain, (lower, upper) = ScrewChain(robot), finite_limits(robot.model)
    rows = constraint_rows(relation, X_PT[None])[0]
    is_linear = np.abs(rows[:, :3]).max(axis=1, initial=0.0) > 0.0
    rows = rows[is_linear] if tip_only else rows
    if not len(rows):
        return 0.0, 0.0
    lever = max(1.0, float(np.linalg.norm((X_WP @ X_PT)[:3, 3] - robot.X_WB[:3, 3])))
    q, best = np.clip(seeds, lower, upper), np.full((len(seeds), len(rows)), np.inf)
    for _ in range(ATTEMPTS):
        error, J = _error_and_jacobian(chain, relation, q, X_PT, X_WP=X_WP, rows=rows)
        size = np.linalg.norm(error, axis=1)
        is_better = size < np.linalg.norm(best, axis=1)
        best[is_better] = error[is_better]
        move = _move(J, error, SHARE * lever * size, at=(q <= lower, q >= upper))
        q = np.clip(q + move, lower, upper)
    left = best[int(np.argmin(np.linalg.norm(best, axis=1)))] @ rows
    return float(np.linalg.norm(left[:3])), float(np.linalg.norm(left[3:]))


def _error_and_jacobian(
    chain: ScrewChain, relation: Relation, q: Array, X_PT: Array, *, X_WP: Array, rows: Array
) -> tuple[Array, Array]:
    """Reference minus actual, shape (B, m), and the Jacobian of the actual, shape (B, m, n)."""
    X_WT, screws_W = chain.tool_motion(q)
    goals = np.broadcast_to(X_PT, (len(q), 4, 4))
    error = pose_errors(goals, inverse(X_WP) @ X_WT, [relation.is_spin_free] * len(q)) @ rows.T
    return error, rows @ tip_jacobian(screws_W, X_WT[:, :3, 3], X_WP[:3, :3].T)


def _move(J: Array, error: Array, squared_damping: Array, *, at: tuple[Flags, Flags]) -> Array:
    """Damped moves, shape (B, n), in which no joint at a limit goes farther and none goes far."""
    downhill = np.einsum("bmn,bm->bn", J, error)
    is_free = ~((at[0] & (downhill < 0.0)) | (at[1] & (downhill > 0.0)))
    J = J * is_free[:, None, :]
    J_T = np.swapaxes(J, 1, 2)
    damping = np.maximum(squared_damping, 1e-12)[:, None, None] * np.eye(J.shape[1])
    move = (J_T @ np.linalg.solve(J @ J_T + damping, error[:, :, None]))[:, :, 0]
    longest = np.abs(move).max(axis=1, keepdims=True)
    return move * np.minimum(1.0, LONGEST_MOVE / np.maximum(longest, LONGEST_MOVE))
