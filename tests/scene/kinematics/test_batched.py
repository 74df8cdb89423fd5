"""Many configurations at once against two other kinematics: successive screws and the combined model."""

from dataclasses import replace

import numpy as np
import pytest
from builders.batch_cells import CELLS, configurations, mixed_cell
from builders.random_cells import moved, random_cell, random_pose

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.scene.kinematics.batched import BatchChains, BatchState, Placement
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

ROUNDING = 1e-13  # [-] products of a dozen matrices of order one, lengths of some metres
LANES = 5


def tools(state: BatchState) -> Array:
    """Tool poses, shape (robots, lanes, 4, 4)."""
    X = np.zeros((*state.p_WT.shape[1:], 4, 4))
    X[..., :3, :3] = np.moveaxis(state.R_WT, (0, 1), (-2, -1))
    X[..., :3, 3] = np.moveaxis(state.p_WT, 0, -1)
    X[..., 3, 3] = 1.0
    return X


def screws_of(chains: BatchChains, state: BatchState, cell: Cell) -> Array:
    """Screws of all joints at the world origin, from axes and points on them, shape (robots, lanes, 6, joints)."""
    turning, sliding = chains.is_turning[:, :, None], chains.is_sliding[:, :, None]
    linear = np.cross(state.points, state.axes, axis=0) * turning + state.axes * sliding
    per_axis = np.concatenate([linear, state.axes * turning])
    return np.einsum("ilrb,ljr->rbij", per_axis, chains.to_joints)


@pytest.mark.parametrize("name", CELLS)
def test_tools_stand_where_successive_screws_put_them(name: str) -> None:
    cell, chains = CELLS[name], BatchChains(CELLS[name])
    q = configurations(cell, LANES)

    result = tools(chains.state(q, chains.placement(cell)))

    for robot, poses in zip(cell.robots, result, strict=True):
        expected = ScrewChain(robot).tool_poses(q[cell.columns(robot.name)].T)
        np.testing.assert_allclose(poses, expected, atol=100 * ROUNDING)


@pytest.mark.parametrize("name", CELLS)
def test_axes_are_the_screws_of_the_combined_model(name: str) -> None:
    cell, chains, model = CELLS[name], BatchChains(CELLS[name]), CombinedModel(CELLS[name])
    q = configurations(cell, LANES)

    screws = screws_of(chains, chains.state(q, chains.placement(cell)), cell)

    for lane in range(LANES):
        state = model.state(q[:, lane])
        for index, robot in enumerate(cell.robots):
            columns = cell.columns(robot.name)
            expected = state.screws_W[:, columns] * model.carries_flange[index, columns]
            axes = screws[index, lane, :, : len(robot.model.joints)]
            np.testing.assert_allclose(axes, expected, atol=100 * ROUNDING)
            assert not screws[index, lane, :, len(robot.model.joints) :].any()


def test_each_batch_entry_may_have_its_own_bases_and_tools() -> None:
    rng, template = np.random.default_rng(3), mixed_cell(5)
    chains, q = BatchChains(template), configurations(template, LANES)
    cells = []
    for _ in range(LANES):
        robots = [
            replace(r, X_WB=random_pose(rng), tool=replace(r.tool, X_FT=random_pose(rng))) for r in template.robots
        ]
        cells.append(replace(template, robots=tuple(robots)))
    placements = [chains.placement(cell) for cell in cells]
    together = Placement(
        *(np.concatenate([getattr(p, part) for p in placements], axis=-1) for part in Placement.__slots__)
    )

    poses = tools(chains.state(q, together))

    for lane, cell in enumerate(cells):
        for index, robot in enumerate(cell.robots):
            expected = ScrewChain(robot).tool_poses(q[cell.columns(robot.name), lane][None])[0]
            np.testing.assert_allclose(poses[index, lane], expected, atol=100 * ROUNDING)
    picked = tools(chains.state(q[:, [3, 1]], together.of(np.array([3, 1]))))
    np.testing.assert_allclose(picked, poses[:, [3, 1]], atol=ROUNDING)
    twice = tools(chains.state(np.repeat(q, 2, axis=1), together.repeated(2)))
    np.testing.assert_allclose(twice, np.repeat(poses, 2, axis=1), atol=ROUNDING)


def test_one_placement_stands_for_the_whole_batch() -> None:
    cell = random_cell(2, operators=1)
    placement = BatchChains(cell).placement(cell)
    assert placement.of(np.array([4, 7])) is placement
    assert placement.repeated(3) is placement


def test_moving_the_world_moves_all_tools_along() -> None:
    cell, X = mixed_cell(8), random_pose(np.random.default_rng(1))
    chains, q = BatchChains(cell), configurations(cell, LANES)

    here, there = (tools(chains.state(q, chains.placement(entry))) for entry in (cell, moved(cell, X)))

    np.testing.assert_allclose(there, X @ here, atol=100 * ROUNDING)


def test_what_is_plain_and_what_only_turns_is_known() -> None:
    result = {name: BatchChains(CELLS[name]) for name in ("plain of equal arms", "followers", "mixed", "plain")}
    assert {name: chains.is_plain for name, chains in result.items()} == {
        "plain of equal arms": True,
        "followers": False,
        "mixed": False,
        "plain": True,
    }
    assert result["plain"].is_all_turning
    assert not result["followers"].is_all_turning


def test_columns_name_the_joints_of_each_robot() -> None:
    cell = mixed_cell(5)
    chains = BatchChains(cell)
    for index, robot in enumerate(cell.robots):
        listed = chains.columns[:, index]
        columns = cell.columns(robot.name)
        assert listed[listed >= 0].tolist() == list(range(columns.start, columns.stop))


def test_a_robot_on_its_own_base_has_a_tool_that_rests() -> None:
    cell = mixed_cell(5)
    robot = cell.robot("op2")
    index = [robot.name for robot in cell.robots].index("op2")
    chains = BatchChains(cell)
    poses = tools(chains.state(configurations(cell, LANES), chains.placement(cell)))[index]
    expected = robot.X_WB @ robot.model.X_BF @ robot.tool.X_FT
    np.testing.assert_allclose(poses, np.broadcast_to(expected, poses.shape), atol=10 * ROUNDING)
