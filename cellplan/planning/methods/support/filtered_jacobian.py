"""Filtered inverse: a matrix that follows the inverse of the task rows as a filter follows its input."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.errors import DivergedError
from cellplan.geometry.transforms import Array
from cellplan.planning.tracking.problem import FirstOrder, StepResult, TrackingProblem
from cellplan.planning.tracking.weighted_inverse import WeightedInverse

Law = Callable[[Array, Array], Array]  # from Theta, shape (nq, m), and J, shape (m, nq), to B, shape (nq, m)

LEAST_AT_START: Final = 0.02  # singular values below this one count as this one when the filter starts at the inverse
LONGEST_MOVE: Final = 0.05  # [rad] or [m] of a joint in one sub-step: the first order holds to a few thousandths
FARTHEST: Final = 1.0  # feedback gain times sub-step times |J B|: above 1 the feedback overshoots, above 2 it swings up
SHORTEST: Final = 2.0**-10  # of a step: a sub-step that would have to be shorter is not taken


class Relaxation:
    r"""How the filter settles while ``J`` is held: the exact solution of [Vargas2012]_ Eq. 34.

    .. math:: \dot\Theta = -\Gamma (S_l J^T + J^T S_r), \quad S_l = \Theta J - I, \quad S_r = J \Theta - I

    ``J = U S V^T`` takes it apart into one scalar equation for each entry of ``X = V^T \Theta U``:

    .. math:: \dot x_{ij} = -\Gamma ((\sigma_i^2 + \sigma_j^2) x_{ij} - 2 \sigma_i \delta_{ij})

    Its exact solution is stable for any gain and any step, where Euler's steps would blow up. With full rank it tends
    to the Moore-Penrose inverse; where a singular value vanishes it stands still, so it stays bounded.
    """

    def __init__(self, J: Array) -> None:
        """Take J apart, shape (m, nq)."""
        self._U, self._s, self._Vt = np.linalg.svd(J)
        rows, columns = np.zeros(len(self._Vt)), np.zeros(len(self._U))
        rows[: len(self._s)] = columns[: len(self._s)] = self._s**2
        self._rates = rows[:, None] + columns

    def after(self, gain_time: float, theta: Array) -> Array:
        """Theta, shape (nq, m), after a time; ``gain_time`` is Gamma times that time."""
        X = (self._Vt @ theta @ self._U) * np.exp(-gain_time * self._rates)
        diagonal = np.arange(len(self._s))
        X[diagonal, diagonal] += 2.0 * gain_time * self._s * _mean_decay(2.0 * gain_time * self._s**2)
        return self._Vt.T @ X @ self._U.T

    def inverse(self) -> Array:
        """Moore-Penrose inverse, shape (nq, m), held finite in a singularity."""
        rank = len(self._s)
        gains = self._s / np.maximum(self._s, LEAST_AT_START) ** 2
        return (self._Vt[:rank].T * gains) @ self._U[:, :rank].T


def _mean_decay(x: Array) -> Array:
    """``(1 - exp(-x)) / x`` for x of at least 0, and 1 where x is 0."""
    safe = np.where(x > 0.0, x, 1.0)
    return np.where(x > 0.0, -np.expm1(-safe) / safe, 1.0)


class FilteredMotion:
    r"""The filter follows the Jacobian, and the joints follow the filter.

    .. math:: \dot q = W^{-1/2} B (\dot x_d + K e) + (I - J^\# J) \dot q_0

    with ``B`` from the law. The filter works on ``J W^-1/2``, so that it tends to the inverse in the metric of the
    joint weights. In each sub-step it settles first and the joints move then: with an endless filter gain this is the
    pseudo-inverse. Secondary goals are projected with the exact inverse, as ``I - Theta J`` would let them leak into
    the tasks while the filter lags.
    """

    def __init__(self, problem: TrackingProblem, law: Law) -> None:
        """Begin with an unset filter."""
        self._problem, self._law = problem, law
        self._settings = problem.cell.solver.filtered_inverse
        self._reach = np.any(problem.signs != 0.0, axis=0)
        self.theta: Array | None = None  # filtered inverse of ``J W^-1/2``, shape (nq, m); None before the first step

    def advance(self, k: int, q: Array) -> StepResult:
        """One step, in as many sub-steps as it needs; between two times the desired twist is held."""
        step, moves = self._problem.step(k), self._reach & (self._problem.mobile(k) > 0.0)
        passed, evaluations = 0.0, 0  # shares of the step are binary fractions: they add up to 1 exactly
        while passed < 1.0:
            tasks = self._problem.first_order(k, q)
            xdot = tasks.twist + self._problem.gain * (tasks.error + passed * step * tasks.twist)
            share, velocities = self._sub_step(tasks, xdot, moves, longest=1.0 - passed, step=step)
            q = q + velocities * (share * step)
            passed, evaluations = passed + share, evaluations + 1
        return StepResult(q=q, iterations=evaluations)

    def _sub_step(
        self, tasks: FirstOrder, xdot: Array, moves: Array, *, longest: float, step: float
    ) -> tuple[float, Array]:
        """Let the filter settle over a sub-step; its share of the step and the joint velocities, shape (nq,).

        The sub-step is halved while a joint would move too far or the feedback would overshoot.
        """
        root = np.sqrt(tasks.weights)
        J = tasks.J / root
        relaxation = Relaxation(J)
        theta = self._start(relaxation, J) if self.theta is None else self.theta
        lateral = _besides(tasks)
        share = longest
        while share >= SHORTEST:
            settled = relaxation.after(self._settings.gain_per_s * share * step, theta) * moves[:, None]
            B = self._law(settled, J)
            at_work = B @ xdot / root
            velocities = at_work + tasks.bounded(lateral, velocities=at_work)
            fastest = float(np.max(np.abs(velocities), initial=0.0))
            swing = self._problem.gain * float(np.linalg.norm(J @ B, 2))
            if fastest * share * step <= LONGEST_MOVE and swing * share * step <= FARTHEST:
                self.theta = settled
                return share, velocities
            share /= 2.0
        raise DivergedError(
            f"the filtered inverse asks for a joint speed of {fastest:.3g} rad/s or m/s: shorten motion.step_s, lower "
            "the gain or solver.filtered_inverse.gain_per_s"
        )

    def _start(self, relaxation: Relaxation, J: Array) -> Array:
        """Theta at the first time."""
        return np.zeros_like(J.T) if self._settings.start == "zero" else relaxation.inverse()


def _besides(tasks: FirstOrder) -> Array:
    """Joint velocities for the secondary goals in the null space of the tasks, shape (nq,)."""
    if tasks.secondary is None:
        return np.zeros_like(tasks.weights)
    return WeightedInverse(tasks.J, tasks.weights).null_space_projection(tasks.secondary)
