"""Moments of load and process about the wrist: passing and failing by a known amount, and not judged in ignorance."""

from dataclasses import replace

import numpy as np
import pytest
from builders.forced_cells import always_on, process
from builders.scene_builders import QUARTER, joint, make_cell, placed, work

from cellplan.checks.joints.forces import check_forces
from cellplan.geometry.transforms import pose
from cellplan.measures.forces.static_forces import force_report, static_forces
from cellplan.measures.forces.wrenches import GRAVITY
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Tool
from cellplan.model.report.report import Check
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.robot import AxisLimitEntry, PayloadEntry
from cellplan.scene.kinematics.screw_chain import ScrewChain


def checks_of(limit: float, *, mass: float | None = 2.0, pressed: bool = True) -> list[Check]:
    """An arm along x that turns about y; its tool of 0.1 m reaches on and is pressed up with 30 N at its tip."""
    payload = PayloadEntry(mass_kg=6.0, axes={"a": AxisLimitEntry(moment_nm=limit)})
    model = RobotModel(
        name="one",
        source="test",
        joints=(joint("a", -1, axis=(0.0, 1.0, 0.0)),),
        flange_link=0,
        X_BF=pose((0.5, 0.0, 0.0), (0.0, QUARTER, 0.0)),
        bodies=(),
        payload=payload,
    )
    tool = Tool(X_FT=pose((0.0, 0.0, 0.1)), bodies=(), mass=mass, centre=None if mass is None else np.zeros(3))
    task = replace(work("arm"), process=process((0.0, 0.0, 30.0), frame="world") if pressed else None)
    cell = make_cell(placed("arm", model, tool=tool), tasks=[task])
    chains, q = {"arm": ScrewChain(cell.robots[0])}, {"arm": np.zeros((2, 1))}
    forces = static_forces(cell, chains, always_on(cell), q, part_poses(cell, chains, q))
    return check_forces(cell, force_report(forces, chains, q))


def test_a_process_relieves_or_loads_the_wrist_beside_the_weight() -> None:
    moment = 30.0 * 0.6 - 2.0 * GRAVITY * 0.5

    (passes,), (fails,) = checks_of(8.2), checks_of(8.1)

    assert passes.passed
    assert passes.value == pytest.approx(abs(moment))
    assert not fails.passed
    assert fails.message == (
        "process arm/a: moment of load and process 8.19 Nm at 0.000 s (8.19 Nm at rest, 18.00 Nm by the process "
        "alone), allowed 8.1 Nm"
    )


def test_nothing_is_judged_without_a_process_or_with_a_mass_that_is_not_stated() -> None:
    assert checks_of(1.0, pressed=False) == []
    assert checks_of(1.0, mass=None) == []


def test_the_accelerations_of_the_load_count() -> None:
    """An arm that swings about the vertical with a load at its tip: no weight about that axis, but inertia."""
    payload = PayloadEntry(mass_kg=6.0, axes={"a": AxisLimitEntry(moment_nm=50.0)})
    model = RobotModel(
        name="one",
        source="test",
        joints=(joint("a", -1),),
        flange_link=0,
        X_BF=pose((0.5, 0.0, 0.0)),
        bodies=(),
        payload=payload,
    )
    tool = Tool(X_FT=np.eye(4), bodies=(), mass=2.0)
    cell = make_cell(placed("arm", model, tool=tool), tasks=[replace(work("arm"), process=process((0.0, 3.0, 0.0)))])
    clock = always_on(cell, 1001)
    u = clock.times
    chains, q = {"arm": ScrewChain(cell.robots[0])}, {"arm": (0.4 * u**3 * (10.0 - 15.0 * u + 6.0 * u**2))[:, None]}

    forces = static_forces(cell, chains, clock, q, part_poses(cell, chains, q))
    (check,) = check_forces(cell, force_report(forces, chains, q))

    inertia = 2.0 * 0.5**2 * 0.4 * 10.0 / np.sqrt(3.0)  # times the largest acceleration of the quintic
    assert check.value == pytest.approx(3.0 * 0.5 + inertia, rel=1e-3)
