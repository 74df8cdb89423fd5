"""Torques of the written motion: closed forms on one joint, what is not known, and programs of several phases."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from builders.scene_builders import arm_model, fixed_part, joint, make_cell, no_tool, placed, schedule

from cellplan.checks.joints.torques import check_torques, check_torques_at_rest, motion_torques
from cellplan.files.robots.joint_table import load_bundled
from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Box
from cellplan.measures.torques import halved_rows
from cellplan.model.cell.cell import Cell, Tool
from cellplan.model.robot.inertia import LinkInertia
from cellplan.model.robot.robot import RobotModel
from cellplan.model.robot.torque import RobotTorques, mean_torque
from cellplan.report.record.sections.torques import torques_of_phases, torques_record, unjudged_torques
from cellplan.scene.dynamics.loads import GRAVITY

MASS, LENGTH, INERTIA = 3.0, 0.8, 0.05
TIMES = np.linspace(0.0, 2.0, 401)


def one_joint(*, axis: tuple[float, float, float], torque: float | None = 40.0, slides: bool = False) -> RobotModel:
    """A rod along x that turns about an axis through the origin, or slides."""
    rod = LinkInertia(link=0, mass=MASS, centre_B=np.array([LENGTH, 0.0, 0.0]), inertia_B=INERTIA * np.eye(3))
    axes = (replace(joint("a", -1, axis=axis, slides=slides), torque=torque),)
    return RobotModel(name="one", source="test", joints=axes, flange_link=0, X_BF=np.eye(4), bodies=(), inertias=(rod,))


def use_of(model: RobotModel, q: Array, times: Array = TIMES, tool: Tool | None = None) -> RobotTorques:
    cell = cell_of(model, tool)
    (use,) = motion_torques(cell, clock(times), {"a": q})
    return use


def cell_of(model: RobotModel, tool: Tool | None = None) -> Cell:
    return make_cell(placed("a", model, tool=tool or no_tool()), part=fixed_part(Box((0.1, 0.1, 0.1)), np.eye(4)))


def clock(times: Array = TIMES):
    return schedule(len(times), duration=float(times[-1]))


def smooth(times: Array, turn: float) -> Array:
    """From rest to rest along a cycloid, without a jump of acceleration."""
    share = times / times[-1]
    return (turn * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi)))[:, None]


def test_a_rod_at_rest_takes_its_weight() -> None:
    use = use_of(one_joint(axis=(0.0, 1.0, 0.0)), np.zeros((401, 1)))
    held = MASS * GRAVITY * LENGTH
    assert use.joints[0].peak == pytest.approx(held, rel=1e-12)
    assert use.joints[0].rms == pytest.approx(held, rel=1e-12)
    assert (use.energy, use.peak_power) == (0.0, 0.0)


def test_what_a_process_exerts_is_held_beside_the_weight() -> None:
    """20 N up at the end of the rod, about the origin of the world."""
    pressed = {"a": np.tile([0.0, 0.0, 20.0, 0.0, -20.0 * LENGTH, 0.0], (401, 1))}
    cell = cell_of(one_joint(axis=(0.0, 1.0, 0.0)))
    (use,) = motion_torques(cell, clock(), {"a": np.zeros((401, 1))}, pressed)
    assert use.joints[0].peak == pytest.approx((MASS * GRAVITY - 20.0) * LENGTH, rel=1e-12)
    assert use.reaction is not None
    assert use.reaction.vertical.size == pytest.approx(MASS * GRAVITY - 20.0, rel=1e-12)
    assert use.reaction.tilting_at_rest.size == pytest.approx(MASS * GRAVITY * LENGTH, rel=1e-12)


def test_a_turn_about_the_vertical_takes_inertia_times_acceleration() -> None:
    use = use_of(one_joint(axis=(0.0, 0.0, 1.0)), smooth(TIMES, 1.5))
    whole = MASS * LENGTH**2 + INERTIA
    peak = whole * 1.5 * 2.0 * np.pi / TIMES[-1] ** 2  # of the cycloid
    assert use.joints[0].peak == pytest.approx(peak, rel=1e-4)  # second order in the step
    assert use.joints[0].peak_at_s == pytest.approx(0.5, abs=0.01)
    assert use.joints[0].rms == pytest.approx(peak / np.sqrt(2.0), rel=1e-4)
    assert use.energy == pytest.approx(0.5 * whole * 1.5**2, rel=1e-4)  # of the fastest turn, 2 x 1.5 / 2 rad/s


def test_the_work_of_lifting_is_the_gain_of_height() -> None:
    use = use_of(one_joint(axis=(0.0, -1.0, 0.0)), smooth(TIMES, 0.5))
    assert use.energy == pytest.approx(MASS * GRAVITY * LENGTH * np.sin(0.5), rel=1e-3)  # braking is helped by weight


def test_a_slide_upwards_takes_newtons() -> None:
    (check,) = check_torques((use_of(one_joint(axis=(0.0, 0.0, 1.0), slides=True, torque=25.0), np.zeros((401, 1))),))
    assert not check.passed
    assert check.value == pytest.approx(MASS * GRAVITY)
    assert (
        check.message
        == "joint a/a exceeds its largest force: 29.42 N at 0.000 s (limit 25 N, root mean square 29.42 N)"
    )
    held = "joint a/a has a peak force of 29.42 N at 0.000 s (limit 30 N, root mean square 29.42 N)"
    (enough,) = check_torques((use_of(one_joint(axis=(0.0, 0.0, 1.0), slides=True, torque=30.0), np.zeros((401, 1))),))
    assert enough.passed
    assert enough.message == held


def test_the_torque_between_two_rows_is_not_missed() -> None:
    """A rod that swings through the horizontal between two rows weighs most there."""
    times = np.linspace(0.0, 1.0, 5)
    q = np.array([-0.4, -0.4, -0.1, 0.15, 0.15])[:, None]
    use = use_of(replace(one_joint(axis=(0.0, -1.0, 0.0))), q, times)
    at_rows = use_of(one_joint(axis=(0.0, -1.0, 0.0)), q[[2, 2]], times[[0, -1]]).joints[0].peak
    assert use.joints[0].peak > at_rows


def test_halfway_rows_are_those_of_a_polynomial_of_the_third_degree() -> None:
    times = np.linspace(0.0, 1.0, 11)
    rows = halved_rows(times, (times**3)[:, None], (6.0 * times)[:, None])
    middle = 0.5 * (times[1:] + times[:-1])
    np.testing.assert_allclose(rows.q[1::2, 0], middle**3, atol=1e-15)
    np.testing.assert_allclose(rows.qdd[1::2, 0], 6.0 * middle, atol=1e-15)
    np.testing.assert_allclose(rows.qd[1::2, 0], 3.0 * middle**2 + 0.25 * 0.1**2, atol=1e-14)  # mean over the step


def test_what_is_not_known_is_one_line_and_drives_without_a_limit_another() -> None:
    heavy = one_joint(axis=(0.0, 0.0, 1.0), torque=None)
    uses = (
        use_of(arm_model(), np.zeros((401, 6))),
        replace(use_of(arm_model(), np.zeros((401, 6))), robot="b"),
        replace(use_of(heavy, np.zeros((401, 1))), robot="c"),
        replace(use_of(heavy, np.zeros((401, 1)), tool=Tool(X_FT=np.eye(4), bodies=(), mass=None)), robot="d"),
    )
    lines = unjudged_torques(uses)
    known = "masses of links not stated (a, b)"
    assert lines[0].startswith(f"torques and base reactions not known: {known}")
    assert lines[1:] in (
        ["torques not judged: largest ones not stated (c)"],
        ["torques not judged: largest ones not stated (c; d)"],  # an empty tool at the flange weighs nothing
    )
    assert check_torques(uses) == []


def test_of_a_robot_with_some_limits_the_drives_without_one_are_named() -> None:
    use = use_of(one_joint(axis=(0.0, 1.0, 0.0)), np.zeros((401, 1)))
    (drive,) = use.joints
    some = replace(use, joints=(drive, replace(drive, joint="b", limit=None), replace(drive, joint="c", limit=None)))
    assert unjudged_torques([use]) == []
    assert unjudged_torques([some, some]) == ["torques not judged: largest ones not stated (a b, c)"]


def test_an_excess_is_named_with_its_instant() -> None:
    (check,) = check_torques((use_of(one_joint(axis=(0.0, 1.0, 0.0), torque=20.0), np.zeros((401, 1))),))
    assert not check.passed
    assert (
        check.message
        == "joint a/a exceeds its largest torque: 23.54 Nm at 0.000 s (limit 20 Nm, root mean square 23.54 Nm)"
    )
    assert (check.name, check.subject, check.unit) == ("joint_torque", "a/a", "Nm")


@pytest.mark.parametrize("name", ["franka_panda", "kuka_lbr_iiwa_14_r820", "kuka_lbr_iiwa_7_r800", "ur5e"])
def test_bundled_arms_hold_their_own_payload_in_every_posture(name: str) -> None:
    model = load_bundled(name)
    assert model.payload is not None
    rng, lower, upper = np.random.default_rng(0), np.maximum(model.lower, -3.0), np.minimum(model.upper, 3.0)
    load = Tool(X_FT=np.eye(4), bodies=(), mass=model.payload.mass_kg, centre=np.array([0.0, 0.0, 0.03]))
    cell = cell_of(model, load)
    for q in rng.uniform(lower, upper, (40, len(lower))):
        uses = motion_torques(cell, clock(TIMES[:3]), {"a": np.tile(q, (3, 1))})
        assert all(check.passed for check in check_torques(uses)), (name, q)


def test_the_mean_of_two_runs_counts_their_time() -> None:
    assert mean_torque([(3.0, 1.0), (0.0, 3.0)]) == pytest.approx(1.5)


def test_a_record_has_the_robots_that_are_known() -> None:
    known = use_of(one_joint(axis=(0.0, 1.0, 0.0)), np.zeros((401, 1)))
    record = torques_record((known, RobotTorques(robot="b", missing=("masses of links not stated",))))
    assert list(record["torques"]) == ["a"]
    assert record["torques"]["a"]["joints"]["a"]["torque_ratio"] == pytest.approx(23.536 / 40.0, rel=1e-4)
    assert torques_record((RobotTorques(robot="b", missing=("masses",)),)) == {}


def test_a_posture_that_no_drive_holds_is_found_before_anything_moves() -> None:
    cell = cell_of(one_joint(axis=(0.0, 1.0, 0.0), torque=20.0))
    assert [check.passed for check in check_torques_at_rest(cell, np.zeros(1))] == [False]
    assert [check.passed for check in check_torques_at_rest(cell, np.array([1.2]))] == [True]


def test_means_and_work_of_a_program_are_those_of_all_its_time() -> None:
    times = np.linspace(0.0, 6.0, 401)
    model = one_joint(axis=(0.0, -1.0, 0.0))
    up, wait = use_of(model, smooth(TIMES, 0.5)), use_of(model, np.full((401, 1), 0.5), times)
    down = use_of(model, 0.5 - smooth(TIMES, 0.5))
    whole_times = np.concatenate([TIMES[:-1], 2.0 + times[::15], 8.0 + TIMES[1:]])
    reports = [SimpleNamespace(torques=(use,)) for use in (up, wait, down)]
    worst = torques_record((up,))["torques"]
    (record,) = torques_of_phases(reports, worst)["torques"].values()
    squares = 2.0 * up.joints[0].rms ** 2 + 6.0 * wait.joints[0].rms ** 2 + 2.0 * down.joints[0].rms ** 2
    assert record["joints"]["a"]["rms_torque"] == pytest.approx(np.sqrt(squares / whole_times[-1]), rel=1e-9)
    assert record["energy_j"] == pytest.approx(up.energy + down.energy, rel=1e-9)
    assert wait.energy == 0.0
