"""The schedule keeps times, feeds and rests, and its twists are the motion of its poses."""

import re
from typing import Any

import numpy as np
import pytest
from builders.roller_paths import clocked

from cellplan.errors import InputError
from cellplan.geometry.shapes import Cylinder
from cellplan.geometry.transforms import pose, rotation_exp
from cellplan.model.cell.cell import Part
from cellplan.model.motion.motion import Schedule
from cellplan.model.origin import Origin
from cellplan.model.task.task import (
    CirclePath,
    PathSpec,
    PlaneName,
    PolygonPath,
    SpacePolylinePath,
    Task,
    TimeLaw,
    TimeLawKind,
    ToleranceEntry,
)
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths, schedule_tasks

ROLLER = Part(shape=Cylinder(0.25, 0.5), X_PS=pose(rpy=[0.0, np.pi / 2.0, 0.0]), held_by=(), X_WP=np.eye(4))
ORIGIN = Origin(file="cell.yaml", lines={"tasks.a": 7, "motion.step_s": 20})
QUINTIC = TimeLaw(kind=TimeLawKind.QUINTIC)
TRAPEZOID = TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.2)
CONSTANT = TimeLaw(kind=TimeLawKind.CONSTANT)
CIRCLE = CirclePath(plane=PlaneName.XY, center=(0.0, 0.0), radius=0.1)
RECTANGLE = PolygonPath(
    plane=PlaneName.XZ, corners=((0.175, 0.125), (-0.175, 0.125), (-0.175, -0.125), (0.175, -0.125)), is_closed=True
)
ELL = SpacePolylinePath(points=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.1, 0.0)), is_closed=False)


def task(name: str, path: PathSpec, **words: Any) -> Task:
    plain: dict[str, Any] = {
        "robot": name,
        "project": None,
        "plane_offset": 0.0,
        "tool_axis": np.array([0.0, 0.0, -1.0]),
        "tool_x": np.array([1.0, 0.0, 0.0]),
        "turn": 0.0,
        "axes": (0, 1, 2, 3, 4, 5),
        "is_spin_free": False,
        "tolerance": ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1e-4)),
        "start": 0.0,
        "duration": None,
        "feed": None,
        "time_law": QUINTIC,
        "blend": None,
        "origin": ORIGIN,
    }
    return Task(name=name, path=path, **(plain | words))


def scheduled(*tasks: Task, duration: float | None = 4.0, step: float = 0.001) -> Schedule:
    cell = clocked(*tasks, duration=duration, step=step, origin=ORIGIN)
    return schedule_tasks(cell, [build_toolpath(one, ROLLER) for one in tasks])


def on_roller(name: str = "a", path: PathSpec = CIRCLE, **words: Any) -> Task:
    side = np.array([0.0, 0.0, 1.0]) if path is CIRCLE else np.array([0.0, -1.0, 0.0])
    return task(name, path, project=side, tool_axis=None, **words)


def test_the_clock_is_even_and_reads_well() -> None:
    times = scheduled(on_roller()).times

    assert len(times) == 4001
    assert [repr(float(t)) for t in times[[0, 3, 7, 4000]]] == ["0.0", "0.003", "0.007", "4.0"]


def test_a_clock_without_a_length_ends_with_the_last_task() -> None:
    schedule = scheduled(
        task("a", ELL, start=0.5, duration=1.0), task("b", ELL, duration=2.0005), duration=None, step=0.001
    )

    assert schedule.times[-1] == 2.001  # the first instant not before 2.0005
    assert [one.end for one in schedule.tasks] == pytest.approx([1.5, 2.0005], abs=1e-15)


@pytest.mark.parametrize("settings", [{"duration": 1.0}, {"feed": 0.4}])
def test_a_clock_with_a_length_is_neither_cut_short_nor_stretched(settings: dict[str, float]) -> None:
    (one,) = (schedule := scheduled(on_roller(**settings), duration=3.0)).tasks

    assert schedule.times[-1] == 3.0
    assert one.end < 3.0
    assert np.all(one.V_PT_P[schedule.times > one.end] == 0.0)
    assert np.ptp(one.X_PT[schedule.times > one.end], axis=0).max() == 0.0


def test_a_task_that_needs_more_than_the_clock_is_refused_with_the_time_it_needs() -> None:
    with pytest.raises(InputError) as caught:
        scheduled(on_roller(feed=0.01, time_law=CONSTANT), duration=2.0)

    (needed,) = scheduled(on_roller(feed=0.01, time_law=CONSTANT), duration=None).tasks
    assert str(caught.value) == (
        f"cell.yaml:7: tasks.a.feed_mm_s: expected an end within the clock of 2 s (motion.duration_s), got an end at "
        f"{needed.end:.6g} s ({1e3 * needed.length:.4g} mm at up to 10 mm/s); give the clock at least "
        f"{np.ceil(1e3 * needed.end) / 1e3:g} s, or leave motion.duration_s out and it ends with the last task"
    )


def test_the_time_that_a_refused_task_asks_for_is_enough() -> None:
    with pytest.raises(InputError) as caught:
        scheduled(on_roller(feed=0.01), duration=2.0)

    enough = float(re.search(r"at least ([0-9.]+) s", str(caught.value)).group(1))  # type: ignore[union-attr]
    assert scheduled(on_roller(feed=0.01), duration=enough).tasks[0].end <= enough


def test_without_any_time_a_task_is_refused() -> None:
    with pytest.raises(InputError, match=r"tasks\.a: missing duration_s: expected duration_s or feed_mm_s"):
        scheduled(task("a", ELL), duration=None)


def test_without_own_times_a_task_lasts_until_the_end_of_the_motion() -> None:
    (one,) = scheduled(task("a", ELL, start=1.25), duration=3.0).tasks

    assert one.end == 3.0
    assert np.all(one.travelled[1251:3000] > 0.0)
    assert one.travelled[1250] == 0.0
    assert one.travelled[3000] == pytest.approx(0.4, abs=1e-15)


@pytest.mark.parametrize("law", [QUINTIC, TRAPEZOID, CONSTANT], ids=lambda law: law.kind)
def test_integrating_the_twists_reproduces_the_poses(law: TimeLaw) -> None:
    (one,) = scheduled(on_roller(path=RECTANGLE, time_law=law, turn=1.0)).tasks
    h = 0.001
    p, R = one.X_PT[0, :3, 3].copy(), one.X_PT[0, :3, :3].copy()
    worst = 0.0
    for k in range(len(one.V_PT_P) - 1):
        v = 0.5 * (one.V_PT_P[k] + one.V_PT_P[k + 1]) if law is not CONSTANT else one.V_PT_P[k]
        p, R = p + h * v[:3], rotation_exp(h * v[3:]) @ R
        worst = max(worst, np.abs(p - one.X_PT[k + 1, :3, 3]).max(), np.abs(R - one.X_PT[k + 1, :3, :3]).max())

    limit = 2e-5 if law is QUINTIC else 2e-3  # trapezoid rule h^2; the others change speed between two samples
    assert worst <= limit


@pytest.mark.parametrize("law", [QUINTIC, TRAPEZOID, CONSTANT], ids=lambda law: law.kind)
def test_the_fastest_moment_runs_at_the_feed(law: TimeLaw) -> None:
    (one,) = scheduled(on_roller(path=RECTANGLE, feed=0.2, time_law=law), duration=None, step=0.0005).tasks

    speed = np.linalg.norm(one.V_PT_P[:, :3], axis=1)

    assert speed.max() == pytest.approx(0.2, rel=1e-5)  # the peak lies between two samples
    assert speed.max() <= 0.2 * (1.0 + 1e-12)


def test_with_a_duration_each_side_takes_time_in_proportion_to_its_length() -> None:
    (one,) = scheduled(task("a", ELL, duration=4.0)).tasks

    speed = np.linalg.norm(one.V_PT_P[:, :3], axis=1)

    assert np.flatnonzero(speed == 0.0).tolist() == [0, 3000, 4000]
    assert one.travelled[3000] == pytest.approx(0.3, abs=1e-15)
    assert speed[:3000].max() == pytest.approx(1.875 * 0.1, rel=1e-6)
    assert speed[3000:].max() == pytest.approx(1.875 * 0.1, rel=1e-6)


def test_a_constant_law_changes_direction_at_the_corner_and_rests_from_its_end_on() -> None:
    (one,) = scheduled(task("a", ELL, duration=4.0, start=0.5, time_law=CONSTANT), duration=6.0).tasks

    velocity = one.V_PT_P[:, :3]

    assert np.all(velocity[:500] == 0.0)
    assert np.allclose(velocity[500:3500], [0.1, 0.0, 0.0], atol=1e-14)
    assert np.allclose(velocity[3500:4500], [0.0, 0.1, 0.0], atol=1e-14)  # at the corner the later side counts
    assert np.all(one.V_PT_P[4500:] == 0.0)  # and the rest at the end


@pytest.mark.parametrize("step", [0.001, 0.0037, 0.1])
def test_straight_sides_at_constant_speed_are_met_by_single_steps_even_where_corners_fall_between_them(
    step: float,
) -> None:
    early = task("a", ELL, start=0.2503, duration=0.9127, time_law=CONSTANT, turn=1.0)
    schedule = scheduled(early, task("b", ELL), duration=2.0, step=step)

    X, V = schedule.tasks[0].X_PT, schedule.tasks[0].V_PT_P
    p_next = X[:-1, :3, 3] + step * V[:-1, :3]
    R_next = np.stack([rotation_exp(step * v[3:]) @ R for v, R in zip(V[:-1], X[:-1, :3, :3], strict=True)])

    assert np.abs(p_next - X[1:, :3, 3]).max() <= 1e-14  # a straight line has no error of the method
    assert np.abs(R_next - X[1:, :3, :3]).max() <= 1e-12


def test_the_tool_holds_still_before_and_after_its_task() -> None:
    first, _ = scheduled(on_roller("a", start=0.5, duration=1.0), on_roller("b", duration=3.0)).tasks

    assert np.all(first.X_PT[:501] == first.X_PT[0])
    assert np.all(first.X_PT[1500:] == first.X_PT[-1])
    assert np.all(first.V_PT_P[:501] == 0.0)
    assert np.all(first.V_PT_P[1500:] == 0.0)
    assert np.allclose(first.X_PT[0], first.X_PT[-1], atol=1e-14)
    assert first.travelled[-1] == pytest.approx(first.length, abs=1e-15)


def test_steps_that_do_not_divide_the_cycle_are_kept() -> None:
    schedule = scheduled(task("a", ELL), duration=1.0, step=0.3)

    assert schedule.times.tolist() == [0.0, 0.3, 0.6, 0.9, 1.2]
    assert schedule.tasks[0].travelled[-1] == pytest.approx(0.4, abs=1e-15)


def test_a_task_that_starts_after_the_motion_is_refused() -> None:
    with pytest.raises(InputError) as caught:
        scheduled(task("a", ELL, start=4.0))

    assert str(caught.value) == (
        "cell.yaml:7: tasks.a.start_s: expected a start before the end of the clock at 4 s, got 4; make "
        "motion.duration_s longer"
    )


def test_too_many_samples_are_refused() -> None:
    with pytest.raises(InputError) as caught:
        scheduled(task("a", ELL), step=1e-6)

    assert str(caught.value) == (
        "cell.yaml:20: motion.step_s: expected a step that makes at most 2000000 samples, got 1e-06 s for a cycle of "
        "4 s; make the step longer"
    )


@pytest.mark.parametrize(
    ("words", "got", "key"),
    [
        ({"duration": 0.0099}, "0.0099", "duration_s"),
        ({"start": 3.995}, "0.005", "duration_s"),
        ({"feed": 1e3}, None, "feed_mm_s"),
    ],
)
def test_a_task_too_short_to_be_judged_by_its_samples_is_refused(words: Any, got: str | None, key: str) -> None:
    """A closed path within one step would pass every check with a tool that never moves."""
    one = on_roller(**words)

    with pytest.raises(InputError) as caught:
        clock_paths(clocked(one, origin=ORIGIN), [build_toolpath(one, ROLLER)])

    reported = str(caught.value)
    desired = "expected a task of at least 0.01 s (10 times motion.step_s), got "
    assert reported.startswith(f"cell.yaml:7: tasks.a.{key}: {desired}{got or ''}")
    assert reported.endswith("; slow the task down or shorten the step")


def test_ten_steps_are_enough() -> None:
    one = on_roller(duration=0.01)

    assert len(clock_paths(clocked(one, origin=ORIGIN), [build_toolpath(one, ROLLER)])) == 1
