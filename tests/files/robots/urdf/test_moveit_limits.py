"""MoveIt's joint limits count beside those of the URDF, and nothing else in its file does."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import ARM, joint, write_urdf

from cellplan.errors import InputError
from cellplan.files.robots.urdf.load import UrdfOptions, UrdfRobot, load_urdf
from cellplan.files.robots.urdf.moveit_limits import read_moveit_limits
from cellplan.model.cell.cell import Cell

SCALING = "default_velocity_scaling_factor: 0.1\ndefault_acceleration_scaling_factor: 0.1\n"


def loaded(
    folder: Path, *entries: str, above: str = "", limit: str = '<limit lower="-1" upper="2" velocity="3"/>'
) -> UrdfRobot:
    """A robot of a turn and a slide, with the limits of MoveIt in lines of their own."""
    lines = [f'<link name="{name}"/>' for name in ("base", "arm", "tip")]
    lines += [joint("turn", "base", "arm", limit), joint("slide", "arm", "tip", limit, kind="prismatic")]
    path = folder / "joint_limits.yaml"
    path.write_text(f"{above}joint_limits:\n" + "\n".join(f"  {entry}" for entry in entries) + "\n", encoding="utf-8")
    moveit = read_moveit_limits(path, path.name)
    return load_urdf(write_urdf(folder, *lines), UrdfOptions(flange="tip", moveit=moveit))


def test_what_moveit_states_counts_where_it_is_tighter(tmp_path: Path) -> None:
    robot = loaded(
        tmp_path,
        "turn: {has_velocity_limits: true, max_velocity: 1.5, has_acceleration_limits: true, max_acceleration: 4}",
        "slide: {has_velocity_limits: true, max_velocity: 7, has_jerk_limits: true, max_jerk: 20, max_acceleration: 2}",
    )
    turn, slide = robot.model.joints
    assert (turn.velocity, turn.acceleration, turn.jerk) == (1.5, 4.0, None)
    assert (slide.velocity, slide.acceleration, slide.jerk) == (3.0, 2.0, 20.0)  # the URDF's velocity is tighter
    assert robot.remarks == ()


def test_nothing_is_stated_where_a_limit_is_said_to_be_none(tmp_path: Path) -> None:
    robot = loaded(
        tmp_path,
        "turn: {has_velocity_limits: false, max_velocity: 0, has_acceleration_limits: false, max_acceleration: 0.1}",
        "slide: {has_position_limits: false, min_position: 0, max_position: 0, has_jerk_limits: false, max_jerk: 1}",
    )
    turn, slide = robot.model.joints
    assert (turn.velocity, turn.acceleration) == (3.0, None)
    assert (slide.lower, slide.upper, slide.jerk) == (-1.0, 2.0, None)


def test_scaling_factors_are_no_limits_and_are_named(tmp_path: Path) -> None:
    robot = loaded(tmp_path, "turn: {max_velocity: 2, max_effort: 5}", "hand: {max_velocity: 1}", above=SCALING)
    assert robot.model.joints[0].velocity == 2.0
    assert robot.remarks == (
        "joint_limits.yaml: 'rig' does not have the joints hand",
        "joint_limits.yaml: no limits, not used: default_acceleration_scaling_factor, "
        "default_velocity_scaling_factor, max_effort",
    )


def test_positions_and_deceleration_count(tmp_path: Path) -> None:
    robot = loaded(
        tmp_path,
        "turn: {has_position_limits: true, min_position: -0.5, max_position: 0.5}",
        "slide: {min_position: -9, max_position: 1, max_acceleration: 3, max_deceleration: -2}",
    )
    turn, slide = robot.model.joints
    assert (turn.lower, turn.upper) == (-0.5, 0.5)
    assert (slide.lower, slide.upper, slide.acceleration) == (-1.0, 1.0, 2.0)
    assert robot.remarks == (
        "joint_limits.yaml: joint 'slide': positions outside the range of the joint (-9000 mm) were not used",
    )


def test_moveit_supplies_a_velocity_that_the_urdf_lacks(tmp_path: Path) -> None:
    entries = ("turn: {max_velocity: 1.5}", "slide: {max_velocity: 0.5}")
    robot = loaded(tmp_path, *entries, limit='<limit lower="-1" upper="2" velocity="0"/>')
    assert np.array_equal(robot.model.velocity, [1.5, 0.5])


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        (
            "turn: {has_velocity_limits: true, max_velocity: 0}",
            "joint_limits.yaml:2: joint_limits.turn.max_velocity: expected a positive number, got 0",
        ),
        (
            "turn: {has_acceleration_limits: true}",
            "joint_limits.yaml:2: joint_limits.turn: states has_acceleration_limits: true, but no max_acceleration",
        ),
        (
            "turn: {has_jerk_limits: maybe}",
            "joint_limits.yaml:2: joint_limits.turn.has_jerk_limits: expected true or false, got 'maybe'",
        ),
        (
            "turn: {max_jerk: fast}",
            "joint_limits.yaml:2: joint_limits.turn.max_jerk: expected a positive number, got 'fast'",
        ),
        ("turn: 3", "joint_limits.yaml: expected limits of MoveIt, joints by name below the key joint_limits"),
        (
            "a1: {max_velocity: 1}",
            "joint_limits.yaml: expected the limits of 'rig', got some of none of its joints: a1",
        ),
    ],
)
def test_what_cannot_be_a_limit_is_refused_by_line(tmp_path: Path, entry: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        loaded(tmp_path, entry)
    assert str(caught.value) == message


def test_the_file_counts_in_a_cell_and_belongs_to_its_inputs(load: Callable[..., Cell], tmp_path: Path) -> None:
    write_urdf(tmp_path, *ARM)
    (tmp_path / "limits.yaml").write_text("joint_limits: {a1: {max_acceleration: 4}}\nmore: 1\n", encoding="utf-8")
    model = ("model: abb_irb1600", "model: arm.urdf")

    cell = load(model, ("    weights: [1, 1, 1, 1, 1, 1]", "    moveit_limits: limits.yaml"))

    assert cell.robot("worker").model.joints[0].acceleration == 4.0
    assert "limits.yaml" in cell.inputs
    assert ("robots.worker.model", "limits.yaml: no limits, not used: more") in cell.remarks
    with pytest.raises(
        InputError, match=r"c:11: robots\.worker\.moveit_limits: expected an existing file, got 'no\.yaml'"
    ):
        load(model, ("    weights: [1, 1, 1, 1, 1, 1]", "    moveit_limits: no.yaml"))
    with pytest.raises(InputError, match=r"robots\.worker\.moveit_limits: unexpected key, it applies to a URDF only"):
        load(("    weights: [1, 1, 1, 1, 1, 1]", "    moveit_limits: limits.yaml"))
