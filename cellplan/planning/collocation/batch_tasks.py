"""Batched linearisation: pose errors and the arrow-shaped cooperation Jacobian of all tasks at many configurations."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import SMALL_ANGLE, Array
from cellplan.model.cell.cell import Cell, Relation
from cellplan.planning.collocation.arrow_inverse import ArrowInverse
from cellplan.planning.tracking.task_constraints import TaskConstraints
from cellplan.scene.kinematics.batched import BatchChains, BatchState, Placement

# Desired tool poses, shape (4, 4, tasks, batch), and twists, linear first, shape (6, tasks, batch), in the frames that
# the tasks are relative to.
Desired = tuple[Array, Array]


@dataclass(frozen=True, slots=True, eq=False)
class ToolPoses:
    """The tools as the tasks see them."""

    R_WR: Array  # frames that the tasks are relative to, in W, shape (3, 3, tasks, batch)
    R: Array  # tool orientations in these frames, shape (3, 3, tasks, batch)
    p: Array  # tool tips in these frames in [m], shape (3, tasks, batch)
    p_WT: Array  # tool tips in W in [m], shape (3, tasks, batch)


class BatchTasks:
    """The tasks of one run, and the joints that may move for them."""

    def __init__(
        self, cell: Cell, tasks: Sequence[Relation], moving: Sequence[str], *, is_refined: bool = False
    ) -> None:
        """Gather what stays the same from configuration to configuration; refined speeds are exact to rounding."""
        self.is_refined = is_refined  # speeds are exact to rounding even where operators cannot do their tasks alone
        self.chains, self.joint_count = BatchChains(cell), cell.joint_count
        constraints = TaskConstraints.of(cell, tasks, moving)
        self._robots, self._holder, self._X_CP = constraints.operators, constraints.carrier, cell.part.X_CP
        self._is_on_part, self._is_spin_free = constraints.is_on_part, constraints.is_spin_free
        self._constrained = constraints.constrained.T[:, :, None].astype(float)
        self._is_whole = constraints.is_whole
        self._operator_signs, self._share = constraints.operator_signs[:, None], constraints.carrier_signs[:, None]
        joints = 0 if self._holder is None else len(cell.robots[self._holder].model.joints)
        self._operator_columns = self.chains.columns[:, self._robots]
        self._shared_columns = self.chains.columns[:joints, self._holder or 0]
        self._weights = np.concatenate([robot.weights for robot in cell.robots])[:, None]
        self._may_move, self._is_given = constraints.may_move, constraints.follows_path > 0.0

    def linearise(
        self,
        q: Array,
        desired: Desired,
        placement: Placement,
        *,
        mobile: Array,
        weights: Array | None = None,
        damping: float = 0.0,
    ) -> "Linearisation":
        """The tasks at stacked joint vectors, shape (nq, batch), to first order.

        Args:
            mobile: 1 for joints that are not locked, shape (nq,).
            weights: Joint weights, shape (nq, 1 or batch); those of the cell when None.
            damping: Square of a damping factor.
        """
        weights = self._weights if weights is None else weights
        state = self.chains.state(q, placement)
        seen, (X, V) = self._seen(state), desired
        mobile = mobile * self._may_move
        columns, count = self._columns(state, seen, X), len(self._robots)
        shared = mobile[self._shared_columns][:, None, None]
        arrow = ArrowInverse(
            columns[:, :, :count],
            columns[:, : len(shared), count:] * (self._share * shared),
            mobility=_padded(mobile[:, None] / weights)[self._operator_columns] * self._operator_signs,
            coupling_weights=weights[self._shared_columns],
            idle=1.0 - self._constrained + damping * self._constrained,
            is_given=self._is_given[self._shared_columns],
        )
        rows = seen.R_WR if self._is_whole else None
        errors = self._errors(seen, X)
        return Linearisation(self, arrow, errors=errors, rows=rows, desired=self._twists(X, V), mobile=mobile)

    def errors(self, q: Array, X: Array, placement: Placement) -> Array:
        """Pose errors, desired X minus actual, as `cooperation.pose_errors` has them, shape (6, tasks, batch).

        Components that a task leaves open are zero. With free spin the rotation is given in the desired tool frame.
        """
        return self._errors(self._seen(self.chains.state(q, placement)), X)

    def task_errors(self, q: Array, X: Array, placement: Placement) -> Array:
        """Pose errors with all rotations in the frames of the tasks, shape (6, tasks, batch)."""
        errors, free = self.errors(q, X, placement), self._is_spin_free
        errors[3:, free] = np.einsum("ijtb,jtb->itb", X[:3, :3, free], errors[3:, free])
        return errors

    def stacked(self, local: Array, shared: Array) -> Array:
        """What belongs to the joints, sorted into the stacked joint vector, shape (nq, batch)."""
        everything = np.zeros((self.joint_count + 1, shared.shape[1]))
        everything[self._operator_columns] = local
        everything[self._shared_columns] = shared
        return everything[:-1]

    def unstacked(self, everything: Array) -> tuple[Array, Array]:
        """The parts of stacked joint vectors, shape (nq, batch), that belong to each task and to all of them."""
        return _padded(everything)[self._operator_columns] * self._operator_signs, everything[self._shared_columns]

    def _seen(self, state: BatchState) -> ToolPoses:
        """The tools as the tasks see them."""
        p_WT, R_WT = state.p_WT[:, self._robots], state.R_WT[:, :, self._robots]
        R_CP, p_CP = self._X_CP[:3, :3], self._X_CP[:3, 3]
        R_WR, p_WR = np.empty_like(R_WT), np.empty_like(p_WT)
        if self._holder is None:
            R_WR[:], p_WR[:] = R_CP[..., None, None], p_CP[..., None, None]
        else:
            R_WC = state.R_WT[:, :, self._holder]
            R_WR[:] = np.einsum("ijb,jk->ikb", R_WC, R_CP)[:, :, None]
            p_WR[:] = (state.p_WT[:, self._holder] + np.einsum("ijb,j->ib", R_WC, p_CP))[:, None]
        if not self._is_on_part.all():
            R_WR[:, :, ~self._is_on_part] = np.eye(3)[:, :, None, None]
            p_WR[:, ~self._is_on_part] = 0.0
        R = np.einsum("jitb,jktb->iktb", R_WR, R_WT)
        p = np.einsum("jitb,jtb->itb", R_WR, p_WT - p_WR)
        return ToolPoses(R_WR, R, p, p_WT)

    def _errors(self, seen: ToolPoses, X: Array) -> Array:
        """See `errors`."""
        errors = np.empty((6, *seen.p.shape[1:]))
        errors[:3] = X[:3, 3] - seen.p
        between = np.einsum("ijtb,kjtb->iktb", X[:3, :3], seen.R)
        across = between[[2, 0, 1], [1, 2, 0]] - between[[1, 2, 0], [2, 0, 1]]
        errors[3:] = _rotation(0.5 * across, 0.5 * (np.einsum("iitb->tb", between) - 1.0))
        if self._is_spin_free.any():
            free = self._is_spin_free
            z, goal = seen.R[:, 2, free], X[:3, 2, free]
            across_tool = np.einsum("jitb,jtb->itb", X[:3, :3, free], _cross(z, goal))
            errors[3:, free] = _rotation(across_tool, np.einsum("itb,itb->tb", z, goal))
        return errors if self._is_whole else errors * self._constrained

    def _twists(self, X: Array, V: Array) -> Array:
        """Desired twists of the constrained components, in the frames of `errors`, shape (6, tasks, batch)."""
        if self._is_whole:
            return V
        twists = V.copy()
        free = self._is_spin_free
        twists[3:, free] = np.einsum("jitb,jtb->itb", X[:3, :3, free], twists[3:, free])
        twists *= self._constrained
        return twists

    def _columns(self, state: BatchState, seen: ToolPoses, X: Array) -> Array:
        """Tool twists per unit speed of joints: of each task's own robot, then of the positioner at each tip.

        Shape (6, joints, 2 tasks, batch), expressed in W, or in the frames of `errors` where a task leaves components
        open; without a positioner the second half is not used.
        """
        chains = self.chains
        robots = np.concatenate([self._robots, np.full(len(self._robots), self._holder or 0)])
        axes = state.axes[:, :, robots]
        tips = np.concatenate([seen.p_WT, seen.p_WT], axis=1)
        columns = np.empty((6, *axes.shape[1:]))
        columns[:3] = _cross(axes, tips[:, None] - state.points[:, :, robots])
        columns[3:] = axes
        if not chains.is_all_turning:
            turning = chains.is_turning[:, robots][..., None]
            columns[:3] = np.where(turning, columns[:3], axes)
            columns[3:] *= turning
        if not chains.is_plain:
            columns = np.einsum("iltb,ljt->ijtb", columns, chains.to_joints[:, :, robots])
        return columns if self._is_whole else self._in_rows(columns, seen, X)

    def _in_rows(self, columns: Array, seen: ToolPoses, X: Array) -> Array:
        """Columns in the frames of `errors`, zero in the rows that a task leaves open."""
        R, turned, free = seen.R_WR, seen.R_WR.copy(), self._is_spin_free
        turned[:, :, free] = np.einsum("ijtb,jktb->iktb", R[:, :, free], X[:3, :3, free])
        rows = np.empty_like(columns)
        for half in (slice(None, len(free)), slice(len(free), None)):
            rows[:3, :, half] = np.einsum("jitb,jltb->iltb", R, columns[:3, :, half])
            rows[3:, :, half] = np.einsum("jitb,jltb->iltb", turned, columns[3:, :, half])
            rows[:, :, half] *= self._constrained[:, None]
        return rows


class Linearisation:
    """The tasks at many configurations, to first order."""

    def __init__(
        self,
        tasks: BatchTasks,
        arrow: ArrowInverse,
        *,
        errors: Array,
        rows: Array | None,
        desired: Array,
        mobile: Array,
    ) -> None:
        """Keep what was found; ``rows`` turn errors and twists into the frame of the columns, if it is another."""
        self._tasks, self._arrow, self._rows, self._desired, self._mobile = tasks, arrow, rows, desired, mobile
        self._velocities = arrow.refined_velocities if tasks.is_refined else arrow.velocities
        self.errors = errors  # pose errors, see `BatchTasks.errors`, shape (6, tasks, batch)

    def velocities(self, drift: Array | None = None) -> Array:
        r"""Joint velocities ``J^# x_dot + (I - J^# J) u`` for the desired twists and a drift ``u``, shape (nq, batch).

        The drift has the shape (nq,) or (nq, batch).
        """
        b = self._turned(self._desired)
        if drift is None:
            return self._tasks.stacked(*self._velocities(b))
        u = np.broadcast_to((self._mobile * drift.T).T.reshape(len(drift), -1), (len(drift), b.shape[2]))
        return u + self._tasks.stacked(*self._velocities(b - self._arrow.twists(*self._tasks.unstacked(u))))

    def null_space_projection(self, u: Array) -> Array:
        """What of joint velocities moves no tool, ``(I - J^# J) u``, shape (nq, batch)."""
        twists = self._arrow.twists(*self._tasks.unstacked(u))
        return u - self._tasks.stacked(*self._velocities(twists))

    def correction(self, moved: Array) -> Array:
        """Newton's correction ``J^# (e - J d)`` of configurations that will be moved by ``d``, shape (nq, batch)."""
        b = self._turned(self.errors) - self._arrow.twists(*self._tasks.unstacked(moved))
        return self._tasks.stacked(*self._velocities(b))

    def _turned(self, b: Array) -> Array:
        """Errors or twists in the frame of the columns."""
        if self._rows is None:
            return b
        turned = np.empty_like(b)
        np.einsum("ijtb,jtb->itb", self._rows, b[:3], out=turned[:3])
        np.einsum("ijtb,jtb->itb", self._rows, b[3:], out=turned[3:])
        return turned


def _padded(everything: Array) -> Array:
    """Stacked joint vectors with a last row of zeros, for the places of joints that a robot does not have."""
    return np.concatenate([everything, np.zeros((1, everything.shape[1]))])


def _rotation(sine_axis: Array, cosine: Array) -> Array:
    """Rotation vectors from axis times sine, shape (3, ...), and cosine of the angle, shape (...).

    Of a half turn the axis is not known; it is given as one about x, so that it does not linear like none.
    """
    sine = np.sqrt(np.einsum("i...,i...->...", sine_axis, sine_axis))
    is_small = sine <= SMALL_ANGLE
    scale = np.where(is_small, 1.0, np.arctan2(sine, cosine) / np.where(is_small, 1.0, sine))
    vector: Array = sine_axis * scale
    vector[0] += np.pi * (is_small & (cosine < 0.0))
    return vector


def _cross(a: Array, b: Array) -> Array:
    """Cross products along the first axis, shape (3, ...)."""
    product = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=product[i])
        product[i] -= a[k] * b[j]
    return product
