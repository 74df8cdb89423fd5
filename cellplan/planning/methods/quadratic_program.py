"""Quadratic program: the smallest weighted joint speeds within hard limits, the tasks given up only where they must."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.planning.methods.support.qp_engine import nearest_to_origin
from cellplan.planning.methods.support.speed_bounds import JointBounds, VelocityBounds
from cellplan.planning.tracking.problem import FirstOrder, StepResult, TrackingProblem

STEEPEST: Final = 1e10  # largest ratio of the tasks' weight to that of joint velocities: beyond it digits are lost


def quadratic_program(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Integrate by Euler's method; every step is a quadratic program with the limits as hard bounds.

    .. math:: \min_{\dot q, s} \tfrac12 (\dot q - \dot q_0)^T W (\dot q - \dot q_0) + \tfrac12 \rho \, s^T s
              \quad \text{where} \quad J \dot q + s = \dot x_d + K e, \quad l \le \dot q \le u

    Position, speed and acceleration limits, and the room to brake before a position limit, are in ``l`` and ``u``.
    Where no bound is active this is the weighted, damped inverse with ``lambda^2 = 1 / rho`` ([Ribeiro2010]_ Eq. D.43).
    What the slack ``s`` leaves of the tasks is made up for by the feedback as soon as there is room.
    """
    limits = JointBounds(problem.cell)
    velocities: Array | None = None

    def advance(k: int, q: Array) -> StepResult:
        nonlocal velocities
        if velocities is None:
            limits.refuse_outside(q)
            velocities = np.zeros_like(q)
        tasks, dt = problem.first_order(k, q), problem.step(k)
        xdot = tasks.twist + problem.gain * tasks.error
        bounds = limits.at(q, velocities, dt)
        velocities = bounded_velocities(
            tasks,
            xdot,
            bounds,
            mobile=problem.mobile(k) > 0.0,
            slack_weight=problem.cell.solver.quadratic_program.slack_weight,
        )
        return StepResult(q=q + velocities * dt, slack=float(np.linalg.norm(xdot - tasks.J @ velocities)))

    return advance


def bounded_velocities(
    tasks: FirstOrder, xdot: Array, bounds: VelocityBounds, *, mobile: Flags, slack_weight: float
) -> Array:
    r"""Solve the program of one step.

    The slack is eliminated. With ``z = W^1/2 (qd - qd_0)``, ``B = J W^-1/2 = U S V^T`` and the optimum without bounds
    ``z_0``, the cost is ``1/2 |y|^2`` for ``z = z_0 + V (I + rho S^2)^-1/2 y``: what remains is the point ``y`` nearest
    to the origin between the bounds. In these coordinates metres, radians, weights and the weight of the slack have no
    say in how well the program is conditioned.

    Args:
        xdot: Reference twist components with error feedback, shape (m,).
        mobile: Whether a joint may move, shape (nq,); the others have speed 0.
        slack_weight: ``rho``.

    Returns:
        Joint velocities within the bounds to the last bit, shape (nq,).
    """
    velocities = np.zeros(len(tasks.weights))
    if not mobile.any():
        return velocities
    J, root = tasks.J[:, mobile], np.sqrt(tasks.weights[mobile])
    desired = velocities[mobile] if tasks.secondary is None else tasks.secondary[mobile]
    U, s, Vt = np.linalg.svd(J / root, full_matrices=True)
    lambda_squared = max(1.0 / slack_weight, float(s[0]) ** 2 / STEEPEST)
    z_0 = Vt[: len(s)].T @ (s / (s**2 + lambda_squared) * (U[:, : len(s)].T @ (xdot - J @ desired)))
    steepness = np.ones(len(root))
    steepness[: len(s)] += s**2 / lambda_squared
    A = Vt.T / np.sqrt(steepness)
    lower, upper = bounds.lower[mobile], bounds.upper[mobile]
    offset = z_0 + root * desired
    y = nearest_to_origin(A, lower=root * lower - offset, upper=root * upper - offset)
    velocities[mobile] = np.clip((offset + A @ y) / root, lower, upper)
    return velocities
