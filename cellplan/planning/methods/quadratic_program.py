"""Quadratic program: the smallest weighted joint speeds within hard limits, the tasks given up only where they must."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array, Flags
from cellplan.planning.methods.support.qp_engine import nearest_to_origin
from cellplan.planning.methods.support.speed_bounds import JointBounds, VelocityBounds
from cellplan.planning.tracking.problem import FirstOrder, StepResult, TrackingProblem
from cellplan.planning.tracking.task_constraints import TiltRows

SIDES: Final = 16  # [-] of the polygon inside a cone, which leaves 2 % of its angle unused
NORMALS: Final = np.array([[np.cos(a), np.sin(a)] for a in 2.0 * np.pi / SIDES * np.arange(SIDES)])
INSCRIBED: Final = float(np.cos(np.pi / SIDES))  # [-] of the angle of the cone, at the middles of the sides
APPROACH: Final = 20.0  # [1/s] of the angle that is left: an axis slows down over some 50 ms before the border
LARGEST_SHARE: Final = 0.5  # [-] of the angle that is left, by which an axis may come nearer to the border in a step
STEEPEST: Final = 1e10  # largest ratio of the tasks' weight to that of joint velocities: beyond it digits are lost


def quadratic_program(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Integrate by Euler's method; every step is a quadratic program with the limits as hard bounds.

    .. math:: \min_{\dot q, s} \tfrac12 (\dot q - \dot q_0)^T W (\dot q - \dot q_0) + \tfrac12 \rho \, s^T s
              \quad \text{where} \quad J \dot q + s = \dot x_d + K e, \quad l \le \dot q \le u

    Position, speed and acceleration limits, and the room to brake before a position limit, are in ``l`` and ``u``.
    The axis of a tool that may lean has no rows of J: it is bounded by its cone, see `without_tilts`.
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
        velocities, slack = leaning_velocities(
            tasks,
            xdot,
            limits.at(q, velocities, dt),
            mobile=problem.mobile(k) > 0.0,
            slack_weight=problem.cell.solver.quadratic_program.slack_weight,
            cones=without_tilts(tasks, xdot, problem.tilt_rows, gain=min(problem.gain, LARGEST_SHARE / dt)),
        )
        return StepResult(q=q + velocities * dt, slack=slack)

    return advance


@dataclass(frozen=True, slots=True, eq=False)
class Cones:
    """Rows of tool axes that lean: joint velocities ``G qd >= least`` lead none of them out of its cone."""

    G: Array  # shape (c, nq)
    least: Array  # shape (c,), in [rad/s]


def without_tilts(
    tasks: FirstOrder, xdot: Array, tilts: Sequence[TiltRows], *, gain: float
) -> tuple[FirstOrder, Array, Cones]:
    r"""The tasks without the rotations of tool axes that may lean, and the cones that bound these instead.

    Let e be the rotation that takes an axis onto the desired one, about x and y of the desired tool frame. The cone of
    half angle :math:`\alpha` is a regular polygon inside it with normals :math:`n_j`, and e stays in it from step to
    step where

    .. math:: n_j^T (\omega_d - J_\omega \dot q) \le \kappa (\alpha \cos(\pi / N) - n_j^T e)

    with the rate ``kappa`` in [1/s] at which an axis may come nearer to a side, the nearer, the slower; beyond a side
    it is the gain that leads the axis back.

    Args:
        xdot: Reference twist components with error feedback, shape (m,).
        tilts: Rows of each axis that may lean, and its cone.
        gain: That of axes which are beyond their cones in [1/s].
    """
    stays = np.ones(len(xdot), dtype=bool)
    G, least = [np.zeros((0, tasks.J.shape[1]))], [np.zeros(0)]
    for rows, tilt in tilts:
        stays[rows] = False
        G.append(NORMALS @ tasks.J[rows])
        left = INSCRIBED * tilt - NORMALS @ tasks.error[rows]
        least.append(NORMALS @ tasks.twist[rows] - np.where(left > 0.0, APPROACH, gain) * left)
    others = replace(tasks, J=tasks.J[stays], twist=tasks.twist[stays], error=tasks.error[stays])
    return others, xdot[stays], Cones(np.concatenate(G), np.concatenate(least))


def leaning_velocities(
    tasks: FirstOrder,
    xdot: Array,
    bounds: VelocityBounds,
    *,
    mobile: Flags,
    slack_weight: float,
    cones: tuple[FirstOrder, Array, Cones],
) -> tuple[Array, float]:
    """Solve the program of one step, and how much of the tasks it gives up.

    Where limits of joints leave no speed within the cones the axes are led back to the desired ones.

    Args:
        cones: The tasks without the axes that may lean, their twist, and the cones of these axes.
    """
    others, others_xdot, within = cones
    if len(within.G):
        try:
            velocities = bounded_velocities(
                others, others_xdot, bounds, mobile=mobile, slack_weight=slack_weight, cones=within
            )
            return velocities, float(np.linalg.norm(others_xdot - others.J @ velocities))
        except NoSolutionError:
            pass
    velocities = bounded_velocities(tasks, xdot, bounds, mobile=mobile, slack_weight=slack_weight)
    return velocities, float(np.linalg.norm(xdot - tasks.J @ velocities))


def bounded_velocities(
    tasks: FirstOrder,
    xdot: Array,
    bounds: VelocityBounds,
    *,
    mobile: Flags,
    slack_weight: float,
    cones: Cones | None = None,
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
        cones: Further bounds on joint velocities; None for none.

    Returns:
        Joint velocities within the bounds to the last bit, shape (nq,).
    """
    velocities = np.zeros(len(tasks.weights))
    if not mobile.any():
        return velocities
    J, root = tasks.J[:, mobile], np.sqrt(tasks.weights[mobile])
    desired = velocities[mobile] if tasks.secondary is None else tasks.secondary[mobile]
    U, s, Vt = np.linalg.svd(J / root, full_matrices=True)
    lambda_squared = max(1.0 / slack_weight, float(s.max(initial=0.0)) ** 2 / STEEPEST)
    z_0 = Vt[: len(s)].T @ (s / (s**2 + lambda_squared) * (U[:, : len(s)].T @ (xdot - J @ desired)))
    steepness = np.ones(len(root))
    steepness[: len(s)] += s**2 / lambda_squared
    A = Vt.T / np.sqrt(steepness)
    lower, upper = bounds.lower[mobile], bounds.upper[mobile]
    offset = z_0 + root * desired
    rows, low, high = A, root * lower - offset, root * upper - offset
    if cones is not None and len(cones.G):
        G = cones.G[:, mobile] / root
        rows, low = np.concatenate([A, G @ A]), np.concatenate([low, cones.least - G @ offset])
        high = np.concatenate([high, np.full(len(G), np.inf)])
    y = nearest_to_origin(rows, lower=low, upper=high)
    velocities[mobile] = np.clip((offset + A @ y) / root, lower, upper)
    return velocities
