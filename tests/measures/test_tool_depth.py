"""Depth of a tool's axis on its desired path against a closed form and against points that are counted."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import work
from builders.tool_over_part import BARE, DOWN, tool_over_part

from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.measures.tool_depth import path_depth

BLOCK = Box((0.4, 0.4, 0.1))


def test_the_desired_path_is_measured_where_the_task_keeps_the_axis() -> None:
    cell = tool_over_part(BARE, BLOCK, work("drill"))
    X_PT = pose((0.0, 0.0, 0.035), DOWN)[None]

    desired = path_depth(cell, cell.tasks[0], X_PT)

    assert desired is not None
    assert desired.depth == pytest.approx(0.015, abs=1e-12)
    assert path_depth(cell, replace(cell.tasks[0], axes=(0, 1, 2)), X_PT) is None


def test_depth_is_what_counted_points_of_the_axis_are_inside_or_beyond() -> None:
    generator, half = np.random.default_rng(4), 0.5 * np.array(BLOCK.size)
    cell, behind = tool_over_part(BARE, BLOCK, work("drill")), np.linspace(0.1, 0.0, 20_001)  # from the flange
    depths = []
    for _ in range(200):
        X_PT = pose(generator.uniform(-1.2, 1.2, 3) * half, generator.uniform(-3.0, 3.0, 3))
        inside = np.all(np.abs(X_PT[:3, 3] - behind[:, None] * X_PT[:3, 2]) <= half, axis=1)
        if inside[0]:
            continue  # where the axis came in is not on it
        depths.append(behind[np.argmax(inside)] if inside.any() else 0.0)

        measured = path_depth(cell, cell.tasks[0], X_PT[None])

        assert measured is not None
        shift = 2e-5 / np.abs(X_PT[:3, 2]).min()  # of the entry into an inclined face, 10 um off the axis
        assert measured.depth == pytest.approx(depths[-1], abs=shift)

    assert sum(depth > 0.0 for depth in depths) > 30
