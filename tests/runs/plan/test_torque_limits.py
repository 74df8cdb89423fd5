"""Retimed rows within limits of torque: slides of known mass against closed forms, arms by the equations of motion."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.rod_arms import rod_values
from builders.scene_builders import make_cell
from builders.transfer_cells import gantry
from builders.uncertified import uncertified

from cellplan import load_cell
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Tool
from cellplan.model.robot.inertia import LinkInertia
from cellplan.model.settings.program import ProgramEntry, TransferEntry
from cellplan.planning.transfer.straight_time import straight_rows
from cellplan.runs.plan.retiming import row_limits, transfer_retimer
from cellplan.runs.plan.torque_limits import torque_limits
from cellplan.scene.scene import Scene

CELL = Path(__file__).resolve().parents[3] / "cells" / "planar_pair.yaml"
STEP = 0.004  # [s]
MASSES = (6.0, 2.0)  # [kg] of both slides
START, GOAL = np.zeros(2), np.array([0.8, 0.0])


def slides(force: float | None, *, tool: float = 0.0, share: float = 1.0) -> Scene:
    """Two slides without other limits, the first one with a largest force in [N], and a tool in [kg]."""
    robot = gantry("a")
    inertias = tuple(
        LinkInertia(link=link, mass=mass, centre_B=np.zeros(3), inertia_B=0.01 * np.eye(3))
        for link, mass in enumerate(MASSES)
    )
    first, second = (replace(joint, velocity=1e3) for joint in robot.model.joints)
    model = replace(robot.model, joints=(replace(first, torque=force), second), inertias=inertias)
    robot = replace(robot, model=model, tool=Tool(X_FT=np.eye(4), bodies=(), mass=tool))
    cell = make_cell(robot)
    program = ProgramEntry(transfer=TransferEntry(speed_percent=100.0 * share))
    motion = replace(cell.motion, step=STEP, build_up=None)
    return Scene.from_cell(replace(cell, motion=motion, program=program))


@pytest.mark.parametrize(("tool", "share"), [(0.0, 1.0), (4.0, 1.0), (4.0, 0.5)])
def test_a_straight_move_takes_the_time_of_a_pushed_mass_with_its_tool(tool: float, share: float) -> None:
    """In slow motion a share of the force is left: a quarter of it at half the speed."""
    force, mass = 40.0, sum(MASSES) + tool
    rows = straight_rows(START, GOAL, transfer_retimer(slides(force, tool=tool, share=share)))
    fastest = 2.0 * np.sqrt(0.8 * mass / (share**2 * force))
    assert STEP * (len(rows) - 1) == pytest.approx(fastest, rel=0.03)
    assert mass * np.abs(np.diff(rows[:, 0], 2)).max() / STEP**2 <= share**2 * force * (1.0 + 1e-9)


def test_masses_without_a_largest_force_change_no_row() -> None:
    weightless = slides(None)
    assert not torque_limits(weightless)
    robot = weightless.cell.robots[0]
    bare = replace(robot, model=replace(robot.model, inertias=None))
    cell = replace(weightless.cell, robots=(bare,))
    rows = [straight_rows(START, GOAL, transfer_retimer(scene)) for scene in (weightless, Scene.from_cell(cell))]
    np.testing.assert_array_equal(*rows)


TORQUES = {"A": 8.0, "B": 4.0, "C": 1.0}  # [N m]


def pair(timing: object, **further: object) -> Cell:
    """Two planar arms of rods, retimed."""
    values = {
        "part.mass_kg": 1e-6,
        "motion.timing": timing,
        "motion.step_s": STEP,
        "motion.duration_s": 4,
        "acceleration": {"full_speed_in_s": [0.25, 0.2, 0.15]},
        "tasks.circle.tolerance.between_rows_mm": 10,
        "tasks.circle.tolerance.between_rows_deg": 10,
    }
    return load_cell(CELL).with_values(values | further | rod_values(("left", "right"), TORQUES))


def planar_torques(q: Array) -> Array:
    """Torques of three rods in a plane, by d/dt dT/dqd - dT/dq with differences of the energy, shape (N - 2, 3)."""
    lengths, masses = np.array([0.5, 0.4, 0.2]), np.array([4.0, 3.0, 1.0])

    def momenta(q: Array, qd: Array) -> tuple[Array, float]:
        """dT/dqd and T."""
        angles, rates = np.cumsum(q), np.cumsum(qd)
        joint, jacobian, inertia = np.zeros((2, 3)), [], np.zeros((3, 3))
        for k in range(3):
            turned = np.array([-np.sin(angles[k]), np.cos(angles[k])])[:, None] * (np.arange(3) <= k)
            jacobian.append(joint + 0.5 * lengths[k] * turned)
            joint = joint + lengths[k] * turned
            spin = (np.arange(3) <= k).astype(float)
            inertia += masses[k] * jacobian[k].T @ jacobian[k]
            inertia += masses[k] * lengths[k] ** 2 / 12.0 * np.outer(spin, spin)
        assert rates.shape == (3,)
        return inertia @ qd, 0.5 * float(qd @ inertia @ qd)

    speeds, small, torques = np.diff(q, axis=0) / STEP, 1e-6, []
    for k in range(1, len(q) - 1):
        middle = 0.5 * (speeds[k - 1] + speeds[k])
        half = 0.25 * STEP * (speeds[k - 1] + speeds[k])
        acceleration = (speeds[k] - speeds[k - 1]) / STEP
        change = [momenta(q[k] + sign * half, middle + sign * 0.5 * STEP * acceleration)[0] for sign in (1.0, -1.0)]
        by_place = [momenta(q[k] + small * e, middle)[1] - momenta(q[k] - small * e, middle)[1] for e in np.eye(3)]
        torques.append((change[0] - change[1]) / STEP - np.array(by_place) / (2.0 * small))
    return np.array(torques)


@pytest.mark.slow
def test_a_program_at_its_torque_limit_holds_it_by_equations_of_lagrange() -> None:
    solution = uncertified(pair("fastest"))
    largest = np.array(list(TORQUES.values()))
    share = max(float((np.abs(planar_torques(q)) / largest).max()) for q in solution.runs[0].report.q.values())
    assert 0.97 <= share <= 1.005  # the middle of rows is not quite the row
    run = solution.runs[0]
    checks = [check for check in run.report.checks if check.name == "joint_torque"]
    assert len(checks) == 6
    assert all(check.passed for check in checks)
    assert max(check.value / check.limit for check in checks) > 0.99
    needed = row_limits(run.scene, run.schedule).slower(run.motion.sigma, run.motion.q)
    assert 0.98 <= needed <= 1.0


@pytest.mark.slow
def test_torques_of_retiming_are_those_that_are_checked_with_forces_of_processes_too() -> None:
    force = {"frame": "world", "newton": [0.0, -2.0, 0.0]}
    cell = pair("fastest", **{"tasks.circle.process": {"feed_mm_s": 200, "ramp_s": 0.4, "force": force}})
    run = uncertified(cell).runs[0]
    times, q = run.schedule.times, run.motion.q
    shares, _ = row_limits(run.scene, run.schedule).torques(times, q, sigma=times)
    checks = [check for check in run.report.checks if check.name == "joint_torque"]
    np.testing.assert_allclose(shares, [check.value / check.limit for check in checks], rtol=1e-9)
    silent = replace(run.schedule, tasks=())
    without, _ = row_limits(run.scene, silent).torques(times, q, sigma=times)
    assert np.abs(shares - without).max() > 0.1


UR5E = """\
cellplan: 1
name: loaded
robots:
  ur:
    model: ur5e
    base: {xyz_mm: [0, 0, 400]}
    tool: {xyz_mm: [0, 0, 150], mass_kg: 4, geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
    home_deg: [180, -100, 100, -90, -90, 0]
    start_deg: auto
    limits: {shoulder_lift: {torque_nm: 90}, elbow: {torque_nm: 50}}
part:
  geometry: {box: {size_mm: [300, 300, 200]}}
  at: {xyz_mm: [550, 0, 500]}
tasks:
  one: {robot: ur, path: {circle: {radius_mm: 60, plane: xy}, project: +z}, tool_axis: normal}
  two: {robot: ur, path: {circle: {radius_mm: 90, plane: xy}, project: +z}, tool_axis: normal, after: one}
program: {}
motion: {mode: part_at_rest, duration_s: 3, step_s: 0.008, timing: fastest}
acceleration: {full_speed_in_s: 0.12}
checks: {clearance_mm: 5}
"""


@pytest.mark.slow
def test_a_program_from_home_to_home_holds_its_torques_in_blocks_and_transfer_moves(tmp_path: Path) -> None:
    file = tmp_path / "loaded.yaml"
    file.write_text(UR5E, encoding="utf-8")
    runs = uncertified(load_cell(file)).runs
    used = {
        run.phase.name: max(check.value / check.limit for check in run.report.checks if check.name == "joint_torque")
        for run in runs
    }
    assert len(used) == 5
    assert max(used.values()) <= 1.0
    assert min(used[name] for name in ("transfer-1", "work-1", "work-2", "transfer-3")) > 0.85
