"""Depth of tools in the part, from written rows: what is buried fails with its depth, what touches passes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import work
from builders.tool_over_part import BARE, PEN, tool_over_part

from cellplan.checks.clearance.tool_depth import check_depths
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Solid
from cellplan.geometry.transforms import Array
from cellplan.measures.tool_depth import tool_depths
from cellplan.model.cell.cell import Cell, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check, ToolDepth
from cellplan.model.task.task import Frame, SampledPath, Task
from cellplan.scene.kinematics.screw_chain import ScrewChain

SHEET = Box((0.4, 0.4, 0.002))


def cell_with(tool: Tool, part: Solid, task: Task | None = None) -> Cell:
    return tool_over_part(tool, part, task or work("drill"))


def depth_of(cell: Cell, heights: Sequence[float] | Array) -> tuple[ToolDepth, Check]:
    """What is said of a tool whose tip passes these heights in [m], one after another in 1 s."""
    q = np.asarray(heights, dtype=float)[:, None]
    times = np.linspace(0.0, 1.0, len(q))
    scheduled = TaskSchedule(
        task=cell.tasks[0],
        X_PT=np.broadcast_to(np.eye(4), (len(q), 4, 4)),
        V_PT_P=np.zeros((len(q), 6)),
        travelled=np.zeros(len(q)),
        length=1.0,
        end=1.0,
    )
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    depths = tool_depths(cell, Schedule(times=times, tasks=(scheduled,)), chains, {"drill": q})
    (check,) = check_depths(cell, depths)
    return depths[0], check


@pytest.mark.parametrize("tool", [PEN, BARE])
@pytest.mark.parametrize("part", [SHEET, tessellate(SHEET)])
def test_a_pen_through_a_sheet_fails_with_all_that_is_inside_and_beyond(tool: Tool, part: Solid) -> None:
    depth, check = depth_of(cell_with(tool, part), [0.05, 0.001, -0.014, 0.02])

    assert depth.depth == pytest.approx(0.015, abs=1e-9)
    assert depth.at_s == pytest.approx(2.0 / 3.0)
    assert not check.passed
    assert check.message.startswith(
        "tool depth of task 'work_of_drill': 15 mm of the tool is inside the part or beyond it"
    )


@pytest.mark.parametrize("tool", [PEN, BARE])
def test_a_tool_that_touches_or_hovers_passes(tool: Tool) -> None:
    depth, check = depth_of(cell_with(tool, SHEET), np.linspace(0.05, 0.001, 51))

    assert depth.depth == pytest.approx(0.0, abs=1e-9)
    assert check.passed


def test_a_plunge_between_two_rows_is_found_where_joints_move_evenly() -> None:
    block = Box((0.4, 0.4, 0.1))
    q = [0.2, 0.04, 0.2]

    depth, _ = depth_of(cell_with(BARE, block), q)

    assert (depth.depth, depth.at_s) == (pytest.approx(0.01, abs=1e-9), pytest.approx(0.5))


def test_a_thin_plate_that_is_passed_between_two_rows_is_found() -> None:
    depth, check = depth_of(cell_with(BARE, SHEET), [0.05, -0.3])  # below -0.12 the tool is beyond the sheet wholly

    assert depth.depth > 0.09
    assert depth.at_s not in (0.0, 1.0)
    assert not check.passed


@pytest.mark.parametrize(("allowed", "passes"), [(0.002, False), (0.003, True), (0.004, True)])
def test_a_task_that_cuts_may_be_as_deep_as_it_says(allowed: float, passes: bool) -> None:
    task = replace(work("drill"), tool_depth=allowed)

    depth, check = depth_of(cell_with(PEN, Box((0.4, 0.4, 0.1)), task), [0.1, 0.047 - 1e-9, 0.1])

    assert (check.passed, check.limit) == (passes, pytest.approx(1e3 * allowed))
    assert depth.depth == pytest.approx(0.003, abs=1e-8)


def test_a_task_in_the_world_has_no_depth() -> None:
    cell = cell_with(PEN, SHEET, replace(work("drill"), relative_to=Frame.WORLD))
    scheduled = TaskSchedule(
        task=cell.tasks[0],
        X_PT=np.eye(4)[None],
        V_PT_P=np.zeros((1, 6)),
        travelled=np.zeros(1),
        length=1.0,
        end=1.0,
    )

    assert tool_depths(cell, Schedule(times=np.zeros(1), tasks=(scheduled,)), {}, {}) == ()


def test_the_cure_fits_the_task() -> None:
    up = np.array([0.0, 0.0, 1.0])
    file = SampledPath(
        source="path.csv", points=np.zeros((2, 3)), axes=None, rotations=None, is_smooth=True, is_closed=False
    )
    words = {
        "project the path onto the surface (path.project)": work("drill"),
        "reverse tool_axis": replace(work("drill"), project=up, tool_axis=up),
        "check the points and axes of the file": replace(work("drill"), path=file),
    }
    for cure, task in words.items():
        _, check = depth_of(cell_with(BARE, Box((0.4, 0.4, 0.1)), task), [0.0, 0.0])
        assert f"; {cure}" in check.message
        assert check.message.endswith("allow it with tool_depth_mm if the process removes material")
