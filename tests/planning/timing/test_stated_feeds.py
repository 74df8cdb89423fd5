"""Feeds that a file states: closed forms of the time, derivatives of the motion, delays at rapids."""

from dataclasses import replace

import numpy as np
import pytest
from builders.cam_files import milling_cell

from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.clocked_path import ClockedPath, demanded_spans, fixed_rests, process_spans, stops_of
from cellplan.model.task.task import ProgrammedPath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_path, schedule_tasks

RAMP = 0.1
DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    folder = tmp_path_factory.mktemp("cell")
    (folder / "part.apt").write_text("UNITS/MM\nFEDRAT/60\nGOTO/0,0,200\nGOTO/9,0,200\n")
    (folder / "cell.yaml").write_text(milling_cell("{apt: part.apt}", more="    tool_axis: -z\n"))
    return load_cell(folder / "cell.yaml")


def clocked(
    cell: Cell, points_mm: list, speeds_mm_s: list, rapid: tuple[int, ...] = (), **process: float
) -> ClockedPath:
    """A path with a speed for each side, on the clock."""
    points = np.array(points_mm) * 1e-3
    path = ProgrammedPath(
        source="part.apt",
        points=points,
        axes=np.tile(DOWN, (len(points), 1)),
        rotations=None,
        is_smooth=False,
        is_closed=False,
        speeds=np.array(speeds_mm_s) * 1e-3,
        is_rapid=np.isin(np.arange(len(points) - 1), rapid),
        rounding=1e-5,
        stop_angle=np.deg2rad(20.0),
    )
    task = replace(cell.tasks[0], path=path, tool_axis=None, process=ProcessEntry(ramp_s=RAMP, **process))
    return clock_path(cell, task, build_toolpath(task, cell.part))


def test_each_stretch_takes_its_length_through_its_feed_and_half_a_ramp_for_each_change_of_speed(cell: Cell) -> None:
    """20 mm at 10 mm/s and 30 mm at 40 mm/s: the ramp between 10 and 40 mm/s lies in the faster one."""
    path = clocked(cell, [[0, 0, 200], [20, 0, 200], [50, 0, 200]], [10, 40])

    first = 20 / 10 + RAMP / 2
    second = 30 / 40 + RAMP / 2 + RAMP / 2 * (1 - 10 / 40)
    assert np.diff(path.corners) == pytest.approx([first, second], rel=1e-12)
    assert stops_of(path) == pytest.approx([0.0, first + second])
    spans = demanded_spans(path)
    assert [span.feed for span in spans] == pytest.approx([0.01, 0.04])
    assert (spans[0].begin, spans[0].end) == pytest.approx((RAMP, first))
    assert (spans[1].begin, spans[1].end) == pytest.approx((first + RAMP, first + second - RAMP))


def test_a_feed_that_is_stated_twice_and_points_on_a_line_change_nothing(cell: Cell) -> None:
    one = clocked(cell, [[0, 0, 200], [20, 0, 200]], [10])
    many = clocked(cell, [[0, 0, 200], [1, 0, 200], [7, 0, 200], [20, 0, 200]], [10, 10, 10])

    assert many.corners == pytest.approx(one.corners, rel=1e-12)
    times = np.linspace(0.0, one.end, 101)
    assert np.abs(one.poses(times) - many.poses(times)).max() < 1e-12


@pytest.mark.parametrize("feeds", [[10, 40, 10], [40, 10, 40], [10, 20, 40], [40, 39, 1]])
def test_the_twist_is_the_derivative_of_the_pose_and_the_feed_holds_where_it_is_demanded(
    cell: Cell, feeds: list
) -> None:
    path = clocked(cell, [[0, 0, 200], [20, 0, 200], [40, 3, 200], [60, 9, 203]], feeds)
    times = np.linspace(0.0, path.end, 20_001)
    h = times[1]
    X, V, travelled = path.targets(times)

    numeric = (X[2:, :3, 3] - X[:-2, :3, 3]) / (2.0 * h)
    assert np.linalg.norm(numeric - V[1:-1, :3], axis=1).max() < 5e-4
    speeds = np.linalg.norm(V[:, :3], axis=1)
    for begin, end, feed in demanded_spans(path):
        assert np.abs(speeds[(times >= begin) & (times <= end)] - feed).max() < 1e-12
    assert speeds.max() <= max(feeds) * 1e-3 * (1.0 + 1e-12)
    assert speeds[0] == 0.0
    assert travelled[-1] == pytest.approx(path.toolpath.length)


def test_sharp_corners_are_stops_and_others_are_rounded_within_the_stated_distance(cell: Cell) -> None:
    points = [[0, 0, 200], [20, 0, 200], [40, 5, 200], [40, 25, 200]]
    path = clocked(cell, points, [10, 10, 10])

    assert len(stops_of(path)) == 3
    p = path.toolpath.poses(np.linspace(0.0195, 0.0205, 5001))[:, :3, 3]
    distance = np.linalg.norm(p - np.array(points[1]) * 1e-3, axis=1).min()
    assert distance == pytest.approx(1e-5, rel=1e-3)
    assert path.poses(stops_of(path))[1, :3, 3] == pytest.approx(np.array(points[2]) * 1e-3, abs=1e-12)


def test_stretches_that_are_too_short_for_their_feed_go_from_stop_to_stop_below_it(cell: Cell) -> None:
    """0.5 mm at 10 mm/s: two ramps of 0.1 s cover it at 5 mm/s, as its top speed."""
    path = clocked(cell, [[0, 0, 200], [0, 20, 200], [0.5, 20, 200], [0.5, 0, 200]], [10, 10, 10])

    assert path.pace is not None
    assert path.pace.tops == pytest.approx([0.01, 0.005, 0.01])
    assert path.pace.is_at_feed.tolist() == [True, False, True]
    assert np.diff(path.corners)[1] == pytest.approx(2 * RAMP)
    assert [span.feed for span in demanded_spans(path)] == pytest.approx([0.01, 0.01])


def test_a_short_stretch_between_two_feeds_stops_at_both_of_its_ends(cell: Cell) -> None:
    path = clocked(cell, [[0, 0, 200], [20, 0, 200], [20.5, 0, 200], [40, 0, 200]], [10, 20, 30])

    assert len(stops_of(path)) == 4
    speeds = np.linalg.norm(path.targets(path.corners)[1][:, :3], axis=1)
    assert speeds.max() < 1e-15


def test_the_process_is_off_on_rapids_and_rests_for_its_delays_at_both_ends_of_them(cell: Cell) -> None:
    points = [[0, 0, 200], [20, 0, 200], [20, 0, 230], [40, 0, 230], [40, 0, 200], [60, 0, 200]]
    path = clocked(cell, points, [10, 250, 250, 250, 10], (1, 2, 3), on_delay_s=0.3, off_delay_s=0.2)

    cut = 20 / 10 + RAMP
    rapids = 2 * (30 / 250 + RAMP) + 20 / 200 + RAMP  # the middle one is too short for 250 mm/s: 200 mm/s at its top
    on, off = 0.3 + cut + 0.2, 0.3 + cut + 0.2
    assert np.ravel(process_spans(path)) == pytest.approx([0.0, on, on + rapids, on + rapids + off])
    assert sorted(end - begin for begin, end in fixed_rests(path)) == pytest.approx([0.2, 0.2, 0.3, 0.3])
    X, V, _ = path.targets(np.array([on - 0.1, on - 1e-6, on + rapids + 1e-6, on + rapids + 0.2]))
    assert X[:, :3, 3] == pytest.approx(np.array([points[1], points[1], points[4], points[4]]) * 1e-3, abs=1e-9)
    assert np.abs(V).max() < 1e-3


def test_knots_are_passed_at_the_times_that_the_breaks_say(cell: Cell) -> None:
    points = [[0, 0, 200], [20, 0, 200], [40, 3, 200], [40, 3, 230], [60, 9, 203], [70, 9, 203]]
    path = clocked(cell, points, [10, 40, 250, 10, 20], (2,), on_delay_s=0.3, off_delay_s=0.2)
    breaks = path.breaks

    _, _, travelled = path.targets(breaks)
    behind = path.toolpath.arc.lengths(path.toolpath.knots)
    nearest = np.abs(travelled[None] - behind[:, None]).min(axis=1)
    assert nearest.max() < 1e-12


def test_the_schedule_holds_feeds_stops_and_process_of_the_path(cell: Cell) -> None:
    schedule = schedule_tasks(cell, [build_toolpath(cell.tasks[0], cell.part)])

    task = schedule.tasks[0]
    assert [span.feed for span in task.demanded] == pytest.approx([0.001])
    assert task.process_on == ((0.0, pytest.approx(9.1)),)
    assert task.stops == (0.0, pytest.approx(9.1))
