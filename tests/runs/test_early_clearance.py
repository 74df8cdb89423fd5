"""The clearance of a search has the verdicts of ``solve`` and its smallest distances, as far as they are exact."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.checks.verify import Clearance, run_clearance
from cellplan.model.progress import silent
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.runs.solve import certified, solve_motion

CELL = Path(__file__).resolve().parents[2] / "cells" / "planar_pair.yaml"
VALUES = {"motion.duration_s": 2.0, "motion.step_s": 0.02}


@pytest.mark.parametrize("is_begun", [False, True])
def test_verdicts_and_smallest_distances_are_those_of_solve(is_begun: bool) -> None:
    calls: list[int] = []

    def begin(function: Callable[..., Clearance], *arguments: object) -> Callable[[], Clearance]:
        calls.append(len(arguments))
        return lambda: function(*arguments)

    early = EarlyClearance(begin if is_begun else None)
    scene, solution = solve_motion(load_cell(CELL).with_values(VALUES), task=None, progress=silent, early=early)
    run = certified(solution, progress=silent, early=early).runs[0]

    q = np.concatenate([run.report.q[robot.name] for robot in scene.cell.robots], axis=1)
    clearance, checks = run_clearance(scene, run.schedule, q)
    for kind, full in clearance.minima.items():
        minimum = run.report.clearance.minima[kind]
        assert (minimum.pair, minimum.certified, minimum.exact) == (full.pair, full.certified, full.exact)
        if full.minimum is not None:
            assert minimum.minimum == pytest.approx(
                full.minimum, abs=1e-4
            )  # both proved, to within 0.1 mm of the truth
            assert (minimum.minimum or 0.0) <= full.minimum  # curves only raise what is proved
    of_clearance = run.report.checks[-len(checks) :]
    assert [(entry.name, entry.subject, entry.passed) for entry in of_clearance] == [
        (check.name, check.subject, check.passed) for check in checks
    ]
    assert len(calls) == is_begun


def test_what_was_begun_for_other_tasks_or_rows_is_not_taken() -> None:
    scene, solution = solve_motion(load_cell(CELL).with_values(VALUES), task=None, progress=silent)
    run = solution.runs[0]
    q = np.concatenate([run.report.q[robot.name] for robot in scene.cell.robots], axis=1)
    clearance, other = run_clearance(scene, run.schedule, q), (run.report.clearance, ())
    early = EarlyClearance(lambda *_: lambda: other)

    early.begin(scene, run.schedule, q)

    assert clearance[1]
    assert early.of(scene, run.schedule, q, silent) is other
    for schedule, rows in ((replace(run.schedule), q), (run.schedule, q + 1e-9)):
        checks = early.of(scene, schedule, rows, silent)[1]
        assert [check.name for check in checks] == [bound.name for bound in clearance[1]]
