"""Lines and arcs that are chosen along the path of a tool."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import work

from cellplan.geometry.transforms import Array, pose
from cellplan.model.settings.task import ToleranceEntry
from cellplan.programs.seams.choose import ToolPath
from cellplan.programs.seams.shapes import corner_cut

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


def corner(step: float) -> ToolPath:
    """A path of 40 mm along x and 40 mm along y, with a row each so many [m], whose tool may be off by 1 mm."""
    along = np.arange(0.0, 0.04 + 0.5 * step, step)
    X = np.repeat(pose((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0))[None], 2 * len(along) - 1, axis=0)
    X[:, 0, 3] = np.append(along, np.full(len(along) - 1, along[-1]))
    X[:, 1, 3] = np.append(np.zeros(len(along)), along[1:])
    task = replace(work("alpha"), tolerance=ToleranceEntry(position_mm=1.0, orientation_deg=1.0))
    return ToolPath(task=task, X_PT=X, most=5e-5, smallest_zone=1e-3)


def test_a_corner_that_is_rounded_too_little_for_a_number_has_a_short_line_before_it() -> None:
    """Half of that line is the most that a corner of a right angle may be rounded by: its cut is 0.71 of it."""
    path = corner(2e-4)
    last = len(path.X_PT) - 1
    pieces, in_process = list(path.pieces([0, last])), np.ones(last + 1, dtype=bool)

    before, short, after = path.divided(pieces, in_process)

    assert [piece.last for piece in pieces] == [short.last, after.last]
    allowed = 0.25 * path.task.tolerance.between[0]
    assert corner_cut(short.shape, after.shape, 0.5 * short.shape.length).cut <= allowed
    assert corner_cut(short.shape, after.shape, 0.5 * short.shape.length + 1e-4).cut > allowed  # a row farther away
    np.testing.assert_allclose(before.shape.poses(np.ones(1))[0], short.shape.start, atol=1e-12)
    assert list(path.divided(pieces, ~in_process)) == pieces
    assert list(replace(path, smallest_zone=0.0).divided(pieces, in_process)) == pieces


def test_rows_that_are_far_apart_leave_a_corner_as_it_is() -> None:
    path = corner(5e-3)
    last = len(path.X_PT) - 1
    pieces = list(path.pieces([0, last]))

    assert list(path.divided(pieces, np.ones(last + 1, dtype=bool))) == pieces
