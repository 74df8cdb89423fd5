"""Tool axes that may lean within a cone: derivatives, the cone from step to step, and errors beyond it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.cam_files import milling_cell
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan import Solution, load_cell, solve
from cellplan.errors import InputError
from cellplan.geometry.transforms import pose_from, rotation_exp
from cellplan.measures.tool_errors import error_lengths, errors_on_part
from cellplan.model.cell.cell import Cell
from cellplan.planning.methods.quadratic_program import APPROACH, NORMALS, Cones, leaning_velocities, without_tilts
from cellplan.planning.methods.support.speed_bounds import VelocityBounds
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import FirstOrder, TrackingProblem

# two sides of 30 mm over the ball, between which the axis of the file turns by 17 degrees
PATH = "UNITS/MM\nMULTAX/ON\nFEDRAT/2400\nGOTO/-30,0,201,0,0,1\nGOTO/0,0,201,0.3,0,1\nGOTO/30,0,201,0,0,1\n"


def cell_of(folder: Path, free: str, method: str = "quadratic_program") -> Cell:
    (folder / "part.apt").write_text(PATH)
    text = milling_cell("{apt: part.apt}", more="    standoff_mm: [0, 5]\n").replace("free: [spin]", f"free: {free}")
    (folder / "cell.yaml").write_text(f"{text}solver: {{method: {method}}}\n")
    return load_cell(folder / "cell.yaml")


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Solution:
    return solve(cell_of(tmp_path_factory.mktemp("strict"), "[spin]"))


def leaning(strict: Solution, tilt_deg: float) -> Solution:
    """The same cell from the same start, with a cone."""
    cell = strict.cell
    tasks = tuple(replace(task, tilt=np.deg2rad(tilt_deg)) for task in cell.tasks)
    return solve(replace(cell, tasks=tasks, robots=(replace(cell.robots[0], start=strict.runs[0].motion.q[0]),)))


@pytest.fixture(scope="module")
def narrow(strict: Solution) -> Solution:
    return leaning(strict, 2.0)


def angles(solution: Solution) -> np.ndarray:
    """Angles in [deg] between the tool axis and the desired one, by a second kinematics."""
    run = solution.runs[0]
    X_WT = run.scene.chains["arm"].tool_poses(run.motion.q)
    z = X_WT[:, :3, 2] @ solution.cell.part.X_CP[:3, :3]
    z_desired = run.schedule.tasks[0].X_PT[:, :3, 2]
    return np.rad2deg(np.arctan2(np.linalg.norm(np.cross(z, z_desired), axis=1), np.sum(z * z_desired, axis=1)))


def test_the_axis_leans_up_to_the_border_and_no_farther_and_saves_joint_speed(
    strict: Solution, narrow: Solution
) -> None:
    assert strict.passed
    assert narrow.passed
    assert angles(strict).max() < 0.01
    assert 2.0 * np.cos(np.pi / 16) - 0.01 < angles(narrow).max() <= 2.01
    effort = [np.linalg.norm(np.diff(it.runs[0].motion.q, axis=0)) for it in (strict, narrow)]
    assert effort[1] < 0.98 * effort[0]


def test_the_report_has_the_angle_and_what_lies_beyond_the_cone_is_the_error(narrow: Solution) -> None:
    accuracy = narrow.runs[0].report.accuracy[0]
    assert accuracy.lean is not None
    assert np.rad2deg(accuracy.lean) == pytest.approx(angles(narrow).max(), abs=1e-6)
    beyond = np.maximum(angles(narrow) - 2.0, 0.0)
    assert np.rad2deg(np.linalg.norm(accuracy.orientation_error, axis=1)) == pytest.approx(beyond, abs=1e-6)
    checks = {check.name: check for check in narrow.runs[0].report.checks}
    assert "beyond a tilt of 2 deg" in checks["orientation_error"].message
    assert checks["orientation_error_between_rows"].passed


def test_a_cone_that_is_hardly_open_is_the_strict_axis(strict: Solution) -> None:
    nearly = leaning(strict, 1e-4)

    assert np.abs(nearly.runs[0].motion.q - strict.runs[0].motion.q).max() < 1e-4


def test_the_lean_changes_as_the_rows_of_the_cone_say(narrow: Solution) -> None:
    """The derivative of the lean by every joint, with the desired axis at rest, from central differences."""
    run, h = narrow.runs[0], 1e-6
    problem = TrackingProblem(MotionTask(narrow.cell, run.schedule, ["arm"], run.motion.q[0]))
    (rows,) = problem.tilt_rows
    k = int(np.argmax(angles(narrow)))
    q = run.motion.q[k]
    first = problem.first_order(k, q)
    xdot = first.twist + problem.gain * first.error
    _, stays, cones = without_tilts(first, xdot, problem.tilt_rows, gain=100.0)

    def length(q: np.ndarray) -> float:
        return float(np.linalg.norm(problem.first_order(k, q).error[rows.rows]))

    e = first.error[rows.rows]
    numeric = np.array([(length(q + h * step) - length(q - h * step)) / (2.0 * h) for step in np.eye(len(q))])
    weights = np.linalg.lstsq(NORMALS.T, e / np.linalg.norm(e), rcond=None)[0]  # the side of the lean, by normals
    assert len(stays) == len(xdot) - 2
    assert -(weights @ cones.G) == pytest.approx(numeric, abs=1e-7)
    at_rest = cones.least - NORMALS @ first.twist[rows.rows]
    beyond = NORMALS @ e - np.cos(np.pi / 16) * rows.tilt
    assert at_rest == pytest.approx(np.where(beyond < 0.0, APPROACH, 100.0) * beyond)


@pytest.mark.parametrize(("least", "speed"), [(0.3, 0.3), (-0.3, 0.0), (1.0, 0.5)])
def test_a_cone_bounds_speeds_and_yields_to_the_limits_of_joints(least: float, speed: float) -> None:
    """One joint: it has the speed that the cone demands; where its limit of 0.5 is less, it leads the axis back."""
    whole = FirstOrder(np.ones((1, 1)), np.zeros(1), np.ones(1), np.ones(1), None)
    others = replace(whole, J=np.zeros((0, 1)), twist=np.zeros(0), error=np.zeros(0))
    bounds = VelocityBounds(np.full(1, -0.5), np.full(1, 0.5))
    cones = Cones(np.ones((1, 1)), np.array([least]))

    qd, slack = leaning_velocities(
        whole, np.ones(1), bounds, mobile=np.ones(1, bool), slack_weight=1e8, cones=(others, np.zeros(0), cones)
    )
    assert qd == pytest.approx([speed], abs=1e-7)
    assert slack == pytest.approx(0.5 if speed == 0.5 else 0.0, abs=1e-7)


@given(st.floats(0.0, 0.5), st.floats(0.0, 0.4), st.floats(0.0, 6.28))
@settings(max_examples=50, deadline=None)
def test_the_error_of_an_axis_is_its_angle_beyond_the_cone(angle: float, tilt: float, side: float) -> None:
    task = _Relation(tilt)
    lean = rotation_exp(angle * np.array([[np.cos(side), np.sin(side), 0.0]]))
    X_PT = pose_from(lean, np.zeros((1, 3)))

    error = errors_on_part(X_PT, np.eye(4)[None], task)[0, 3:]
    assert np.linalg.norm(error) == pytest.approx(max(0.0, angle - tilt), abs=1e-12)
    if angle > tilt:
        assert np.cross(error, [np.cos(side), np.sin(side), 0.0]) == pytest.approx(np.zeros(3), abs=1e-12)


class _Relation:
    """A tool with a free spin and a cone."""

    is_spin_free = True
    axes = (0, 1, 2, 3, 4, 5)

    def __init__(self, tilt: float) -> None:
        self.tilt = tilt


def test_no_angle_between_rows_is_larger_than_its_bound(narrow: Solution) -> None:
    """The rows of the strict axis, and what they are against narrower and wider cones, in a fine subdivision."""
    run = narrow.runs[0]
    between = run.report.accuracy[0].between
    assert between is not None
    assert between.orientation.bound is not None
    task = run.schedule.tasks[0].task
    s = np.linspace(0.0, 1.0, 21)[:-1]
    times = run.schedule.times
    fine = (times[:-1, None] + s * np.diff(times)[:, None]).ravel()
    q = (run.motion.q[:-1, None] + s[:, None] * np.diff(run.motion.q, axis=0)[:, None]).reshape(-1, 6)
    X_PT = np.linalg.inv(narrow.cell.part.X_CP) @ run.scene.chains["arm"].tool_poses(q)
    (desired,) = run.schedule.poses(fine)

    assert error_lengths(X_PT, desired, task)[:, 1].max() <= between.orientation.bound + 1e-12


@pytest.mark.parametrize("method", ["weighted_pseudo_inverse", "damped_least_squares"])
def test_methods_that_cannot_let_an_axis_lean_keep_it(tmp_path: Path, strict: Solution, method: str) -> None:
    cell = cell_of(tmp_path, "[spin, {tilt_deg: 5}]", method)
    solution = solve(cell)

    assert solution.passed
    assert angles(solution).max() < 0.01
    assert cell.tasks[0].tilt == pytest.approx(np.deg2rad(5.0))


@pytest.mark.parametrize(
    ("free", "words"),
    [
        (
            "[{tilt_deg: 5}]",
            "tasks.mill.free: expected spin beside tilt_deg: [spin, {tilt_deg: 10}], as a cone is round",
        ),
        ("[spin, {tilt_deg: 0}]", "tasks.mill.free[1].tilt_deg: expected"),
        ("[spin, {tilt_deg: 80}]", "tasks.mill.free[1].tilt_deg: expected"),
        ("[spin, lean]", "tasks.mill.free[1]: expected"),
        ("[spin, {tilt_deg: 5}, {tilt_deg: 6}]", "tasks.mill.free[2]: expected each word once"),
    ],
)
def test_wrong_cones_are_refused_by_key(tmp_path: Path, free: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        cell_of(tmp_path, free)
    assert words in str(caught.value)
