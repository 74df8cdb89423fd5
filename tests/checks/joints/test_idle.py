"""Idle robots stand at their homes, from the first row to the last."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, make_cell, placed, schedule, slide_model, work

from cellplan.checks.joints.transfer_speeds import check_idle
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check

BLOCK = Box((0.1, 0.1, 0.1))
HOME = np.array([0.1, 0.2, 0.3, 0.0, 0.5, 0.0])


def idle_checks(q: Array, home: Array | None = HOME) -> list[Check]:
    arm = replace(placed("arm", arm_model()), home=home)
    cell: Cell = make_cell(arm, placed("saw", slide_model(BLOCK)), tasks=(work("arm"), work("saw")))
    clock = schedule(len(q), work("saw"))
    return check_idle(cell, ["arm"], clock.times, {"arm": q, "saw": np.zeros((len(q), 1))})


def test_a_robot_at_its_home_passes() -> None:
    (check,) = idle_checks(np.tile(HOME, (11, 1)))

    assert check.passed
    assert (check.name, check.subject, check.message) == (
        "home",
        "arm",
        "idle robot arm: stays at its home, at most 0 deg from it",
    )


@pytest.mark.parametrize("rows", [slice(None), slice(5, 6), slice(10, None)])
def test_a_robot_away_from_its_home_fails_however_short_it_is_away(rows: slice) -> None:
    q = np.tile(HOME, (11, 1))
    q[rows, 1] += np.radians(0.001)

    (check,) = idle_checks(q)

    assert not check.passed
    assert check.value == pytest.approx(0.001)
    assert check.message.startswith("idle robot arm: joint a2 is 0.001 deg from its home at ")


def test_without_a_home_a_robot_has_to_stand_still_all_the_same() -> None:
    still, moved = np.tile(HOME, (11, 1)), np.tile(HOME, (11, 1))
    moved[-1, 0] += 1e-6

    assert [check.passed for check in idle_checks(still, home=None) + idle_checks(moved, home=None)] == [True, False]
