"""Tool axes along a seam are those of AWS A3.0: by hand, by symmetry, and whatever frame they are expressed in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine, cross_section, tool_axes, tool_targets, weld_face
from cellplan.geometry.transforms import rotation_exp

EX, EY, EZ = np.eye(3)
ROOT = np.sqrt(0.5)
ANGLES = st.floats(-1.2, 1.2)


def along_x(**walls: Array) -> SeamLine:
    return SeamLine(
        source="weld",
        points=np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]),
        tangents=np.stack([EX, EX]),
        behind=np.array([0.0, 0.1]),
        walls={name: np.stack([normal, normal]) for name, normal in walls.items()},
        is_closed=False,
    )


FILLET = along_x(floor=EZ, web=-EY)


@pytest.mark.parametrize(
    ("face", "work", "axis"),
    [
        ("floor", 0.0, -EZ),
        ("floor", 90.0, EY),
        ("floor", 45.0, ROOT * (EY - EZ)),
        ("web", 45.0, ROOT * (EY - EZ)),
        ("web", 0.0, EY),
        ("floor", 30.0, 0.5 * EY - np.sqrt(0.75) * EZ),
        ("web", 60.0, 0.5 * EY - np.sqrt(0.75) * EZ),
    ],
)
def test_work_angle_of_a_fillet_leans_from_its_wall_towards_the_open_side(face: str, work: float, axis: Array) -> None:
    axes = tool_axes(FILLET, SeamAngles(face=face, work=np.deg2rad(work)))

    assert np.allclose(axes, axis, atol=1e-15)


def test_pushed_tool_points_along_travel_and_dragged_one_against_it() -> None:
    push, drag = (tool_axes(FILLET, SeamAngles(face="floor", work=0.3, travel=v)) for v in (0.2, -0.2))

    assert np.allclose(push @ EX, np.sin(0.2), atol=1e-15)
    assert np.allclose(drag @ EX, -np.sin(0.2), atol=1e-15)
    assert np.allclose(push - drag, 2.0 * np.sin(0.2) * EX, atol=1e-15)


def test_beside_one_wall_and_in_a_butt_joint_the_work_angle_is_positive_to_the_left_of_travel() -> None:
    leaning = SeamAngles(face="plate", work=0.1)
    one, butt = tool_axes(along_x(plate=EZ), leaning), tool_axes(along_x(plate=EZ, other=EZ), leaning)

    assert np.allclose(-one, np.sin(0.1) * EY + np.cos(0.1) * EZ, atol=1e-15)  # left of +x seen from above is +y
    assert np.array_equal(one, butt)


def test_side_of_travel_does_not_matter_between_two_walls() -> None:
    back = SeamLine(**{name: getattr(FILLET, name) for name in FILLET.__slots__} | {"tangents": -FILLET.tangents})
    angles = SeamAngles(face="floor", work=0.6)

    assert np.allclose(tool_axes(FILLET, angles), tool_axes(back, angles), atol=1e-15)


def test_tip_stands_off_against_its_own_axis() -> None:
    points, axes = tool_targets(FILLET, SeamAngles(face="floor", work=0.4, travel=0.3, standoff=0.012))

    assert np.allclose(points + 0.012 * axes, FILLET.points, atol=1e-17)


def test_passes_lie_across_the_weld_face() -> None:
    out, across = weld_face(FILLET, SeamAngles(face="floor"))
    groove = weld_face(along_x(left=-EY, right=EY), SeamAngles(face="left"))

    assert np.allclose(out, ROOT * (EZ - EY), atol=1e-15)
    assert np.allclose(across, ROOT * (EY + EZ), atol=1e-15)  # up the web, towards it
    assert np.allclose(groove, [[-EY] * 2, [EZ] * 2], atol=1e-15)


def test_walls_that_lean_along_the_seam_count_across_it_only() -> None:
    leaning = along_x(floor=np.array([0.6, 0.0, 0.8]), web=-EY)
    section = cross_section(leaning, "floor")

    assert np.allclose(section.normal, EZ, atol=1e-15)
    assert np.allclose(section.open_side, -EY, atol=1e-15)


@given(work=ANGLES, travel=ANGLES, turn=st.tuples(*[st.floats(-2.0, 2.0)] * 3))
def test_axes_turn_with_the_part_and_keep_their_angles(
    work: float, travel: float, turn: tuple[float, float, float]
) -> None:
    R = rotation_exp(np.array(turn))
    moved = SeamLine(
        source="weld",
        points=FILLET.points @ R.T,
        tangents=FILLET.tangents @ R.T,
        behind=FILLET.behind,
        walls={name: normals @ R.T for name, normals in FILLET.walls.items()},
        is_closed=False,
    )
    angles = SeamAngles(face="floor", work=work, travel=travel)
    axes = tool_axes(moved, angles)

    assert np.allclose(axes, tool_axes(FILLET, angles) @ R.T, atol=1e-14)
    assert np.allclose(np.linalg.norm(axes, axis=1), 1.0, atol=1e-15)
    assert np.allclose(np.sum(axes * moved.tangents, axis=1), np.sin(travel), atol=1e-14)


def test_a_seam_line_with_fewer_normals_than_points_is_refused() -> None:
    with pytest.raises(ValueError, match="seam line 'weld'"):
        SeamLine(
            source="weld", points=np.zeros((2, 3)), tangents=np.stack([EX, EX]), behind=np.array([0.0, 1.0]),
            walls={"floor": EZ[None]}, is_closed=False,
        )  # fmt: skip
