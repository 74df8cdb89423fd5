"""How far rounded rows may be off straight motion: against corner paths that are sampled densely."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.shapes import Mesh
from cellplan.model.report.exported import RobotRows
from cellplan.programs.rows.margins import body_reach, corners_at, in_steps, raised, tool_corners
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

SHARE = 0.4


def bound(q: np.ndarray, times: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """What one robot may be off in each step."""
    return in_steps(corners_at(RobotRows(robot="a", q=q, times=times), shares, times))


def straight(q: np.ndarray, times: np.ndarray, at: float) -> np.ndarray:
    return np.array([np.interp(at, times, column) for column in q.T])


@pytest.mark.parametrize("seed", range(20))
def test_no_parabola_at_a_row_is_farther_off_than_the_bound(seed: int) -> None:
    """Each leaves within its own share on either side; it is compared with straight motion at the same time."""
    rng = np.random.default_rng(seed)
    q, times = rng.normal(size=(3, 4)), np.cumsum(rng.uniform(0.1, 2.0, 3))
    h, v = np.diff(times), np.diff(q, axis=0) / np.diff(times)[:, None]

    allowed = bound(q, times, np.array([0.0, SHARE, 0.0]))

    largest = np.zeros(4)
    for first, last in [(SHARE, SHARE), *rng.uniform(0.0, SHARE, (10, 2))]:
        before, after = first * h[0], last * h[1]
        for s in np.linspace(0.0, 1.0, 200):
            path = q[1] - (1.0 - s) ** 2 * before * v[0] + s**2 * after * v[1]
            time = times[1] - (1.0 - s) ** 2 * before + s**2 * after
            largest = np.maximum(largest, np.abs(path - straight(q, times, time)))
    assert np.all(largest <= allowed[0] + 1e-12)
    np.testing.assert_array_equal(allowed[0], allowed[1])


@pytest.mark.parametrize("seed", range(5))
def test_the_chord_of_a_corner_is_off_by_the_bound_itself(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, times = rng.normal(size=(3, 4)), np.cumsum(rng.uniform(0.1, 2.0, 3))
    ends = [straight(q, times, times[1] + by) for by in (-SHARE * (times[1] - times[0]), SHARE * (times[2] - times[1]))]
    part = (times[1] - times[0]) / (times[2] - times[0])  # of the chord at the time of the row

    allowed = bound(q, times, np.array([0.0, SHARE, 0.0]))

    np.testing.assert_allclose(np.abs(ends[0] + part * (ends[1] - ends[0]) - q[1]), allowed[0], rtol=1e-9)


def test_even_motion_in_uneven_steps_is_off_by_nothing() -> None:
    times = np.array([0.0, 0.1, 1.0, 1.1, 3.0])

    allowed = bound(times[:, None] * np.array([1.0, -2.0]), times, np.full(5, 0.5))

    np.testing.assert_allclose(allowed, 0.0, atol=1e-12)


def test_only_the_steps_beside_a_rounded_row_are_off() -> None:
    q = np.random.default_rng(1).normal(size=(6, 2))

    allowed = bound(q, np.arange(6.0), np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0]))

    assert np.all(allowed[1:3] > 0.0)
    np.testing.assert_array_equal(allowed[[0, 3, 4]], 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_point_of_the_triangle_is_off_by_less_the_farther_it_is_from_the_row(seed: int) -> None:
    """Any place within the triangle, with a share of its own on either side: never beyond the bound at its time."""
    rng = np.random.default_rng(seed)
    q, times = rng.normal(size=(3, 4)), np.cumsum(rng.uniform(0.1, 2.0, 3))
    rows, shares = RobotRows(robot="a", q=q, times=times), np.array([0.0, SHARE, 0.0])
    h, v = np.diff(times), np.diff(q, axis=0) / np.diff(times)[:, None]

    for before, after in rng.uniform(0.0, SHARE, (200, 2)) * h:
        one, other = np.sort(rng.uniform(0.0, 1.0, 2))
        back, on = one * before, (1.0 - other) * after
        time = times[1] + on - back
        off = q[1] - back * v[0] + on * v[1] - straight(q, times, time)
        (allowed,) = corners_at(rows, shares, np.array([time]))
        along = float(off @ allowed) / float(allowed @ allowed)
        assert -1e-9 <= along <= 1.0 + 1e-9
        np.testing.assert_allclose(off, along * allowed, atol=1e-12)


@pytest.fixture(scope="module")
def scene(cells: Path) -> Scene:
    return Scene.from_cell(load_cell(cells / "two_robots.yaml"))


@pytest.mark.parametrize("seed", range(3))
def test_no_tool_is_moved_farther_on_the_part_than_its_bound(scene: Scene, seed: int) -> None:
    """By other kinematics: each robot off by any part of what it may be, the whole between two times too."""
    cell, rng = scene.cell, np.random.default_rng(seed)
    middle = np.array([0.5 * (joint.lower + joint.upper) for robot in cell.robots for joint in robot.model.joints])
    q = middle + rng.uniform(-0.6, 0.6, len(middle)) + np.cumsum(rng.uniform(-0.004, 0.004, (5, len(middle))), axis=0)
    corners = rng.uniform(-0.002, 0.002, q.shape) * np.array([0.0, 0.6, 1.0, 0.3, 0.0])[:, None]
    corners[1:4] = corners[2] * np.array([0.6, 1.0, 0.3])[:, None]
    (task,) = cell.tasks
    columns = [cell.columns(robot.name) for robot in cell.robots]

    allowed = tool_corners(LeverArms(scene, q), scene, task, q, corners)

    assert np.all(allowed[[0, -1]] >= 0.0)
    largest = np.zeros(2)
    for step in range(4):
        for s in np.linspace(0.0, 1.0, 5):
            at, off = q[step] + s * (q[step + 1] - q[step]), corners[step] + s * (corners[step + 1] - corners[step])
            most = allowed[step] + s * (allowed[step + 1] - allowed[step])
            for parts in [(1.0, 1.0), (1.0, 0.0), (0.0, 1.0), *rng.uniform(0.0, 1.0, (3, 2))]:
                moved = at.copy()
                for part, column in zip(parts, columns, strict=True):
                    moved[column] += part * off[column]
                one, other = (_on_part(scene, task.robot, entry) for entry in (at, moved))
                turn = np.arccos(np.clip(0.5 * (np.trace(one[:3, :3].T @ other[:3, :3]) - 1.0), -1.0, 1.0))
                moved_by = np.array([np.linalg.norm(one[:3, 3] - other[:3, 3]), turn])
                assert np.all(moved_by <= most + 1e-9)
                largest = np.maximum(largest, moved_by)
    assert np.all(allowed.max(axis=0) <= 1.25 * largest)


def _on_part(scene: Scene, robot: str, q: np.ndarray) -> np.ndarray:
    """Tool in the part frame."""
    cell = scene.cell
    holder = cell.part.held_by[0].robot
    X = {name: scene.chains[name].tool_poses(q[None, cell.columns(name)])[0] for name in (robot, holder)}
    X_PT: np.ndarray = np.linalg.inv(X[holder] @ cell.part.X_CP) @ X[robot]
    return X_PT


def test_pairs_are_to_keep_what_joints_may_be_off_besides(scene: Scene) -> None:
    """Those that need not keep a distance have to keep this much; those that do not move nothing more."""
    q = np.zeros((2, scene.cell.joint_count))
    off = np.zeros((1, scene.cell.joint_count))
    off[0, scene.cell.columns(scene.cell.tasks[0].robot)] = 1e-3

    more = raised(LeverArms(scene, q), scene, off)

    assert len(more.pairs) == len(scene.pairs)
    moved = {
        index for index, body in enumerate(scene.bodies) if body.robot == scene.cell.tasks[0].robot and body.link >= 0
    }
    for pair, other in zip(scene.pairs, more.pairs, strict=True):
        before = pair.demand if pair.rule is Rule.CLEARANCE else 0.0
        if moved & {pair.first, pair.second} and other.rule is Rule.CLEARANCE:
            assert other.demand >= before
        else:
            assert other == pair
    assert any(other.demand > pair.demand for pair, other in zip(scene.pairs, more.pairs, strict=True))
    assert raised(LeverArms(scene, q), scene, 0.0 * off).pairs == scene.pairs


@pytest.mark.parametrize("seed", range(5))
def test_no_point_on_the_flange_moves_farther_than_the_tip_and_its_turn_let_it(scene: Scene, seed: int) -> None:
    """Joints are moved by chance; corners of the hulls on the flange are compared with what the tool does."""
    rng, cell, robot = np.random.default_rng(seed), scene.cell, scene.cell.tasks[0].robot
    at = np.tile(rng.uniform(-1.0, 1.0, cell.joint_count), (2, 1))
    at[1, cell.columns(robot)] += rng.normal(scale=0.01, size=at[1, cell.columns(robot)].shape)
    tip, other = scene.chains[robot].tool_poses(at[:, cell.columns(robot)])
    turn = np.arccos(np.clip(0.5 * (np.trace(tip[:3, :3].T @ other[:3, :3]) - 1.0), -1.0, 1.0))
    tips = {robot: np.array([[np.linalg.norm(tip[:3, 3] - other[:3, 3]), turn]])}
    off = np.abs(np.diff(at, axis=0))

    arms, poses = LeverArms(scene, at), scene.body_poses(at)
    by_joints, by_tip = body_reach(arms, scene, off), body_reach(arms, scene, off, tips)

    flange = cell.robot(robot).model.flange_link
    on_flange = [
        index
        for index in range(len(by_tip))
        if scene.carrier(index).robot == robot and scene.carrier(index).link == flange
    ]
    assert on_flange
    for index in range(len(by_tip)):
        body = scene.engine.bodies[index]
        vertices = body.hull.vertices if isinstance(body.hull, Mesh) else body.ends
        places = np.einsum("nij,vj->nvi", poses.R[index], vertices) + poses.p[index][:, None]
        assert np.linalg.norm(places[1] - places[0], axis=1).max() <= by_tip[index, 0] + 1e-12
        assert by_tip[index, 0] <= by_joints[index, 0]
        assert index in on_flange or by_tip[index, 0] == by_joints[index, 0]
    assert np.all(by_tip[on_flange] < by_joints[on_flange])
