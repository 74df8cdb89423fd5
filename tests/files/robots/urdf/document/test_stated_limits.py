"""What a URDF states about the limits of a joint counts: accelerations, jerk and soft limits."""

import math
from pathlib import Path

import pytest
from builders.urdf_texts import joint, write_urdf

from cellplan.errors import InputError
from cellplan.files.robots.limits import StatedLimits
from cellplan.files.robots.urdf.load import UrdfOptions, UrdfRobot, load_urdf
from cellplan.model.robot.robot import Joint

TURN = 2.0 * math.pi


def loaded(
    folder: Path, inside: str, *more: str, kind: str = "revolute", cell: StatedLimits | None = None
) -> UrdfRobot:
    """A robot of one joint, whose element stands in line 4."""
    lines = ('<link name="base"/>', '<link name="tip"/>', joint("a1", "base", "tip", inside, kind=kind), *more)
    return load_urdf(write_urdf(folder, *lines), UrdfOptions(limits={} if cell is None else {"a1": cell}, flange="tip"))


def limit(more: str = "", lower: float = -1.0, upper: float = 2.0) -> str:
    return f'<limit lower="{lower!r}" upper="{upper!r}" velocity="3" {more}/>'


def first(robot: UrdfRobot) -> Joint:
    return robot.model.joints[0]


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "continuous"])
def test_acceleration_and_jerk_of_the_file_are_limits(tmp_path: Path, kind: str) -> None:
    cell = StatedLimits(wraps=True) if kind == "continuous" else None
    robot = loaded(tmp_path, limit('acceleration="0.2" jerk="1.5"'), kind=kind, cell=cell)
    assert (first(robot).acceleration, first(robot).jerk) == (0.2, 1.5)
    assert robot.remarks == ()


@pytest.mark.parametrize(
    ("more", "acceleration", "remark"),
    [
        ('deceleration="0.3"', 0.3, "the smaller one of acceleration and deceleration counts for both"),
        (
            'acceleration="0.5" deceleration="0.3"',
            0.3,
            "the smaller one of acceleration and deceleration counts for both",
        ),
        ('acceleration="0.2" deceleration="0.2"', 0.2, None),
        ('acceleration="inf"', None, None),
        ('acceleration="0"', None, "acceleration 0 is not positive and was not used"),
        ('jerk="-1"', None, "jerk -1 is not positive and was not used"),
    ],
)
def test_what_is_stated_of_ramps_counts_or_is_a_remark(
    tmp_path: Path, more: str, acceleration: float | None, remark: str | None
) -> None:
    robot = loaded(tmp_path, limit(more))
    assert first(robot).acceleration == acceleration
    assert robot.remarks == (() if remark is None else (f"arm.urdf:4: joint 'a1': {remark}",))


def test_the_tighter_of_file_and_cell_counts_and_none_is_widened(tmp_path: Path) -> None:
    tighter = loaded(tmp_path, limit('acceleration="2" jerk="5"'), cell=StatedLimits(acceleration=1.0))
    assert (first(tighter).acceleration, first(tighter).jerk) == (1.0, 5.0)
    with pytest.raises(InputError, match=r"acceleration_deg_s2: expected at most 114\.59\d*, the limit of the model"):
        loaded(tmp_path, limit('acceleration="2"'), cell=StatedLimits(acceleration=3.0))


def test_accelerations_of_a_follower_bound_its_leader(tmp_path: Path) -> None:
    lever = '<mimic joint="a1" multiplier="-2"/>' + limit('acceleration="0.8" jerk="3"', -10.0, 10.0)
    robot = loaded(tmp_path, limit('acceleration="5"'), '<link name="f"/>', joint("lever", "base", "f", lever))
    assert (first(robot).acceleration, first(robot).jerk) == (0.4, 1.5)


def soft(lower: str | None, upper: str | None) -> str:
    given = {"soft_lower_limit": lower, "soft_upper_limit": upper}
    stated = (f'{key}="{value}"' for key, value in given.items() if value is not None)
    return f"<safety_controller {' '.join(stated)}/>"


@pytest.mark.parametrize(
    ("lower", "upper", "ends", "remark"),
    [
        ("-0.5", "0.5", (-0.5, 0.5), None),
        ("-1", "2", (-1.0, 2.0), None),
        (None, "0.5", (-1.0, 0.5), None),
        ("-0.5", None, (-0.5, 2.0), None),
        (None, None, (-1.0, 2.0), None),
        ("0.5", "-0.5", (-1.0, 2.0), "soft limits 28.6479 to -28.6479 deg leave no range and were not used"),
        ("0", "0", (-1.0, 2.0), "soft limits 0 to 0 deg leave no range and were not used"),
        ("-3", "0.5", (-1.0, 0.5), "soft limits outside the range of the joint (-171.887 deg) were not used"),
        ("-3", "9", (-1.0, 2.0), "soft limits outside the range of the joint (-171.887, 515.662 deg) were not used"),
    ],
)
def test_soft_limits_narrow_the_range_where_they_make_sense(
    tmp_path: Path, lower: str | None, upper: str | None, ends: tuple[float, float], remark: str | None
) -> None:
    robot = loaded(tmp_path, limit() + soft(lower, upper))
    assert (first(robot).lower, first(robot).upper) == ends
    assert robot.remarks == (() if remark is None else (f"arm.urdf:4: joint 'a1': {remark}",))


def test_soft_limits_of_a_sliding_joint_are_in_metres_and_of_a_continuous_one_a_remark(tmp_path: Path) -> None:
    slide = loaded(tmp_path, limit() + soft("-0.25", "5"), kind="prismatic")
    assert (first(slide).lower, first(slide).upper) == (-0.25, 2.0)
    assert slide.remarks == (
        "arm.urdf:4: joint 'a1': soft limits outside the range of the joint (5000 mm) were not used",
    )
    turn = loaded(tmp_path, limit() + soft("-1", "1"), kind="continuous", cell=StatedLimits(wraps=True))
    assert (first(turn).lower, first(turn).upper) == (-math.inf, math.inf)
    assert turn.remarks == ("arm.urdf:4: joint 'a1': is continuous: its soft limits were not used",)


def test_a_joint_is_held_where_it_can_go_though_its_controller_would_not(tmp_path: Path) -> None:
    """Soft limits are the controller's: what is locked may stand up to the end of the range."""
    finger = joint("finger", "tip", "jaw", limit() + soft("-0.5", "0.5"))
    path = write_urdf(
        tmp_path, '<link name="base"/>', '<link name="tip"/>', joint("a1", "base", "tip"), '<link name="jaw"/>', finger
    )
    assert load_urdf(path, UrdfOptions(flange="tip", locked={"finger": 2.0})).model.joint_names == ("a1",)


def several(folder: Path, *widths: float) -> tuple[list[tuple[float, float]], tuple[str, ...]]:
    """Ranges of joints in a row of these widths each way, and the remarks of the file."""
    lines = ['<link name="l0"/>']
    for number, width in enumerate(widths):
        lines += [f'<link name="l{number + 1}"/>']
        lines += [joint(f"a{number}", f"l{number}", f"l{number + 1}", limit(lower=-width, upper=width))]
    robot = load_urdf(write_urdf(folder, *lines), UrdfOptions(flange=f"l{len(widths)}"))
    return [(it.lower, it.upper) for it in robot.model.joints], robot.remarks


@pytest.mark.parametrize("width", [2.5 * TURN, 10.0 * TURN])
def test_a_joint_may_turn_several_times_each_way(tmp_path: Path, width: float) -> None:
    ranges, remarks = several(tmp_path, 3.0, 2.0, width)
    assert ranges[2] == (-width, width)
    degrees = f"{math.degrees(width):.6g}"
    assert remarks == (f"arm.urdf:8: joint 'a2': has a range of several turns, {degrees} deg (is its unit rad?)",)
    assert several(tmp_path, width)[0] == [(-width, width)]  # a turntable alone


@pytest.mark.parametrize("widths", [(30.0, 45.0, 3.0), (30.0, 170.0), (2.0, 3.0, 62.9)])
def test_degrees_of_a_whole_file_are_no_turns(tmp_path: Path, widths: tuple[float, ...]) -> None:
    with pytest.raises(
        InputError, match=r"expected position limits within (two|ten) turns, .* \(is the unit degrees\?\)"
    ):
        several(tmp_path, *widths)
