"""Rehearsals with simulated arms and a camera: what they execute, how frames correct, programs from home to home."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from cellplan import load_cell, load_errors, rehearse, solve
from cellplan.checks.real_cell import RealCell, pixels
from cellplan.errors import InputError
from cellplan.jobs.rehearsal.record import rehearsal_record
from cellplan.jobs.rehearsal.result import rehearsal_figures, simulated_lines
from cellplan.model.cell.cell_errors import CellErrors
from cellplan.model.settings.simulation import SimulationEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.report.record.common import Provenance

pytestmark = pytest.mark.usefixtures("stored_solutions")

LINKS = {
    name: {"mass_kg": mass, "centre_mm": [centre, 0, 0], "inertia_kg_m2": [0.01, 0, 0, 0.2, 0, 0.2]}
    for name, mass, centre in (("A", 20, 250), ("B", 12, 700), ("C", 5, 1000))
}
LOOSE = {"kp": {"A": 300, "B": 100, "C": 20}, "kd": {"A": 100, "B": 30, "C": 5}}
STIFF = {"kp": {"A": 3000, "B": 1000, "C": 200}, "kd": {"A": 300, "B": 100, "C": 15}, "feedforward": "dynamics"}


@pytest.fixture(scope="module")
def pair(cells):
    """The planar pair on a clock of 50 ms; the right arm has masses, the other one none."""
    values = {"robots.right.inertias": {"links": LINKS}, "robots.right.tool.mass_kg": 1.0, "motion.duration_s": 3}
    cell = load_cell(cells / "planar_pair.yaml").with_values(values)
    task = replace(cell.task("circle"), tolerance=ToleranceEntry(position_mm=0.1, orientation_deg=0.01))
    solver = cell.solver.changed(gain_per_s=10.0, integrator="euler")
    return solve(replace(cell, tasks=(task,), motion=replace(cell.motion, step=0.05), solver=solver)).cell


def simulation(robot="right", **settings):
    return SimulationEntry.model_validate({"step_ms": 5.0, "robots": {robot: settings}}, strict=False)


def joint_errors(run):
    joints = run.trials[0].joints
    return np.abs(joints.executed - joints.commanded)


def test_tools_are_where_the_executed_joints_have_them(pair):
    (run,) = rehearse(pair, CellErrors(simulation=simulation(**LOOSE))).runs

    (trial,) = run.trials
    schedule = solve(pair).runs[0].schedule
    (expected,) = RealCell(pair).accuracy(schedule, trial.joints.executed)
    np.testing.assert_array_equal(trial.before[0].position_error, expected.position_error)
    still, moved = joint_errors(run)[:, pair.columns("left")], joint_errors(run)[:, pair.columns("right")]
    assert not still.any()
    assert moved.max() > 0.001


def test_stiffer_controllers_with_feedforward_follow_better(pair):
    loose, stiff = (
        rehearse(pair, CellErrors(simulation=simulation(**settings))).runs[0] for settings in (LOOSE, STIFF)
    )

    assert joint_errors(stiff).max() < 0.1 * joint_errors(loose).max()


def test_feedback_cancels_what_controllers_leave(pair):
    made = rehearse(pair, CellErrors(simulation=simulation(**STIFF)), feedback=True)

    (trial,) = made.runs[0].trials
    before, after = (np.linalg.norm(it[0].position_error, axis=1).max() for it in (trial.before, trial.final))
    assert after < 0.3 * before


def test_records_say_how_far_joints_were_off_and_which_torque_moved_them(pair):
    made = rehearse(pair, CellErrors(simulation=simulation(**LOOSE, saturation=30)))

    record = rehearsal_record(made, provenance=Provenance(versions={}, digests={}))
    of_a = record["simulated"]["right"]["A"]
    assert of_a["max_error_deg"] == pytest.approx(np.degrees(joint_errors(made.runs[0])[:, 3].max()))
    assert 0.0 < of_a["max_torque_nm"] <= 30.0
    (line,) = simulated_lines(record)
    assert line.startswith("right: joint error ")
    assert line.endswith(")")
    assert " N m (" in line
    assert "joints_right" in rehearsal_figures(made)


def test_a_robot_without_masses_is_refused(pair):
    stated = CellErrors(simulation=simulation("left", kp=400), file="e.yaml")

    with pytest.raises(InputError, match=r"^e.yaml: simulation.robots.left: expected a robot whose masses are stated"):
        rehearse(pair, stated)


def test_an_inertia_that_no_body_has_is_refused(cells):
    links = {**LINKS, "B": {**LINKS["B"], "inertia_kg_m2": [-0.01, 0, 0, 0.2, 0, 0.2]}}
    values = {"robots.right.inertias": {"links": links}, "robots.right.tool.mass_kg": 1.0}
    odd = load_cell(cells / "planar_pair.yaml").with_values(values)

    with pytest.raises(InputError, match=r"simulation.robots.right: .* B: an inertia that is not positive definite"):
        rehearse(odd, CellErrors(simulation=simulation(**LOOSE)))


def test_a_robot_that_carries_a_part_without_a_mass_is_refused(pair):
    """A part of unknown weight is not taken for weightless."""
    holder = pair.robot("left")
    heavy = replace(holder, model=replace(holder.model, inertias=pair.robot("right").model.inertias))
    robots = tuple(heavy if it.name == holder.name else it for it in pair.robots)
    cell = replace(pair, robots=robots, part=replace(pair.part, mass=None))

    with pytest.raises(InputError, match=r"^e.yaml: simulation.robots.left: .* mass of the part not stated"):
        rehearse(cell, CellErrors(file="e.yaml", simulation=simulation("left", kp=1.0)))


@pytest.fixture(scope="module")
def servo(cells):
    """The arm that a camera leads to a point, for half a second, with a model and a camera that are right."""
    cell = load_cell(cells / "papers" / "nicolato_servo.yaml")
    cell = cell.with_values({"tasks.target.duration_s": 0.4, "tasks.target.settle_s": 0.2, "motion.step_s": 0.01})
    stated = load_errors(cells / "errors" / "nicolato_servo.yaml", cell)
    camera = stated.measurement.camera.changed(believed=None)
    return cell, replace(stated, robots={}, simulation=None, measurement=stated.measurement.changed(camera=camera))


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_each_image_takes_away_its_share_of_the_error(servo, share):
    cell, stated = servo
    stated = replace(stated, measurement=stated.measurement.changed(share=share))

    (trial,) = rehearse(cell, stated, in_pass=True).runs[0].trials

    error = np.linalg.norm(trial.in_pass[0].position_error, axis=1)
    images = error[::4]  # 40 ms; what an image shows acts until the next
    expected = error[0] * (1.0 - share) ** np.arange(len(images))
    np.testing.assert_allclose(images, expected, atol=2e-4)  # [m] the point itself moves on by 0.2 mm


def test_a_believed_camera_scales_corrections_by_height_over_focal_length(servo):
    """Eqs. 4.3 to 4.6 of the thesis: twice as long in columns and 4/3 in rows, at the same height."""
    cell, stated = servo
    camera = stated.measurement.camera
    wrong = camera.changed(believed={"focal_px": (200.0, 300.0), "at": camera.at})
    system = stated.measurement.changed(camera=wrong)
    desired = np.eye(4)[None]
    desired[0, :3, 3] = [0.3, 0.1, 0.0]
    q = np.array([[0.4, 0.3, -0.2]])

    (seen,) = RealCell(cell).measured([(cell.task("target"), desired)], q, system, np.random.default_rng(0))

    (true,) = RealCell(cell).tool_poses([cell.task("target")], q)
    expected = (desired - true)[0, :2, 3] * [4 / 3, 2.0]  # rows of the image run along -x, columns along -y
    np.testing.assert_allclose((desired - seen)[0, :3, 3], [*expected, 0.0], atol=1e-12)
    np.testing.assert_array_equal(seen[0, :3, :3], desired[0, :3, :3])


def test_the_printed_camera_sees_the_printed_target_beyond_the_arm(servo):
    camera = servo[1].measurement.camera.changed(at={"xyz_mm": (0.0, 0.0, 1200.0), "rpy_deg": (180.0, 0.0, -90.0)})

    np.testing.assert_allclose(pixels(camera, np.array([[0.57, 0.24, 0.0]])), [[240.0, 50.0]], atol=1e-9)
    with pytest.raises(InputError, match=r"^measurement.camera.at: expected all tips in front of the camera"):
        pixels(camera, np.array([[0.0, 0.0, 1.3]]))


@pytest.mark.slow
def test_a_program_from_home_to_home_is_executed_as_a_whole(cells):
    cell = load_cell(cells / "three_tasks_each.yaml")
    axes = cell.robot("left").model.joints
    links = {
        joint.name: {
            "mass_kg": 4,
            "centre_mm": (1e3 * joint.point_B).tolist(),
            "inertia_kg_m2": [0.1, 0, 0, 0.1, 0, 0.1],
        }
        for joint in axes
    }
    masses = {f"robots.{name}.tool.mass_kg": 1.0 for name in ("left", "right", "holder")}
    cell = cell.with_values({"robots.left.inertias": {"links": links}} | masses)
    stated = CellErrors(simulation=simulation("left", kp=3000, kd=100, rotor_inertia=1.0, feedforward="dynamics"))

    made = rehearse(cell, stated)

    columns = cell.columns("left")
    joints = [run.trials[0].joints for run in made.runs]
    for before, after in pairwise(joints):  # the same row: nothing is begun anew
        np.testing.assert_array_equal(before.executed[-1, columns], after.executed[0, columns])
        np.testing.assert_array_equal(before.torque[-1], after.torque[0])
    assert {task.task for run in made.runs for task in run.trials[0].before} == {task.name for task in cell.tasks}
    with pytest.raises(InputError, match="expected a cell without a program from home to home for --feedback"):
        rehearse(cell, stated, feedback=True)
