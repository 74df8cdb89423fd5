"""Trajectories keep the times of their file: where the tool is, how fast it moves, when it ends."""

from typing import Any

import numpy as np
import pytest
from builders.roller_paths import ROLLER, clocked, sampled, task_on

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, rotation_exp, rotation_vector
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.origin import Origin
from cellplan.model.task.task import Task, TimedPath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths, schedule_tasks

ORIGIN = Origin(file="cell.yaml", lines={"tasks.ring.repeat": 12, "tasks.ring.settle_s": 13, "tasks.ring.path": 14})
DOWN = -np.eye(3)[2]
PERIOD = 2.0


def vargas(case: int, t: Array) -> Array:
    """Trajectories of Vargas 2012, sections VII-A to VII-C, in [m]."""
    x, y = {
        1: (2.0 + 0.5 * np.sin(0.4 * t), 0.5 * np.cos(0.2 * t)),
        2: (1.1 + np.sin(0.2 * t), 0.35 * np.cos(0.2 * t)),
        3: (2.0 - 0.1 * t, 2.0 - 0.1 * t),
    }[case]
    return np.stack([x, y, 0.0 * t], axis=1)


def vargas_rate(case: int, t: Array) -> Array:
    x, y = {
        1: (0.2 * np.cos(0.4 * t), -0.1 * np.sin(0.2 * t)),
        2: (0.2 * np.cos(0.2 * t), -0.07 * np.sin(0.2 * t)),
        3: (-0.1 + 0.0 * t, -0.1 + 0.0 * t),
    }[case]
    return np.stack([x, y, 0.0 * t], axis=1)


def timed(times: Array, points: Array, **words: Any) -> TimedPath:
    plain: dict[str, Any] = {"source": "loop.csv", "axes": None, "rotations": None, "is_closed": False}
    return TimedPath(times=times, points=points, **(plain | words))


def ellipse(samples: int = 41, **words: Any) -> TimedPath:
    t = np.linspace(0.0, PERIOD, samples)
    w = 2.0 * np.pi / PERIOD * t
    points = np.stack([0.2 * np.cos(w), 0.1 * np.sin(w), 0.0 * t], axis=1)
    points[-1] = points[0]
    return timed(t, points, is_closed=True, **words)


def on_clock(task: Task, *, duration: float = 4.0, step: float = 0.01) -> TaskSchedule:
    (one,) = schedule_tasks(clocked(task, duration=duration, step=step), [build_toolpath(task, ROLLER)]).tasks
    return one


@pytest.mark.parametrize("case", [1, 2, 3])
@pytest.mark.parametrize("spacing", [0.05, 0.1])
def test_trajectories_of_the_paper_are_kept_to_ten_nanometres(case: int, spacing: float) -> None:
    t = np.arange(0.0, 35.0 + 0.5 * spacing, spacing)
    task = task_on(timed(t, vargas(case, t)), tool_axis=DOWN, axes=(0, 1))

    one = on_clock(task, duration=35.0, step=0.0037)

    clock = np.arange(len(one.X_PT)) * 0.0037
    inside = clock < 35.0
    assert one.end == pytest.approx(35.0, abs=1e-12)
    assert np.abs(one.X_PT[inside, :3, 3] - vargas(case, clock[inside])).max() <= 1e-8
    assert np.abs(one.V_PT_P[inside][:-1, :3] - vargas_rate(case, clock[inside])[:-1]).max() <= 2e-7  # third order
    assert np.all(one.V_PT_P[:, 3:] == 0.0)


@pytest.mark.parametrize("kind", ["axes", "rotations", "fixed"])
def test_twists_are_the_derivatives_of_the_poses(kind: str) -> None:
    t = np.concatenate([[0.0], np.cumsum(np.random.default_rng(2).uniform(0.02, 0.1, 30))])
    points = np.stack([np.sin(t), np.cos(2 * t), 0.3 * t], axis=1)
    lean = np.stack([0.3 * np.sin(t), 0.2 * np.cos(t), -np.ones_like(t)], axis=1)
    words = {
        "axes": {"axes": lean / np.linalg.norm(lean, axis=1, keepdims=True)},
        "rotations": {"rotations": rotation_exp(np.stack([0.5 * t, np.sin(t), 0.2 * t**2], axis=1))},
        "fixed": {},
    }[kind]
    task = task_on(timed(t, points, **words), tool_axis=DOWN if kind == "fixed" else None)
    path = build_toolpath(task, ROLLER)
    assert path.is_timed
    h = 1e-6
    u = np.linspace(h, path.duration - h, 300)

    X, V = path.at(u)

    above, below = path.at(u + h)[0], path.at(u - h)[0]
    linear = (above - below)[:, :3, 3] / (2.0 * h)
    angular = rotation_vector(above[:, :3, :3] @ np.swapaxes(below[:, :3, :3], 1, 2)) / (2.0 * h)
    assert np.abs(np.hstack([linear, angular]) - V).max() <= 1e-5  # third derivatives jump at the knots: h times 10
    assert np.allclose(X[:, :3, :3] @ np.swapaxes(X[:, :3, :3], 1, 2), np.eye(3), atol=1e-13)


def test_a_trajectory_is_shifted_by_its_start_and_rests_before_and_after() -> None:
    t = np.linspace(0.0, 1.0, 11)
    task = task_on(timed(t, np.outer(t, [0.3, 0.0, 0.0])), tool_axis=DOWN, start=0.5)
    other = task_on(ellipse(), tool_axis=DOWN, name="other")
    cell = clocked(task, other, step=0.01)
    one = schedule_tasks(cell, [build_toolpath(task, ROLLER), build_toolpath(other, ROLLER)]).tasks[0]

    assert one.end == pytest.approx(1.5, abs=1e-15)
    assert np.allclose(one.X_PT[[0, 50, 100, 150, 152], 0, 3], [0.0, 0.0, 0.15, 0.3, 0.3], atol=1e-14)
    assert np.all(one.V_PT_P[:50] == 0.0)
    assert np.all(one.V_PT_P[150:] == 0.0)
    assert np.allclose(one.V_PT_P[50:150, 0], 0.3, atol=1e-13)
    assert one.travelled[-1] == pytest.approx(0.3, abs=1e-14)
    assert one.cycle_ends == ()


def test_a_tool_may_stand_still_or_only_turn_on_its_trajectory() -> None:
    t = np.linspace(0.0, 1.0, 21)
    turned = rotation_exp(np.outer(t, [0.0, 0.0, 0.5]))
    one = on_clock(task_on(timed(t, np.full((21, 3), 0.2), rotations=turned)), duration=1.0)

    assert one.length == 0.0
    assert np.all(one.X_PT[:, :3, 3] == 0.2)
    assert np.allclose(one.V_PT_P[1:-1, 5], 0.5, atol=1e-12)


def test_cycles_of_a_closed_trajectory_follow_each_other_smoothly() -> None:
    once = on_clock(task_on(ellipse(), tool_axis=DOWN), duration=PERIOD)
    thrice = on_clock(task_on(ellipse(), tool_axis=DOWN, repeat=3), duration=3 * PERIOD)

    assert thrice.end == pytest.approx(3 * PERIOD, abs=1e-14)
    assert thrice.cycle_ends == pytest.approx((2.0, 4.0, 6.0), abs=1e-14)
    for cycle in range(3):
        piece = slice(200 * cycle, 200 * (cycle + 1))
        assert np.allclose(thrice.X_PT[piece], once.X_PT[:-1], atol=1e-13)
        assert np.allclose(thrice.V_PT_P[piece], once.V_PT_P[:-1], atol=1e-12)
    assert thrice.travelled[-1] == pytest.approx(3.0 * once.length, rel=1e-12)
    steps = np.diff(thrice.V_PT_P[:600, :3], axis=0)
    assert np.abs(np.diff(steps, axis=0)).max() <= 1.1 * 0.2 * np.pi**3 * 0.01**2  # no kink: the third derivative


def test_length_is_that_of_the_curve() -> None:
    a, b = 0.2, 0.1
    u = 2.0 * np.pi * np.arange(200) / 200  # the trapezoid rule converges geometrically on a periodic function
    exact = 2.0 * np.pi * float(np.hypot(a * np.sin(u), b * np.cos(u)).mean())

    path = build_toolpath(task_on(ellipse(401), tool_axis=DOWN), ROLLER)

    assert path.length == pytest.approx(exact, rel=1e-8)


def test_an_open_trajectory_is_not_repeated() -> None:
    t = np.linspace(0.0, 1.0, 11)
    with pytest.raises(InputError) as caught:
        build_toolpath(task_on(timed(t, np.outer(t, [1, 0, 0])), tool_axis=DOWN, repeat=2, origin=ORIGIN), ROLLER)

    assert str(caught.value) == (
        "cell.yaml:12: tasks.ring.repeat: expected 1 for a path that does not end in the pose of its start, got 2; "
        "close the path"
    )


def test_a_trajectory_needs_ten_steps_and_some_time_to_be_judged() -> None:
    short, settling = task_on(ellipse(), tool_axis=DOWN), task_on(ellipse(), tool_axis=DOWN, settle=PERIOD)
    for task, step, key in ((short, 0.3, "path"), (settling, 0.01, "settle_s")):
        with pytest.raises(InputError, match=f"tasks.ring.{key}: expected a t"):
            clock_paths(clocked(task, step=step), [build_toolpath(task, ROLLER)])


@pytest.mark.parametrize("times", [[0.1, 0.2], [0.0, 0.0], [0.0, np.nan], [0.0]])
def test_times_that_do_not_go_on_are_refused_at_the_door(times: list[float]) -> None:
    with pytest.raises(ValueError, match=r"trajectory 'loop.csv': expected"):
        timed(np.array(times), np.zeros((len(times), 3)))


def test_poses_are_spread_over_the_time_of_a_trajectory_and_over_the_length_of_a_path() -> None:
    t = np.array([0.0, 0.1, 1.0])
    uneven = timed(t, np.outer(t**2, [0.3, 0.0, 0.0]))
    trajectory = build_toolpath(task_on(uneven, tool_axis=DOWN), ROLLER)
    path = build_toolpath(task_on(sampled(uneven.points), tool_axis=DOWN), ROLLER)

    assert np.array_equal(trajectory.spread(7), trajectory.at(np.linspace(0.0, 1.0, 7))[0])
    assert np.allclose(path.spread(4)[:, 0, 3], [0.0, 0.1, 0.2, 0.3], atol=1e-12)
    assert np.array_equal(trajectory.spread(1)[0], trajectory.X_PT_start)
