r"""Collocation: joints as polynomials in time that hold the tools on their tasks and resolve the redundancy.

On each panel the joints are polynomials through Chebyshev points, the nodes. At every node the tools are on their
tasks, and in the null space of the tasks the joints are the integral of the weighted pseudo-inverse
([Ribeiro2010]_ Eq. D.28):

.. math:: e(t_j, q_j) = 0, \qquad N_j \left( q(t_0) + \int_{t_0}^{t_j} J^\# \dot x_d \, dt - q_j \right) = 0

Picard's iteration finds the integral, Newton's the tasks, both in one pass over all nodes of a window: with
``d_j`` what Picard would add to ``q_j``, the pass adds ``d_j + J^# (e_j - J d_j)``.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.planning.collocation.batch_targets import DesiredAt, in_windows
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired, Linearisation
from cellplan.planning.collocation.redundancy import Redundancy
from cellplan.planning.collocation.windows import Window
from cellplan.scene.kinematics.batched import Placement

Drift = Callable[[Array], Array]  # times in [s], shape (K,), to joint velocities, shape (nq, K)
Record = Callable[[Window, Indices, Array, Array], None]  # window, cells, q (nq, cells, nodes), bounds (cells,)

AT_ONCE: Final = 200  # windows whose targets are evaluated together: some 20 000 times
MOST_PASSES: Final = 20  # over a window; where passes help, about eight do
SLOW: Final = 0.7  # a pass that leaves more than this share of the change before does not lead to a solution
FREE_PASSES: Final = 3  # before a pass is judged by that
LONGEST_MOVE: Final = np.pi  # [rad] or [m]: a pass that moves a joint farther has lost its way
OVERSHOOT: Final = 2.0  # largest error anywhere, of the largest that is checked; see `_errors`
TOOL_SHARE: Final = 0.25  # of the accuracy: tool errors at the nodes that passes may leave
CONFIGURATION_SHARE: Final = 10.0  # times as far from their limit as tools may configurations be, in [rad] for [m]


@dataclass(frozen=True, slots=True, eq=False)
class WindowResult:
    """What came of one window."""

    q: Array  # configurations at the nodes, shape (nq, cells, nodes)
    is_settled: Flags  # whether the passes came to an end, shape (cells,)
    errors: Array  # bound of the tool errors in the panels, between nodes too, in [m] or [rad], shape (panels, cells)


@dataclass(frozen=True, slots=True, kw_only=True)
class Precision:
    """How exact a motion has to be, and how fine it may become."""

    accuracy: float  # largest tool error at the nodes and between them, in [m] and [rad]
    configuration_tol: float | None = None  # [rad] and [m] from the limit of the passes; None: 10 accuracies
    shortest: float = 0.0  # length in [s] below which no panel is made by halving


@dataclass(frozen=True, slots=True, kw_only=True)
class NullSpaceMotion:
    """What decides about the redundancy besides the smallest velocities with constant weights."""

    drift: Drift | None = None  # joint velocities that are added in the null space of the tasks; None for none
    redundancy: Redundancy | None = None  # goals and changing weights of a single cell; None for none


class Collocation:
    """Resolves one run of many cells that differ in bases, tools and start configurations only.

    Attributes:
        sweeps: Passes over windows so far.
        solves: Systems of equations solved so far: nodes of all passes.
    """

    def __init__(
        self,
        tasks: BatchTasks,
        desired_at: DesiredAt,
        placement: Placement,
        precision: Precision,
        *,
        mobile: Array | None = None,
        null_space: NullSpaceMotion | None = None,
    ) -> None:
        """Take tasks, robots and joints.

        Args:
            placement: Where the robots of the cells stand; one for all, or one per cell.
            mobile: 1 for joints that are not locked, 0 for those that are, shape (nq,); None for all free.
            null_space: What decides about the redundancy besides constant weights; None for nothing.
        """
        self._tasks, self._desired_at, self._placement = tasks, desired_at, placement
        self._accuracy, self._shortest, tolerance = precision.accuracy, precision.shortest, precision.configuration_tol
        self._configuration_tol = CONFIGURATION_SHARE * precision.accuracy if tolerance is None else tolerance
        self._mobile = np.ones(tasks.joint_count) if mobile is None else mobile
        self._null_space = null_space or NullSpaceMotion()
        self.sweeps = self.solves = 0

    def carry(self, windows: tuple[Window, ...], q: Array, cells: Indices, record: Record) -> Indices:
        """Carry cells through windows, refined where that is needed; returns those that came to the end.

        Args:
            q: Configurations of all cells, shape (nq, all cells); those of the cells are carried on in place.
            record: Called with every window that cells passed, in order for each of them.
        """
        for first in range(0, len(windows), AT_ONCE):
            batch = windows[first : first + AT_ONCE]
            for window, desired in zip(batch, in_windows(self._desired_at, batch), strict=True):
                if not len(cells):
                    return cells
                cells = self._carry_on(window, desired, q, cells, record=record)
        return cells

    def _carry_on(self, window: Window, desired: Desired, q: Array, cells: Indices, *, record: Record) -> Indices:
        """Carry cells through one window; those for which it is too coarse go through finer ones."""
        attempt = self.attempt(window, desired, q[:, cells], self._placement.of(cells))
        is_exact = attempt.is_settled & np.all(attempt.errors <= self._accuracy, axis=0)
        through = cells[is_exact]
        if len(through):
            q[:, through] = attempt.q[:, is_exact, -1]
            record(window, through, attempt.q[:, is_exact], attempt.errors[:, is_exact].max(axis=0))
        is_rough = attempt.is_settled & ~is_exact
        finer = [(~attempt.is_settled, window.parts(shortest=self._shortest))]
        if is_rough.any():
            places = np.any(attempt.errors[:, is_rough] > self._accuracy, axis=1)
            finer.append((is_rough, window.refined(places.tolist(), shortest=self._shortest)))
        arrived = [through]
        for which, windows in finer:
            if which.any() and windows:
                arrived.append(self.carry(windows, q, cells[which], record))
        return np.sort(np.concatenate(arrived))

    @np.errstate(divide="ignore", over="ignore", invalid="ignore")  # what is not a number does not settle
    def attempt(self, window: Window, desired: Desired, q0: Array, placement: Placement) -> WindowResult:
        """Resolve one window from start postures, shape (nq, cells)."""
        cells, nodes = q0.shape[1], window.count
        q = np.repeat(q0[:, :, None], nodes, axis=2)
        is_settled, before = np.zeros(cells, dtype=bool), np.full(cells, np.inf)
        going = np.arange(cells)
        for number in range(MOST_PASSES):
            at_nodes = repeated((desired[0][..., :nodes], desired[1][..., :nodes]), len(going))
            spread = placement.of(going).repeated(nodes)
            moved, errors = self._pass(window, at_nodes, q[:, going], spread, q0=q0[:, going])
            q[:, going] += moved
            change = np.abs(moved).max(axis=(0, 2))
            ratio = change / before[going] if number else np.full(cells, SLOW)
            left = change * ratio / np.maximum(1.0 - ratio, 1.0 - SLOW)
            is_near = errors * ratio <= TOOL_SHARE * self._accuracy  # where blocks are nearly singular, Newton is slow
            is_there = is_near & (left <= self._configuration_tol)
            is_lost = ~(change < LONGEST_MOVE) | ((ratio > SLOW) & (number >= FREE_PASSES))
            is_settled[going[is_there]] = True
            before[going] = change
            going = going[~is_there & ~is_lost]
            if not len(going):
                break
        return WindowResult(q, is_settled, self._errors(window, repeated(desired, cells)[0], q, placement))

    def _pass(
        self, window: Window, desired: Desired, q: Array, placement: Placement, *, q0: Array
    ) -> tuple[Array, Array]:
        """Corrections of q at the nodes in one pass, (nq, cells, nodes), and tool errors before it, (cells,)."""
        self.sweeps += 1
        self.solves += q.shape[1] * q.shape[2]
        linear, velocities = self._velocities(np.tile(window.times[: window.count], q.shape[1]), q, desired, placement)
        qd = velocities.reshape(q.shape)
        picard = (q0[:, :, None] + qd @ window.integral.T - q).reshape(len(q), -1)
        moved: Array = (picard + linear.correction(picard)).reshape(q.shape)
        moved[:, :, 0] = 0.0
        return moved, np.abs(linear.errors).max(axis=(0, 1)).reshape(q.shape[1:]).max(axis=1)

    def _velocities(
        self, times: Array, q: Array, desired: Desired, placement: Placement
    ) -> tuple[Linearisation, Array]:
        """The tasks to first order at the nodes, times of shape (cells * nodes,), and the joint velocities there."""
        at, mobile, null_space = q.reshape(len(q), -1), self._mobile, self._null_space
        drift = None if null_space.drift is None else null_space.drift(times)
        if null_space.redundancy is not None:
            return null_space.redundancy.velocities(times, at, desired, placement=placement, mobile=mobile, drift=drift)
        linear = self._tasks.linearise(at, desired, placement, mobile=mobile)
        return linear, linear.velocities(drift)

    def _errors(self, window: Window, X: Array, q: Array, placement: Placement) -> Array:
        r"""Bounds of the tool errors at the nodes and between them, by panel, shape (panels, cells).

        The nodes of a panel and the points between them are ``2 n + 1`` Chebyshev points. A polynomial of degree ``m``
        is nowhere larger than :math:`1 / \cos(\pi m / 4 n)` times its largest value at them (Ehlich and Zeller 1964):
        twice, up to degree ``4 n / 3``. The error of interpolation begins with degree ``n + 1`` and falls from there.
        """
        everywhere = np.concatenate([q, q @ window.between.T], axis=2)
        cells, points = everywhere.shape[1:]
        errors = self._tasks.errors(everywhere.reshape(len(q), -1), X, placement.repeated(points))
        by_panel = np.zeros((len(window.panels), cells))
        np.maximum.at(by_panel, window.panel_of, largest(errors).reshape(cells, points).T)
        return OVERSHOOT * by_panel


def repeated(desired: Desired, count: int) -> Desired:
    """The same samples for so many cells, one cell after the other."""
    X, V = (np.concatenate([part] * count, axis=-1) for part in desired)
    return X, V


def largest(errors: Array) -> Array:
    """Largest distance in [m] or angle in [rad] of all tasks, shape (6, tasks, batch) to (batch,)."""
    squares = np.maximum(np.sum(errors[:3] ** 2, axis=0), np.sum(errors[3:] ** 2, axis=0))
    return np.sqrt(squares.max(axis=0))
