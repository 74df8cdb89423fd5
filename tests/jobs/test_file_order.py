"""The order in which a file lists robots, tasks, further holders and obstacles changes nothing."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from builders.timed_cells import solved_start

from cellplan import load_cell, solve
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.name_order import NameOrder
from cellplan.planning.path.build import build_toolpath
from cellplan.runs.solution import Solution
from cellplan.scene.scene import Scene

THREE_PLANAR_ARMS = """
cellplan: 1
name: three-arms
robots:
  {robots}
part:
  geometry: {{box: {{size_mm: [340, 300, 10]}}}}
  held_by: [{{robot: left, at: {{xyz_mm: [-120, 0, 5], rpy_deg: [180, 0, 0]}}}}]
tasks:
  {tasks}
motion: {{mode: simultaneous, duration_s: 2, step_s: 0.02, time_law: quintic}}
solver: {{method: {method}}}
"""
ARMS = {
    "left": "{model: planar_3r, base: {xyz_mm: [0, 0, 500]}, tool: {xyz_mm: [0, 0, 40]}, start_deg: [50, -85, 35]}",
    "right": "{model: planar_3r, base: {xyz_mm: [1900, 300, 500], rpy_deg: [0, 0, 180]}, tool: {xyz_mm: [0, 0, 40]}}",
    "upper": "{model: planar_3r, base: {xyz_mm: [900, 950, 800], rpy_deg: [0, 0, -90]}, tool: {xyz_mm: [0, 0, 340]}}",
}
ON_PLATE = "project: +z}, tool_axis: normal, tool_x: -x, axes: [x, y, rz]}"
TASKS = {
    "circle": f"circle: {{robot: right, path: {{circle: {{radius_mm: 60, center_mm: [80, -60], plane: xy}}, {ON_PLATE}",
    "line": f"line: {{robot: upper, path: {{polyline: {{points_mm: [[0, 100, 0], [60, 120, 0]]}}, {ON_PLATE}",
}


def three_arms(folder: Path, order: tuple[str, ...], tasks: tuple[str, ...], method: str) -> Cell:
    text = THREE_PLANAR_ARMS.format(
        robots="\n  ".join(f"{name}: {ARMS[name]}" for name in order),
        tasks="\n  ".join(TASKS[name] for name in tasks),
        method=method,
    )
    path = folder / "cell.yaml"
    path.write_text(text, encoding="utf-8")
    return load_cell(path)


def by_robot(solution: Solution) -> Mapping[str, Array]:
    """Joint motion of every robot."""
    return {name: q for run in solution.runs for name, q in run.report.q.items()}


@pytest.mark.slow
@pytest.mark.parametrize(
    "method", ["weighted_pseudo_inverse", pytest.param("recursive_search", marks=pytest.mark.slow)]
)
def test_starts_motion_and_verdict_are_the_same_to_the_last_digit(tmp_path: Path, method: str) -> None:
    solutions = [
        solve(three_arms(tmp_path, order, tasks, method))
        for order, tasks in [
            (("left", "right", "upper"), ("circle", "line")),
            (("upper", "right", "left"), ("line", "circle")),
        ]
    ]

    first, other = (by_robot(solution) for solution in solutions)
    assert set(first) == set(other) == set(ARMS)
    for name, q in first.items():
        np.testing.assert_array_equal(other[name], q)
    verdicts = [
        {(check.name, check.subject, check.passed, check.value) for check in solution.runs[0].report.checks}
        for solution in solutions
    ]
    assert verdicts[0] == verdicts[1]


def start_by_robot(cell: Cell) -> Mapping[str, Array]:
    """The start that is found, by robot."""
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    q = solved_start(Scene.from_cell(cell), toolpaths)
    return {robot.name: q[cell.columns(robot.name)] for robot in cell.robots}


def test_holders_found_together_do_not_depend_on_the_order(cells: Path) -> None:
    cell = load_cell(cells / "load_sharing_planar.yaml")
    expected = start_by_robot(cell)

    starts = start_by_robot(replace(cell, robots=cell.robots[::-1]))

    for name, q in expected.items():
        np.testing.assert_array_equal(starts[name], q)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["load_sharing", "dual_arm"])
def test_starts_of_real_arms_do_not_depend_on_the_order(cells: Path, name: str) -> None:
    cell = load_cell(cells / f"{name}.yaml")
    expected = start_by_robot(cell)
    for robots in list(permutations(cell.robots))[1:]:
        starts = start_by_robot(replace(cell, robots=robots))
        for robot, q in expected.items():
            np.testing.assert_array_equal(starts[robot], q)


def test_the_way_to_the_order_of_names_and_back_is_none(cells: Path) -> None:
    cell = load_cell(cells / "four_robots.yaml")
    order = NameOrder.of(cell)
    q = np.arange(2.0 * cell.joint_count).reshape(2, -1)

    there = order.sorted(q)

    np.testing.assert_array_equal(order.as_listed(there), q)
    assert [robot.name for robot in order.cell.robots] == ["abb", "kuka", "reis", "staubli"]
    assert order.cell.positioners == cell.positioners
    for robot in cell.robots:
        np.testing.assert_array_equal(there[:, order.cell.columns(robot.name)], q[:, cell.columns(robot.name)])
