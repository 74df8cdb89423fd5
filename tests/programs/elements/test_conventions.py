"""Orientations as the makers count them, against their own formulas, another library and published numbers."""

from functools import reduce

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cellplan.geometry.transforms import Array, pose_from
from cellplan.programs.elements.conventions import CELL_FILE, CONVENTIONS, Convention, convention_of

EVERY = {**CONVENTIONS, "other": CELL_FILE}
SEQUENCES = {
    "fanuc": "xyz",
    "yaskawa": "xyz",
    "other": "xyz",
    "kuka": "ZYX",
    "staubli": "XYZ",
}  # of scipy: fixed, MOVED
POLES = [(30.0, 90.0, 0.0), (-170.0, -90.0, 40.0), (0.0, 90.0, 0.0), (180.0, 0.0, 0.0), (0.0, 180.0, 0.0), (90.0,) * 3]


def placed(R: Array) -> Array:
    return pose_from(R, np.array([1.25, -0.02, 0.38]))


def axis_turn(axis: str, degrees: float) -> Array:
    """The textbook matrix of a turn about one axis."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    matrices = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]], "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]]}
    return np.array(matrices.get(axis, [[c, -s, 0], [s, c, 0], [0, 0, 1]]))


@pytest.mark.parametrize(
    ("kind", "numbers"),
    [
        ("kuka", (30.0, 40.0, 50.0)),
        ("fanuc", (50.0, 40.0, 30.0)),
        ("yaskawa", (50.0, 40.0, 30.0)),
        ("staubli", (42.8535, 47.8033, -8.9971)),
        ("ur", (0.636736, 0.844159, 0.169598)),
        ("abb", (0.8600422, 0.3033718, 0.4021985, 0.0808047)),
    ],
)
def test_one_rotation_in_all_conventions(kind: str, numbers: tuple[float, ...]) -> None:
    R = axis_turn("z", 30.0) @ axis_turn("y", 40.0) @ axis_turn("x", 50.0)

    result = CONVENTIONS[kind].numbers(placed(R))

    np.testing.assert_allclose(result[:3], [1250.0, -20.0, 380.0], atol=1e-9)
    np.testing.assert_allclose(result[3:], numbers, atol=1e-4 if kind != "abb" else 5e-8)


def test_a_published_frame_on_a_published_frame_of_staubli_is_the_published_place() -> None:
    staubli = CONVENTIONS["staubli"]
    cell = staubli.pose(np.array([362.0420374, -49.909946, -265.899982, -0.0000135538, -0.00000434751, 90.0000199962]))
    point = staubli.pose(np.array([169.837325, 700.0334453, 372.398311, -179.999244, -0.000734286, 88.845311]))

    result = staubli.numbers(cell @ point)

    np.testing.assert_allclose(result, [-337.9915, 119.9272, 106.4982, 179.99925, -0.00075, -1.1547], atol=1e-4)


@pytest.mark.parametrize("kind", [*SEQUENCES])
@given(angles=st.tuples(*[st.floats(-180.0, 180.0)] * 3))
def test_angles_are_those_of_another_library(kind: str, angles: tuple[float, float, float]) -> None:
    R = Rotation.from_euler(SEQUENCES[kind], angles, degrees=True).as_matrix()

    np.testing.assert_allclose(EVERY[kind].rotation(np.array(angles)), R, atol=1e-12)
    np.testing.assert_allclose(
        Rotation.from_euler(SEQUENCES[kind], EVERY[kind].numbers(placed(R))[3:], degrees=True).as_matrix(), R, atol=2e-6
    )  # within a millionth of a pole the turn about x is zero


@given(vector=st.tuples(*[st.floats(-1.8, 1.8)] * 3))
def test_quaternions_and_rotation_vectors_are_those_of_another_library(vector: tuple[float, float, float]) -> None:
    other = Rotation.from_rotvec(vector)

    w, *rest = CONVENTIONS["abb"].numbers(placed(other.as_matrix()))[3:]

    assert w >= 0.0
    np.testing.assert_allclose(Rotation.from_quat([*rest, w]).as_matrix(), other.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(CONVENTIONS["ur"].numbers(placed(other.as_matrix()))[3:], other.as_rotvec(), atol=1e-7)


@pytest.mark.parametrize("convention", EVERY.values(), ids=EVERY)
@pytest.mark.parametrize("turns", POLES, ids=str)
def test_typed_numbers_give_the_pose_back_at_every_pole(convention: Convention, turns: tuple[float, ...]) -> None:
    R = reduce(np.matmul, (axis_turn(axis, turn) for axis, turn in zip("zyx", turns, strict=True)))

    texts = convention.texts(placed(R))

    back = convention.pose(np.array([float(text) for text in texts]))
    np.testing.assert_allclose(back, placed(R), atol=2e-5)
    assert not any(text.startswith("-0.") and not text.strip("-0.") for text in texts)
    assert "-180.0000" not in texts


@pytest.mark.parametrize(("kind", "free"), [("kuka", 5), ("fanuc", 3), ("yaskawa", 3), ("staubli", 3)])
def test_at_a_pole_the_turn_about_x_is_zero(kind: str, free: int) -> None:
    first, last = ("z", "x") if kind != "staubli" else ("x", "z")

    numbers = CONVENTIONS[kind].numbers(placed(axis_turn(first, 25.0) @ axis_turn("y", 90.0) @ axis_turn(last, 10.0)))

    assert numbers[free] == pytest.approx(0.0, abs=1e-9)
    assert numbers[4] == pytest.approx(90.0, abs=1e-6)


def test_what_no_maker_is_known_of_is_written_as_in_a_cell_file() -> None:
    assert convention_of(None) is convention_of("ros") is CELL_FILE


def test_tools_and_frames_have_their_numbers_or_a_question_mark() -> None:
    fanuc, abb = CONVENTIONS["fanuc"], CONVENTIONS["abb"]

    assert [fanuc.named(fanuc.frame, number) for number in (3, None)] == ["UFRAME 3", "UFRAME ?"]
    assert [abb.named(abb.tool, number) for number in (3, None)] == ["tooldata 3", "tooldata"]


@pytest.mark.parametrize("kind", CONVENTIONS)
def test_a_half_turn_is_a_positive_one_and_a_length_keeps_its_sign(kind: str) -> None:
    R = axis_turn("z", -180.0 + 1e-9)

    texts = CONVENTIONS[kind].texts(pose_from(R, np.array([-0.18, 0.18, -0.0])))

    assert texts[:3] == ("-180.000", "180.000", "0.000")
    if CONVENTIONS[kind].unit == "deg":
        assert {float(text) for text in texts[3:]} == {0.0, 180.0}
