"""The best-first search on the published examples of one arm, at singular configurations and in cooperative cells."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import make_task, random_cell
from builders.search_arms import (
    ANTHROPOMORPHIC,
    FOUR_LINKS,
    PUMA,
    arm_cell,
    dh_arm,
    followed,
    points_schedule,
    position_errors,
    quintic,
    schedule_of,
    tool_poses,
    turn_errors,
)

from cellplan.errors import DivergedError, InputError
from cellplan.geometry.transforms import inverse, pose_from, rotation_exp
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.origin import Origin
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain

BIG = 2 * np.cos(np.pi / 6)  # [m] the published 1.7320: reach of the arm at its start
BOTH = ["heuristic_search", "recursive_search"]
CELLS = {
    "two operators": (random_cell(31, operators=2, joints=7), "pose"),
    "fixed part": (random_cell(32, operators=1, joints=7, held=False), "pose"),
    "linkages": (random_cell(33, operators=2, joints=5, with_follower=True), "point"),
    "free spin": (random_cell(34, operators=1, joints=5), "axis"),
    "two axes": (random_cell(35, operators=1, joints=4), "two axes"),
}  # and what of the pose of each tool is constrained


def circle_through_shoulder(count):
    """[Nicolato2007]_ 4.1: a circle in the plane xz that meets the shoulder at half time, and starts at reach BIG."""
    times = np.linspace(0.0, 6.0, count)
    phi = 2 * np.pi * quintic(times)
    return times, 0.5 * BIG * np.stack([1 + np.cos(phi), 0 * phi, np.sin(phi)], axis=1)


@pytest.mark.slow
def test_circle_through_the_shoulder_singularity_is_followed_smoothly():
    cell = arm_cell(dh_arm(ANTHROPOMORPHIC), method="heuristic_search", tolerance_mm=4.5e-5)
    schedule = points_schedule(cell, *circle_through_shoulder(601))
    np.testing.assert_allclose(schedule.tasks[0].X_PT[300, :3, 3], 0.0, atol=1e-15)

    motion = followed(cell, schedule, [0.0, np.pi / 6, -np.pi / 3])

    assert position_errors(cell, schedule, motion).max() < 4.5e-8  # the published figure
    speeds = np.diff(motion.q, axis=0) / 0.01
    assert np.abs(np.diff(speeds, axis=0)).max() < 0.06  # [rad/s] from sample to sample at up to 2 rad/s: no jump
    assert motion.slack.max() == 0.0


def test_line_of_singular_points_only_is_followed():
    """[Nicolato2007]_ 4.1: the axis of the shoulder, from one side of the shoulder to the other."""
    cell = arm_cell(dh_arm(ANTHROPOMORPHIC), method="heuristic_search")
    times = np.linspace(0.0, 5.0, 501)
    points = np.zeros((501, 3))
    points[:, 2] = BIG * (1 - 2 * quintic(times))
    schedule = points_schedule(cell, times, points)
    motion = followed(cell, schedule, [np.pi / 9, np.pi / 3, np.pi / 3])
    assert position_errors(cell, schedule, motion).max() <= 1e-7
    assert np.abs(np.diff(motion.q, axis=0)).max() / 0.01 < 4.0  # [rad/s]


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize(
    ("configuration", "goal"), [([0, 0, 0, 0], 0.799), ([0, 0, 0, 0], 0.75), ([0.4] * 1 + [0] * 3, 0.79)]
)
def test_stretched_arm_gets_away_towards_a_goal_on_its_own_line(method, configuration, goal):
    """The only singular situation (3.2.2): no joint alone can gain anything."""
    cell = arm_cell(dh_arm(FOUR_LINKS), method=method, axes=(0, 1))
    start = np.array(configuration, dtype=float)
    points = goal * np.tile([np.cos(start[0]), np.sin(start[0]), 0.0], (2, 1))
    schedule = points_schedule(cell, np.array([0.0, 1.0]), points)
    motion = followed(cell, schedule, start)
    assert position_errors(cell, schedule, motion).max() <= 1e-7
    assert motion.slack[0] == 0.0


@pytest.mark.parametrize("method", BOTH)
def test_goal_out_of_reach_is_approached_and_what_is_missing_is_reported(method):
    """The nearest configuration of a stretched arm is the stretched arm itself."""
    cell = arm_cell(dh_arm(FOUR_LINKS), method=method, axes=(0, 1), rounds=300)
    schedule = points_schedule(cell, np.array([0.0, 0.5]), np.tile([0.9, 0.0, 0.0], (2, 1)))
    motion = followed(cell, schedule, [0.1, -0.2, 0.1, 0.1])
    assert position_errors(cell, schedule, motion)[0] == pytest.approx(0.1, abs=1e-4)
    assert motion.slack[0] == pytest.approx(0.1 / 0.5, abs=1e-3)
    assert motion.iterations[0] <= 300


@pytest.mark.parametrize("method", BOTH)
def test_pose_of_a_puma_is_tracked(method):
    """[Nicolato2007]_ 4.3: tolerance 1e-8, gamma 0.01; the poses are those of the printed joint values."""
    model = dh_arm(PUMA)
    cell = arm_cell(model, method=method, axes=range(6), tolerance_mm=1e-5, orientation_weight_m2=0.01)
    start = np.array([np.pi / 4, np.pi / 4, np.pi / 3, np.pi / 3, np.pi / 3, np.pi / 5])
    ends = np.array([start, [np.pi / 3, np.pi / 3, np.pi / 4, 3 * np.pi / 4, np.pi / 4, 2 * np.pi / 3]])
    first, last = tool_poses(cell, ends)
    times = np.linspace(0.0, 2.0, 101)
    share = quintic(times)[:, None]
    turn = np.array(rotation_log(last[:3, :3] @ first[:3, :3].T))
    X = pose_from(rotation_exp(share * turn) @ first[:3, :3], first[:3, 3] + share * (last - first)[:3, 3])
    schedule = schedule_of(cell, times, X)

    motion = followed(cell, schedule, start)

    assert position_errors(cell, schedule, motion).max() <= 1e-8
    assert turn_errors(cell, schedule, motion).max() <= 1e-7  # 1e-8 / sqrt(2 gamma)
    np.testing.assert_allclose(tool_poses(cell, motion.q[-1:])[0], last, atol=1e-7)


def rotation_log(R):
    angle = np.arccos(0.5 * (np.trace(R) - 1))
    return angle / (2 * np.sin(angle)) * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])


@pytest.mark.parametrize("method", BOTH)
def test_sliding_joints_take_part(method):
    """An arm of two turns and a slide (cylinder coordinates with a lift)."""
    model = dh_arm([(0.0, 0.0, 0.3), (0.0, -np.pi / 2, 0.2), (0.0, 0.0, 0.5)], slides=(1, 2))
    cell = arm_cell(model, method=method)
    start = np.array([0.3, 0.1, 0.2])
    at = tool_poses(cell, start[None])[0, :3, 3]
    times = np.linspace(0.0, 1.0, 51)
    phi = 2 * np.pi * quintic(times)
    points = at + 0.1 * np.stack([np.cos(phi) - 1, np.sin(phi), np.sin(2 * phi)], axis=1)
    schedule = points_schedule(cell, times, points)
    motion = followed(cell, schedule, start)
    assert position_errors(cell, schedule, motion).max() <= 1e-7


def relative(cell, task, q):
    X_WT = ScrewChain(cell.robot(task.robot)).tool_poses(q[:, cell.columns(task.robot)])
    if not cell.part.held_by:
        return inverse(cell.part.X_WP) @ X_WT
    X_WH = ScrewChain(cell.robot("holder")).tool_poses(q[:, cell.columns("holder")])
    return inverse(X_WH @ inverse(cell.part.held_by[0].X_PT)) @ X_WT


def wave_schedule(cell, start, count=16):
    """A small loop and a small turn of every tool on the part, from where it starts."""
    times = np.linspace(0.0, 2.0, count)
    phi = 2 * np.pi * quintic(times)
    tasks = []
    for task in cell.tasks:
        X = relative(cell, task, start[None])[0]
        turn = 0.03 * np.stack([np.sin(phi), 0 * phi, 1 - np.cos(phi)], axis=1)
        offset = 0.006 * np.stack([np.cos(phi) - 1, np.sin(phi), 0 * phi], axis=1)
        X_PT = pose_from(rotation_exp(turn) @ X[:3, :3], X[:3, 3] + offset)
        tasks.append(
            TaskSchedule(task=task, X_PT=X_PT, V_PT_P=np.zeros((count, 6)), travelled=times, length=1.0, end=times[-1])
        )
    return Schedule(times=times, tasks=tuple(tasks))


@pytest.mark.parametrize(
    ("cell", "component", "method"),
    [
        pytest.param(*case, method, id=f"{name}-{method}", marks=marks)
        for name, case in CELLS.items()
        for method, marks in [
            ("heuristic_search", pytest.mark.slow if name == "two operators" else ()),
            ("recursive_search", ()),
        ]
    ],
)
def test_all_tools_of_a_cell_are_brought_to_their_place_on_the_part(cell, component, method):
    """What is constrained is reached; the relative pose is taken from the chains that the checks use."""
    changes = {
        "pose": {},
        "point": {"axes": (0, 1, 2)},
        "axis": {"axes": (0, 1, 2), "is_spin_free": True},
        "two axes": {"axes": (0, 1)},
    }[component]
    tasks = tuple(make_task(task.robot, **changes) for task in cell.tasks)
    cell = replace(cell, tasks=tasks, solver=cell.solver.changed(method=method))
    start = np.random.default_rng(3).uniform(-0.5, 0.5, cell.joint_count)
    schedule = wave_schedule(cell, start)

    motion = integrate_schedule(MotionTask(cell, schedule, [robot.name for robot in cell.robots], start))

    for scheduled in schedule.tasks:
        actual = relative(cell, scheduled.task, motion.q)[1:]
        gap = (scheduled.X_PT[1:] - actual)[:, :3]
        axes = [axis for axis in scheduled.task.axes if axis < 3]
        assert np.linalg.norm(gap[:, axes, 3], axis=1).max() <= 1e-7
        if component == "pose":
            assert np.abs(gap[:, :, :3]).max() <= 1e-6  # 1e-7 / sqrt(gamma)
        if component == "axis":
            assert np.abs(gap[:, :, 2]).max() <= 1e-6


@pytest.mark.parametrize("method", BOTH)
def test_planar_turn_alone_is_reached(method):
    """x, y and the turn about z of a planar arm; a tilt that no joint can touch does not count."""
    cell = arm_cell(dh_arm(FOUR_LINKS), method=method, axes=(0, 1, 5))
    start = np.array([0.3, 0.5, 0.4, -0.3])
    X = tool_poses(cell, start[None])[0]
    times = np.linspace(0.0, 1.0, 21)
    share = quintic(times)
    R = rotation_exp(share[:, None] * [0.0, 0.0, 0.5]) @ X[:3, :3] @ rotation_exp(np.array([0.3, 0.0, 0.0]))
    schedule = schedule_of(cell, times, pose_from(R, X[:3, 3] + share[:, None] * [-0.05, 0.02, 0.0]))
    motion = followed(cell, schedule, start)
    assert position_errors(cell, schedule, motion).max() <= 1e-7
    actual = tool_poses(cell, motion.q)
    E = schedule.tasks[0].X_PT[:, :3, :3] @ np.swapaxes(actual[:, :3, :3], 1, 2)
    assert np.abs(E[1:, 1, 0] - E[1:, 0, 1]).max() <= 4e-6  # twice the sine of the turn left; 1e-7 / sqrt(gamma)


@pytest.mark.parametrize("method", BOTH)
@pytest.mark.parametrize("axes", [(0, 1, 5), (0, 1, 2, 3, 4)])
def test_rotations_that_cannot_be_taken_apart_are_refused_with_their_place(method, axes):
    cell = arm_cell(dh_arm(PUMA), method=method, axes=axes)
    origin = Origin(file="cell.yaml", lines={"tasks.task_arm.axes": 14})
    cell = replace(cell, tasks=tuple(replace(task, origin=origin) for task in cell.tasks))
    X = tool_poses(cell, np.full((1, 6), 0.5))
    schedule = schedule_of(cell, np.array([0.0, 1.0]), np.tile(X, (2, 1, 1)))
    with pytest.raises(InputError, match=rf"^cell\.yaml:14: tasks\.task_arm\.axes: method '{method}' expected all of"):
        followed(cell, schedule, np.full(6, 0.5))


@pytest.mark.parametrize("method", BOTH)
def test_joints_stay_inside_their_position_limits_and_locked_ones_where_they_are(method):
    model = dh_arm(FOUR_LINKS, limits={3: (0.70, 0.80)})
    cell = arm_cell(model, method=method, axes=(0, 1))
    cell = replace(cell, motion=replace(cell.motion, locked=(LockedJointEntry(robot="arm", joint="j1", from_s=0.5),)))
    start = np.array([np.pi / 4, np.pi / 6, np.pi / 2, np.pi / 4])
    at = tool_poses(cell, start[None])[0, :3, 3]
    times = np.linspace(0.0, 1.0, 101)
    phi = 2 * np.pi * times
    schedule = points_schedule(cell, times, at + 0.08 * np.stack([np.cos(phi) - 1, np.sin(phi), 0 * phi], axis=1))
    motion = followed(cell, schedule, start)
    assert position_errors(cell, schedule, motion).max() <= 1e-7
    assert 0.70 <= motion.q[:, 3].min() < 0.701
    assert motion.q[:, 3].max() <= 0.80
    assert np.ptp(motion.q[50:, 0]) == 0.0 < np.ptp(motion.q[:50, 0])


@pytest.mark.parametrize("method", BOTH)
def test_lost_path_is_refused_by_name(method):
    cell = arm_cell(dh_arm(FOUR_LINKS), method=method, axes=(0, 1), rounds=20)
    points = np.zeros((3, 3))
    points[:, 0] = [0.7, 3.0, 3.0]
    schedule = points_schedule(cell, np.array([0.0, 0.1, 0.2]), points)
    with pytest.raises(DivergedError, match=r"at 0\.100 s the tool of 'arm' is \d+ mm from task 'task_arm'"):
        followed(cell, schedule, [0.2, -0.2, 0.3, 0.4])


def test_same_input_gives_the_same_motion():
    cell = random_cell(32, operators=1, joints=7, held=False)
    cell = replace(cell, solver=cell.solver.changed(method="heuristic_search"))
    start = np.random.default_rng(3).uniform(-0.5, 0.5, cell.joint_count)
    schedule = wave_schedule(cell, start)
    first, second = (integrate_schedule(MotionTask(cell, schedule, ["op0"], start)) for _ in range(2))
    np.testing.assert_array_equal(first.q, second.q)


def test_joints_that_move_no_tool_stay_where_they_are():
    """The tip of this arm is the centre of its wrist: rounding alone would turn the last three joints by any angle."""
    cell = arm_cell(dh_arm(PUMA), method="heuristic_search", axes=(0, 1, 2))
    start = np.array([0.3, -0.9, 0.4, 0.2, 0.0, 0.1])
    at = tool_poses(cell, start[None])[0, :3, 3]
    times = np.arange(21) * 2e-3
    schedule = points_schedule(cell, times, at + np.linspace(0.0, 0.01, 21)[:, None] * [1.0, 0.0, 0.0])
    motion = followed(cell, schedule, start)
    assert np.ptp(motion.q[:, 3:], axis=0).max() == 0.0
    assert position_errors(cell, schedule, motion).max() <= cell.solver.search.tolerance_mm.si
