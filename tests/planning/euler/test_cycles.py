"""Closed paths that are gone through several times."""

from dataclasses import replace

import numpy as np
import pytest
from builders.roller_paths import ON_ROLLER, RECTANGLE, RHOMBUS, ROLLER, circle, clocked, sampled, task_on

from cellplan.errors import InputError
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.origin import Origin
from cellplan.model.task.task import PolygonPath, SpacePolylinePath, Task, TimeLaw, TimeLawKind
from cellplan.model.task.time_law import advance, reached_at
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths, schedule_tasks

ORIGIN = Origin(file="cell.yaml", lines={"tasks.ring.repeat": 12, "tasks.ring.settle_s": 13})
CONSTANT, QUINTIC = TimeLaw(kind=TimeLawKind.CONSTANT), TimeLaw(kind=TimeLawKind.QUINTIC)
DOWN = -np.eye(3)[2]


def on_clock(task: Task, *, duration: float | None = 4.0, step: float = 0.01) -> TaskSchedule:
    (one,) = schedule_tasks(clocked(task, duration=duration, step=step), [build_toolpath(task, ROLLER)]).tasks
    return one


def test_a_path_with_corners_rests_at_them_in_every_cycle() -> None:
    once = on_clock(ON_ROLLER["rectangle"], duration=2.0)
    thrice = on_clock(replace(ON_ROLLER["rectangle"], repeat=3), duration=6.0)

    for cycle in range(3):
        piece = slice(200 * cycle, 200 * cycle + 201)
        assert np.allclose(thrice.X_PT[piece], once.X_PT, atol=1e-12)
        assert np.allclose(thrice.V_PT_P[piece], once.V_PT_P, atol=1e-11)
    assert thrice.cycle_ends == pytest.approx((2.0, 4.0, 6.0), abs=1e-14)
    assert thrice.travelled[-1] == pytest.approx(3.0 * once.length, rel=1e-14)
    assert thrice.length == once.length


def test_a_circle_at_constant_speed_runs_through_its_start() -> None:
    task = replace(ON_ROLLER["circle"], repeat=4, time_law=CONSTANT)
    one = on_clock(task, duration=4.0)

    speed = np.linalg.norm(one.V_PT_P[:400, :3], axis=1)

    assert np.allclose(speed, 4.0 * one.length / 4.0, rtol=1e-12)
    assert one.cycle_ends == pytest.approx((1.0, 2.0, 3.0, 4.0), abs=1e-12)
    assert np.allclose(one.X_PT[100], one.X_PT[0], atol=1e-12)


def test_a_path_without_stops_has_one_law_over_all_its_cycles() -> None:
    task = replace(ON_ROLLER["circle"], repeat=2, time_law=QUINTIC)
    one = on_clock(task, duration=4.0)

    tau = np.arange(401) / 400
    assert np.allclose(one.travelled, 2.0 * one.length * advance(QUINTIC, tau).share, atol=1e-12)
    assert one.cycle_ends == pytest.approx((2.0, 4.0), abs=1e-12)  # half of the way is done after half of the time
    assert np.linalg.norm(one.V_PT_P[200, :3]) == pytest.approx(1.875 * one.length / 2.0, rel=1e-9)  # and at full speed
    ends = on_clock(replace(task, repeat=4)).cycle_ends
    assert advance(QUINTIC, np.array(ends) / 4.0).share == pytest.approx([0.25, 0.5, 0.75, 1.0], abs=1e-14)


@pytest.mark.parametrize(
    "law", [CONSTANT, QUINTIC, TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.2)], ids=lambda v: v.kind
)
def test_the_instant_of_a_share_is_found_for_every_law(law: TimeLaw) -> None:
    share = np.linspace(0.0, 1.0, 23)

    tau = reached_at(law, share)

    assert np.allclose(advance(law, tau).share, share, rtol=0.0, atol=1e-15)
    assert tau[[0, -1]].tolist() == [0.0, 1.0]


def test_a_feed_holds_in_every_cycle() -> None:
    fast = replace(ON_ROLLER["circle"], feed=0.3, time_law=CONSTANT)
    once, thrice = (on_clock(replace(fast, repeat=n), duration=None) for n in (1, 3))

    assert thrice.end == pytest.approx(3.0 * once.end, rel=1e-14)
    assert np.linalg.norm(thrice.V_PT_P[:, :3], axis=1).max() <= 0.3 * (1.0 + 1e-12)


@pytest.mark.parametrize("law", [CONSTANT, QUINTIC], ids=lambda v: v.kind)
@pytest.mark.parametrize("path", [circle(), RECTANGLE], ids=["circle", "rectangle"])
def test_the_tool_turns_on_and_on_without_a_jump(path: object, law: TimeLaw) -> None:
    side = {"project": -np.eye(3)[1]} if path is RECTANGLE else {"project": np.eye(3)[2]}
    task = task_on(path, turn=1.0, repeat=3, time_law=law, **side)
    one = on_clock(task, duration=6.0)

    x = one.X_PT[:, :3, 0]
    plain = on_clock(replace(task, turn=0.0), duration=6.0).X_PT[:, :3, :3]
    in_tool = np.einsum("nij,ni->nj", plain, x)
    angle = np.unwrap(np.arctan2(in_tool[:, 1], in_tool[:, 0]))
    assert np.allclose(angle, 3.0 * one.travelled / one.travelled[-1], atol=1e-9)
    assert one.cycle_ends == ()  # turned by 1 rad the tool is not back at its start


@pytest.mark.parametrize(
    ("words", "cycles"),
    [
        ({"turn": 2.0 * np.pi}, 3),
        ({"turn": -4.0 * np.pi}, 3),
        ({"turn": 1.0, "is_spin_free": True}, 3),
        ({"turn": 1.0, "axes": (0, 1, 2)}, 3),
        ({"turn": 3.1}, 0),
    ],
)
def test_a_turn_counts_where_it_is_asked_for(words: dict[str, object], cycles: int) -> None:
    assert len(on_clock(replace(ON_ROLLER["circle"], repeat=3, **words)).cycle_ends) == cycles


def test_closed_files_and_rounded_corners_are_repeated() -> None:
    u = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    ring = sampled(np.stack([0.1 * np.cos(u), 0.1 * np.sin(u), 0.0 * u], axis=1), is_smooth=True, is_closed=True)
    through = on_clock(task_on(ring, tool_axis=DOWN, repeat=2, time_law=CONSTANT))
    rounded = on_clock(task_on(RHOMBUS, tool_axis=-np.eye(3)[0], tool_x=np.eye(3)[2], repeat=2, blend=0.01))

    assert np.linalg.norm(through.V_PT_P[200, :3]) == pytest.approx(through.length / 2.0, rel=1e-3)
    steps = np.diff(through.V_PT_P[195:206, :3], axis=0)
    assert np.linalg.norm(steps, axis=1).max() <= 1.02 * 0.01 * 0.1 * np.pi**2  # that of a circle at this speed
    assert np.all(rounded.V_PT_P[200] == 0.0)  # the first corner is not rounded


@pytest.mark.parametrize(
    "path",
    [
        SpacePolylinePath(points=((0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.3, 0.1, 0.0)), is_closed=False),
        replace(RECTANGLE, is_closed=False),
    ],
)
def test_an_open_path_is_not_repeated(path: PolygonPath | SpacePolylinePath) -> None:
    with pytest.raises(InputError) as caught:
        build_toolpath(task_on(path, tool_axis=DOWN, repeat=5, origin=ORIGIN), ROLLER)

    assert str(caught.value) == (
        "cell.yaml:12: tasks.ring.repeat: expected 1 for a path that does not end in the pose of its start, got 5; "
        "close the path"
    )


def test_a_file_that_comes_back_to_its_point_in_another_orientation_is_not_closed() -> None:
    points = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0, 0]]
    axes = np.array([[0, 0, -1.0], [0, 0, -1], [0, 0, -1], [0, 0.6, -0.8]])
    for changed in (axes, axes[[0, 1, 2, 0]]):
        path = build_toolpath(task_on(sampled(points, axes=changed)), ROLLER)
        assert path.is_closed == (changed is not axes)


def test_cycles_too_short_and_stops_too_many_are_refused() -> None:
    short = replace(ON_ROLLER["circle"], repeat=100)
    many = replace(ON_ROLLER["circle"], path=many_sided(), project=None, tool_axis=DOWN, repeat=10_000, origin=ORIGIN)
    with pytest.raises(InputError, match=r"expected a cycle of at least 0.1 s .*, got 0.04 s; slow the task down"):
        clock_paths(clocked(short, step=0.01), [build_toolpath(short, ROLLER)])
    with pytest.raises(
        InputError, match=r"cell.yaml:12: tasks.ring.repeat: expected at most 6644 cycles of a path with"
    ):
        clock_paths(clocked(many), [build_toolpath(many, ROLLER)])


def many_sided() -> SpacePolylinePath:
    u = np.linspace(0.0, 2.0 * np.pi, 300, endpoint=False)
    return SpacePolylinePath(points=tuple((float(np.cos(v)), float(np.sin(v)), 0.0) for v in u), is_closed=True)


def test_a_time_to_settle_that_leaves_nothing_to_judge_is_refused() -> None:
    task = replace(ON_ROLLER["circle"], settle=3.95, origin=ORIGIN)
    cell = clocked(task, step=0.01)
    with pytest.raises(InputError) as caught:
        clock_paths(cell, [build_toolpath(task, ROLLER)])

    assert str(caught.value) == (
        "cell.yaml:13: tasks.ring.settle_s: expected a time that leaves at least 0.1 s (10 times motion.step_s) of the "
        "task's 4 s to be judged, got 3.95"
    )
    shorter = replace(task, settle=3.9)
    clock_paths(clocked(shorter, step=0.01), [build_toolpath(shorter, ROLLER)])
