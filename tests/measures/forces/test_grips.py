"""Friction of grips by hand: a held block, a load beside its middle, a moving part, and the limit of a soft finger."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import held_part, make_cell, placed, schedule, slide_model

from cellplan.checks.joints.forces import check_forces
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.measures.forces.grips import grip_use
from cellplan.measures.forces.static_forces import force_report, static_forces
from cellplan.measures.forces.wrenches import GRAVITY
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.settings.forces import GripEntry
from cellplan.scene.kinematics.screw_chain import ScrewChain

GRIP = GripEntry.model_validate({"force_n": 100.0, "friction": 0.4, "radius_mm": 15.0, "normal": "y"})
LEVER = 2.0 / 3.0 * 0.015  # [m]
TIMES = np.linspace(0.0, 1.0, 1001)


def holding(mass: float | None, *, centre=(0.0, 0.0, 0.0), grip: GripEntry = GRIP) -> Cell:
    """A slide along x whose pads press a block along y."""
    robot = placed("a", slide_model(Box((0.05, 0.05, 0.05))))
    grasp = Grasp(robot="a", X_PT=np.eye(4), grip=grip)
    part = replace(
        held_part(Box((0.1, 0.1, 0.1)), "a", np.eye(4)), held_by=(grasp,), mass=mass, centre=np.array(centre)
    )
    return make_cell(robot, part=part)


def forces_of(cell: Cell, q):
    chains, rows = {"a": ScrewChain(cell.robots[0])}, {"a": q[:, None]}
    forces = static_forces(cell, chains, schedule(len(q)), rows, part_poses(cell, chains, rows))
    return force_report(forces, chains, rows)


def test_a_block_is_held_by_its_weight_over_the_friction_of_both_pads() -> None:
    (use,) = forces_of(holding(5.0), np.zeros(1001)).grips

    assert use.share == pytest.approx(5.0 * GRAVITY / (0.4 * 200.0))
    assert (use.tangential, use.torsion, use.normal) == pytest.approx((5.0 * GRAVITY, 0.0, 0.0))


def test_a_centre_of_mass_beside_the_pads_turns_the_block_about_their_normal() -> None:
    cell = holding(5.0, centre=(0.03, 0.0, 0.0))
    forces = forces_of(cell, np.zeros(1001))
    (use,), weight = forces.grips, 5.0 * GRAVITY

    expected = np.hypot(weight, 0.03 * weight / LEVER) / 80.0
    assert use.share == pytest.approx(expected)
    (check,) = check_forces(cell, forces)
    assert not check.passed
    assert check.value == pytest.approx(100.0 * expected)
    assert check.message == (
        "grip of a: needs 193.8 % of its friction at 0.000 s (49.03 N along the pads, 1.471 Nm about their normal, "
        "0 N along it)"
    )


def test_the_acceleration_of_the_written_motion_counts_at_its_time() -> None:
    q = 0.2 * (TIMES**3 * (10.0 - 15.0 * TIMES + 6.0 * TIMES**2))  # quintic: largest acceleration 0.2 * 5.7735
    cell = holding(5.0)
    forces = forces_of(cell, q)
    (use,) = forces.grips

    assert use.share == pytest.approx(5.0 * np.hypot(GRAVITY, 0.2 * 10.0 / np.sqrt(3.0)) / 80.0, rel=1e-4)
    assert use.at_s == pytest.approx(0.5 - np.sqrt(3.0) / 6.0, abs=1e-2)
    assert [check.passed for check in check_forces(cell, forces)] == [True]


def test_a_load_along_the_normal_is_taken_from_the_pads() -> None:
    tip = np.array([[0.0, -30.0, 0.0, 0.0, 0.0, 0.0], [24.0, 30.0, 32.0, 0.1, 0.2, 0.0]])

    use = grip_use(Grasp(robot="a", X_PT=np.eye(4)), GRIP, tip, np.array([0.0, 1.0]))

    assert use.share == pytest.approx((np.hypot(40.0, 0.2 / LEVER) / 0.4 + 30.0) / 200.0)
    assert (use.at_s, use.normal, use.across) == pytest.approx((1.0, 30.0, 0.1))
    # as the criterion: what friction bears at the normal force that is left
    assert use.share > 1.0 or np.hypot(40.0, 0.2 / LEVER) <= 0.4 * (200.0 - 30.0)


def test_pads_press_along_an_axis_of_the_tool_and_not_of_the_part() -> None:
    turned = Grasp(robot="a", X_PT=pose((0.0, 0.0, 0.0), (0.0, 0.0, 0.5 * np.pi)))  # y of the tool is -x of the part

    use = grip_use(turned, GRIP, np.array([[7.0, 2.0, 0.0, 0.0, 0.0, 0.0]]), np.zeros(1))

    assert (use.normal, use.tangential) == pytest.approx((7.0, 2.0))


def test_the_limit_of_torsion_is_that_of_an_even_pressure() -> None:
    """Integral of mu p r over a disc, by rings, for a moment that is just borne."""
    edges = np.linspace(0.0, 0.015, 20001)
    middle = 0.5 * (edges[1:] + edges[:-1])
    moment = float(np.sum(0.4 * 200.0 / (np.pi * 0.015**2) * middle * np.pi * (edges[1:] ** 2 - edges[:-1] ** 2)))

    use = grip_use(Grasp(robot="a", X_PT=np.eye(4)), GRIP, np.array([[0, 0, 0, 0, moment, 0.0]]), np.zeros(1))

    assert use.share == pytest.approx(1.0, rel=1e-6)


def test_a_grip_is_not_judged_without_the_mass_of_the_part() -> None:
    assert forces_of(holding(None), np.zeros(1001)).grips == ()


def test_an_error_of_closure_comes_in_the_worst_direction() -> None:
    tip = np.array([[3.0, 0.0, 4.0, 0.0, 0.02, 0.0]])

    use = grip_use(Grasp(robot="a", X_PT=np.eye(4)), GRIP, tip, np.zeros(1), at_error=(6.0, 0.03))

    assert use.share == pytest.approx(np.hypot(11.0, 0.05 / LEVER) / 80.0)
