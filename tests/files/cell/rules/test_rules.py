"""A task whose path brings its own clock leaves the times to the file."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import TimedPath

Load = Callable[..., Cell]
ROWS = "t_s,x_mm,y_mm,z_mm,i,j,k\n0,0,0,250,0,0,-1\n1,50,0,250,0,0,-1\n2,50,50,250,0,0,-1\n3,0,0,250,0,0,-1\n"
CIRCLE = "path: {circle: {radius_mm: 100, plane: xy}, project: +z}"
CSV = "path: {csv: {file: loop.csv, closed: true}}"


@pytest.fixture
def load_timed(load: Load) -> Load:
    """Loads the small cell with a closed trajectory of 3 s, and further changes."""

    def load_changed(*changes: tuple[str, str], path: str = CSV) -> Cell:
        Path("loop.csv").write_text(ROWS, encoding="utf-8")
        return load((CIRCLE, path), *changes)

    return load_changed


def test_the_file_decides_on_times_and_the_motion_on_nothing(load_timed: Load) -> None:
    task = load_timed(("motion: {duration_s: 4}", "motion: {duration_s: 4, time_law: trapezoid, corners: stop}")).tasks[
        0
    ]

    assert isinstance(task.path, TimedPath)
    assert (task.duration, task.feed) == (None, None)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("duration_s: 3", "duration_s: unexpected key, the column t_s of the path's file decides"),
        ("feed_mm_s: 3", "feed_mm_s: unexpected key, the column t_s of the path's file decides"),
        ("time_law: quintic", "time_law: unexpected key, the column t_s of the path's file decides"),
        ("corners: stop", "corners: unexpected key, the column t_s of the path's file decides"),
        (
            "tool_turn_deg: 30",
            "tool_turn_deg: expected no turn on a path with a column t_s; give the turn as qw,qx,qy,qz in the file",
        ),
    ],
)
def test_what_the_file_decides_is_refused_in_the_cell(load_timed: Load, key: str, message: str) -> None:
    with pytest.raises(InvalidFileError) as caught:
        load_timed(("tool_axis: normal", key))

    assert str(caught.value) == f"c:20: tasks.ring.{message}"


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (
            "path: {csv: loop.csv, project: +z}",
            "c:19: tasks.ring.path.project: unexpected key, a path with a column t_s is used as it stands in the file",
        ),
        (
            "path: {csv: {file: loop.csv, smooth: false}}",
            "c:19: tasks.ring.path.csv.smooth: expected true for a file with a column t_s: straight sides would jump "
            "in speed, got false",
        ),
    ],
)
def test_a_trajectory_is_smooth_and_used_as_it_stands(load_timed: Load, path: str, message: str) -> None:
    with pytest.raises(InvalidFileError) as caught:
        load_timed(path=path)

    assert str(caught.value) == message


def test_a_trajectory_that_outlasts_the_clock_is_refused(load_timed: Load) -> None:
    with pytest.raises(InvalidFileError) as caught:
        load_timed(("tool_axis: normal", "repeat: 2"))
    with pytest.raises(InvalidFileError) as late:
        load_timed(("tool_axis: normal", "start_s: 1.5"))

    assert str(caught.value) == (
        "c:19: tasks.ring.path.csv: expected an end within the clock (motion.duration_s = 4), got start_s + 2 cycles "
        "of 3 s of loop.csv = 6"
    )
    assert "got start_s + 3 s of loop.csv = 4.5" in str(late.value)


def test_a_written_cell_with_a_trajectory_loads_to_the_same_task(load_timed: Load) -> None:
    cell = load_timed(("tool_axis: normal", "repeat: 3\n    settle_s: 0.5"), ("duration_s: 4", "duration_s: 9"))

    text = render_cell(cell)
    Path("again").write_text(text, encoding="utf-8")
    again = load_cell("again")

    first, second = cell.tasks[0], again.tasks[0]
    assert isinstance(second.path, TimedPath)
    assert np.array_equal(first.path.times, second.path.times)
    assert (second.repeat, second.settle, second.path.is_closed, second.duration) == (3, 0.5, True, None)
    assert render_cell(again) == text
    assert "time_law" not in text.split("tasks:")[1].split("motion:")[0]
