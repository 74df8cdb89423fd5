"""A tool's motion at any instant: that of the schedule, smooth between the breaks and nowhere else."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from builders.roller_paths import (
    EX,
    EY,
    EZ,
    ON_ROLLER,
    RECTANGLE,
    RHOMBUS,
    ROLLER,
    circle,
    clocked,
    part_of,
    sampled,
    task_on,
)
from numpy.polynomial import chebyshev

from cellplan.errors import InputError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import Array, rotation_exp, rotation_vector
from cellplan.model.cell.cell import Part
from cellplan.model.motion.motion import Schedule
from cellplan.model.task.clocked_path import ClockedPath, distinct
from cellplan.model.task.task import (
    TIME_TOLERANCE,
    SpacePolylinePath,
    StraightMove,
    Task,
    TimedPath,
    TimeLaw,
    TimeLawKind,
)
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_path, schedule_tasks

DEGREE = 16
SMOOTH = 2e-13  # [m], [rad] the arc length is known to about twelve digits
ROUGH = np.linspace(0.0, 1.0, 14)
ELL = SpacePolylinePath(points=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.1, 0.0), (0.2, 0.1, 0.2)), is_closed=False)
RING = np.stack([0.1 * np.cos(2 * np.pi * ROUGH), 0.07 * np.sin(2 * np.pi * ROUGH), 0.02 * np.cos(7 * ROUGH)], axis=1)
AXES = np.stack([0.3 * np.sin(3 * ROUGH), 0.2 * np.cos(5 * ROUGH), -np.ones(14)], axis=1)
AXES /= np.linalg.norm(AXES, axis=1, keepdims=True)
TURNS = rotation_exp(np.stack([0.5 * ROUGH, np.sin(2 * ROUGH), 0.4 * ROUGH**2], axis=1))
UNEVEN = 3.0 * ROUGH**1.3
LAWS = {
    "constant": TimeLaw(kind=TimeLawKind.CONSTANT),
    "quintic": TimeLaw(kind=TimeLawKind.QUINTIC),
    "trapezoid": TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.2),
    "triangle": TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.5),
}
MOVES = {"approach": StraightMove(distance=0.05, duration=0.3), "retract": StraightMove(distance=0.08, duration=0.4)}
ON_BALL, ON_BOX, ON_MESH = part_of(Sphere(0.3)), part_of(Box((0.5, 0.4, 0.3))), part_of(tessellate(Sphere(0.3)))


def timed(**words: Any) -> TimedPath:
    plain: dict[str, Any] = {"source": "loop.csv", "axes": None, "rotations": None, "is_closed": False}
    return TimedPath(times=UNEVEN, points=RING, **(plain | words))


CLOSED = {"points": np.vstack([RING[:-1], RING[:1]]), "is_closed": True}
PATHS: dict[str, tuple[Task, Part]] = {
    "circle": (ON_ROLLER["circle"], ROLLER),
    "rectangle": (ON_ROLLER["rectangle"], ROLLER),
    "rhombus": (ON_ROLLER["rhombus"], ROLLER),
    "rounded": (replace(ON_ROLLER["rectangle"], blend=0.03), ROLLER),
    "used up": (task_on(RECTANGLE, tool_axis=EY, blend=0.125), ROLLER),
    "rounded rhombus": (task_on(RHOMBUS, tool_axis=-EX, tool_x=EZ, blend=0.02), ROLLER),
    "polyline": (task_on(ELL, tool_axis=-EZ), ROLLER),
    "circle on a ball": (task_on(circle(0.1, center=(0.02, 0.01)), project=EZ), ON_BALL),
    "rectangle on a box": (task_on(RECTANGLE, project=-EY, blend=0.02), ON_BOX),
    "circle on a mesh": (task_on(circle(0.05), project=EZ), ON_MESH),
    "smooth file": (task_on(sampled(RING[:-1], axes=AXES[:-1], is_smooth=True, is_closed=True)), ROLLER),
    "smooth file of frames": (task_on(sampled(RING, rotations=TURNS, is_smooth=True)), ROLLER),
    "sides of a file": (task_on(sampled(RING, axes=AXES)), ROLLER),
    "rounded sides of a file": (task_on(sampled(RING, rotations=TURNS), blend=0.01), ROLLER),
    "trajectory": (task_on(timed(axes=AXES)), ROLLER),
    "trajectory of frames": (task_on(timed(rotations=TURNS)), ROLLER),
}
CYCLES: dict[str, tuple[Task, Part]] = {
    "circles": (task_on(circle(), project=EZ, repeat=3, turn=1.0), ROLLER),
    "rectangles": (task_on(RECTANGLE, project=-EY, repeat=2, turn=1.0), ROLLER),
    "smooth files": (task_on(sampled(RING[:-1], is_smooth=True, is_closed=True), tool_axis=-EZ, repeat=2), ROLLER),
    "trajectories": (
        task_on(TimedPath(source="a.csv", times=UNEVEN, axes=None, rotations=None, **CLOSED), tool_axis=-EZ, repeat=2),
        ROLLER,
    ),
}
CASES = {
    f"{name}-{kind}": (replace(task, start=0.4123, time_law=law, **MOVES), part)
    for name, (task, part) in (PATHS | CYCLES).items()
    for kind, law in LAWS.items()
    if not (isinstance(task.path, TimedPath) or name == "circle on a mesh") or kind == "trapezoid"
    if kind != "triangle" or name in {"circles", "rectangles", "rounded"}
}


def clock(task: Task, part: Part = ROLLER, *, step: float = 0.01) -> Schedule:
    task = replace(task, duration=task.time_for_path(5.0))
    return schedule_tasks(clocked(task, duration=None, step=step), [build_toolpath(task, part)])


@cache
def case(name: str) -> Schedule:
    return clock(*CASES[name])


@cache
def spectra_of(name: str) -> tuple[Array, Array, Array]:
    (path,) = case(name).paths
    return spectra(path, path.breaks)


def around(breaks: Array, times: Array) -> tuple[Array, Array]:
    """The two breaks round each instant; at a break the later side."""
    k = np.clip(np.searchsorted(breaks, times, side="right") - 1, 0, len(breaks) - 2)
    return breaks[k], breaks[k + 1]


def panels(breaks: Array, count: int, nodes: Array) -> tuple[Array, tuple[Array, Array], Array]:
    """Instants of shape (panels * nodes,) of ``count`` panels in each interval, the interval, the panels' widths."""
    edges = breaks[:-1, None] + np.linspace(0.0, 1.0, count + 1) * np.diff(breaks)[:, None]
    low, high = edges[:, :-1, None], edges[:, 1:, None]
    times = (low + 0.5 * (nodes + 1.0) * (high - low)).ravel()
    rows = count * len(nodes)
    return times, (np.repeat(breaks[:-1], rows), np.repeat(breaks[1:], rows)), (high - low).ravel()


def spectra(path: ClockedPath, breaks: Array) -> tuple[Array, Array, Array]:
    """Chebyshev coefficients of the motion on each panel, shape (panels, DEGREE + 1, 6), errors of twists and widths.

    The number of panels is prime, so that no border of theirs is a break that was left out.
    """
    nodes, count = chebyshev.chebpts2(DEGREE + 1), 19 if len(breaks) < 100 else 2
    times, within, widths = panels(breaks, count, nodes)
    X, V = path.at(times, within)
    X, V = X.reshape(-1, DEGREE + 1, 4, 4), V.reshape(-1, DEGREE + 1, 6)
    R = X[:, :, :3, :3]
    vectors = rotation_vector(R @ np.swapaxes(R[:, DEGREE // 2, None], 2, 3))
    motion = np.concatenate([X[:, :, :3, 3], vectors], axis=2)
    coefficients = np.linalg.solve(chebyshev.chebvander(nodes, DEGREE), motion)
    slopes = chebyshev.chebval(0.0, chebyshev.chebder(coefficients, axis=1).transpose(1, 0, 2))
    return coefficients, V[:, DEGREE // 2] - slopes * 2.0 / widths[:, None], widths


def tails(coefficients: Array) -> Array:
    """Largest of the last coefficients in [m] or [rad] on each panel: rounding where the motion is smooth."""
    largest: Array = np.abs(coefficients[:, -3:]).max(axis=(1, 2))
    return largest


@pytest.mark.parametrize("name", CASES)
def test_at_the_instants_of_the_clock_it_is_the_schedule(name: str) -> None:
    tasks = case(name)
    (path,), (one,) = tasks.paths, tasks.tasks

    X, V = path.at(tasks.times, around(tasks.breaks, tasks.times))

    jumps = np.searchsorted(tasks.times, path.corners, side="right") - 1
    is_plain = ~np.isin(np.arange(len(tasks.times)), jumps)  # steps with a corner inside have the mean twist
    assert np.abs(X - one.X_PT).max() <= 1e-12
    assert np.abs(V - one.V_PT_P)[is_plain].max() <= 1e-12 * max(1.0, np.abs(V).max())


@pytest.mark.parametrize("name", CASES)
def test_between_breaks_the_motion_is_a_quickly_converging_polynomial(name: str) -> None:
    coefficients, _, _ = spectra_of(name)

    assert tails(coefficients).max() <= SMOOTH


@pytest.mark.parametrize("name", CASES)
def test_twists_are_the_derivatives_of_the_poses(name: str) -> None:
    _, errors, widths = spectra_of(name)

    tolerance = 1e-11 + 1e-13 / widths[:, None]  # the derivative of a polynomial of degree 16 magnifies rounding
    assert np.all(np.abs(errors) <= tolerance)


@pytest.mark.parametrize(
    ("name", "law"),
    [
        ("rectangle", "trapezoid"),
        ("rounded", "constant"),
        ("used up", "quintic"),
        ("polyline", "quintic"),
        ("smooth file", "trapezoid"),
        ("rounded sides of a file", "constant"),
        ("trajectory", "quintic"),
        ("trajectory of frames", "quintic"),
        ("rectangles", "constant"),
        ("smooth files", "quintic"),
        ("trajectories", "quintic"),
    ],
)
def test_each_break_is_one(name: str, law: str) -> None:
    """Without it the polynomials do not converge: the test above would miss none."""
    task, part = (PATHS | CYCLES)[name]
    (path,) = clock(replace(task, start=0.4123, time_law=LAWS[law], **MOVES), part).paths

    breaks = path.breaks
    for k in range(1, len(breaks) - 1):
        without, _, _ = spectra(path, breaks[[k - 1, k + 1]])
        assert tails(without).max() >= 2.0 * SMOOTH


def test_breaks_are_where_the_words_put_them() -> None:
    task = task_on(ELL, tool_axis=-EZ, start=1.0, duration=5.0, time_law=LAWS["trapezoid"], **MOVES)
    (path,) = clock(task).paths

    sides = np.array([0.3, 0.1, np.hypot(0.1, 0.2)])
    corners = 1.0 + 5.0 * np.append(0.0, np.cumsum(sides)) / sides.sum()
    ramps = 0.2 * np.diff(corners)
    expected = np.concatenate([[0.7], corners, corners[:-1] + ramps, corners[1:] - ramps, [6.4]])
    assert path.breaks == pytest.approx(np.sort(expected), abs=1e-14)


@pytest.mark.parametrize("law", ["constant", "quintic", "trapezoid"])
def test_knots_are_passed_at_their_breaks(law: str) -> None:
    task = task_on(sampled(RING, axes=AXES, is_smooth=True), start=0.5, duration=3.0, time_law=LAWS[law])
    (path,) = clock(task).paths

    X, _ = path.at(path.breaks, (path.start, path.end))

    gaps = np.linalg.norm(X[:, None, :3, 3] - RING[None], axis=2)
    assert gaps.min(axis=0).max() <= 1e-12


def test_ends_of_an_interval_are_seen_from_inside() -> None:
    task = task_on(ELL, tool_axis=-EZ, start=0.5, duration=4.0, time_law=LAWS["constant"])
    (path,) = clock(task).paths
    a, b, c, d = path.corners

    def speeds(low: float, high: float) -> Array:
        return path.at(np.array([low, high]), (low, high))[1]

    v = path.toolpath.length / 4.0
    assert np.all(speeds(0.0, a) == 0.0)
    assert np.allclose(speeds(a, b), [v, 0, 0, 0, 0, 0], atol=1e-14)
    assert np.allclose(speeds(b, c), [0, v, 0, 0, 0, 0], atol=1e-14)
    assert np.allclose(speeds(c, d), v * np.array([-1, 0, 2, 0, 0, 0]) / np.sqrt(5.0), atol=1e-14)
    assert np.all(speeds(d, d + 1.0) == 0.0)


def test_instants_outside_the_interval_are_taken_at_its_nearer_end() -> None:
    (path,) = clock(task_on(ELL, tool_axis=-EZ, duration=4.0, time_law=LAWS["constant"])).paths
    low, high = path.corners[:2]

    beyond = path.at(np.array([low - 1.0, high + 1.0]), (low, high))
    ends = path.at(np.array([low, high]), (low, high))

    assert all(np.array_equal(one, other) for one, other in zip(beyond, ends, strict=True))


def test_all_intervals_at_once_are_each_on_its_own() -> None:
    task, part = PATHS["rounded"]
    (path,) = clock(task, part).paths
    breaks = path.breaks
    times, within, _ = panels(breaks, 1, np.linspace(-1.0, 1.0, 5))

    X, V = path.at(times, within)

    for k, pair in enumerate(pairwise(breaks)):
        chosen = slice(5 * k, 5 * k + 5)
        X_pair, V_pair = path.at(times[chosen], pair)
        assert np.abs(X_pair - X[chosen]).max() <= 1e-14  # one Newton step more or less
        assert np.abs(V_pair - V[chosen]).max() <= 1e-13


def test_breaks_of_all_tasks_are_joined_within_the_clock() -> None:
    first = task_on(ELL, tool_axis=-EZ, name="first", start=1.0, duration=1.0, **MOVES)
    second = task_on(circle(), project=EZ, name="second", start=0.0, duration=2.0000000001)
    cell = clocked(first, second, duration=None, step=0.35)
    tasks = schedule_tasks(cell, [build_toolpath(task, ROLLER) for task in (first, second)])

    assert tasks.times[-1] == pytest.approx(2.45)
    inner = tasks.paths[0].corners[1:3]
    assert tasks.breaks == pytest.approx([0.0, 0.7, 1.0, *inner, 2.0, 2.4, 2.45], abs=1e-9)
    assert np.diff(tasks.breaks).min() > TIME_TOLERANCE


def test_without_tasks_the_clock_is_one_interval() -> None:
    assert schedule_tasks(clocked(duration=2.0), []).breaks.tolist() == [0.0, 2.0]


def test_instants_nearer_than_rounding_are_one() -> None:
    assert distinct(np.array([2.0, 1.0, 1.0 + 1e-12, 2.0])).tolist() == [1.0, 2.0]


def test_knots_beyond_the_limit_are_refused() -> None:
    task = task_on(sampled(RING[:-1], is_smooth=True, is_closed=True), tool_axis=-EZ, repeat=200_000)
    task = replace(task, duration=1e3)
    path = clock_path(clocked(task), task, build_toolpath(task, ROLLER))

    with pytest.raises(InputError) as caught:
        _ = path.breaks

    assert str(caught.value) == (
        "cell.yaml:14: tasks.ring.path: expected at most 2000000 knots of the path in all cycles, got 14 in each of "
        "200000; repeat it less often, or write solver.integrator: euler"
    )


def test_jumps_are_the_breaks_that_no_knot_of_the_path_makes() -> None:
    """Corners, ramps, coming and leaving are; a smooth file and a mesh have none inside."""
    for name in ("circle on a mesh", "smooth file"):
        task, part = PATHS[name]
        cell = replace(clocked(task, duration=2.0), part=part)
        timed_tasks = schedule_tasks(cell, [build_toolpath(task, part)])
        assert timed_tasks.jumps.tolist() == [0.0, 2.0]
        assert len(timed_tasks.breaks) > 5
    task = replace(ON_ROLLER["rectangle"], time_law=LAWS["trapezoid"], **MOVES)
    cell = clocked(replace(task, start=0.3), duration=4.0)
    timed_tasks = schedule_tasks(cell, [build_toolpath(cell.tasks[0], ROLLER)])
    assert set(timed_tasks.jumps) <= set(timed_tasks.breaks)
    assert np.array_equal(timed_tasks.jumps, timed_tasks.breaks)  # its sides meet at stops
