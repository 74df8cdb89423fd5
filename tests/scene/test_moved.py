"""A scene with bases elsewhere against one built from the changed cell."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import CellplanError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell
from cellplan.scene.bodies import is_ground
from cellplan.scene.scene import Scene

FOLDER = Path(__file__).resolve().parents[2] / "cells"
QUICK = ("rail", "planar_pair")


def elsewhere(cell: Cell, *, height: float) -> dict[str, Array]:
    """Every base moved and turned on the floor, and raised."""
    rng, bases = np.random.default_rng(1), {}
    for robot in cell.robots:
        x, y = rng.uniform(-0.1, 0.1, 2)
        bases[robot.name] = (
            pose((x, y, height)) @ robot.X_WB @ pose((0.0, 0.0, 0.0), (0.0, 0.0, rng.uniform(-0.3, 0.3)))
        )
    return bases


def with_bases(cell: Cell, bases: dict[str, Array]) -> Cell:
    return replace(cell, robots=tuple(replace(robot, X_WB=bases[robot.name]) for robot in cell.robots))


def assert_same(scene: Scene, expected: Scene) -> None:
    """Everything that a certificate asks of a scene."""
    assert (scene.pairs, scene.mounted, scene.excluded) == (expected.pairs, expected.mounted, expected.excluded)
    assert (scene.exclusions, scene.left_out) == (expected.exclusions, expected.left_out)
    assert [body.name for body in scene.bodies] == [body.name for body in expected.bodies]
    rng = np.random.default_rng(2)
    q = rng.uniform(-1.0, 1.0, (2, scene.cell.joint_count))
    poses = [scene.body_poses(q) for scene in (scene, expected)]
    np.testing.assert_allclose(poses[0].R, poses[1].R, atol=1e-12)
    np.testing.assert_allclose(poses[0].p, poses[1].p, atol=1e-12)
    np.testing.assert_allclose(scene.engine.radii, expected.engine.radii, atol=1e-12)
    for one, other in zip(scene.bodies, expected.bodies, strict=True):
        if not is_ground(one) and not isinstance(one.shape, Mesh):
            assert repr(one.shape) == repr(other.shape) or one.shape == pytest.approx(other.shape)
    near = [scene.near(q, 0.3) for scene in (scene, expected)]
    np.testing.assert_array_equal(near[0].rows, near[1].rows)
    np.testing.assert_allclose(near[0].distances, near[1].distances, atol=1e-6)


@pytest.mark.parametrize(
    "name",
    [
        name if name in QUICK else pytest.param(name, marks=pytest.mark.slow)
        for name in sorted(p.stem for p in FOLDER.glob("*.yaml"))
    ],
)
@pytest.mark.parametrize("height", [0.0, 0.05])
def test_distances_are_those_of_a_scene_built_from_the_changed_cell(name: str, height: float) -> None:
    cell = load_cell(FOLDER / f"{name}.yaml")
    bases = elsewhere(cell, height=height)
    assert_same(Scene.from_cell(cell).moved(bases), Scene.from_cell(with_bases(cell, bases)))


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_cell(load_cell(FOLDER / "four_robots.yaml"))


def test_only_columns_whose_height_changes_are_made_anew(scene: Scene) -> None:
    base = scene.cell.robot("kuka").X_WB
    shifted, above = (scene.moved({"kuka": pose(step) @ base}) for step in ((0.1, 0.0, 0.0), (0.0, 0.0, 0.1)))
    column = next(index for index, body in enumerate(scene.bodies) if body.name == "kuka/pedestal")
    assert shifted.engine is scene.engine
    unchanged = [a is b for a, b in zip(above.engine.bodies, scene.engine.bodies, strict=True)]
    assert unchanged.count(False) == 1
    assert not unchanged[column]
    assert scene.body_poses(np.zeros((1, 24))).p[column, 0, 0] == pytest.approx(base[0, 3])
    assert shifted.body_poses(np.zeros((1, 24))).p[column, 0, 0] == pytest.approx(base[0, 3] + 0.1)


def test_a_column_that_comes_or_goes_is_a_pair_more_or_less(scene: Scene) -> None:
    on_floor = scene.cell.robot("kuka").X_WB.copy()
    on_floor[2, 3] = 0.0
    low = scene.moved({"kuka": on_floor})
    assert len(low.bodies) == len(scene.bodies) - 1
    assert len(low.moved({"kuka": scene.cell.robot("kuka").X_WB}).pairs) == len(scene.pairs)


def test_unknown_robots_and_poses_that_are_none_are_refused(scene: Scene) -> None:
    with pytest.raises(ValueError, match=r"expected names of robots \(reis, kuka, abb, staubli\), got 'kuak'"):
        scene.moved({"kuak": np.eye(4)})
    with pytest.raises(ValueError, match="expected a rigid displacement of shape"):
        scene.moved({"kuka": 2.0 * np.eye(4)})


def test_configurations_that_are_no_numbers_have_no_poses(scene: Scene) -> None:
    with pytest.raises(CellplanError, match="not finite or not a rigid displacement"):
        scene.body_poses(np.full((2, 24), np.nan))
