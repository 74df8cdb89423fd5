"""Pairs that begin nearer than is demanded only come apart: discs of which the distance is known in closed form."""

import numpy as np
import pytest
from builders.scene_builders import body, displaced, fixed_part, floor, joint, make_cell, placed, slide_model
from builders.transfer_cells import gantry, scene_of

from cellplan.certify.growth import certify_growth, rows_too_near, sampled_growth, scene_at_stop, signed_distances
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.scene import Scene

RADII = 0.2  # [m] of both discs together
DEMAND = 0.005  # [m]


@pytest.fixture(scope="module")
def scene() -> Scene:
    """Two discs that slide in one plane."""
    return scene_at_stop(scene_of(gantry("a"), gantry("b")))


def apart(*distances: float) -> Array:
    """Rows in which the second disc is so far from the first, each distance signed, in [m]."""
    gaps = np.interp(np.linspace(0, len(distances) - 1, 40), np.arange(len(distances)), distances)
    return np.column_stack([np.zeros((40, 2)), RADII + gaps, np.zeros(40)])


@pytest.mark.parametrize("begin", [-0.03, -1e-4, 0.001, 0.004])
def test_discs_that_part_are_proved_and_their_distances_are_the_closed_form(scene: Scene, begin: float) -> None:
    growth = certify_growth(scene, apart(begin, 0.05))

    (pair,) = growth.apart
    assert growth.is_proved
    assert growth.is_clear
    tolerance = 1e-4 + 2e-3 * abs(begin)  # of a depth
    assert pair.begin == pytest.approx(begin, abs=tolerance)
    assert pair.end == pytest.approx(0.05, abs=1e-4)
    rows = apart(begin, 0.05)[:, 2] - RADII
    assert pair.row is not None
    assert rows[pair.row] >= DEMAND


@pytest.mark.parametrize(
    "gaps", [(-0.02, -0.025, 0.05), (-0.001, -0.002, 0.05), (0.003, 0.002, 0.05), (0.002, 0.05, 0.002)]
)
def test_discs_that_come_nearer_on_the_way_are_a_fault(scene: Scene, gaps: tuple[float, ...]) -> None:
    growth = certify_growth(scene, apart(*gaps))

    assert not growth.is_proved
    assert growth.faults[0][0] == ("a/disc", "b/disc")


def test_discs_that_part_by_too_little_are_proved_but_not_clear(scene: Scene) -> None:
    growth = certify_growth(scene, apart(-0.001, 0.003))

    assert growth.is_proved
    assert not growth.is_clear
    assert growth.apart[0].row is None


def test_a_pair_that_begins_with_its_demand_has_to_keep_it(scene: Scene) -> None:
    free, lost = certify_growth(scene, apart(0.02, 0.006)), certify_growth(scene, apart(0.02, 0.004))

    assert (free.is_clear, free.apart) == (True, ())
    assert not lost.is_proved


def test_a_search_finds_what_the_proof_finds(scene: Scene) -> None:
    for gaps in [(-0.02, 0.05), (0.001, 0.05), (-0.02, -0.025, 0.05)]:
        near = rows_too_near(scene, apart(*gaps)[0])
        growth = sampled_growth(scene, apart(*gaps), near=near, moved=range(len(scene.pairs)))
        assert growth.is_clear == certify_growth(scene, apart(*gaps)).is_clear


def test_the_pairs_that_are_too_near_are_those_below_the_demand(scene: Scene) -> None:
    assert [bool(rows_too_near(scene, apart(d, d)[0])) for d in (-0.01, 0.0, 0.0049, 0.0052, 0.1)] == [
        True,
        True,
        True,
        False,
        False,
    ]


@pytest.mark.parametrize("place", [np.eye(4), pose((0.7, -1.2, 0.4), (0.3, -0.8, 2.0))])
@pytest.mark.parametrize("begin", [-0.02, 0.002])
def test_a_ball_that_leaves_the_floor_along_its_normal_rises_as_its_joint_does(place: Array, begin: float) -> None:
    """Up is proved, down is a fault, and along the floor is none, wherever the cell stands."""
    joints = (joint("up", -1, slides=True), joint("along", 0, axis=(1.0, 0.0, 0.0), slides=True))
    ball = body("ball", 1, shape=Sphere(RADII), at=(0.0, 0.0, RADII))
    lift = RobotModel(name="lift", source="test", joints=joints, flange_link=1, X_BF=np.eye(4), bodies=(ball,))
    cell = make_cell(placed("lift", lift), things=(floor(),), checks=ChecksEntry(clearance_mm=1e3 * DEMAND))
    scene = scene_at_stop(Scene.from_cell(displaced(cell, place)))
    rise = begin + 0.03 * np.linspace(0.0, 1.0, 12) ** 2
    up, along = (np.stack([rise, 0.0 * rise], axis=1), np.stack([0.0 * rise + begin, rise], axis=1))

    growth = certify_growth(scene, up)

    (pair,) = growth.apart
    np.testing.assert_allclose(
        signed_distances(scene, scene.pairs[rows_too_near(scene, up[0])[0]], up), rise, atol=1e-9
    )
    assert growth.is_clear
    assert (pair.begin, pair.end) == pytest.approx((rise[0], rise[-1]), abs=1e-9)
    assert pair.row is not None
    assert rise[pair.row] >= pair.demand > rise[pair.row - 2]
    assert certify_growth(scene, along).is_proved
    assert not certify_growth(scene, along).is_clear
    assert not certify_growth(scene, up[:4][::-1]).is_proved


def test_a_ball_inside_a_closed_mesh_is_as_deep_as_its_way_out() -> None:
    """Nothing touches there: the surface of the mesh is far from the ball."""
    block = tessellate(Box((0.2, 0.2, 0.2)))
    cell = make_cell(placed("probe", slide_model(Sphere(0.005))), part=fixed_part(block, np.eye(4)))
    scene = scene_at_stop(Scene.from_cell(cell))
    shifts = np.linspace(0.0, 0.2, 40)[:, None]

    (near,) = rows_too_near(scene, shifts[0])
    growth = certify_growth(scene, shifts)

    distances = signed_distances(scene, scene.pairs[near], shifts)
    np.testing.assert_allclose(distances, shifts[:, 0] - 0.105, atol=2e-4)
    assert growth.is_clear
    assert growth.apart[0].begin == pytest.approx(-0.105, abs=2e-4)
    assert not certify_growth(scene, shifts[:20][::-1]).is_proved
