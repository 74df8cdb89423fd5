"""The scene: where bodies are, and whether a single configuration touches."""

import pickle

import numpy as np
import pytest
from builders.scene_builders import (
    arm_model,
    displaced,
    fixed_part,
    floor,
    held_part,
    make_cell,
    placed,
    random_pose,
    schedule,
    stick,
    work,
)

from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.shapes import Box, Cylinder
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell
from cellplan.scene.scene import Scene


@pytest.fixture(scope="module")
def cell() -> Cell:
    arms = (
        placed("a", arm_model(), tool=stick()),
        placed("b", arm_model(), base=pose((1.6, 0.0, 0.0), (0.0, 0.0, np.pi)), tool=stick()),
    )
    part = held_part(Cylinder(0.1, 0.3), "b", pose((0.0, 0.0, -0.15)))
    return make_cell(*arms, part=part, things=(floor(),), tasks=(work("a"),))


def configurations(cell: Cell, count: int) -> np.ndarray:
    rng = np.random.default_rng(4)
    return rng.uniform(-1.5, 1.5, (count, cell.joint_count))


def test_a_held_part_moves_with_the_tool_tip_of_its_holder(cell: Cell) -> None:
    scene, q = Scene.from_cell(cell), configurations(cell, 5)
    place = [body.name for body in scene.bodies].index("part")

    poses = scene.body_poses(q)
    X_WT = scene.chains["b"].tool_poses(q[:, cell.columns("b")])

    np.testing.assert_allclose(poses.p[place], (X_WT @ pose((0.0, 0.0, 0.15)))[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(poses.R[place], X_WT[:, :3, :3], atol=1e-12)


def test_a_tool_ends_at_the_tool_tip(cell: Cell) -> None:
    scene, q = Scene.from_cell(cell), configurations(cell, 5)
    place = [body.name for body in scene.bodies].index("a/tool")

    poses = scene.body_poses(q)
    tip = poses.p[place] + 0.05 * poses.R[place][:, :, 2]

    np.testing.assert_allclose(tip, scene.chains["a"].tool_poses(q[:, cell.columns("a")])[:, :3, 3], atol=1e-12)


@pytest.mark.slow
def test_single_postures_and_whole_motions_get_the_same_answer(cell: Cell) -> None:
    scene, q = Scene.from_cell(cell), configurations(cell, 60)
    touching = [scene.touching(configuration) for configuration in q]

    for configuration, pair in zip(q, touching, strict=True):
        report, _ = check_clearance(scene, schedule(2, *cell.tasks), np.stack([configuration, configuration]))
        forbidden = {contact.pair for contact in report.contacts if not contact.is_allowed}
        assert (pair in forbidden) if pair else not forbidden
    assert any(touching)
    assert not all(touching)


def test_moving_the_whole_cell_changes_no_answer(cell: Cell) -> None:
    rng = np.random.default_rng(8)
    moved = displaced(cell, random_pose(rng, reach=5.0))
    q = configurations(cell, 40)

    here, there = Scene.from_cell(cell), Scene.from_cell(moved)

    assert here.exclusions == there.exclusions
    assert here.pairs == there.pairs
    assert [here.touching(configuration) for configuration in q] == [
        there.touching(configuration) for configuration in q
    ]


def test_a_scene_survives_the_way_to_another_process(cell: Cell) -> None:
    scene, q = Scene.from_cell(cell), configurations(cell, 10)

    copy = pickle.loads(pickle.dumps(scene))  # noqa: S301

    assert [copy.touching(configuration) for configuration in q] == [
        scene.touching(configuration) for configuration in q
    ]


def test_a_cell_with_nothing_solid_but_the_part_never_touches() -> None:
    bare = arm_model().__class__(
        name="bare", source="test", joints=arm_model().joints, flange_link=5, X_BF=arm_model().X_BF, bodies=()
    )
    cell = make_cell(placed("a", bare), part=fixed_part(Box((0.1, 0.1, 0.1)), np.eye(4)))

    assert Scene.from_cell(cell).touching(np.zeros(6)) is None
