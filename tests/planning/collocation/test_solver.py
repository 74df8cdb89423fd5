"""Collocation of many cells at once: each goes its own way, as if it were alone."""

from dataclasses import replace

import numpy as np
import pytest
from builders.batch_cells import CELLS, everyone, random_desired
from builders.timed_cells import Case, triangles
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell
from cellplan.planning.collocation.batch_targets import desired_motion, in_windows
from cellplan.planning.collocation.batch_tasks import BatchTasks
from cellplan.planning.collocation.solver import Collocation, Precision, repeated
from cellplan.planning.collocation.windows import Panel, Window, windows_between
from cellplan.planning.tracking.motion_task import closures
from cellplan.scene.kinematics.batched import Placement

ACCURACY = 1e-7
CELL = triangles(CELLS["mixed"])


def collocation(
    case: Case,
    placement: Placement | None = None,
    *,
    accuracy: float = ACCURACY,
    shortest: float = 0.0,
    mobile: Array | None = None,
) -> Collocation:
    grasps = closures(case.cell, case.moving)
    tasks = BatchTasks(case.cell, [*case.cell.tasks, *grasps], case.moving)
    placed = tasks.chains.placement(case.cell) if placement is None else placement
    precision = Precision(accuracy=accuracy, shortest=shortest)
    return Collocation(tasks, desired_motion(case.schedule.paths, grasps), placed, precision, mobile=mobile)


def moved_bases(cell: Cell, count: int) -> list[Cell]:
    """The cell with all its robots a little elsewhere, so that their tools are not on their paths any more."""
    rng, cells = np.random.default_rng(4), []
    for _ in range(count):
        nudge = pose_from(rotation_exp(1e-9 * rng.normal(size=3)), 1e-9 * rng.normal(size=3))
        cells.append(replace(cell, robots=tuple(replace(r, X_WB=nudge @ r.X_WB) for r in cell.robots)))
    return cells


def placement_of(cells: list[Cell]) -> Placement:
    chains = BatchTasks(cells[0], cells[0].tasks, everyone(cells[0])).chains
    placements = [chains.placement(cell) for cell in cells]
    return Placement(*(np.concatenate([getattr(p, part) for p in placements], axis=-1) for part in Placement.__slots__))


def carried_through(
    collocation: Collocation, case: Case, q: Array, cells: NDArray[np.intp]
) -> tuple[Array, list[int], dict]:
    """The last configurations, who arrived, and the panels that each cell passed."""
    passed: dict[int, list[Panel]] = {int(cell): [] for cell in cells}

    def record(window: Window, which: NDArray[np.intp], nodes: Array, errors: Array) -> None:
        assert nodes.shape == (len(q), len(which), window.count)
        assert np.all(errors <= ACCURACY)
        for cell in which.tolist():
            passed[cell].extend(window.panels)

    last = q.copy()
    windows = windows_between(case.schedule.breaks, whole=float(case.schedule.times[-1]))
    arrived = collocation.carry(windows, last, cells, record)
    return last, arrived.tolist(), passed


def test_cells_together_do_what_each_does_alone() -> None:
    cells = moved_bases(CELL.cell, 3)
    q = np.repeat(CELL.start[:, None], 3, axis=1)

    last, arrived, passed = carried_through(collocation(CELL, placement_of(cells)), CELL, q, np.arange(3))

    assert arrived == [0, 1, 2]
    for index, cell in enumerate(cells):
        alone = replace(CELL, cell=cell)
        single, _, panels = carried_through(collocation(alone), alone, q[:, :1], np.zeros(1, dtype=np.intp))
        np.testing.assert_allclose(last[:, index], single[:, 0], atol=1e-6)  # passes may end earlier for one alone
        assert passed[index] == panels[0]


def test_one_that_is_lost_leaves_the_others_alone() -> None:
    """The second cell starts with its tools in the middle of nowhere, and out of reach of their paths."""
    cells = [CELL.cell, *moved_bases(CELL.cell, 1)]
    far = [
        replace(robot, X_WB=pose_from(np.eye(3), np.array([50.0 * k, 0.0, 0.0])))
        for k, robot in enumerate(CELL.cell.robots)
    ]
    cells.insert(1, replace(CELL.cell, robots=tuple(far)))
    q = np.repeat(CELL.start[:, None], 3, axis=1)
    solver = collocation(CELL, placement_of(cells), shortest=0.02)

    last, arrived, passed = carried_through(solver, CELL, q, np.arange(3))

    assert arrived == [0, 2]
    assert passed[1] == []
    alone, _, panels = carried_through(collocation(CELL), CELL, q[:, :1], np.zeros(1, dtype=np.intp))
    np.testing.assert_allclose(last[:, 0], alone[:, 0], atol=1e-6)
    assert passed[0] == panels[0]


def test_panels_come_in_order_without_gaps() -> None:
    """Also where windows were refined on the way."""
    hard = triangles(CELLS["mixed"], side=0.3)
    exact = collocation(hard, accuracy=1e-12)
    _, arrived, passed = carried_through(exact, hard, hard.start[:, None], np.zeros(1, dtype=np.intp))
    assert arrived == [0]
    ends = [0.0] + [panel.end for panel in passed[0]]
    assert [panel.begin for panel in passed[0]] == ends[:-1]
    assert len(ends) > 7


def test_an_attempt_that_does_not_settle_says_so_in_silence() -> None:
    """Even where no robot may move and the tools are desired elsewhere; no warning is let out."""
    solver = collocation(CELL, mobile=np.zeros(CELL.cell.joint_count))
    window = Window((Panel(0.0, 1.0 / 3.0, 12),))
    times, (begins, ends) = window.times, window.stretches
    desired = desired_motion(CELL.schedule.paths, ())(times, begins, ends)

    attempt = solver.attempt(
        window,
        desired,
        CELL.start[:, None],
        BatchTasks(CELL.cell, CELL.cell.tasks, CELL.moving).chains.placement(CELL.cell),
    )

    assert not (attempt.is_settled & np.all(attempt.errors <= ACCURACY, axis=0)).any()


def test_work_is_counted() -> None:
    solver = collocation(CELL)
    carried_through(solver, CELL, CELL.start[:, None], np.zeros(1, dtype=np.intp))
    assert solver.sweeps > 6
    assert solver.solves == 25 * solver.sweeps  # a panel of degree 24 in each window


@pytest.mark.parametrize("name", ["mixed", "closed", "world"])
def test_targets_of_windows_are_those_of_the_tasks(name: str) -> None:
    case = triangles(CELLS[name])
    grasps = closures(case.cell, case.moving)
    windows = windows_between(case.schedule.breaks, whole=1.0)

    targets = in_windows(desired_motion(case.schedule.paths, grasps), windows)

    for window, (desired, twists) in zip(windows, targets, strict=True):
        for index, path in enumerate(case.schedule.paths):
            X, V = path.at(window.times, window.stretches)
            np.testing.assert_array_equal(np.moveaxis(desired[:, :, index], -1, 0), X)
            np.testing.assert_array_equal(twists[:, index].T, V)
        for index, grasp in enumerate(grasps, start=len(case.schedule.paths)):
            assert np.all(desired[:, :, index] == grasp.X_PT[:, :, None])
            assert not twists[:, index].any()


def test_desired_poses_are_repeated_for_each_cell() -> None:
    X, V = random_desired(2, 3)[0]
    X_twice, V_twice = repeated((X, V), 2)
    assert np.array_equal(X_twice, np.concatenate([X, X], axis=-1))
    assert np.array_equal(V_twice, np.concatenate([V, V], axis=-1))
