"""Rows on the grid of the controllers: every so many rows of the finer program, and retimed within all limits."""

import numpy as np
import pytest
from builders.two_phases import PAIR
from builders.uncertified import uncertified

from cellplan import Cell, load_cell, solve


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> Cell:
    file = tmp_path_factory.mktemp("grid") / "pair.yaml"
    file.write_text(
        PAIR.replace("duration_s: 2, step_s: 0.01", "duration_s: 2.01, step_s: 0.005, jerk_build_up_s: unlimited"),
        encoding="utf-8",
    )
    return load_cell(file)


def test_a_program_as_written_has_every_so_many_rows_of_the_finer_one(cell: Cell) -> None:
    euler = cell.with_values({"solver.integrator": "euler"})
    coarser = euler.with_values({"motion.grid_ms": 20})
    fine, coarse = (uncertified(entry, task="first").motion for entry in (euler, coarser))

    assert coarse.times.tolist() == np.round(0.02 * np.arange(102), 12).tolist()  # the last step is a whole one
    assert np.abs(coarse.q[:101] - fine.q[:401:4]).max() < 1e-9


def test_a_retimed_program_on_a_grid_loses_a_step_at_most_and_keeps_every_limit(cell: Cell) -> None:
    fast = cell.with_values({"motion.timing": "fastest", "tasks.first.tolerance.between_rows_mm": 10})
    fine, coarse = (solve(entry, task="first") for entry in (fast, fast.with_values({"motion.grid_ms": 20})))

    assert coarse.passed
    assert coarse.motion.times.tolist() == np.round(0.02 * np.arange(len(coarse.motion.times)), 12).tolist()
    assert coarse.motion.times[-1] <= fine.motion.times[-1] + 0.04  # and the rest up to the grid


def test_tolerances_between_rows_bound_the_speed(cell: Cell) -> None:
    """Rows 40 ms apart on a circle of 100 mm: the faster the motion, the farther joints leave it between two rows."""
    fast = cell.with_values({"motion.timing": "fastest", "motion.grid_ms": 40})
    solution = solve(fast, task="first")
    between = solution.runs[0].report.accuracy[0].between

    assert solution.passed
    assert between is not None
    assert 0.5e-4 < between.position.largest <= 1e-4
    motion = solution.cell.motion
    assert (motion.step, motion.grid, motion.finer) == (0.04, 0.04, 0.005)
