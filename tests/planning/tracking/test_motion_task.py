"""References of a motion task; closures against the derivative of an independent kinematics, in each mode."""

from dataclasses import replace

import numpy as np
import pytest
from builders.jacobian_cells import planners_jacobian
from builders.random_cells import carried, moved, random_cell, random_pose, sharing

from cellplan.errors import DivergedError, InputError
from cellplan.geometry.transforms import inverse, rotation_vector
from cellplan.model.cell.cell import Grasp, Mode
from cellplan.model.motion.motion import Schedule
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.task.task import Frame
from cellplan.planning.modes import plan_phases
from cellplan.planning.tracking.motion_task import MotionTask, closures, locked_since
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.scene.kinematics.screw_chain import ScrewChain

DERIVATIVE_TOL = 1e-6  # relative; central differences with h = 1e-5 leave h^2 and eps / h, both near 1e-10
H = 1e-5
STILL = Schedule(times=np.arange(4) * 1e-3, tasks=())


def relative_poses(cell, q):
    """Tools on the part, or in the world, by screw displacements: shares no code with the planner's kinematics."""
    poses = {r.name: ScrewChain(r).tool_poses(q[None, cell.columns(r.name)])[0] for r in cell.robots}
    X_PW = cell.part.held_by[0].X_PT @ inverse(poses["holder"])
    in_world = [relation.relative_to is Frame.WORLD for relation in cell.relations]
    return np.stack(
        [poses[r.robot] if world else X_PW @ poses[r.robot] for r, world in zip(cell.relations, in_world, strict=True)]
    )


def central_differences(cell, q):
    columns = []
    R_T = np.swapaxes(relative_poses(cell, q)[:, :3, :3], 1, 2)
    for j in range(cell.joint_count):
        step = H * np.eye(cell.joint_count)[j]
        ahead, behind = relative_poses(cell, q + step), relative_poses(cell, q - step)
        linear = (ahead - behind)[:, :3, 3] / (2 * H)
        angular = rotation_vector(ahead[:, :3, :3] @ R_T) - rotation_vector(behind[:, :3, :3] @ R_T)
        columns.append(np.concatenate([linear, angular / (2 * H)], axis=1))
    return np.stack(columns, axis=2)


@pytest.mark.parametrize("holders", [1, 2, 3])
@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_rows_of_closures_and_of_carrying_are_the_derivative_of_the_poses(holders, with_follower):
    cell = carried(sharing(random_cell(holders, operators=holders + 1, with_follower=with_follower), holders))
    q = np.random.default_rng(holders).uniform(-1.5, 1.5, cell.joint_count)

    J = planners_jacobian(cell, q)

    expected = central_differences(cell, q)
    assert [relation.name for relation in cell.relations[-holders:]] == [f"op{i}@part" for i in range(1, holders + 1)]
    assert np.abs(J - expected).max() <= DERIVATIVE_TOL * np.abs(expected).max()


def test_moving_the_whole_cell_changes_no_row_of_a_closure():
    cell = sharing(random_cell(41, operators=3), 2)
    q = np.random.default_rng(2).uniform(-1.5, 1.5, cell.joint_count)

    elsewhere = moved(cell, random_pose(np.random.default_rng(3)))

    np.testing.assert_allclose(planners_jacobian(elsewhere, q), planners_jacobian(cell, q), atol=1e-12)


def test_the_reference_of_a_closure_is_its_grasp_at_all_times_without_twist():
    cell = sharing(random_cell(42, operators=2), 1, axes=(0, 1, 5))

    motion = MotionTask(cell, STILL, ("holder", "op1"), np.zeros(cell.joint_count))
    (relation,), (X_PT, V_PT_P) = motion.relations, motion.references()

    assert isinstance(relation, Grasp)
    assert relation.axes == (0, 1, 5)
    assert not V_PT_P.any()
    np.testing.assert_array_equal(X_PT[:, 0], np.broadcast_to(cell.part.held_by[1].X_PT, (4, 4, 4)))


def test_only_the_kept_components_of_a_closure_become_rows():
    cell = sharing(random_cell(43, operators=2), 2, axes=(0, 1, 5))
    q = np.random.default_rng(4).uniform(-1.5, 1.5, cell.joint_count)
    motion = MotionTask(cell, STILL, tuple(robot.name for robot in cell.robots), np.zeros(cell.joint_count))
    references = np.broadcast_to(relative_poses(cell, q), motion.references()[0].shape)

    with pytest.raises(DivergedError, match="from its grasp on the part"):
        TrackingProblem(motion).first_order(0, q)
    tasks = TrackingProblem(motion, references=references).first_order(0, q)

    np.testing.assert_allclose(tasks.J, planners_jacobian(cell, q)[:, [0, 1, 5]].reshape(6, -1), atol=1e-12)
    assert np.abs(tasks.error).max() < 1e-12


def in_mode(cell, mode):
    return replace(cell, motion=replace(cell.motion, mode=mode))


@pytest.mark.parametrize(
    ("mode", "moving"),
    [
        (Mode.SIMULTANEOUS, [{"holder", "op1", "op2", "op0"}]),
        (Mode.PAIRWISE, [{"holder", "op1", "op2", "op0"}, {"holder", "op1", "op2"}]),
    ],
)
def test_all_holders_move_in_every_run(mode, moving):
    cell = in_mode(carried(sharing(random_cell(44, operators=3), 2)), mode)
    assert [set(run.moving) for run in plan_phases(cell).program] == moving
    assert all(len(closures(cell, run.moving)) == 2 for run in plan_phases(cell).program)


def test_no_holder_moves_with_the_part_at_rest():
    cell = in_mode(sharing(random_cell(45, operators=3), 2), Mode.PART_AT_REST)
    (run,) = plan_phases(cell).program
    assert run.moving == ("op0",)
    assert closures(cell, run.moving) == ()


def test_the_part_cannot_be_carried_while_it_is_to_rest():
    cell = in_mode(carried(random_cell(46, operators=1)), Mode.PART_AT_REST)
    with pytest.raises(InputError) as caught:
        plan_phases(cell)
    assert str(caught.value) == (
        "<cell>: tasks.task_holder.robot: expected a robot that does not hold the part in the mode part_at_rest, got "
        "the positioner 'holder'; choose another mode or leave the task out"
    )
    assert plan_phases(cell, only="task_op0").program[0].moving == ("op0",)


def test_each_joint_stands_still_from_its_earliest_instant_on() -> None:
    cell = random_cell(1, operators=2)
    locks = (
        LockedJointEntry(robot="op1", joint="j2", from_s=0.7),
        LockedJointEntry(robot="op1", joint="j2", from_s=0.4),
        LockedJointEntry(robot="holder", joint="j0", from_s=0.0),
    )

    since = locked_since(replace(cell, motion=replace(cell.motion, locked=locks)))

    assert since[cell.columns("op1").start + 2] == 0.4
    assert since[0] == 0.0
    assert np.isinf(since).sum() == cell.joint_count - 2
    assert np.all(np.isinf(locked_since(cell)))
