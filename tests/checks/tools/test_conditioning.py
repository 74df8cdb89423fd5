"""Singular values of the report against the planner's matrix, and against the derivative of the tool poses."""

import numpy as np
import pytest
from builders.jacobian_cells import planners_jacobian
from builders.random_cells import carried, make_task, random_cell, sharing

from cellplan.checks.tools.conditioning import conditioning
from cellplan.measures.tool_errors import part_poses
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

N = 5


def planners_values(cell, schedule, q, moving):
    model = CombinedModel(cell)
    names = [r.name for r in cell.robots]
    tasks = [scheduled.task for scheduled in schedule.tasks]
    signs = TaskConstraints.of(cell, tasks, moving).column_signs(model.carries_flange)
    values = []
    for k in range(N):
        state = model.state(q[k])
        p_WT = state.X_WT[[names.index(t.robot) for t in tasks], :3, 3]
        J = cooperation_jacobian(state, p_WT, signs)
        rows = [constraint_rows(s.task, s.X_PT)[k] for s in schedule.tasks]
        stacked = np.concatenate([pick @ block for pick, block in zip(rows, J, strict=True)])
        active = stacked[:, np.abs(stacked).max(axis=0) > 0]
        values.append(np.linalg.svd(active, compute_uv=False)[-1] if active.shape[1] >= len(stacked) else 0.0)
    return np.array(values)


def still_scheduled(tasks, chains, by_name, X_WP):
    """A schedule that wants every tool where it is."""
    scheduled = tuple(
        TaskSchedule(
            task=task,
            X_PT=np.linalg.inv(X_WP) @ chains[task.robot].tool_poses(by_name[task.robot]),
            V_PT_P=np.zeros((len(X_WP), 6)),
            travelled=np.zeros(len(X_WP)),
            length=1.0,
            end=1.0,
        )
        for task in tasks
    )
    return Schedule(times=np.arange(len(X_WP)) * 1e-3, tasks=scheduled)


@pytest.mark.parametrize("options", [{}, {"is_spin_free": True}, {"axes": (0, 1, 5)}], ids=["whole", "spin", "planar"])
@pytest.mark.parametrize("at_rest", [False, True])
def test_smallest_singular_value_of_the_stack(options, at_rest):
    cell = random_cell(21, operators=2, with_follower=True)
    tasks = [make_task(task.robot, **options) for task in cell.tasks]
    q = np.random.default_rng(0).uniform(-1, 1, (N, cell.joint_count))
    chains = {r.name: ScrewChain(r) for r in cell.robots}
    by_name = {r.name: q[:, cell.columns(r.name)] for r in cell.robots}
    X_WP = part_poses(cell, chains, by_name)
    schedule = still_scheduled(tasks, chains, by_name, X_WP)
    moving = [t.robot for t in tasks] if at_rest else [r.name for r in cell.robots]

    measures = conditioning(cell, schedule, chains, q=by_name, X_WP=X_WP, moving=moving)

    np.testing.assert_allclose(measures.stack, planners_values(cell, schedule, q, moving), atol=1e-12)
    assert ("holder" in measures.robots) is not at_rest


@pytest.mark.parametrize("axes", [(0, 1, 2, 3, 4, 5), (0, 1, 5)], ids=["whole", "planar"])
def test_the_stack_holds_the_closures_of_further_holders_and_the_path_of_the_part(axes):
    cell = carried(sharing(random_cell(22, operators=3), 1, axes=axes))
    q = np.random.default_rng(1).uniform(-1, 1, (N, cell.joint_count))
    chains = {r.name: ScrewChain(r) for r in cell.robots}
    by_name = {r.name: q[:, cell.columns(r.name)] for r in cell.robots}
    scheduled = tuple(
        TaskSchedule(
            task=task,
            X_PT=np.broadcast_to(np.eye(4), (N, 4, 4)),
            V_PT_P=np.zeros((N, 6)),
            travelled=np.zeros(N),
            length=1.0,
            end=1.0,
        )
        for task in cell.tasks
    )
    schedule = Schedule(times=np.arange(N) * 1e-3, tasks=scheduled)
    names = [r.name for r in cell.robots]

    measures = conditioning(cell, schedule, chains, q=by_name, X_WP=part_poses(cell, chains, by_name), moving=names)

    for k in range(N):
        J = planners_jacobian(cell, q[k])
        stack = np.concatenate([J[:-1].reshape(-1, cell.joint_count), J[-1][list(axes)]])
        assert measures.stack[k] == pytest.approx(np.linalg.svd(stack, compute_uv=False)[-1], abs=1e-12)
        columns = J[-1][list(axes)][:, cell.columns("op2")]
        assert measures.robots["op2"][k] == pytest.approx(
            np.linalg.svd(columns, compute_uv=False)[len(axes) - 1], abs=1e-12
        )
    assert set(measures.robots) == set(names)
    assert all(len(series) == N for series in measures.robots.values())


NUDGE = 1e-5  # [rad]: central differences are then good to about 1e-10


def poses_in_part(cell, chains, tasks, q):
    """Tool poses seen from the part, shape (tasks, 4, 4), from chains of screws alone."""
    by_name = {r.name: q[None, cell.columns(r.name)] for r in cell.robots}
    X_PW = np.linalg.inv(part_poses(cell, chains, by_name))[0]
    return np.array([X_PW @ chains[task.robot].tool_poses(by_name[task.robot])[0] for task in tasks])


def jacobian_by_differences(cell, chains, tasks, q):
    """Twists of all tools relative to the part, in P, by central differences of their poses, shape (6 tasks, nq)."""
    X = poses_in_part(cell, chains, tasks, q)
    columns = []
    for joint in range(cell.joint_count):
        step = NUDGE * np.eye(cell.joint_count)[joint]
        rate = poses_in_part(cell, chains, tasks, q + step) - poses_in_part(cell, chains, tasks, q - step)
        rate /= 2.0 * NUDGE
        spin = rate[:, :3, :3] @ np.swapaxes(X[:, :3, :3], 1, 2)
        turn = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        columns.append(np.concatenate([rate[:, :3, 3], turn], axis=1).ravel())
    return np.array(columns).T


def measured(cell, tasks, q):
    """What the report says at the configurations q, shape (N, nq), with all robots free to move."""
    chains = {r.name: ScrewChain(r) for r in cell.robots}
    by_name = {r.name: q[:, cell.columns(r.name)] for r in cell.robots}
    X_WP = part_poses(cell, chains, by_name)
    schedule = still_scheduled(tasks, chains, by_name, np.broadcast_to(X_WP, (len(q), 4, 4)))
    return conditioning(cell, schedule, chains, q=by_name, X_WP=X_WP, moving=[r.name for r in cell.robots])


@pytest.mark.parametrize("operators", [1, 2, 3])
def test_manipulability_and_condition_follow_from_the_derivative_of_the_tool_poses(operators):
    cell = random_cell(8, operators=operators)
    tasks = [make_task(task.robot) for task in cell.tasks]
    q = np.random.default_rng(1).uniform(-1, 1, (3, cell.joint_count))
    chains = {r.name: ScrewChain(r) for r in cell.robots}

    measures = measured(cell, tasks, q)

    for k, configuration in enumerate(q):
        J = jacobian_by_differences(cell, chains, tasks, configuration)
        squares = np.linalg.eigvalsh(J @ J.T)  # in rising order: squared singular values, by another way
        assert measures.manipulability[k] == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)), rel=1e-6)
        assert measures.squared_condition[k] == pytest.approx(squares[0] / squares[-1], rel=1e-6)
        assert measures.condition[k] == pytest.approx(np.sqrt(squares[0] / squares[-1]), rel=1e-6)
        assert measures.stack[k] == pytest.approx(np.sqrt(squares[0]), rel=1e-6)


def test_with_more_rows_than_joints_everything_is_singular():
    cell = random_cell(3, operators=2, joints=3)  # 12 rows, 9 joints

    measures = measured(cell, list(cell.tasks), np.random.default_rng(2).uniform(-1, 1, (N, 9)))

    for values in (measures.stack, measures.condition, measures.squared_condition, measures.manipulability):
        np.testing.assert_array_equal(values, np.zeros(N))
