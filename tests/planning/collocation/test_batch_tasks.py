"""The tasks at many configurations against the planner's Jacobian, its dense inverse and derivatives."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from builders.batch_cells import CELLS, configurations, everyone, random_desired, relations, seen_poses

from cellplan.geometry.transforms import Array, inverse, rotation_exp, rotation_vector
from cellplan.model.cell.cell import Cell
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired, Linearisation
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian, pose_errors
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows
from cellplan.planning.tracking.weighted_inverse import WeightedInverse
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

LANES = 3
H = 1e-6  # [-] step of differences
ONES = {name: np.ones(cell.joint_count) for name, cell in CELLS.items()}


class Dense:
    """The tasks of one cell at one configuration by the planner's other way: rows over the stacked joint vector."""

    def __init__(self, cell: Cell, q: Array, X: Array, twists: Array, *, moving: list[str], mobile: Array) -> None:
        tasks, model = relations(cell), CombinedModel(cell)
        state = model.state(q)
        constraints = TaskConstraints.of(cell, tasks, moving)
        X_WT, X_WR = state.X_WT[constraints.operators], constraints.reference_frames(state.X_WP)
        signs = constraints.column_signs(model.carries_flange) * mobile
        J = cooperation_jacobian(state, X_WT[:, :3, 3], signs, X_WR=X_WR)
        error = pose_errors(X, inverse(X_WR) @ X_WT, [task.is_spin_free for task in tasks])
        picks = [constraint_rows(task, X[None, index])[0] for index, task in enumerate(tasks)]
        self.J = np.concatenate([pick @ block for pick, block in zip(picks, J, strict=True)])
        self.error = np.concatenate([pick @ part for pick, part in zip(picks, error, strict=True)])
        self.twist = np.concatenate([pick @ twist for pick, twist in zip(picks, twists.T, strict=True)])
        self.weights = np.concatenate([robot.weights for robot in cell.robots])

    @property
    def inverse(self) -> WeightedInverse:
        return WeightedInverse(self.J, self.weights)

    @property
    def rank(self) -> int:
        return int(np.linalg.matrix_rank(self.J))


def looked(
    cell: Cell, q: Array, desired: Desired, *, moving: list[str] | None = None, mobile: Array | None = None
) -> Linearisation:
    tasks = BatchTasks(cell, relations(cell), moving or everyone(cell))
    mobile = np.ones(cell.joint_count) if mobile is None else mobile
    return tasks.linearise(q, desired, tasks.chains.placement(cell), mobile=mobile)


@pytest.mark.parametrize("name", CELLS)
def test_errors_are_those_of_the_planner_in_the_rows_that_a_task_keeps(name: str) -> None:
    cell = CELLS[name]
    q, tasks = configurations(cell, LANES), BatchTasks(cell, relations(cell), everyone(cell))
    desired, X = random_desired(len(relations(cell)), LANES)

    errors = tasks.task_errors(q, desired[0], tasks.chains.placement(cell))

    seen = seen_poses(cell, q.T)
    for lane in range(LANES):
        free = [task.is_spin_free for task in relations(cell)]
        expected = pose_errors(X[lane], seen[lane], free)
        for index, task in enumerate(relations(cell)):
            rows = constraint_rows(task, X[lane, None, index])[0]
            np.testing.assert_allclose(rows @ errors[:, index, lane], rows @ expected[index], atol=1e-11)
            projector = rows.T @ rows  # onto what the rows keep; nothing is left beside them
            np.testing.assert_allclose(projector @ errors[:, index, lane], errors[:, index, lane], atol=1e-11)


@pytest.mark.parametrize("name", CELLS)
def test_speeds_are_the_smallest_weighted_ones_and_the_drift_that_no_task_notices(name: str) -> None:
    cell = CELLS[name]
    q = configurations(cell, LANES)
    desired, X = random_desired(len(relations(cell)), LANES)
    drift = np.random.default_rng(5).normal(size=cell.joint_count)
    linear = looked(cell, q, desired)

    plain, drifting = linear.velocities(), linear.velocities(drift)

    for lane in range(LANES):
        dense = Dense(cell, q[:, lane], X[lane], desired[1][..., lane], moving=everyone(cell), mobile=ONES[name])
        assert dense.rank == len(dense.J), "drawn so that all tasks can be done"
        expected = dense.inverse.velocities(dense.twist, 0.0)
        tolerance = 1e-8 * (dense.inverse.largest / dense.inverse.smallest) ** 2  # damping of 1e-10, some ten rows
        np.testing.assert_allclose(plain[:, lane], expected, atol=tolerance * np.abs(expected).max())
        expected += dense.inverse.null_space_projection(drift)
        np.testing.assert_allclose(drifting[:, lane], expected, atol=tolerance * np.abs(expected).max())


@pytest.mark.parametrize("name", CELLS)
def test_corrections_lead_onto_the_tasks_in_quadratic_steps(name: str) -> None:
    """Newton's method from 1e-2 beside: 1e-4, 1e-8, then rounding, whatever the factor."""
    cell = CELLS[name]
    goal = configurations(cell, LANES)
    X = seen_poses(cell, goal.T)
    desired = np.moveaxis(X, (0, 1), (3, 2)), np.zeros((6, X.shape[1], LANES))
    q = goal + 2e-4 * configurations(cell, LANES, seed=9)
    moves = []
    for _ in range(6):
        linear = looked(cell, q, desired)
        moves.append(np.abs(linear.errors).max())
        q = q + linear.correction(np.zeros_like(q))

    assert moves[0] > 1e-5
    assert moves[-1] <= 1e-13 * 50.0  # lengths of some ten metres
    assert any(after <= 1e4 * before**2 for before, after in pairwise(moves) if before > 1e-6)


@pytest.mark.parametrize("name", CELLS)
def test_a_correction_allows_for_what_the_posture_moves_anyway(name: str) -> None:
    """``J (d + J^# (e - J d)) = e`` for any ``d``."""
    cell = CELLS[name]
    q, d = configurations(cell, LANES), configurations(cell, LANES, seed=4)
    desired, X = random_desired(len(relations(cell)), LANES)

    total = d + looked(cell, q, desired).correction(d)

    for lane in range(LANES):
        dense = Dense(cell, q[:, lane], X[lane], desired[1][..., lane], moving=everyone(cell), mobile=ONES[name])
        tolerance = 1e-8 * (dense.inverse.largest / dense.inverse.smallest) ** 2
        np.testing.assert_allclose(dense.J @ total[:, lane], dense.error, atol=tolerance * 10.0)


@pytest.mark.parametrize("name", [name for name in CELLS if name not in ("carried", "world", "mixed")])
def test_a_part_at_rest_is_left_to_the_operators(name: str) -> None:
    cell = CELLS[name]
    operators = [task.robot for task in cell.tasks]
    at_rest = replace(cell, part=replace(cell.part, held_by=cell.part.held_by[:1]))  # further holders rest as well
    q = configurations(cell, LANES)
    desired, X = random_desired(len(cell.tasks), LANES)
    linear = looked(at_rest, q, desired, moving=operators)

    speeds = linear.velocities()

    for robot in cell.robots:
        assert robot.name in operators or not speeds[cell.columns(robot.name)].any()
    for lane in range(LANES):
        twists = desired[1][..., lane]
        dense = Dense(at_rest, q[:, lane], X[lane], twists, moving=operators, mobile=ONES[name])
        expected = np.linalg.pinv(dense.J / np.sqrt(dense.weights), rcond=1e-9) @ dense.twist / np.sqrt(dense.weights)
        if dense.rank == len(dense.J):
            scale = (dense.inverse.largest / dense.inverse.smallest) ** 2
            np.testing.assert_allclose(speeds[:, lane], expected, atol=1e-8 * scale * np.abs(expected).max())


@pytest.mark.parametrize("name", CELLS)
def test_locked_joints_get_exactly_nothing_and_the_others_make_up_for_it(name: str) -> None:
    cell = CELLS[name]
    q = configurations(cell, LANES)
    mobile = np.ones(cell.joint_count)
    mobile[[0, cell.columns(cell.tasks[0].robot).start]] = 0.0
    desired, X = random_desired(len(relations(cell)), LANES)
    linear = looked(cell, q, desired, mobile=mobile)
    drift = np.ones(cell.joint_count)

    for velocities in (linear.velocities(), linear.velocities(drift), linear.correction(np.zeros_like(q))):
        assert not velocities[mobile == 0.0].any()
    for lane in range(LANES):
        dense = Dense(cell, q[:, lane], X[lane], desired[1][..., lane], moving=everyone(cell), mobile=mobile)
        if dense.rank == len(dense.J):
            tolerance = 1e-8 * (dense.inverse.largest / dense.inverse.smallest) ** 2
            expected = dense.inverse.velocities(dense.twist, 0.0)
            np.testing.assert_allclose(linear.velocities()[:, lane], expected, atol=tolerance * np.abs(expected).max())


@pytest.mark.parametrize("name", ["plain", "sliding", "followers", "mixed", "fixture", "closed", "carried"])
def test_speeds_move_the_tools_as_desired(name: str) -> None:
    """By central differences of poses from successive screws: shares no code with the lanes."""
    cell = CELLS[name]
    q = configurations(cell, LANES)
    desired, _ = random_desired(len(relations(cell)), LANES)
    speeds = looked(cell, q, desired).velocities()

    ahead, behind = (seen_poses(cell, (q + h * speeds).T) for h in (H, -H))

    linear = (ahead - behind)[..., :3, 3] / (2.0 * H)
    angular = rotation_vector(ahead[..., :3, :3] @ np.swapaxes(behind[..., :3, :3], -1, -2)) / (2.0 * H)
    result = np.moveaxis(np.concatenate([linear, angular], axis=-1), -1, 0)
    expected = np.swapaxes(desired[1], 1, 2)
    scale = np.abs(speeds).max()
    np.testing.assert_allclose(result, expected, atol=1e-7 * max(scale, 1.0) ** 2)  # damping, and eps / H of rounding


def test_what_belongs_to_the_joints_is_sorted_there_and_back() -> None:
    for cell in CELLS.values():
        tasks = BatchTasks(cell, relations(cell), everyone(cell))
        q = configurations(cell, LANES)
        working = np.zeros(cell.joint_count, dtype=bool)
        for name in {*cell.positioners[:1], *(task.robot for task in relations(cell))}:
            working[cell.columns(name)] = True
        np.testing.assert_array_equal(tasks.stacked(*tasks.unstacked(q)), q * working[:, None])


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-3, 1.0, 3.0, np.pi - 1e-5, np.pi])
@pytest.mark.parametrize("name", ["plain", "spin"])
def test_errors_of_any_size_are_seen(name: str, angle: float) -> None:
    cell = CELLS[name]
    q, tasks = configurations(cell, 1), BatchTasks(cell, relations(cell), everyone(cell))
    X = seen_poses(cell, q.T)[0]
    axis = np.array([0.6, -0.8, 0.0])  # across the tool's axis, so that free spin does not hide it
    X[:, :3, :3] = X[:, :3, :3] @ rotation_exp(angle * axis)

    result = tasks.errors(q, np.moveaxis(X, 0, -1)[..., None], tasks.chains.placement(cell))

    np.testing.assert_allclose(np.linalg.norm(result[3:, :, 0], axis=0), angle, atol=1e-9)
    np.testing.assert_allclose(result[:3], 0.0, atol=1e-12)
