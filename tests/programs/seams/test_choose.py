"""Lines and arcs that are chosen along the path of a tool."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import work

from cellplan.geometry.transforms import Array, pose
from cellplan.programs.seams.choose import ToolPath

RADIUS = 0.08  # [m]
ROUND = np.deg2rad(368.0)  # [rad]


def circle(rows: int) -> Array:
    """Poses of a tool that points down and moves a little more than once round a circle, shape (N, 4, 4)."""
    X = np.repeat(pose((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0))[None], rows, axis=0)
    angles = np.linspace(0.0, ROUND, rows)
    X[:, :2, 3] = RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])
    return X


@pytest.mark.parametrize("rows", [400, 401, 402])
def test_the_last_arc_is_as_long_as_it_is_needed(rows: int) -> None:
    """Three arcs of 120 degrees leave a short rest, on which no output could be switched ahead."""
    path = ToolPath(task=replace(work("alpha"), name="seam"), X_PT=circle(rows), most=5e-5)
    longer = replace(path, least=0.02)

    short, long = list(path.pieces([0, rows - 1])), list(longer.pieces([0, rows - 1]))

    assert len(long) == len(short)
    assert short[-1].shape.length < 0.02 < long[-1].shape.length
    assert [piece.last for piece in short[:-2]] == [piece.last for piece in long[:-2]]
    for pieces in (short, long):
        assert pieces[-1].last == rows - 1
        assert sum(piece.shape.length for piece in pieces) == pytest.approx(ROUND * RADIUS, abs=1e-5)
