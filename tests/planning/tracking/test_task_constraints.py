"""Rows, signs and frames of the tasks, against the definitions of the relative twist."""

import numpy as np
import pytest
from builders.batch_cells import CELLS, everyone, relations
from builders.random_cells import make_task, random_pose

from cellplan.model.task.task import Frame
from cellplan.planning.tracking.task_constraints import TaskConstraints, constrained_components, constraint_rows
from cellplan.scene.kinematics.pinocchio_model import CombinedModel


@pytest.mark.parametrize("name", CELLS)
def test_signs_are_those_of_tool_minus_reference_frame(name: str) -> None:
    cell = CELLS[name]
    model, tasks = CombinedModel(cell), relations(cell)

    signs = TaskConstraints.of(cell, tasks, everyone(cell)).column_signs(model.carries_flange)

    carries = {robot.name: model.carries_flange[k].astype(float) for k, robot in enumerate(cell.robots)}
    part = carries[cell.part.held_by[0].robot] if cell.part.held_by else np.zeros(cell.joint_count)
    for task, row in zip(tasks, signs, strict=True):
        np.testing.assert_array_equal(row, carries[task.robot] - part * (task.relative_to is Frame.PART))


def test_a_robot_that_may_not_move_has_no_signs() -> None:
    cell = CELLS["plain"]
    operators = [task.robot for task in cell.tasks]
    constraints = TaskConstraints.of(cell, cell.tasks, operators)
    signs = constraints.column_signs(CombinedModel(cell).carries_flange)
    assert not signs[:, cell.columns("holder")].any()
    np.testing.assert_array_equal(constraints.may_move[cell.columns("holder")], 0.0)


def test_rows_are_orthonormal_and_as_many_as_components_kept() -> None:
    X_RT = np.array([random_pose(np.random.default_rng(seed)) for seed in range(5)])
    for task in (make_task("op0"), make_task("op0", is_spin_free=True), make_task("op0", axes=(0, 2, 4))):
        rows = constraint_rows(task, X_RT)
        assert rows.shape[1] == constrained_components(task).sum()
        np.testing.assert_allclose(rows @ np.swapaxes(rows, 1, 2) - np.eye(rows.shape[1]), 0.0, atol=1e-15 * 10)


def test_with_free_spin_no_row_sees_a_turn_about_the_tool_axis() -> None:
    X_RT = np.array([random_pose(np.random.default_rng(seed)) for seed in range(5)])
    spin = np.concatenate([np.zeros((5, 3)), X_RT[:, :3, 2]], axis=1)
    rows = constraint_rows(make_task("op0", is_spin_free=True), X_RT)
    np.testing.assert_allclose(rows @ spin[..., None], 0.0, atol=1e-15 * 10)


def test_a_task_in_the_world_is_measured_in_the_world() -> None:
    cell, X_WP = CELLS["world"], random_pose(np.random.default_rng(1))
    frames = TaskConstraints.of(cell, cell.tasks, everyone(cell)).reference_frames(X_WP)
    for task, frame in zip(cell.tasks, frames, strict=True):
        np.testing.assert_array_equal(frame, X_WP if task.relative_to is Frame.PART else np.eye(4))
