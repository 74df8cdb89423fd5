"""How the cooperation Jacobian changes with joints and layout, by Lie brackets of screws."""

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.kernel.job import Job
from cellplan.search.kernel.screws import TaskScrews, bracket, bracket_matrix, cross, power_matrix


class JacobianChanges:
    """The Jacobian ``J`` of all relations at N nodes, and how ``J qd`` and ``J^T lambda`` change."""

    def __init__(self, job: Job, screws: TaskScrews, local: Array, shared: Array, *, at_tips: bool = False) -> None:
        """Note the screws and how fast their axes move.

        Args:
            local: Rates of the own axes of each relation, shape (N, T, levels).
            shared: Rates of the axes of the positioner, shape (N, levels).
            at_tips: Whether all twists are taken at the tips.
        """
        self._screws, self._nq, constraints = screws, job.cell.joint_count, job.constraints
        self._has_local = (constraints.operator_signs > 0.0) | (constraints.carrier_signs > 0.0)
        self._is_carried = constraints.carrier_signs < 0.0
        self._axes, self._holder = flange_axes(job)
        self._is_whole = constraints.is_whole and not at_tips
        self.idle = (1.0 - constraints.constrained).ravel()  # 1 for open components, whose rows are 0, shape (6 T,)
        if not self._is_whole:
            self._rows = constrained_rows(job, screws.tip)
        self._turning = screws.operators * local[..., None]
        self._twist = self._turning.sum(axis=2, keepdims=True)  # of each tool seen from the base, (N, T, 1, 6)
        self._carried = screws.shared * shared[..., None]
        self._minus = np.broadcast_to(-screws.shared[:, None], screws.operators.shape)  # the part moves, not the tool

    @classmethod
    def of(cls, job: Job, screws: TaskScrews, qd: Array) -> "JacobianChanges":
        """Those at joint speeds at the nodes, shape (N, nq)."""
        local, holder = flange_axes(job)
        shared = np.zeros(screws.shared.shape[:2]) if holder is None else holder.axis_rates(qd)
        return cls(job, screws, np.stack([axes.axis_rates(qd) for axes in local], axis=1), shared)

    @property
    def jacobian(self) -> Array:
        """Twists per unit speed of the stacked joints, the constrained components of each relation, (N, 6 T, nq).

        Each in its frame R, taken at the tip where a relation leaves components open, else at the origin of R.
        """
        return self._columns(self._screws.operators, self._minus, self._screws.based[:, :, :0])

    def twists(self) -> Array:
        """Change of ``J qd`` per unit of each joint and direction, shape (N, 6 T, nq + p)."""
        screws, twist, carried = self._screws, self._twist, self._carried
        behind = twist - np.cumsum(self._turning, axis=2)
        before = np.cumsum(carried, axis=1) - carried
        turned, whole = bracket_matrix(twist[:, :, 0]), carried.sum(axis=1)
        local = bracket(screws.operators, behind)
        shared = self._minus @ turned + bracket(screws.shared, before)[:, None]
        held = screws.held @ bracket_matrix(whole)
        layout = screws.based @ turned + held[:, None] * self._is_carried[:, None, None]
        if not self._is_whole:
            spin = twist[..., 3:] - self._is_carried[:, None, None] * whole[:, None, None, 3:]
            for part, tips in zip((local, shared, layout), self._tips(), strict=True):
                part[..., :3] += cross(spin, tips)
        return self._columns(local, shared, layout)

    def forces(self, multipliers: Array) -> Array:
        """Change of ``J^T lambda`` per unit of each joint and direction, shape (N, nq, nq + p)."""
        screws, nodes = self._screws, len(multipliers)
        y = multipliers.reshape(nodes, -1, 6)
        if not self._is_whole:
            y = (np.swapaxes(self._rows, -1, -2) @ y[..., None])[..., 0]
        power = screws.operators @ power_matrix(y)
        held = (y * self._is_carried[:, None]).sum(axis=1)
        held_power = screws.shared @ power_matrix(held)
        below = np.tril(np.ones((power.shape[2],) * 2), -1)
        by_local = (power @ np.swapaxes(screws.operators, -1, -2)) * below
        by_shared, by_layout = -power @ np.swapaxes(screws.shared, -1, -2)[:, None], _products(power, screws.based)
        shared = (held_power @ np.swapaxes(screws.shared, -1, -2)) * below.T, _products(held_power, screws.held)
        forces = np.zeros((nodes, self._nq, self._nq + screws.held.shape[1]))
        tips = None if self._is_whole else self._tips()
        for place, axes in enumerate(self._axes):
            blocks = [by_local[:, place], by_shared[:, place], by_layout[:, place]]
            if tips is not None:
                pull = cross(y[:, place, None, :3], screws.operators[:, place, :, 3:])
                blocks = [block + _products(pull, part[:, place]) for block, part in zip(blocks, tips, strict=True)]
            if self._has_local[place]:
                self._put(forces, axes, place, blocks)
            if tips is not None and self._is_carried[place] and self._holder is not None:
                pull = -cross(y[:, place, None, :3], screws.shared[..., 3:])
                self._put(forces, self._holder, place, [_products(pull, part[:, place]) for part in tips])
        if self._holder is not None:
            axes = self._holder
            forces[:, axes.columns, axes.columns] += axes.to_joints.T @ shared[0] @ axes.to_joints
            forces[:, axes.columns, self._nq :] += axes.to_joints.T @ shared[1]
        return forces

    def _put(self, changes: Array, rows: "FlangeAxes", place: int, blocks: list[Array]) -> None:
        """Add blocks by the own axes, the shared axes and the directions to the rows of a robot's joints."""
        local, shared, layout = (rows.to_joints.T @ block for block in blocks)
        if self._has_local[place]:
            axes = self._axes[place]
            changes[:, rows.columns, axes.columns] += local @ axes.to_joints
        if self._is_carried[place] and self._holder is not None:
            changes[:, rows.columns, self._holder.columns] += shared @ self._holder.to_joints
        changes[:, rows.columns, self._nq :] += layout

    def _columns(self, local: Array, shared: Array, layout: Array) -> Array:
        """Twists by own axes and shared axes, (N, T, levels, 6), and directions, (N, T, p, 6), as (N, 6 T, nq + p)."""
        nodes, count = layout.shape[0], layout.shape[2]
        columns = np.zeros((nodes, len(self._axes), 6, self._nq + count))
        for place, axes in enumerate(self._axes):
            if self._has_local[place]:
                columns[:, place, :, axes.columns] += np.swapaxes(local[:, place], 1, 2) @ axes.to_joints
            if self._is_carried[place] and self._holder is not None:
                columns[:, place, :, self._holder.columns] += (
                    np.swapaxes(shared[:, place], 1, 2) @ self._holder.to_joints
                )
        columns[..., self._nq :] += np.swapaxes(layout, 2, 3)
        return self.in_rows(columns).reshape(nodes, -1, self._nq + count)

    def in_rows(self, twists: Array) -> Array:
        """The constrained components of twists at the origin of R, shape (N, T, 6, n)."""
        return twists if self._is_whole else self._rows @ twists

    def _tips(self) -> tuple[Array, Array, Array]:
        """Displacement of the tips seen from R per unit of own axes, shared axes and directions, (N, T, ..., 3)."""
        screws = self._screws
        moved = (screws.operators, self._minus, screws.based + screws.tooled)
        local, shared, layout = (part[..., :3] + cross(part[..., 3:], screws.tip[:, :, None]) for part in moved)
        return local, shared, layout


class FlangeAxes:
    """The axes on the way to the flange of one robot: its joints among all, and the share of each axis in them."""

    def __init__(self, columns: slice, to_joints: Array) -> None:
        """Store the place of the joints and the shares, shape (levels, n)."""
        self.columns, self.to_joints = columns, to_joints

    @classmethod
    def of(cls, job: Job, robot: int) -> "FlangeAxes":
        """That of a robot, by its place in the cell."""
        placed = job.cell.robots[robot]
        shares = job.tasks.chains.to_joints[:, : len(placed.model.joints), robot]
        return cls(job.cell.columns(placed.name), shares)

    def axis_rates(self, qd: Array) -> Array:
        """Rates of the axes at joint speeds of shape (N, nq), shape (N, levels)."""
        return qd[:, self.columns] @ self.to_joints.T


def flange_axes(job: Job) -> tuple[list[FlangeAxes], FlangeAxes | None]:
    """Those of the robot of each relation, and of the positioner."""
    constraints = job.constraints
    return [FlangeAxes.of(job, int(robot)) for robot in constraints.operators], (
        None if constraints.carrier is None else FlangeAxes.of(job, constraints.carrier)
    )


def constrained_rows(job: Job, tip: Array) -> Array:
    """Matrices that take the constrained components from twists at the origin of R, shape (N, T, 6, 6)."""
    constraints = job.constraints
    rows = np.zeros((*tip.shape[:2], 6, 6))
    rows[..., :, :] = np.eye(6)
    rows[..., :3, 3:] = -np.cross(tip[..., None, :], np.eye(3)).swapaxes(-1, -2)
    free = constraints.is_spin_free
    R = np.moveaxis(job.X[:3, :3], (0, 1, 2, 3), (2, 3, 1, 0))[:, free]
    rows[:, free, 3:, 3:] = np.swapaxes(R, -1, -2)
    return rows * constraints.constrained[:, :, None]


def _products(first: Array, second: Array) -> Array:
    """Scalar products of vectors along the last axes, shape (..., m, k) and (..., n, k) to (..., m, n)."""
    return first @ np.swapaxes(second, -1, -2)
