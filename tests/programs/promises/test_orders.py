"""Marks and orders: between two marks every order is clear, and no mark could be left out.

Two balls slide along crossing lines, the one along x and the other along y, so the distance in any order is known.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from builders.scene_builders import arm_model, body, joint, make_cell, placed, work

from cellplan.certify.free_clocks.free_clocks import RegionBound
from cellplan.errors import NotVerifiedError
from cellplan.geometry.shapes import Sphere
from cellplan.model.cell.cell import Grasp, Robot
from cellplan.model.task.task import Frame
from cellplan.programs.promises.orders import OrderStretch, PhaseSearch, order_finding
from cellplan.programs.promises.run_programs import RunPhase, RunProgram, spoilt_by_another_order
from cellplan.scene.scene import Scene

RADIUS, CLEARANCE = 0.1, 0.005
ROWS = 61


def slider(name: str, axis: tuple[float, float, float]) -> Robot:
    """A ball on a rail through the origin."""
    joints = (joint("slide", -1, axis=axis, slides=True),)
    model = replace(
        arm_model(), name=name, joints=joints, bodies=(body("ball", 0, shape=Sphere(RADIUS)),), flange_link=0
    )
    return placed(name, model)


CELL = make_cell(slider("a", (1.0, 0.0, 0.0)), slider("b", (0.0, 1.0, 0.0)), slider("far", (0.0, 0.0, 1.0)))


def program(a: np.ndarray, b: np.ndarray, process: np.ndarray | None = None) -> RunProgram:
    """Both along their lines, the third one far away."""
    inside = np.zeros(len(a), dtype=bool) if process is None else process
    return RunProgram(
        name=None,
        times=0.1 * np.arange(len(a)),
        q=np.column_stack([a, b, np.full(len(a), 2.5)]),
        phases=(RunPhase(name="transfer-1", place=0, first=0, last=len(a) - 1),),
        process={"task": inside},
    )


def crossing() -> RunProgram:
    """The one passes the crossing well before the other."""
    s = np.linspace(0.0, 2.6, ROWS)
    return program(s - 1.0, s - 1.9)


def stretches(played: RunProgram) -> list[OrderStretch]:
    return list(PhaseSearch(CELL, Scene.from_cell(CELL), played, played.phases[0]).stretches())


def least_distance(played: RunProgram, first: int, last: int) -> float:
    """Distance of the balls over all orders between two rows, in closed form."""
    nearest = [
        max(0.0, float(np.min(rows)), -float(np.max(rows)))
        for rows in (played.q[first : last + 1, 0], played.q[first : last + 1, 1])
    ]
    return float(np.hypot(*nearest)) - 2.0 * RADIUS


def test_all_orders_between_marks_are_clear_and_no_mark_can_be_left_out() -> None:
    played = crossing()
    assert least_distance(played, 0, ROWS - 1) < 0.0  # without marks they can meet

    result = stretches(played)

    assert [result[0].first, result[-1].last] == [0, ROWS - 1]
    assert all(one.last == other.first for one, other in pairwise(result))
    assert len(result) >= 2
    for stretch in result:
        assert least_distance(played, stretch.first, stretch.last) >= CLEARANCE
        assert stretch.pairs == (("a", "b"),)
        assert CLEARANCE <= stretch.proved <= least_distance(played, stretch.first, stretch.last) + 1e-9
    for stretch in result[:-1]:  # one row more would be too much
        assert least_distance(played, stretch.first, stretch.last + 1) < CLEARANCE


def test_robots_that_never_come_near_need_no_mark_between() -> None:
    s = np.linspace(0.0, 1.0, ROWS)

    (stretch,) = stretches(program(s + 0.5, s + 0.5))

    assert (stretch.first, stretch.last) == (0, ROWS - 1)


def test_no_tool_waits_while_it_is_in_process() -> None:
    played = crossing()
    free = stretches(played)
    process = np.zeros(ROWS, dtype=bool)
    process[free[0].last - 3 : free[0].last + 2] = True

    result = stretches(program(played.q[:, 0], played.q[:, 1], process))

    assert result[0].last == free[0].last - 3  # the process begins there
    for stretch in result:
        assert not process[stretch.first - 1 : stretch.first + 2].all() or stretch.first == 0
        assert least_distance(played, stretch.first, stretch.last) >= CLEARANCE


def test_what_marks_cannot_part_is_refused_with_robots_phase_and_distance() -> None:
    played = crossing()

    with pytest.raises(NotVerifiedError) as refusal:
        stretches(program(played.q[:, 0], played.q[:, 1], np.ones(ROWS, dtype=bool)))

    said = str(refusal.value)
    assert said.startswith("sequence only: phase 'transfer-1', 0 to 6 s: 'a' and 'b' come within ")
    assert "(a/ball and b/ball) in another order than that of the plan, 5 mm are demanded" in said
    assert "let the one task follow the other (after)" in said


def test_holders_that_move_together_are_spoilt_by_any_other_order() -> None:
    held = replace(CELL, part=replace(CELL.part, held_by=(_grasp("a"), _grasp("b"))))

    (reason,) = spoilt_by_another_order(held, crossing())

    assert reason == "phase 'transfer-1', 0 s: the holders a and b move the part: another order strains it"
    assert list(spoilt_by_another_order(CELL, crossing())) == []


@pytest.mark.parametrize(("frame", "is_spoilt"), [(Frame.PART, True), (Frame.WORLD, False)])
def test_a_holder_must_stand_still_while_a_tool_is_in_process_on_the_part(frame: Frame, is_spoilt: bool) -> None:
    task = replace(work("b"), name="task", relative_to=frame)
    held = replace(CELL, part=replace(CELL.part, held_by=(_grasp("a"),)), tasks=(task,))
    played = crossing()
    process = np.zeros(ROWS, dtype=bool)
    process[20:30] = True
    moving = program(played.q[:, 0], played.q[:, 1], process)
    a = played.q[:, 0].copy()
    a[20:30] = a[20]
    standing = program(a, played.q[:, 1], process)

    assert list(spoilt_by_another_order(held, standing)) == []
    assert [reason.partition(": ")[0] for reason in spoilt_by_another_order(held, moving)] == (
        ["phase 'transfer-1', 2 s"] if is_spoilt else []
    )


def _grasp(robot: str) -> Grasp:
    return Grasp(robot=robot, X_PT=np.eye(4))


def test_what_is_not_proved_is_no_distance_that_is_measured() -> None:
    bound = RegionBound(
        first="a",
        second="b",
        bodies=("a/ball", "b/ball"),
        distance=7.39e-3,
        proved=4.9992e-3,
        at=None,
        is_met=False,
        demand=5e-3,
    )

    unproved = order_finding("turn", bound, np.array([0.0, 1.0]))
    near = order_finding("turn", replace(bound, distance=4.9e-3), np.array([0.0, 1.0]))
    touching = order_finding("turn", replace(bound, distance=0.0, demand=0.0), np.array([0.0, 1.0]))

    assert "are proved to keep only 4.999 mm, nearest measured 7.39 mm (a/ball and b/ball)" in unproved
    assert "come within 4.9 mm" in near
    assert "come within 0 mm" in touching
    assert "they must not touch" in touching
