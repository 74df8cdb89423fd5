"""Reasons why no start was found: each names its robot and task, says by how much, and what to change."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.errors import StartNotFoundError
from cellplan.geometry.transforms import pose
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.inverse_kinematics import random_configurations
from cellplan.planning.start.reasons import nearest_reach
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_paths
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

ONE_ARM = """
cellplan: 1
name: one-arm
robots:
  kuka:
    model: kuka_kr6
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
    start_deg: auto
part: {geometry: {sphere: {radius_mm: 120}}, at: {xyz_mm: [PLACE, 0, 600]}}
tasks:
  ring: {robot: kuka, path: {circle: {radius_mm: 40, plane: yz}, project: [-1, 0, 1]}, tool_axis: normal, tool_x: +z}
motion: {mode: simultaneous, duration_s: SECONDS, step_s: 0.002, time_law: quintic}
"""


def choice_of(folder: Path, *, place: float = 1100.0, seconds: float = 4.0, more: str = ""):
    text = ONE_ARM.replace("PLACE", str(place)).replace("SECONDS", str(seconds)) + more
    path = folder / "cell.yaml"
    path.write_text(text, encoding="utf-8")
    cell = load_cell(path)
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    return choose_start(Scene.from_cell(cell), clock_paths(cell, toolpaths.values()))


def reason(folder: Path, **changes) -> str:
    with pytest.raises(StartNotFoundError) as caught:
        choice_of(folder, **changes)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_start_out_of_reach_says_for_whom_and_by_how_many_millimetres(tmp_path):
    far, farther = (reason(tmp_path, place=place) for place in (3000.0, 3500.0))

    assert "cell.yaml:8: robots.kuka.start_deg: no configuration within the joint limits brings the tool of" in far
    assert "'kuka' to the start of task 'ring'" in far
    assert "move its base" in far
    away = [float(text.split("tool tip ")[1].split(" mm away")[0]) for text in (far, farther)]
    assert 470.0 < away[1] - away[0] < 500.0  # nearly along the stretched arm
    assert 1000.0 < away[0] < 3000.0


def test_a_start_beyond_a_limit_names_the_joint_and_what_is_missing(tmp_path):
    text = reason(tmp_path, place=1500.0)
    assert "it gets there only beyond a limit, at best with joint 'B2' at 38.1 deg, 3.1 deg outside -155.0 deg" in text
    assert "its tip stays " in text


def test_a_contact_that_no_configuration_avoids_is_named_with_base_and_obstacle(tmp_path):
    column = "environment: {column: {cylinder: {radius_mm: 100, length_mm: 900}, at: {xyz_mm: [0, 0, 400]}}}\n"
    text = reason(tmp_path, more=column)
    assert "no start configuration of 'kuka' is free of contact: 'kuka/" in text
    assert "touches 'column' in all " in text
    assert "reach the start of task 'ring', and wherever else its joints may be" in text
    assert text.endswith("move the base of 'kuka' or the obstacle 'column'")


def test_a_contact_at_the_goal_only_is_not_said_to_be_everywhere(tmp_path):
    plate = "environment: {plate: {box: {size_mm: [300, 600, 20]}, at: {xyz_mm: [1000, 0, 800]}}}\n"
    text = reason(tmp_path, more=plate)
    assert "touches 'plate' in all " in text
    assert "wherever else" not in text


TWO_ARMS = """
cellplan: 1
name: two-arms
robots:
  anna:
    model: kuka_kr6
    base: {xyz_mm: [-1100, 0, 0]}
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
  bert:
    model: kuka_kr6
    base: {xyz_mm: [-1100, 150, 0]}
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
part: {geometry: {sphere: {radius_mm: 120}}, at: {xyz_mm: [0, 0, 600]}}
tasks:
  one: {robot: anna, path: {circle: {radius_mm: 20, plane: yz}, project: [-1, 0, 1]}, tool_axis: normal, tool_x: +z}
  two: {robot: bert, path: {circle: {radius_mm: 20, plane: yz}, project: [-1, 1, 1]}, tool_axis: normal, tool_x: +z}
motion: {mode: simultaneous, duration_s: 4, step_s: 0.01, time_law: quintic}
"""


def test_a_column_through_one_arm_comes_before_the_arms_that_touch_each_other_everywhere(tmp_path):
    column = "environment: {column: {cylinder: {radius_mm: 60, length_mm: 900}, at: {xyz_mm: [-1100, 400, 400]}}}\n"
    texts = []
    for more in ("", column):
        path = tmp_path / "cell.yaml"
        path.write_text(TWO_ARMS + more, encoding="utf-8")
        cell = load_cell(path)
        toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
        with pytest.raises(StartNotFoundError) as caught:
            choose_start(Scene.from_cell(cell), clock_paths(cell, toolpaths.values()))
        texts.append(str(caught.value))

    assert "move the bases" in texts[0]
    assert "robots.bert" in texts[1]
    assert "touches 'column'" in texts[1].split(" in all ")[0]
    assert "; besides, 'anna/" in texts[1]


def test_a_start_of_a_calm_motion_is_said_to_keep_limits_and_one_in_a_hurry_not_to(tmp_path):
    calm, hurried = choice_of(tmp_path), choice_of(tmp_path, seconds=0.2)

    assert calm.trial.is_sound
    assert calm.warning is None
    assert "its whole motion keeps limits and speeds" in calm.words
    assert not hurried.trial.is_sound
    assert "no trial was without fault: kuka/" in hurried.warning
    assert "above its top speed" in hurried.warning


TWO_GIVEN = """
cellplan: 1
name: two-given
robots:
  holder: {model: planar_3r, base: {xyz_mm: [0, 0, 500]}, tool: {xyz_mm: [0, 0, 40]}, start_deg: auto}
  right: {model: planar_3r, base: {xyz_mm: [1900, 300, 500], rpy_deg: [0, 0, 180]}, tool: {xyz_mm: [0, 0, 40]}, RIGHT}
  upper: {model: planar_3r, base: {xyz_mm: [900, 950, 800], rpy_deg: [0, 0, -90]}, tool: {xyz_mm: [0, 0, 340]}, UPPER}
part:
  geometry: {box: {size_mm: [340, 300, 10]}}
  held_by: [{robot: holder, at: {xyz_mm: [-120, 0, 5], rpy_deg: [180, 0, 0]}}]
tasks:
  circle: {robot: right, PATH1, tool_axis: normal, tool_x: -x, axes: [x, y, rz]}
  line: {robot: upper, PATH2, tool_axis: normal, tool_x: -x, axes: [x, y, rz]}
motion: {mode: simultaneous, duration_s: 2, step_s: 0.02}
"""


def test_a_second_given_start_that_no_configuration_of_the_positioner_suits_says_how_far_it_is_off(tmp_path):
    text = (
        TWO_GIVEN.replace("PATH1", "path: {circle: {radius_mm: 60, center_mm: [80, -60], plane: xy}, project: +z}")
        .replace("PATH2", "path: {polyline: {points_mm: [[0, 100, 0], [60, 120, 0]]}, project: +z}")
        .replace("RIGHT", "start_deg: [10, 20, 30]")
        .replace("UPPER", "start_deg: [0, 40, 10]")
    )
    path = tmp_path / "cell.yaml"
    path.write_text(text, encoding="utf-8")
    cell = load_cell(path)
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    with pytest.raises(StartNotFoundError, match=r"start_deg: the tool of 'upper' is at best \d+\.\d+ mm and \d") as e:
        choose_start(Scene.from_cell(cell), clock_paths(cell, toolpaths.values()))
    assert "from the start of task 'line', allowed are" in str(e.value)
    assert not np.isinf(float(str(e.value).split("at best ")[1].split(" mm")[0]))


@pytest.fixture(scope="module")
def arm(cells):
    """The right planar arm of the cell with its task, whose longest link is stretched out at zero."""
    cell = load_cell(cells / "planar_pair.yaml")
    return cell.robot("right"), cell.task("circle")


def tip_left(robot, task, goal):
    seeds = random_configurations(robot.model, 12, np.random.default_rng(0))
    return nearest_reach(robot, task, goal, X_WP=np.eye(4), seeds=seeds, tip_only=True)[0]


def test_a_goal_beyond_the_stretched_arm_is_as_far_as_it_is_beyond(arm):
    robot, task = arm
    base = robot.X_WB[:3, 3]
    stretched = ScrewChain(robot).tool_poses(np.zeros((1, 3)))[0, :3, 3]
    length = float(np.linalg.norm((stretched - base)[:2]))
    direction = np.array([np.cos(2.0), np.sin(2.0), 0.0])
    for beyond in (0.05, 0.7, 5.0):
        goal = pose(base + (length + beyond) * direction)
        assert tip_left(robot, task, goal) == pytest.approx(beyond, abs=1e-4)


def test_a_goal_within_reach_leaves_nothing(arm):
    robot, task = arm
    goal = ScrewChain(robot).tool_poses(np.array([[0.3, 0.9, -0.5]]))[0]
    assert tip_left(robot, task, goal) < 1e-6
