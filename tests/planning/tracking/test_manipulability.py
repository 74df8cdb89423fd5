"""The gradient of the manipulability against central differences and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import random_cell

from cellplan.geometry.transforms import pose_from, rotation_exp
from cellplan.model.task.task import Frame
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian
from cellplan.planning.tracking.secondary_goals import ManipulabilityGradient
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows
from cellplan.scene.kinematics.pinocchio_model import CombinedModel

H = 1e-5  # [rad] or [m]: central differences leave H^2 and eps / H times the condition, both below 1e-7


class Tasks:
    """The task rows of a random cell as a function of the configuration."""

    def __init__(self, cell, *, held: bool, moving=None) -> None:
        self.tasks = cell.tasks
        self.model, names = CombinedModel(cell), [robot.name for robot in cell.robots]
        self.operators = [names.index(task.robot) for task in cell.tasks]
        self.constraints = TaskConstraints.of(cell, cell.tasks, moving or names)
        self.signs = self.constraints.column_signs(self.model.carries_flange)
        X_PT = pose_from(rotation_exp(np.array([[0.3, -0.5, 0.9]])), np.zeros((1, 3)))  # where free spin looks along
        self.picks = [constraint_rows(task, X_PT)[0] for task in cell.tasks]
        on_part = np.array([float(task.relative_to is Frame.PART) for task in cell.tasks])
        self._gradient = ManipulabilityGradient(self.model, self.operators, 0 if held else None, on_part=on_part)

    def rows(self, q):
        state = self.model.state(q)
        X_WR = self.constraints.reference_frames(state.X_WP)
        blocks = cooperation_jacobian(state, state.X_WT[self.operators, :3, 3], self.signs, X_WR=X_WR)
        return np.concatenate([pick @ block for pick, block in zip(self.picks, blocks, strict=True)])

    def log_manipulability(self, q) -> float:
        J = self.rows(q)
        return 0.5 * float(np.linalg.slogdet(J @ J.T)[1])

    def gradient(self, q):
        state = self.model.state(q)
        return self._gradient.at(
            self.model.links(q).screws_W, state, J=self.rows(q), picks=self.picks, signs=self.signs
        )


def test_a_task_in_the_world_keeps_its_frame_while_the_part_turns() -> None:
    cell = random_cell(5, operators=3, joints=7)
    moved, *others = (replace(t, axes=(0, 1, 3, 5)) for t in cell.tasks)
    tasks = Tasks(replace(cell, tasks=(replace(moved, relative_to=Frame.WORLD), *others)), held=True)
    q = np.random.default_rng(5).uniform(-1.0, 1.0, cell.joint_count)

    expected = [
        (tasks.log_manipulability(q + H * e) - tasks.log_manipulability(q - H * e)) / (2 * H) for e in np.eye(len(q))
    ]
    np.testing.assert_allclose(tasks.gradient(q), expected, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("operators", [1, 2, 4])
@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
@pytest.mark.parametrize("held", [False, True], ids=["fixed", "held"])
@pytest.mark.parametrize("is_spin_free", [False, True], ids=["axes", "spin"])
def test_gradient_is_the_derivative_of_the_logarithm(operators, with_follower, held, is_spin_free) -> None:
    cell = random_cell(operators, operators=operators, joints=7, with_follower=with_follower, held=held)
    axes = (0, 2) if is_spin_free else (0, 1, 3, 5)
    cell = replace(cell, tasks=tuple(replace(t, axes=axes, is_spin_free=is_spin_free) for t in cell.tasks))
    tasks = Tasks(cell, held=held, moving=None if operators > 1 else ["op0"])
    q = np.random.default_rng(operators).uniform(-1.0, 1.0, cell.joint_count)

    gradient = tasks.gradient(q)

    expected = [
        (tasks.log_manipulability(q + H * e) - tasks.log_manipulability(q - H * e)) / (2 * H) for e in np.eye(len(q))
    ]
    np.testing.assert_allclose(gradient, expected, atol=1e-6 * np.abs(expected).max())


def test_whole_poses_have_the_same_gradient_in_every_frame() -> None:
    """With six rows a task's manipulability does not depend on the frame, so a turn of the part changes nothing."""
    cell = random_cell(5, operators=1, joints=7, held=False)
    q = np.random.default_rng(5).uniform(-1.0, 1.0, cell.joint_count)
    turned = replace(cell, part=replace(cell.part, X_WP=pose_from(rotation_exp(np.ones(3)), np.zeros(3))))
    np.testing.assert_allclose(Tasks(cell, held=False).gradient(q), Tasks(turned, held=False).gradient(q), atol=1e-10)


def test_more_rows_than_joints_have_no_gradient() -> None:
    cell = random_cell(6, operators=2, joints=3)
    q = np.random.default_rng(6).uniform(-1.0, 1.0, cell.joint_count)
    np.testing.assert_array_equal(Tasks(cell, held=True).gradient(q), 0.0)


def test_no_moving_joint_has_no_gradient() -> None:
    cell = random_cell(6, operators=2, joints=7)
    q = np.random.default_rng(6).uniform(-1.0, 1.0, cell.joint_count)
    tasks = Tasks(cell, held=True)
    tasks.signs = np.zeros_like(tasks.signs)
    np.testing.assert_array_equal(tasks.gradient(q), 0.0)
