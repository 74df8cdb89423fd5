"""The verdict on true errors: the worst of all trials, from where it is judged on."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.checks.real_cell.true_errors import check_true_errors, worst_share
from cellplan.model.cell_errors import Draw
from cellplan.model.rehearsal import RunRehearsal, Trial
from cellplan.model.report import TaskAccuracy
from cellplan.model.settings.units import Mm

N = 11


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "planar_pair.yaml")  # tolerance: 0.003 mm, 0.001 deg


def accuracy(position=0.0, at=0):
    errors = np.zeros((N, 3))
    errors[at, 0] = position
    return TaskAccuracy(
        task="circle",
        robot="right",
        position_error=errors,
        orientation_error=np.zeros((N, 3)),
        path_length=1.0,
        start_s=0.0,
        end_s=1.0,
    )


def run_of(*errors, judged_from=0):
    trials = tuple(
        Trial(draw=Draw(robots={}, X_grasps={}), before=(error,), correction=None, in_pass=None) for error in errors
    )
    return RunRehearsal(
        name=None,
        times=0.1 * np.arange(N),
        judged_from={"circle": judged_from},
        trials=trials,
        before={},
        after=None,
        corrected=None,
    )


def test_the_worst_trial_and_instant_are_named(cell):
    run = run_of(accuracy(1e-6), accuracy(5e-6, at=4))

    position, orientation = check_true_errors(cell, run)

    assert not position.passed
    assert position.message == (
        "true position error of task 'circle': 0.005 mm at 0.400 s in trial 2 of 2, allowed 0.003 mm"
    )
    assert orientation.passed


def test_a_tool_on_its_way_to_the_path_is_not_judged(cell):
    late = run_of(accuracy(5e-6, at=4), judged_from=5)

    assert all(check.passed for check in check_true_errors(cell, late))
    assert worst_share(cell, late.trials[0].before, late.judged_from) == 0.0


def test_errors_count_as_shares_of_their_tolerance(cell):
    assert worst_share(cell, (accuracy(6e-6),), {"circle": 0}) == pytest.approx(2.0)


def test_where_nothing_is_allowed_anything_is_infinitely_much(cell):
    task = cell.task("circle")
    strict = replace(cell, tasks=(replace(task, tolerance=task.tolerance.model_copy(update={"position_mm": Mm(0.0)})),))

    assert worst_share(strict, (accuracy(1e-9),), {"circle": 0}) == np.inf
    assert worst_share(strict, (accuracy(0.0),), {"circle": 0}) == 0.0
