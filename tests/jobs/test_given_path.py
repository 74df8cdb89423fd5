"""A cell that gives the path of its positioner's joints: solved, written, verified, retimed."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve
from cellplan.runs.verify import verify

PAIR = Path(__file__).parents[2] / "cells" / "planar_pair.yaml"
START, END = [50.0, -85.0, 35.0], [54.0, -88.0, 36.0]


@pytest.fixture(scope="module")
def cell() -> Cell:
    """The plate moved a little while it is worked on; the start of the other arm is to be found."""
    return load_cell(PAIR).with_values(
        {
            "robots.left.path": {"coefficients_deg": [START, START, END]},
            "robots.left.start_deg": None,
            "motion.step_s": 0.01,
            "motion.time_law": "quintic",
            "tasks.circle.tolerance.position_mm": 0.05,
            "tasks.circle.tolerance.orientation_deg": 0.01,
        }
    )


@pytest.fixture(scope="module")
def solution(cell: Cell) -> Solution:
    return solve(cell)


def test_it_is_solved_and_the_resolved_cell_gives_the_same_program(solution: Solution, tmp_path: Path) -> None:
    assert solution.passed, [check.message for check in solution.runs[0].report.checks if not check.passed]
    written = tmp_path / "cell.yaml"
    written.write_text(render_cell(solution.cell), encoding="utf-8")

    again = solve(load_cell(written))

    np.testing.assert_array_equal(again.motion.q, solution.motion.q)
    np.testing.assert_allclose(np.degrees(solution.motion.q[-1, :3]), END, atol=1e-9)


def test_a_table_that_leaves_the_path_is_refused(solution: Solution) -> None:
    tables = dict(solution.program.tables)
    lines = tables["left"].splitlines()
    row = next(number for number, line in enumerate(lines) if line.startswith("2.0,"))
    values = lines[row].split(",")
    lines[row] = ",".join([values[0], str(float(values[1]) + 1e-6), *values[2:]])
    tables["left"] = "\n".join(lines) + "\n"

    with pytest.raises(InputError, match=r"^table of 'left': expected the joints of robots\.left\.path, got others$"):
        verify(solution.cell, tables)


def test_retimed_it_stays_on_its_path(cell: Cell) -> None:
    solution = solve(cell.with_values({"motion.timing": "fastest"}))
    spline = cell.robots[0].path
    assert spline is not None

    assert solution.passed
    assert solution.motion.times[-1] < 12.0
    share = solution.motion.sigma / solution.motion.sigma[-1]
    np.testing.assert_allclose(solution.motion.q[:, :3], spline.at(share), rtol=0.0, atol=1e-9)
