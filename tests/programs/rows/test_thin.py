"""Thinned rows: within their tolerances by another kinematics, common to a controller, and nothing lost that counts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.moved_rows import linear_at, smooth_rows

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.geometry.transforms import inverse, rotation_vector
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ProgramRows
from cellplan.programs.rows.rows import EssentialRows, WorkRows
from cellplan.programs.rows.thin import ThinningLimits, thinned
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.scene import Scene

LIMITS = ThinningLimits(turn=2e-3, slide=1e-3, tool=1e-4)
OFF_TOL = 1e-5  # [m] by which a tool may leave its tolerance between two rows of the run


def _work(cell: Cell, program: ProgramRows) -> EssentialRows:
    count = len(next(iter(program.robots.values())))
    return EssentialRows((), (WorkRows(slice(0, count), cell, tuple(task.name for task in cell.tasks), {}, {}),))


def _tool_errors(cell: Cell, one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> np.ndarray:
    """How far the tools of all tasks are apart on the part in two motions, by pinocchio, shape (N, tasks, 2)."""
    model, errors = CombinedModel(cell), []
    stacks = [np.concatenate([q[robot.name] for robot in cell.robots], axis=1) for q in (one, other)]
    for rows in zip(*stacks, strict=True):
        poses = []
        for q in rows:
            state = model.state(q)
            tools = [state.X_WT[cell.index(task.robot)].copy() for task in cell.tasks]
            poses.append([inverse(state.X_WP) @ X_WT for X_WT in tools])
        apart = []
        for X, Y in zip(*poses, strict=True):
            turn = rotation_vector((Y[:3, :3] @ X[:3, :3].T)[None])[0]
            apart.append((np.linalg.norm(Y[:3, 3] - X[:3, 3]), np.linalg.norm(turn)))
        errors.append(apart)
    return np.array(errors)


@pytest.mark.parametrize(("name", "seed"), [("turntable", 11), ("rail", 12), ("fixed_part", 13)])
def test_joints_and_tools_keep_their_tolerances_between_rows_too(cells: Path, name: str, seed: int) -> None:
    cell = load_cell(cells / f"{name}.yaml")
    program = smooth_rows(cell, seed=seed)
    names = [robot.name for robot in cell.robots]

    thin = thinned(Scene.from_cell(cell), program, groups=[names], limits=LIMITS, essential_rows=_work(cell, program))

    times = np.linspace(0.0, 4.0, 371)
    full, fewer = linear_at(program.robots, times), linear_at(thin.robots, times)
    errors = _tool_errors(cell, full, fewer)
    for robot in cell.robots:
        for index, joint in enumerate(robot.model.joints):
            allowed = LIMITS.turn if joint.is_revolute else LIMITS.slide
            assert np.abs(full[robot.name] - fewer[robot.name])[:, index].max() <= allowed + 1e-12
    demanded = np.array([task.tolerance.between for task in cell.tasks])
    assert np.all(errors[..., 0] <= np.minimum(LIMITS.tool, demanded[:, 0]) + OFF_TOL)
    assert np.all(errors[..., 1] <= demanded[:, 1] + 1e-5)
    assert len(next(iter(thin.robots.values()))) < 401


def test_robots_of_a_controller_share_rows_and_others_have_their_own(cells: Path) -> None:
    cell = load_cell(cells / "turntable.yaml")
    program, scene = smooth_rows(cell, seed=14), Scene.from_cell(cell)

    common = thinned(
        scene, program, groups=[["table", "kuka"]], limits=LIMITS, essential_rows=_work(cell, program)
    ).robots
    apart = thinned(
        scene, program, groups=[["table"], ["kuka"]], limits=LIMITS, essential_rows=_work(cell, program)
    ).robots

    np.testing.assert_array_equal(common["table"].times, common["kuka"].times)
    assert not np.array_equal(apart["table"].times, apart["kuka"].times)
    times = np.linspace(0.0, 4.0, 151)
    errors = _tool_errors(cell, linear_at(program.robots, times), linear_at(apart, times))
    assert errors[..., 0].max() <= LIMITS.tool + OFF_TOL


def test_only_robots_of_a_group_are_written(cells: Path) -> None:
    cell = load_cell(cells / "turntable.yaml")
    program = smooth_rows(cell, seed=14)

    thin = thinned(
        Scene.from_cell(cell), program, groups=[["kuka"]], limits=LIMITS, essential_rows=_work(cell, program)
    )

    assert list(thin.robots) == ["kuka"]


def test_what_must_stay_stays(cells: Path) -> None:
    """Ends, switches of the process, marks, standstills and rows that are named, with their values."""
    cell = load_cell(cells / "turntable.yaml")
    program = smooth_rows(cell, seed=15)
    still = {name: rows.q.copy() for name, rows in program.robots.items()}
    for q in still.values():
        q[150:170] = q[150]
    robots = {name: replace(rows, q=still[name], marks=(0, 77, 400)) for name, rows in program.robots.items()}
    program = replace(program, robots=robots)
    loose = ThinningLimits(turn=0.5, slide=0.5, tool=1.0)

    result = thinned(
        Scene.from_cell(cell),
        program,
        groups=[["table", "kuka"]],
        limits=loose,
        essential_rows=EssentialRows((33, 222), ()),
    ).robots

    rows = result["kuka"]
    chosen = np.rint(rows.times / 0.01).astype(int)
    assert {0, 33, 77, 100, 150, 169, 222, 300, 400} <= {*chosen.tolist()}
    assert [int(chosen[mark]) for mark in rows.marks] == [0, 77, 400]
    np.testing.assert_array_equal(rows.q, robots["kuka"].q[chosen])
    np.testing.assert_array_equal(rows.process, robots["kuka"].process[chosen])
    assert np.all(rows.qd[[0, -1]] == 0.0)


def test_the_shortest_time_between_rows_is_kept_or_the_tolerance_is_refused(cells: Path) -> None:
    cell = load_cell(cells / "turntable.yaml")
    program, scene = smooth_rows(cell, seed=16), Scene.from_cell(cell)
    groups = [["table", "kuka"]]
    spread = replace(LIMITS, tool=1e-3, shortest_time=0.05)

    rows = thinned(scene, program, groups=groups, limits=spread).robots["kuka"]

    assert np.diff(rows.times).min() >= 0.05 - 1e-9
    with pytest.raises(InputError, match=r"rows of table, kuka at .* s: expected tolerances that rows at least 0.5 s"):
        thinned(scene, program, groups=groups, limits=replace(LIMITS, shortest_time=0.5))
    with pytest.raises(InputError, match="and 300 mm apart can keep, got joints off by"):
        thinned(scene, program, groups=groups, limits=replace(LIMITS, shortest_distance=0.3))
