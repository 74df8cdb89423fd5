"""Targets on the part: the frames in the files put the tool where the joints do, and the joints are found again."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import closed_form, tip, wide
from builders.export_jobs import NAMES
from builders.rapid_jobs import multimove_cell, part_cell, part_job
from builders.rapid_rules import rules_broken
from builders.scene_builders import arm_model, fixed_part, placed

from cellplan.errors import InputError, NotVerifiedError
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import Array, pose_from, quaternion_to_rotation, rotation_exp
from cellplan.model.report.exported import ExportJob, ProgramRows
from cellplan.programs.elements.conventions import quaternions
from cellplan.programs.formats.rapid.targets import configuration
from cellplan.programs.formats.rapid.writer import RAPID
from cellplan.programs.rows.part_targets import joints_of_part_poses, with_part_poses

MM = 1000.0
WRITTEN = 3e-7  # [m] rounding of four decimals of a millimetre, and of seven of a quaternion at a metre
AWAY = 1.8e-6  # [rad] two units of the fourth decimal of a degree, by which joint targets are rounded at the most
TURN_TOL = 1e-3  # [rad] or [m] that rounding moves a joint, where an arm of these is nearly stretched
TASK_OF = {NAMES[0]: "T_ROB1", NAMES[1]: "T_ROB2", NAMES[2]: "T_ROB3"}


def filled(job: ExportJob) -> ExportJob:
    return replace(job, programs=with_part_poses(job.frame, job.programs))


def frame_of(text: str) -> Array:
    """A frame ``[x,y,z],[w,x,y,z]`` of a file in [m]."""
    place, turn = (
        np.array([float(number) for number in part.split(",")]) for part in re.findall(r"\[([^\[\]]*)\]", text)
    )
    return pose_from(quaternion_to_rotation(turn), place / MM)


@pytest.mark.parametrize("name", NAMES[:2])
def test_frames_of_the_files_put_the_tool_where_the_joints_do(name: str) -> None:
    """Flange of the unit in the world, object frame, target: each is read from the text here."""
    job = filled(part_job(process=False))
    cell, rows = job.frame.cell, job.programs[0].robots
    text = RAPID.render(job)[f"{name}.mod"]
    frames = re.search(r'"STN_3",\[(\[.*?\],\[.*?\])\],\[(\[.*?\],\[.*?\])\]\]', text)
    assert frames is not None
    bare = replace(cell.robot(NAMES[2]), tool=placed("x", arm_model()).tool)

    targets = re.findall(r"MoveL \[(\[[^\]]*\],\[[^\]]*\]),", text)

    assert len(targets) == len(rows[name]) - 1
    np.testing.assert_array_equal(frame_of(frames[1]), np.eye(4))
    for row, target in enumerate(targets, start=1):
        X_WT = tip(bare, rows[NAMES[2]].q[row]) @ frame_of(frames[2]) @ frame_of(target)
        np.testing.assert_allclose(X_WT, tip(cell.robot(name), rows[name].q[row]), rtol=0.0, atol=3.0 * WRITTEN)


@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 6))])
@pytest.mark.parametrize("process", [False, True])
def test_joints_are_found_again(seed: int, process: bool) -> None:
    job = filled(part_job(rows=40, seed=seed, process=process, step=0.002))

    files = RAPID.render(job)
    joints = joints_of_part_poses(job.frame, job.programs, RAPID.read(job.frame, files))

    assert rules_broken(files, TASK_OF) == []
    cell, written = job.frame.cell, job.programs[0].robots
    for name, rows in joints[0].robots.items():
        robot = cell.robot(name)
        assert np.abs(rows.q - written[name].q).max() < TURN_TOL
        X_CP = cell.part.X_CP
        for row in range(0, len(rows), 5):  # the pose on the part, from joints that were found and that were written
            poses = [
                np.linalg.inv(tip(cell.robot(NAMES[2]), entry[NAMES[2]].q[row]) @ X_CP) @ tip(robot, entry[name].q[row])
                for entry in (joints[0].robots, written)
            ]
            np.testing.assert_allclose(poses[0], poses[1], rtol=0.0, atol=6.0 * AWAY)


def test_rows_that_are_far_apart_are_no_straight_lines() -> None:
    """Half a chord of a turn of 0.2 rad at a metre is off by 5 mm in the middle."""
    job = filled(part_job(rows=6, process=False, step=0.2))

    with pytest.raises(NotVerifiedError, match="a straight line to its target on the part is off the motion"):
        joints_of_part_poses(job.frame, job.programs, RAPID.read(job.frame, RAPID.render(job)))


def test_rows_out_of_process_are_stated_as_joints() -> None:
    job = filled(part_job(rows=20))  # in process from row 5 to row 10

    text = RAPID.render(job)[f"{NAMES[0]}.mod"]
    read = RAPID.read(job.frame, RAPID.render(job))[0].robots[NAMES[0]]

    moves = re.findall(r"    (Move\w+) ", text)
    assert [k for k, move in enumerate(moves) if move == "MoveL"] == [6, 7, 8, 9, 10]
    assert read.X_PT is not None
    assert np.flatnonzero(np.isfinite(read.X_PT[:, 0, 0])).tolist() == [6, 7, 8, 9, 10]
    assert np.flatnonzero(np.isnan(read.q[:, 0])).tolist() == [6, 7, 8, 9, 10]


def test_another_configuration_is_not_that_of_the_joints() -> None:
    job = filled(part_job(rows=8, process=False))
    files = RAPID.render(job)
    path = f"{NAMES[0]}.mod"
    number = re.search(r"MoveL .*?,(\d)\],\[9E9", files[path])
    assert number is not None
    other = files[path][: number.start(1)] + str(int(number[1]) ^ 4) + files[path][number.end(1) :]

    read = RAPID.read(job.frame, {**files, path: other})

    with pytest.raises(NotVerifiedError, match="robot 'alpha': row 1: expected configuration"):
        joints_of_part_poses(job.frame, job.programs, read)


def test_another_place_is_not_met_by_the_joints() -> None:
    job = filled(part_job(rows=8, process=False))
    files = RAPID.render(job)
    path = f"{NAMES[0]}.mod"
    other = re.sub(r"(MoveL \[\[-?\d+)", r"\g<1>7", files[path], count=1)

    read = RAPID.read(job.frame, {**files, path: other})

    with pytest.raises(NotVerifiedError, match="robot 'alpha': row 1: its target on the part is not met"):
        joints_of_part_poses(job.frame, job.programs, read)


@pytest.mark.parametrize(
    ("degrees", "expected"),
    [
        ((10, 0, 0, 10, 30, 10), (0, 0, 0, 0)),
        ((-10, 0, 0, 100, 30, 190), (-1, 1, 2, 0)),
        ((10, 0, 0, -100, -30, -350), (0, -2, -4, 1)),
        ((90, 0, 0, 0, 30, -90), (1, 0, -1, 0)),  # an edge belongs to the quarter above it
        ((10, 0, -100, 10, 30, 10), (0, 0, 0, 2)),  # the forearm is folded back over the lower arm
        ((10, -100, 0, 10, 30, 10), (0, 0, 0, 4)),  # the whole arm bent over backwards, its wrist below
    ],
)
def test_configuration_of_an_arm(degrees: tuple[float, ...], expected: tuple[int, ...]) -> None:
    """The lower arm stands upright at zero, 0.6 m long, the forearm points forward, 0.6 m to the wrist."""
    result = configuration(wide("arm"), np.deg2rad([degrees]))[0]

    assert tuple(result[:3]) == expected[:3]
    lean, bend = np.deg2rad(degrees[1]), np.deg2rad(degrees[1] + degrees[2])
    forward = 0.6 * np.sin(lean) + 0.6 * np.cos(bend)
    is_behind = np.sin(np.deg2rad(degrees[2]) + 0.5 * np.pi) < 0.0  # of the lower arm: the forearm is folded over it
    assert result[3] == 4 * (forward < 0.0) + 2 * is_behind + (degrees[4] < 0)


def test_the_eight_ways_to_a_pose_have_eight_numbers() -> None:
    """Shoulder, elbow and wrist of the same tool pose the one way or the other, in closed form for this arm."""
    robot = wide("arm")
    target = tip(robot, np.array([0.4, 0.3, 0.5, 0.7, 0.9, -0.4]))
    signs = [(shoulder, elbow, wrist) for shoulder in (1, -1) for elbow in (1, -1) for wrist in (1, -1)]

    solutions = np.array([closed_form(robot, target, *sign) for sign in signs])

    for q in solutions:
        np.testing.assert_allclose(tip(robot, q), target, rtol=0.0, atol=1e-12)
    assert sorted(configuration(robot, solutions)[:, 3].tolist()) == list(range(8))


def test_quaternions_turn_back_into_their_rotations() -> None:
    rng = np.random.default_rng(3)
    axes = rng.normal(size=(400, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.concatenate([rng.uniform(0.0, 2.0 * np.pi, 390), np.full(10, np.pi)])
    R = rotation_exp(axes * angles[:, None])

    turned_back = quaternions(R)

    np.testing.assert_allclose(quaternion_to_rotation(turned_back), R, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(turned_back, axis=1), 1.0, atol=1e-14)
    assert np.all(np.sum(turned_back[1:] * turned_back[:-1], axis=1) >= 0.0)


# What cannot be written


def refusal(job: ExportJob) -> str:
    with pytest.raises(InputError) as caught:
        with_part_poses(job.frame, job.programs)
    return str(caught.value)


def test_a_part_that_no_robot_holds_is_refused() -> None:
    job = part_job()
    cell = replace(job.frame.cell, part=fixed_part(Box((0.1, 0.1, 0.1)), np.eye(4)))

    assert refusal(replace(job, frame=replace(job.frame, cell=cell))) == (
        "--moves linear: expected a part that a robot holds, got one that is fixed in the world"
    )


def test_a_holder_that_is_not_exported_is_refused() -> None:
    job = part_job()

    text = refusal(replace(job, frame=replace(job.frame, robots=NAMES[:2])))

    assert text == "--moves linear: expected 'gamma', which holds the part, among the exported robots"


def test_a_cell_without_a_task_on_the_part_is_refused() -> None:
    job = part_job()

    text = refusal(replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, tasks=()))))

    assert text == "--moves linear: expected a robot with an arm and a task on the part, got none"


@pytest.mark.parametrize(
    ("place", "changes", "words"),
    [
        (5, {"point_B": np.array([0.7, 0.0, 1.01])}, "expected an arm whose axes 4, 5 and 6 meet in a point"),
        (2, {"axis_B": np.array([0.0, 0.8, 0.6])}, "expected an arm whose axes 2 and 3 are parallel"),
        (1, {"axis_B": np.array([0.0, 0.8, 0.6])}, "expected an arm whose axes 2 and 3 are parallel"),
    ],
)
def test_the_configuration_of_other_arms_is_not_known(place: int, changes: dict[str, Array], words: str) -> None:
    model = arm_model()
    joints = list(model.joints)
    joints[place] = replace(joints[place], **changes)  # type: ignore[arg-type]
    robot = placed("arm", replace(model, joints=tuple(joints)))

    with pytest.raises(InputError, match=words):
        configuration(robot, np.zeros((1, 6)))


def test_poses_belong_to_robots_with_a_task_on_the_part() -> None:
    job = part_job()
    cell = part_cell()
    only = replace(job.frame, cell=replace(cell, tasks=cell.tasks[:1]))

    programs: tuple[ProgramRows, ...] = with_part_poses(only, job.programs)

    assert [name for name, rows in programs[0].robots.items() if rows.X_PT is not None] == [NAMES[0]]
    assert multimove_cell({NAMES[0]: arm_model()}).robots[0].control is not None
