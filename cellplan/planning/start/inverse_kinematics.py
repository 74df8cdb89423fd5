"""All configurations that bring one operator's tool to one place on the part, by multi-start."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.transforms import inverse, skew
from cellplan.model.cell.cell import Relation
from cellplan.model.robot.robot import RobotModel
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.planning.tracking.task_constraints import constraint_rows
from cellplan.scene.kinematics.screw_chain import ScrewChain

CLOSED: Final = 1e-12  # [m, rad] a configuration counts as found when the tool is this near its goal: rounding is 1e-15
SAME_POSTURE: Final = 1e-3  # [rad, m] solutions nearer to each other are one branch
LONGEST_MOVE: Final = 0.4  # [rad, m] largest change of a joint in one iteration: farther, the linear model is wrong
DAMPING: Final = 1e-3  # keeps iterations finite at singular configurations; small enough to converge to CLOSED
ITERATIONS: Final = 50  # most starts that arrive at all do so in 15 to 25
RANK_TOL: Final = 1e-6  # [m/rad] a singular value below it is the rounding of axes in files
TRIAL: Final = 25  # iterations after which starts that are still far away are given up
FAR: Final = 1e-2  # [m, rad] far away: convergence is quadratic well inside this


def random_configurations(model: RobotModel, count: int, rng: np.random.Generator) -> Array:
    """Postures drawn evenly within the joint limits (one turn for endless joints), shape (count, n)."""
    lower, upper = finite_limits(model)
    return rng.uniform(lower, upper, (count, len(lower)))


def finite_limits(model: RobotModel) -> tuple[Array, Array]:
    """Joint limits with half a turn to either side for joints that may turn without end."""
    endless = np.isinf(model.lower) | np.isinf(model.upper)
    return np.where(endless, -np.pi, model.lower), np.where(endless, np.pi, model.upper)


def reaching_configurations(chain: ScrewChain, task: Relation, X_PT: Array, *, X_WP: Array, seeds: Array) -> Array:
    """Run damped Newton iterations from all seeds at once and keep what arrives.

    Joint limits are not checked here: a configuration out of limits may have an equal one a turn away.

    Args:
        X_PT: Reference tool tip in P, shape (4, 4).
        X_WP: The part, shape (4, 4).
        seeds: Configurations to start from, shape (B, n).

    Returns:
        Configurations with the tool within ``CLOSED`` of the goal, shape (K, n).
    """
    placed = np.broadcast_to(X_WP, (len(seeds), 4, 4))
    return reached_by_rows(chain, task, X_PT, X_WP=placed, seeds=seeds)[0]


def reached_by_rows(
    chain: ScrewChain, task: Relation, X_PT: Array, *, X_WP: Array, seeds: Array
) -> tuple[Array, Indices]:
    """As ``reaching_configurations``, with the part elsewhere for each seed, X_WP of shape (B, 4, 4).

    Returns:
        Configurations with the tool within ``CLOSED`` of the goal, shape (K, n), and the seeds they come from, (K,).
    """
    rows = constraint_rows(task, X_PT[None])[0]
    X_PW, q, at = inverse(X_WP), seeds, np.arange(len(seeds))
    arrived, places = [seeds[:0]], [at[:0]]
    for iteration in range(ITERATIONS):
        X_WT, screws_W = chain.tool_motion(q)
        goals = np.broadcast_to(X_PT, (len(q), 4, 4))
        error = pose_errors(goals, X_PW[at] @ X_WT, [task.is_spin_free] * len(q)) @ rows.T
        largest = np.abs(error).max(axis=1)
        arrived.append(q[largest < CLOSED])
        places.append(at[largest < CLOSED])
        going_on = (largest >= CLOSED) & ((largest < FAR) | (iteration < TRIAL))
        if not going_on.any():
            break
        at = at[going_on]
        J = rows @ tip_jacobian(screws_W[going_on], X_WT[going_on, :3, 3], X_PW[at, :3, :3])
        q = q[going_on] + damped_move(J, error[going_on])
    return np.concatenate(arrived), np.concatenate(places)


def damped_move(J: Array, error: Array, longest_move: float = LONGEST_MOVE) -> Array:
    """Damped Newton moves, shape (B, n), none of their joints by more than ``longest_move`` in [rad] or [m]."""
    J_T = np.swapaxes(J, 1, 2)
    normal = J @ J_T + DAMPING**2 * np.eye(J.shape[1])
    move = (J_T @ np.linalg.solve(normal, error[:, :, None]))[:, :, 0]
    longest = np.abs(move).max(axis=1, keepdims=True, initial=longest_move)
    return move * (longest_move / longest)


def within_limits(model: RobotModel, q: Array) -> Array:
    """Turn joints by whole turns nearest to mid-range and drop configurations out of limits, shape (K, n)."""
    lower, upper = finite_limits(model)
    q = on_nearest_turns(model, q)
    return _distinct(q[np.all((q >= lower) & (q <= upper), axis=1)])


def on_nearest_turns(model: RobotModel, q: Array) -> Array:
    """Postures with joints turned by whole turns as near to mid-range as they go, shape (B, n)."""
    lower, upper = finite_limits(model)
    turning = np.array([joint.is_revolute for joint in model.joints])
    middle = 0.5 * (lower + upper)
    return q - 2 * np.pi * np.where(turning, np.round((q - middle) / (2 * np.pi)), 0.0)


def joint_margin_shares(model: RobotModel, q: Array) -> Array:
    """Distance of each joint to its nearer limit as share of half its range, 1 where it has none, shape (..., n)."""
    bounded = np.isfinite(model.lower) & np.isfinite(model.upper)
    half = np.where(bounded, 0.5 * (model.upper - model.lower), 1.0)
    return np.where(bounded, np.minimum(q - model.lower, model.upper - q) / half, 1.0)


def smallest_singular_values(chain: ScrewChain, task: Relation, X_PT: Array, q: Array) -> Array:
    """Smallest singular value of the operator's constrained Jacobian at each configuration, shape (K,)."""
    values = np.linalg.svd(_constrained_jacobians(chain, task, X_PT, q), compute_uv=False)
    return np.asarray(values[:, -1], dtype=float)


def constrained_rank(chain: ScrewChain, task: Relation, X_PT: Array, q: Array) -> int:
    """Largest rank of the operator's constrained Jacobian over some configurations, shape (K, n)."""
    return int(np.linalg.matrix_rank(_constrained_jacobians(chain, task, X_PT, q), tol=RANK_TOL).max())


def _constrained_jacobians(chain: ScrewChain, task: Relation, X_PT: Array, q: Array) -> Array:
    """Constrained Jacobians of the tool on the part, shape (K, rows, n)."""
    X_WT = chain.tool_poses(q)
    R_PW = X_PT[:3, :3] @ np.swapaxes(X_WT[:, :3, :3], 1, 2)
    rows = constraint_rows(task, X_PT[None])[0]
    return rows @ tip_jacobian(chain.flange_screws(q), X_WT[:, :3, 3], R_PW)


def tip_jacobian(screws_W: Array, p_WT: Array, R_PW: Array) -> Array:
    """Jacobians of tool tips in axes parallel to P from screws at the world origin, shape (B, 6, n)."""
    linear = screws_W[:, :3] - skew(p_WT) @ screws_W[:, 3:]
    return np.concatenate([R_PW @ linear, R_PW @ screws_W[:, 3:]], axis=1)


def _distinct(q: Array) -> Array:
    """One configuration of each branch, in the order they were found."""
    distinct: list[Array] = []
    for configuration in q:
        if all(np.abs(configuration - other).max() > SAME_POSTURE for other in distinct):
            distinct.append(configuration)
    return np.array(distinct).reshape(len(distinct), q.shape[1])
