"""A tip that weaves: closed forms, derivatives, the feed along its seam, and forms that come back to their start."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from builders.roller_paths import EZ, ROLLER, circle, clocked, part_of, residual_of_twists, task_on
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.arc_length import measure
from cellplan.geometry.curves.curve import straight_sides
from cellplan.geometry.curves.seam_line import SeamAngles
from cellplan.geometry.shapes import Box
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.clocked_path import on_line, travel_speeds
from cellplan.model.task.seam import Seam, WallPlace, Weave, WeaveForm
from cellplan.model.task.task import SpacePolylinePath, Task, TimeLaw, TimeLawKind
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.path.standing import TURN
from cellplan.planning.path.weave import standing_travel, weave_knots, weave_offsets
from cellplan.planning.timing.schedule import clock_path, schedule_tasks

PLATE = part_of(Box((0.6, 0.6, 0.1)))
LINE = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05)), is_closed=False)
CORNER = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05), (0.1, 0.1, 0.05)), is_closed=False)
FILLET = Seam(walls={"plate": EZ, "tube": WallPlace.LEFT}, angles=SeamAngles(face="plate", work=0.7, travel=0.2))
SINE = Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.005)
DWELLING = Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.005, dwells=(0.001, 0.0005))
STANDING = Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.005, dwells=(0.001, 0.0005), stands=True)
FORMS = {
    "standing": STANDING,
    "standing on one side": Weave(
        form=WeaveForm.ZIGZAG, side=0.002, wavelength=0.006, dwells=(0.0, 0.002), stands=True
    ),
    "sine": SINE,
    "dwelling": DWELLING,
    "zigzag": Weave(form=WeaveForm.ZIGZAG, side=0.002, wavelength=0.006, dwells=(0.0, 0.001)),
    "triangle": Weave(form=WeaveForm.TRIANGLE, side=0.002, wavelength=0.009, out=0.003),
    "circle": Weave(form=WeaveForm.CIRCLE, side=0.0015, wavelength=0.004),
}


def welded(path: Any, weave: Weave, **words: Any) -> Task:
    return task_on(path, weave=weave, **({"tool_axis": -EZ} | words))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("place", ["line", "tube", "roller"])
def test_twists_are_the_derivatives_of_poses(form: str, place: str) -> None:
    weave = FORMS[form]
    task, part = {
        "line": (welded(LINE, weave), PLATE),
        "tube": (welded(circle(), weave, tool_axis=None, seam=FILLET, plane_offset=0.05), PLATE),
        "roller": (welded(circle(), weave, tool_axis=None, project=EZ), ROLLER),
    }[place]

    # Differences over 1e-5 of the length, of a curve whose third derivative is (2 pi / wavelength)^3 times its side.
    path = build_toolpath(task, part)
    h = 1e-5 * path.length
    assert residual_of_twists(path) <= 4.0 * h**2 / 6.0 * (10.0 * np.pi / weave.wavelength) ** 3 * weave.side + 1e-6


@pytest.mark.parametrize("place", ["line", "tube"])
def test_tool_stands_for_the_dwells_and_travels_at_the_feed_in_the_mean(place: str) -> None:
    task = {
        "line": welded(LINE, STANDING),
        "tube": welded(circle(), STANDING, tool_axis=None, seam=FILLET, plane_offset=0.05),
    }[place]
    path = build_toolpath(task, PLATE)
    moving = STANDING.wavelength - sum(STANDING.dwells)
    starts = np.arange(20.0) * STANDING.wavelength + 0.25 * moving  # the left edge is reached a quarter stroke later
    inside = np.linspace(0.01, 0.99, 7) * STANDING.dwells[0]
    X = path.poses((starts[:, None] + inside).ravel()).reshape(20, 7, 4, 4)

    assert np.abs(X - X[:, :1]).max() <= 1e-12
    on_seam = path.without_weave
    at_periods = np.arange(21.0) * STANDING.wavelength
    off = path.poses(at_periods)[:, :3, 3] - on_seam.poses(at_periods)[:, :3, 3]
    assert np.linalg.norm(off, axis=1).max() <= 1e-9  # after whole periods it is where even travel would be
    ends = path.poses(np.array([path.length]))[0, :3, 3] - on_seam.poses(np.array([path.length]))[0, :3, 3]
    assert np.linalg.norm(ends) <= STANDING.side * (1.0 + 1e-9)


@settings(max_examples=30)
@given(
    length=st.floats(0.002, 0.1), left=st.floats(0.01, 0.4), right=st.floats(0.0, 0.4), wavelength=st.floats(2e-3, 9e-3)
)
def test_travel_that_stands_never_turns_back_and_ends_with_the_seam(
    length: float, left: float, right: float, wavelength: float
) -> None:
    dwells = (left * wavelength, right * wavelength)
    weave = Weave(form=WeaveForm.SINE, side=0.003, wavelength=wavelength, dwells=dwells, stands=True)
    line = straight_sides(np.array([0.0, length]), np.array([[0.0, 0.0, 0.0], [length, 0.0, 0.0]]))
    travel = standing_travel(weave, line, measure(line))
    u = np.linspace(0.0, length, 501)
    reached = travel.at(u, travel.whole)[0]

    assert reached[0] == pytest.approx(0.0, abs=1e-15)
    assert reached[-1] == pytest.approx(length, rel=1e-12)
    assert np.diff(reached).min() >= -1e-12
    assert np.abs(reached - u).max() <= 2.0 * max(dwells) + TURN * wavelength  # the ramps of moves
    knots = np.linspace(0.01, 0.99, 9) * length
    assert np.abs(travel.at(travel.knots(knots), travel.whole)[0] - knots).max() <= 1e-9 * length


def test_corner_at_which_a_tool_stops_that_stands_at_its_edges_is_refused() -> None:
    with pytest.raises(InputError, match="would stand on before and after it"):
        build_toolpath(welded(CORNER, STANDING), PLATE)


def test_sine_on_a_line_is_the_sine_to_the_left_of_travel() -> None:
    path = build_toolpath(welded(LINE, SINE), PLATE)
    s = np.linspace(0.0, path.length, 3001)
    p = path.poses(s)[:, :3, 3]

    assert path.length == pytest.approx(0.2, abs=1e-15)
    assert np.abs(p[:, 0] - (s - 0.1)).max() <= 1e-12
    assert np.abs(p[:, 1] - 0.003 * np.sin(2.0 * np.pi * s / 0.005)).max() <= 1e-10
    assert np.ptp(p[:, 2]) <= 1e-15


def test_weave_of_a_fillet_is_across_travel_and_tool() -> None:
    plain, woven = (
        build_toolpath(task_on(circle(), seam=FILLET, plane_offset=0.05, **words), PLATE).spread(997)
        for words in ({}, {"weave": SINE})
    )
    off, travel = woven[:, :3, 3] - plain[:, :3, 3], np.cross(EZ, plain[:, :3, 3] / 0.1)

    assert np.array_equal(woven[:, :3, :3], plain[:, :3, :3])
    assert np.abs(np.sum(off * travel, axis=1)).max() <= 1e-10
    assert np.abs(np.sum(off * plain[:, :3, 2], axis=1)).max() <= 1e-10
    assert 0.00299 <= np.linalg.norm(off, axis=1).max() <= 0.003 * (1.0 + 1e-9)


@settings(max_examples=40)
@given(s=st.floats(0.0, 1.0), form=st.sampled_from(sorted(FORMS)))
def test_weave_is_periodic_and_stays_between_its_edges(s: float, form: str) -> None:
    weave = FORMS[form]
    here, later = weave_offsets(weave, np.array([s, s + weave.wavelength]))[0]

    assert np.allclose(here, later, atol=1e-11)
    assert abs(here[1]) <= weave.side * (1.0 + 1e-12)
    assert 0.0 <= here[2] <= weave.out * (1.0 + 1e-12)


@settings(max_examples=20)
@given(
    side=st.floats(1e-4, 1e-2), wavelength=st.floats(1e-3, 1e-2), left=st.floats(0.0, 0.4), right=st.floats(0.0, 0.4)
)
def test_tip_dwells_on_both_edges_for_the_lengths_that_are_stated(
    side: float, wavelength: float, left: float, right: float
) -> None:
    dwells = (left * wavelength, right * wavelength)
    weave = Weave(form=WeaveForm.ZIGZAG, side=side, wavelength=wavelength, dwells=dwells)
    s = (np.arange(4000) + 0.5) / 4000 * wavelength
    offsets, rates = weave_offsets(weave, s)
    still = np.abs(rates[:, 1]) <= 1e-9

    assert np.mean(still & (offsets[:, 1] > 0.0)) == pytest.approx(left, abs=2e-3)
    assert np.mean(still & (offsets[:, 1] < 0.0)) == pytest.approx(right, abs=2e-3)


def test_triangle_passes_its_root_and_both_edges() -> None:
    weave = FORMS["triangle"]
    third = weave.wavelength / 3.0
    at = weave_offsets(weave, third * np.arange(4.0))[0]

    assert np.allclose(at, [[0, 0, 0], [0, 0.002, 0.003], [0, -0.002, 0.003], [0, 0, 0]], atol=1e-12)


@pytest.mark.parametrize("form", FORMS)
def test_offsets_are_smooth_between_the_knots_of_a_weave(form: str) -> None:
    weave = FORMS[form]
    edges = np.concatenate([[0.0], weave_knots(weave, 0.03), [0.03]])
    for low, high in pairwise(edges.tolist()):
        s = low + (high - low) * (0.5 - 0.499 * np.cos(np.pi * np.arange(25) / 24.0))
        series = np.polynomial.chebyshev.Chebyshev.fit(s, weave_offsets(weave, s)[0][:, 1], 20)
        assert np.abs(series.coef[-3:]).max() <= 1e-10 * weave.side


def rows_of(task: Task, step: float) -> tuple[Array, Array, Array]:
    cell = clocked(task, duration=None, step=step)
    (scheduled,) = schedule_tasks(cell, [build_toolpath(task, PLATE)]).tasks
    ((begin, end, _),) = scheduled.demanded
    times = step * np.arange(len(scheduled.X_PT))
    inside = (times >= begin) & (times <= end)
    return times[inside], scheduled.X_PT[inside, :3, 3], scheduled.travelled[inside]


def test_feed_is_that_of_travel_and_rows_have_amplitude_and_wavelength() -> None:
    process = ProcessEntry(feed_mm_s=8.0)
    task = welded(LINE, SINE, process=process, feed=0.008, time_law=TimeLaw(kind=TimeLawKind.STEADY))
    times, p, travelled = rows_of(task, 0.004)

    assert np.polyfit(times, p[:, 0], 1)[0] == pytest.approx(0.008, rel=1e-9)
    assert np.abs(np.diff(travelled) / 0.004 - 0.008).max() <= 1e-11
    assert p[:, 1].max() == pytest.approx(0.003, abs=1e-5)
    assert p[:, 1].min() == pytest.approx(-0.003, abs=1e-5)
    crossings = np.flatnonzero((p[:-1, 1] < 0.0) & (p[1:, 1] >= 0.0))
    share = p[crossings, 1] / (p[crossings, 1] - p[crossings + 1, 1])
    at = p[crossings, 0] + share * (p[crossings + 1, 0] - p[crossings, 0])
    assert np.abs(np.diff(at) - 0.005).max() <= 1e-6


def test_travel_is_known_without_the_weave() -> None:
    task = welded(
        LINE, SINE, process=ProcessEntry(feed_mm_s=8.0), feed=0.008, time_law=TimeLaw(kind=TimeLawKind.STEADY)
    )
    cell = clocked(task, duration=None)
    path = clock_path(cell, task, build_toolpath(task, PLATE))
    travelled = np.linspace(0.0, 0.2, 301)
    points, off = on_line(path, travelled)

    assert np.abs(points - np.stack([travelled - 0.1, 0.0 * travelled, 0.0 * travelled + 0.05], axis=1)).max() <= 1e-12
    assert np.abs(off[:, 1] - 0.003 * np.sin(2.0 * np.pi * travelled / 0.005)).max() <= 1e-10
    assert travel_speeds(path, np.linspace(1.0, 20.0, 57)) == pytest.approx(np.full(57, 0.008), rel=1e-8)


def test_closed_seam_is_gone_through_again_only_after_whole_periods() -> None:
    whole = Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.2 * np.pi / 40.0)
    half = Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.2 * np.pi / 40.25)

    assert build_toolpath(welded(circle(), whole, plane_offset=0.05), PLATE).is_closed
    assert not build_toolpath(welded(circle(), half, plane_offset=0.05), PLATE).is_closed


def test_corners_at_which_a_weaving_tool_stops_are_refused_where_it_would_jump() -> None:
    with pytest.raises(InputError, match=r"tasks.ring.path.weave: expected corners that are rounded"):
        build_toolpath(welded(CORNER, Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.0047)), PLATE)

    rounded = build_toolpath(welded(CORNER, SINE, blend=0.02), PLATE)
    assert residual_of_twists(rounded) <= 1e-2
