"""The demanded clearance is proved first, the smallest distance looked for afterwards: what is said when work ends."""

import numpy as np
import pytest
from builders.concave_shapes import tube
from builders.scene_builders import joint, make_cell, placed, schedule, thing

from cellplan.certify import pair_state as budget
from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.shapes import Capsule
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, ClearanceClass, ClearanceReport
from cellplan.model.robot.robot import Body, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.scene import Scene

SIDES = 24
BORE, ROD = 0.09, 0.005  # [m] radii
GAP = BORE * np.cos(np.pi / SIDES) - ROD  # [m] from the rod in the middle to the nearest side of the bore


def spindle() -> RobotModel:
    """A rod that turns about its own axis, and is carried round by a first joint a little beside it."""
    rod = Body(name="rod", link=1, shape=Capsule(ROD, 0.3), X_BS=np.eye(4))
    joints = (joint("swing", -1, point=(0.0, 0.02, 0.0)), joint("spin", 0))
    return RobotModel(name="spindle", source="test", joints=joints, flange_link=1, X_BF=np.eye(4), bodies=(rod,))


def turning_rod(clearance: float = 0.005) -> Cell:
    things = (thing("tube", tube(BORE, 0.1, 0.4, sides=SIDES)),)
    return make_cell(placed("arm", spindle()), things=things, checks=ChecksEntry(clearance_mm=1e3 * clearance))


def checked(cell: Cell, q: Array) -> tuple[ClearanceReport, tuple[Check, ...]]:
    return check_clearance(Scene.from_cell(cell), schedule(len(q), duration=0.01 * (len(q) - 1)), q)


def spinning(turn: float = 0.15, samples: int = 30) -> Array:
    """The rod turns to and fro about its own axis by an angle in [rad], in the middle of the tube."""
    return np.stack([np.zeros(samples), turn * np.sin(0.9 * np.arange(samples))], axis=1)


def test_a_rod_that_turns_in_a_tube_passes_with_the_distance_it_keeps() -> None:
    report, checks = checked(turning_rod(), spinning())

    minimum = report.minima[ClearanceClass.ENVIRONMENT]
    assert all(check.passed for check in checks)
    assert minimum.certified
    assert minimum.exact
    assert GAP - 1e-4 <= minimum.minimum <= GAP


def test_when_the_work_ends_a_lower_bound_is_reported_and_the_check_still_passes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(budget, "MAX_READINGS", 12)

    report, checks = checked(turning_rod(), spinning())

    minimum = report.minima[ClearanceClass.ENVIRONMENT]
    assert (minimum.certified, minimum.exact) == (True, False)
    assert 0.005 <= minimum.minimum < GAP - 1e-4
    assert report.not_certified == ()
    assert [check.passed for check in checks if check.name == "clearance"] == [True] * 2
    (message,) = [check.message for check in checks if check.subject == "environment" and check.name == "clearance"]
    assert f"at least {1e3 * minimum.minimum - 0.05:.1f} mm" in message


def test_a_demand_that_cannot_be_proved_is_not_certified_and_never_called_a_collision(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(budget.PairState, "may_cut", property(lambda _: False))

    report, checks = checked(turning_rod(clearance=0.0842), spinning(1.2))

    (failed,) = [check for check in checks if not check.passed]
    assert failed.name == "clearance"
    assert failed.subject == "arm/rod - tube"
    assert 0.0 < failed.value < failed.limit
    assert failed.message.startswith("not certified: arm/rod to tube at ")
    assert f"required 84.2 mm, the smallest distance found is {1e3 * GAP:.2f}" in failed.message
    assert "touch" not in failed.message
    minimum = report.minima[ClearanceClass.ENVIRONMENT]
    assert (minimum.certified, minimum.exact) == (False, False)
    assert minimum.minimum == pytest.approx(1e-3 * failed.value)
    assert report.not_certified == (("arm/rod", "tube"),)
    assert [check.passed for check in checks if check.name == "collision"] == [True] * 2
    assert not report.contacts


def test_a_rod_that_leaves_the_middle_of_the_tube_touches_it() -> None:
    q = np.stack([np.linspace(0.0, 2.0, 40), np.zeros(40)], axis=1)
    near = check_clearance(Scene.from_cell(turning_rod()), schedule(40, duration=0.4), q)[0]
    assert near.minima[ClearanceClass.ENVIRONMENT].minimum > 0.04
