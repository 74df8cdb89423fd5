"""Start postures: given ones are examined, missing ones found within limits, on the task and free."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from builders.timed_cells import solved_start

from cellplan import load_cell
from cellplan.errors import InvalidFileError, StartNotFoundError, StartOffTaskError, StartOutsideLimitsError
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import inverse, pose
from cellplan.model.cell.cell import Obstacle
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import examine_given_starts
from cellplan.planning.start.inverse_kinematics import (
    joint_margin_shares,
    random_configurations,
    reaching_configurations,
    within_limits,
)
from cellplan.planning.start.trial_motion import StartTrials
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "four_robots.yaml")


def toolpaths_of(cell):
    return {task.name: build_toolpath(task, cell.part) for task in cell.tasks}


def with_start(cell, name, start):
    return replace(cell, robots=tuple(replace(r, start=start) if r.name == name else r for r in cell.robots))


def distance_from_task(cell, task, q):
    holder, operator = cell.robot(cell.positioners[0]), cell.robot(task.robot)
    X_WP = ScrewChain(holder).tool_poses(q[None, cell.columns(holder.name)])[0] @ inverse(cell.part.held_by[0].X_PT)
    X_WT = ScrewChain(operator).tool_poses(q[None, cell.columns(operator.name)])[0]
    desired = toolpaths_of(cell)[task.name].X_PT_start
    return np.abs(inverse(X_WP) @ X_WT - desired).max()


def test_given_starts_of_the_reference_cell_are_accepted(cell):
    assert examine_given_starts(cell, toolpaths_of(cell)) is None


def test_start_outside_limits_is_named_with_its_line(cell):
    start = cell.robot("kuka").start.copy()
    start[1] = np.radians(40.0)
    with pytest.raises(StartOutsideLimitsError) as caught:
        examine_given_starts(with_start(cell, "kuka", start), toolpaths_of(cell))
    assert str(caught.value).endswith(
        "four_robots.yaml:25: robots.kuka.start_deg: joint 'B2' starts at 40 deg, outside its limits -155 deg .. 35 deg"
    )


def test_start_off_the_task_is_named_with_distance_and_cure(cell):
    start = cell.robot("abb").start.copy()
    start[0] += np.radians(1.0)
    with pytest.raises(StartOffTaskError) as caught:
        examine_given_starts(with_start(cell, "abb", start), toolpaths_of(cell))
    assert "robots.abb.start_deg: the tool of 'abb' is " in str(caught.value)
    assert "from the start of task 'rhombus', allowed are 0.1 mm and 0.01 deg; `auto` finds a configuration" in str(
        caught.value
    )


def test_a_start_that_a_task_states_is_named_there(cell):
    start = cell.robot("abb").start + np.radians([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    tasks = tuple(replace(it, start_posture=start) if it.name == "rhombus" else it for it in cell.tasks)

    with pytest.raises(
        StartOffTaskError, match=r": tasks\.rhombus\.start_deg: the tool of 'abb' .* without the key one"
    ):
        examine_given_starts(replace(with_start(cell, "abb", start), tasks=tasks), toolpaths_of(cell))


def test_all_wrong_starts_are_named_at_once(cell):
    wrong = cell
    for name in ("kuka", "staubli"):
        wrong = with_start(wrong, name, cell.robot(name).start + np.radians(200.0))
    with pytest.raises(InvalidFileError) as caught:
        examine_given_starts(wrong, toolpaths_of(cell))
    assert {line.split(" robots.")[1].split(".")[0] for line in str(caught.value).split("\n")} == {"kuka", "staubli"}


@cache
def found_without(cell, missing):
    """Scene of the cell without the starts of some robots, and what is found for it."""
    for name in missing:
        cell = with_start(cell, name, None)
    scene = Scene.from_cell(cell)
    return scene, solved_start(scene, toolpaths_of(cell))


@pytest.mark.parametrize(
    "missing",
    [("kuka",), pytest.param(("kuka", "abb", "staubli"), marks=pytest.mark.slow), ("reis",)],
    ids="+".join,
)
def test_found_starts_reach_their_tasks_within_limits_and_free(cell, missing):
    scene, q = found_without(cell, missing)

    for robot in cell.robots:
        q_robot = q[cell.columns(robot.name)]
        assert np.all((q_robot >= robot.model.lower) & (q_robot <= robot.model.upper))
        if robot.name not in missing:
            np.testing.assert_array_equal(q_robot, robot.start)
    for task in cell.tasks:
        assert distance_from_task(cell, task, q) < 1e-8  # given starts close to 1e-9 m, found ones to 1e-12
    assert scene.touching(q) is None


@pytest.mark.parametrize(
    "missing", [pytest.param(("kuka", "abb", "staubli"), marks=pytest.mark.slow), ("reis",)], ids="+".join
)
def test_search_gives_the_same_configuration_again(cell, missing):
    _, first = found_without(cell, missing)
    _, again = found_without.__wrapped__(cell, missing)
    np.testing.assert_array_equal(first, again)


@pytest.mark.slow
def test_all_postures_of_the_positioner_may_be_open_as_well(cells):
    cell = load_cell(cells / "mesh_part_csv.yaml")
    assert any(robot.start is None for robot in cell.robots)
    scene = Scene.from_cell(cell)
    q = solved_start(scene, toolpaths_of(cell))
    assert scene.touching(q) is None


WRIST_THAT_TURNS_ROUND = """
cellplan: 1
name: one-arm-at-a-ball
robots:
  kuka: {model: kuka_kr6, tool: {xyz_mm: [0, 0, 150]}, start_deg: auto}
part: {geometry: {sphere: {radius_mm: 120}}, at: {xyz_mm: [1100, 0, 600]}}
tasks:
  ring: {robot: kuka, path: {circle: {radius_mm: 40, plane: yz}, project: [-1, 0, 1]}, tool_axis: normal, tool_x: +z}
motion: {mode: simultaneous, duration_s: 4, step_s: 0.01, time_law: quintic}
"""


def test_a_wrist_that_turns_round_begins_where_a_whole_turn_has_room(tmp_path):
    """The circle leads the tool axis once round the forearm: D2, free for 700 deg, must make a whole turn."""
    (tmp_path / "cell.yaml").write_text(WRIST_THAT_TURNS_ROUND, encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    toolpaths = toolpaths_of(cell)

    start = solved_start(Scene.from_cell(cell), toolpaths)

    schedule = schedule_tasks(cell, list(toolpaths.values()))
    q = integrate_schedule(MotionTask(cell, schedule, ["kuka"], start)).q
    assert abs(q[-1, 3] - q[0, 3]) == pytest.approx(2 * np.pi, abs=1e-2)  # the tracking error at the end of the path
    assert joint_margin_shares(cell.robot("kuka").model, q).min() > 0.0


@pytest.mark.slow
def test_arms_that_cannot_help_do_not_multiply_a_search_without_hope(tmp_path, monkeypatch):
    """Seven free arms of a few branches each beside one that stands in a wall make thousands of combinations."""
    lines = ["cellplan: 1", "name: eight-arms", "robots:"]
    turns = [float(turn) for turn in range(0, 360, 45)]
    for k, turn in enumerate(turns):
        x, y = 1350.0 * np.cos(np.radians(turn)), 1350.0 * np.sin(np.radians(turn))
        base = f"{{xyz_mm: [{x:.3f}, {y:.3f}, 0], rpy_deg: [0, 0, {turn - 180.0}]}}"
        lines.append(f"  r{k}: {{model: staubli_rx90l, base: {base}, tool: {{xyz_mm: [0, 0, 200]}}}}")
    lines += ["part: {geometry: {sphere: {radius_mm: 300}}, at: {xyz_mm: [0, 0, 700]}}", "tasks:"]
    for k, turn in enumerate(turns):
        side = f"[{np.cos(np.radians(turn)):.6f}, {np.sin(np.radians(turn)):.6f}, 0]"
        across = f"[{-60 * np.sin(np.radians(turn)):.6f}, {60 * np.cos(np.radians(turn)):.6f}, 0]"
        path = f"{{polyline: {{points_mm: [{across}, [0, 0, 60]]}}, project: {side}}}"
        lines.append(f"  t{k}: {{robot: r{k}, path: {path}, tool_axis: normal, tool_x: +z, duration_s: 2}}")
    lines += ["environment:", "  wall: {box: {size_mm: [200, 200, 600]}, at: {xyz_mm: [1000, 0, 700]}}"]
    lines += ["motion: {mode: simultaneous, duration_s: 2}"]
    (tmp_path / "cell.yaml").write_text("\n".join(lines), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    scene, toolpaths = Scene.from_cell(cell), toolpaths_of(cell)

    looks, look = [], StartTrials.touching
    monkeypatch.setattr(StartTrials, "touching", lambda trials, q: looks.append(q) or look(trials, q))
    with pytest.raises(StartNotFoundError, match=r"robots\.r0.*: 'r0/.*' touches 'wall' in all .* of task 't0'"):
        solved_start(scene, toolpaths)

    assert 0 < len(looks) <= 40  # 4 when this was written, of thousands of combinations


def test_what_given_postures_make_collide_is_left_to_the_report(cell):
    """A post through the elbow of the positioner, whose start is given: no start of an operator could help it."""
    reis = cell.robot("reis")
    elbow = ScrewChain(reis).axis_points(reis.start[None])[0, 2]
    post = Obstacle(name="post", shape=Box((0.1, 0.1, 0.1)), X_WS=pose(elbow))
    blocked = with_start(replace(cell, obstacles=(*cell.obstacles, post)), "kuka", None)
    scene = Scene.from_cell(blocked)

    q = solved_start(scene, toolpaths_of(cell))

    first, second = scene.touching(q)
    assert (first.split("/")[0], second) == ("reis", "post")


def test_base_out_of_reach_is_named(cell):
    far = replace(
        cell,
        robots=tuple(
            replace(r, start=None, X_WB=r.X_WB + np.array([[0, 0, 0, 9.0], [0] * 4, [0] * 4, [0] * 4]))
            if r.name == "kuka"
            else r
            for r in cell.robots
        ),
    )
    with pytest.raises(
        StartNotFoundError,
        match=r"robots\.kuka\.start_deg: no configuration within the joint limits brings the tool of 'kuka' to",
    ) as e:
        solved_start(Scene.from_cell(far), toolpaths_of(cell))
    assert "(48 attempts of the inverse kinematics)" in str(e.value)  # the configuration of the positioner is given


def test_multi_start_finds_the_branches_of_a_six_axis_arm(cell):
    """Shoulder, elbow and wrist of a wrist-partitioned arm each have two sides: eight branches, some out of limits."""
    robot, task = cell.robot("staubli"), cell.task("rectangle")
    chain = ScrewChain(robot)
    goal = chain.tool_poses(np.radians([[20.0, -30.0, 80.0, 40.0, 50.0, -20.0]]))[0]
    seeds = random_configurations(robot.model, 200, np.random.default_rng(0))

    q = reaching_configurations(chain, task, goal, X_WP=np.eye(4), seeds=seeds)

    assert np.abs(chain.tool_poses(q) - goal).max() < 1e-11
    branches = {tuple(np.round(np.cos(configuration) + 2 * np.sin(configuration), 4)) for configuration in q}
    assert len(branches) == 8


def test_turning_joints_are_brought_back_by_whole_turns(cell):
    model = cell.robot("kuka").model
    q = np.radians([[10.0, -20.0, 30.0, 300.0 - 360.0 * 3, 50.0, 100.0 + 360.0]])
    back = within_limits(model, q)
    np.testing.assert_allclose(np.degrees(back), [[10, -20, 30, -60, 50, 100]], atol=1e-9)


def test_margin_share_is_one_in_the_middle_and_nil_on_a_limit(cell):
    model = cell.robot("kuka").model
    middle = 0.5 * (model.lower + model.upper)
    assert joint_margin_shares(model, middle) == pytest.approx(1.0)
    assert joint_margin_shares(model, model.upper) == pytest.approx(0.0)


def test_a_task_that_settles_may_start_beside_its_path(cell):
    start = cell.robot("abb").start.copy()
    start[0] += np.radians(20.0)
    tasks = tuple(replace(task, settle=1.0) if task.robot == "abb" else task for task in cell.tasks)
    displaced = with_start(cell, "abb", start)

    assert examine_given_starts(replace(displaced, tasks=tasks), toolpaths_of(cell)) is None
    with pytest.raises(StartOffTaskError):
        examine_given_starts(displaced, toolpaths_of(cell))
