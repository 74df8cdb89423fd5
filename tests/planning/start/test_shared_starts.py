"""Start postures of several holders: given ones are examined, missing ones close the loops."""

from dataclasses import replace

import numpy as np
import pytest
from builders.timed_cells import solved_start

from cellplan import load_cell
from cellplan.errors import StartNotFoundError, StartOffGraspError, StartOffTaskError
from cellplan.geometry.transforms import inverse, pose
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import examine_given_starts
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

# Configurations in [deg] at which both holders have the part and the tool is at the start of its task.
CLOSED = {
    "left": (10.2786911984, -17.9756846139, 61.4752324441, -92.7649113413, -4.4082122244, 123.1145916989),
    "right": (-50.3113700085, 14.9781628646, -24.6976184299, 42.4491631949, 80.4112168659, -32.0798896276),
    "abb": (-7.472538783, 95.768358385, -155.826949468, 51.7822857979, 21.8841593065, 112.7049741223),
}


@pytest.fixture(scope="module")
def shared(cells):
    return load_cell(cells / "load_sharing.yaml")


@pytest.fixture(scope="module")
def planar(cells):
    return load_cell(cells / "load_sharing_planar.yaml")


def toolpaths_of(cell):
    return {task.name: build_toolpath(task, cell.part) for task in cell.tasks}


def with_starts(cell, q, *names):
    """The cell with the configurations of some robots given."""
    robots = tuple(replace(r, start=q[cell.columns(r.name)] if r.name in names else None) for r in cell.robots)
    return replace(cell, robots=robots)


def tools_in_world(cell, q):
    return {r.name: ScrewChain(r).tool_poses(q[None, cell.columns(r.name)])[0] for r in cell.robots}


def assert_loops_are_closed(cell, q):
    tools = tools_in_world(cell, q)
    X_WP = [tools[grasp.robot] @ inverse(grasp.X_PT) for grasp in cell.part.held_by]
    for X in X_WP[1:]:
        np.testing.assert_allclose(X, X_WP[0], atol=1e-9)  # given ones are what a search found before, to rounding


@pytest.fixture(scope="module")
def closed(shared):
    """Stacked configuration of known starts."""
    return np.radians(np.concatenate([CLOSED[robot.name] for robot in shared.robots]))


@pytest.mark.slow
def test_found_starts_close_the_loop_reach_the_task_and_touch_nothing(shared):
    starts_of_cell = solved_start(Scene.from_cell(shared), toolpaths_of(shared))
    assert_loops_are_closed(shared, starts_of_cell)
    tools = tools_in_world(shared, starts_of_cell)
    X_WP = tools["left"] @ inverse(shared.part.held_by[0].X_PT)
    desired = X_WP @ toolpaths_of(shared)["rectangle"].X_PT_start
    np.testing.assert_allclose(tools["abb"], desired, atol=1e-9)
    assert Scene.from_cell(shared).touching(starts_of_cell) is None


@pytest.mark.parametrize(
    "given", [pytest.param("left", marks=pytest.mark.slow), "right", pytest.param("abb", marks=pytest.mark.slow)]
)
def test_the_others_are_found_round_a_robot_that_stands(shared, closed, given):
    cell = with_starts(shared, closed, given)

    q = solved_start(Scene.from_cell(cell), toolpaths_of(cell))

    np.testing.assert_array_equal(q[cell.columns(given)], closed[cell.columns(given)])
    assert_loops_are_closed(cell, q)
    desired = tools_in_world(cell, q)["left"] @ inverse(cell.part.held_by[0].X_PT)
    desired = desired @ toolpaths_of(cell)["rectangle"].X_PT_start
    np.testing.assert_allclose(tools_in_world(cell, q)["abb"], desired, atol=1e-9)
    assert Scene.from_cell(cell).touching(q) is None


def test_planar_holders_are_found_where_the_path_in_the_world_begins(planar):
    q = solved_start(Scene.from_cell(planar), toolpaths_of(planar))
    assert_loops_are_closed(planar, q)
    np.testing.assert_allclose(tools_in_world(planar, q)["left"][:2, 3], [0.75, 0.0], atol=1e-9)


def test_given_starts_that_close_the_loop_are_accepted(shared, closed):
    assert examine_given_starts(with_starts(shared, closed, "left", "right"), toolpaths_of(shared)) is None


def test_a_holder_off_its_grasp_is_named_with_line_distance_and_cure(planar):
    q = solved_start(Scene.from_cell(planar), toolpaths_of(planar))
    cell = with_starts(planar, q, "left", "right")
    turned = replace(cell.robot("right"), start=q[cell.columns("right")] + np.array([0.0, 0.0, np.radians(1.0)]))
    cell = replace(cell, robots=(cell.robots[0], turned))

    with pytest.raises(StartOffGraspError) as caught:
        examine_given_starts(cell, toolpaths_of(cell))

    arm = 1e3 * 0.2 * 2.0 * np.sin(np.radians(0.5))  # the tool tip is 200 mm from the joint that was turned
    assert str(caught.value).endswith(
        f"load_sharing_planar.yaml:16: robots.right.start_deg: the tool of 'right' is {arm:.3f} mm and 1.0000 deg "
        "from its grasp on the part that 'left' carries, allowed are 0.003 mm and 0.001 deg; `auto` finds a "
        "configuration"
    )


def test_a_carrier_off_the_start_of_its_path_is_named(planar):
    cell = with_starts(planar, np.radians([50.0, -85.0, 35.0, 0.0, 0.0, 0.0]), "left")
    with pytest.raises(StartOffTaskError, match=r"robots\.left\.start_deg: .* from the start of task 'carry'"):
        examine_given_starts(cell, toolpaths_of(cell))


def test_a_grasp_out_of_reach_is_named(planar):
    right = planar.robot("right")
    far = replace(planar, robots=(planar.robots[0], replace(right, X_WB=right.X_WB @ pose((-5.0, 0.0, 0.0)))))
    with pytest.raises(
        StartNotFoundError, match=r"robots\.right\..* brings the tool of 'right' to its grasp on the part"
    ):
        solved_start(Scene.from_cell(far), toolpaths_of(far))
