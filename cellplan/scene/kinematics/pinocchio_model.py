"""The interface to pinocchio: all robots of a cell as one combined model for the planner."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import BASE

MAX_AXES: Final = 48  # [-] of the robots that share a pinocchio model: 4 MB of its results; eight arms


@dataclass(frozen=True, slots=True, eq=False)
class CellState:
    """Kinematics of the whole cell at one stacked joint vector."""

    # twist that unit speed of each joint gives what it carries, taken at the world origin, linear part first, shape (6,
    # nq), expressed in W
    screws_W: Array
    X_WT: Array  # tool tip of each robot, in the order of the cell, shape (robots, 4, 4)
    X_WP: Array  # part frame, shape (4, 4)


@dataclass(frozen=True, slots=True, eq=False)
class LinkState:
    """Every link of the cell at one stacked joint vector; robot by robot, driven links before followers."""

    # twist that unit speed of each axis, driven or follower, gives what it carries, taken at the world origin, linear
    # part first, shape (6, links), expressed in W
    screws_W: Array
    # displacement of each link from its place in B at the reference configuration to its place in the world, shape
    # (links, 4, 4): anything fixed to it is at ``D @ X_BS``
    D: Array


class _Group:
    """Some robots in a row as one pinocchio model; the memory of such a model grows with the cube of its axes."""

    def __init__(self, first: int) -> None:
        """Begin with no axes; ``first`` is the place of the group's first axis among all axes."""
        self.model = pin.Model()
        self.first = first

    def close(self) -> None:
        """Make room for results when all axes are there."""
        self.data = self.model.createData()
        self.axes = slice(self.first, self.first + self.model.nv)

    @property
    def screws(self) -> Array:
        """Columns of the axes as last computed, shape (6, axes); of a single one pinocchio gives a vector."""
        return self.data.J.copy().reshape(6, self.model.nv)

    def poses(self) -> list[Array]:
        """Poses of the joint frames as last computed, shape (4, 4) each."""
        return [self.data.oMi[link].homogeneous for link in range(1, self.model.njoints)]


class CombinedModel:
    """All robots in pinocchio; joint columns stand in the order of the stacked joint vector.

    Attributes:
        carries_flange: Whether a joint moves a robot's flange, shape (robots, nq).
        carries_link: Whether an axis moves a link, itself included, shape (links, links): ``[link, axis]``.
        first_link: Place of each robot's first link among all links, by the robot's index.
    """

    def __init__(self, cell: Cell) -> None:
        """Build the model from the joint-axis tables; nothing is read from files here."""
        self._groups: list[_Group] = []
        self._leaders: list[int] = []
        self._ratios: list[float] = []
        self._offsets: list[float] = []
        self._is_before_flange: list[bool] = []
        self.carries_flange = np.zeros((len(cell.robots), cell.joint_count), dtype=bool)
        self._flanges: list[tuple[_Group, int]] = []
        self._X_JT: list[Array] = []
        self.first_link: list[int] = []
        self._points: list[Array] = []
        self._links: list[int] = []  # of each axis of the engine, the place among all links
        for index, robot in enumerate(cell.robots):
            self._add_robot(robot, cell.columns(robot.name), self.carries_flange[index])
        for group in self._groups:
            group.close()
        count = len(self._leaders)
        self._engine_axes = np.argsort(self._links)  # of each link, the place among the engine's axes
        self._spread = np.zeros((count, cell.joint_count))
        self._spread[np.arange(count), self._leaders] = self._ratios
        self._spread_to_flange = self._spread * np.array(self._is_before_flange)[:, None]
        self._offset = np.array(self._offsets)
        self._is_plain = bool(np.array_equal(self._spread, np.eye(cell.joint_count)))
        self._X_WT = np.tile(np.eye(4), (len(cell.robots), 1, 1))
        self.carries_link = np.zeros((count, count), dtype=bool)
        for group in self._groups:
            links = self._links[group.axes]
            self.carries_link[np.ix_(links, links)] = _carriers(group.model)
        self._X_JB = np.array([_at(-point) for point in self._points]).reshape(-1, 4, 4)
        self._carrier, self._X_CP = cell.carrier, cell.part.X_CP

    def state(self, q: Array) -> CellState:
        """Kinematics at the stacked joint vector ``q``, shape (nq,); the result owns its arrays."""
        full = q if self._is_plain else self._spread @ q + self._offset
        self._compute(full)
        screws = self._screws() if self._is_plain else self._screws() @ self._spread_to_flange
        X_WT = self._X_WT.copy()
        for index, ((group, joint_id), X_JT) in enumerate(zip(self._flanges, self._X_JT, strict=True)):
            X_WT[index] = group.data.oMi[joint_id].homogeneous @ X_JT
        X_WP = self._X_CP if self._carrier is None else X_WT[self._carrier] @ self._X_CP
        return CellState(screws, X_WT, X_WP)

    def links(self, q: Array) -> LinkState:
        """All links at the stacked joint vector ``q``, shape (nq,); the result owns its arrays."""
        self._compute(self._spread @ q + self._offset)
        X_WJ = np.array([pose for group in self._groups for pose in group.poses()])
        return LinkState(self._screws(), X_WJ.reshape(-1, 4, 4)[self._engine_axes] @ self._X_JB)

    def along_joints(self, per_axis: Array) -> Array:
        """Sum what belongs to the axes over those that each driven joint turns, shape (..., links) to (..., nq)."""
        return per_axis @ self._spread

    def by_flange(self, per_axis: Array) -> Array:
        """The same over those axes only that are on the way to a flange."""
        return per_axis @ self._spread_to_flange

    def to_flange(self, per_joint: Array) -> Array:
        """Share of each axis on the way to a flange in what belongs to the joints, shape (..., nq) to (..., links)."""
        return per_joint @ self._spread_to_flange.T

    def _compute(self, full: Array) -> None:
        """Let the engine place all axes at their positions, shape (links,)."""
        positions = full if self._is_plain else full[self._links]
        for group in self._groups:
            pin.computeJointJacobians(group.model, group.data, positions[group.axes])

    def _screws(self) -> Array:
        """Columns of all axes as the engine last computed them, shape (6, links)."""
        screws = [group.screws for group in self._groups]
        every = screws[0] if len(screws) == 1 else np.concatenate(screws, axis=1)
        return every if self._is_plain else every[:, self._engine_axes]

    def _group_for(self, axes: int) -> _Group:
        """The last group, or a new one when the last has no room for so many axes."""
        if not self._groups or self._groups[-1].model.nv + axes > MAX_AXES:
            self._groups.append(_Group(len(self._leaders)))
        return self._groups[-1]

    def _add_robot(self, robot: Robot, columns: slice, carries: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> None:
        """Add one robot's joints; every joint frame is parallel to B at the reference configuration."""
        model = robot.model
        axes = model.axes
        ids: dict[int, int] = {BASE: 0}
        group, first = self._group_for(len(axes)), len(self._leaders)
        self.first_link.append(first)
        for link in model.carried_order:
            axis = axes[link]
            X_parent = robot.X_WB @ _at(axis.point_B)
            if axis.parent != BASE:
                X_parent = _at(axis.point_B - axes[axis.parent].point_B)
            kind = pin.JointModelRevoluteUnaligned if axis.is_revolute else pin.JointModelPrismaticUnaligned
            placement, name = pin.SE3(X_parent[:3, :3], X_parent[:3, 3]), f"{robot.name}/{axis.name}"
            ids[link] = group.model.addJoint(ids[axis.parent], kind(axis.axis_B), placement, name)
            self._links.append(first + link)
        for link, axis in enumerate(axes):
            drive = model.drive(link)
            self._points.append(axis.point_B)
            self._leaders.append(columns.start + drive.joint)
            self._ratios.append(drive.ratio)
            self._offsets.append(drive.offset)
        link = model.flange_link
        self._flanges.append((group, ids[link]))
        X_joint = inverse(robot.X_WB) if link == BASE else _at(axes[link].point_B)
        self._X_JT.append(inverse(X_joint) @ model.X_BF @ robot.tool.X_FT)
        for moved in model.links_to_flange:
            carries[columns.start + model.drive(moved).joint] = True
        self._is_before_flange += [moved in model.links_to_flange for moved in range(len(axes))]


def _carriers(model: pin.Model) -> NDArray[np.bool_]:
    """Whether an axis moves a link, shape (links, links); pinocchio counts the world as joint 0."""
    count = model.njoints - 1
    carries = np.eye(count, dtype=bool)
    for link in range(count):
        if model.parents[link + 1] > 0:
            carries[link] |= carries[model.parents[link + 1] - 1]
    return carries


def _at(point: Array) -> Array:
    """Pose without rotation."""
    X = np.eye(4)
    X[:3, 3] = point
    return X
