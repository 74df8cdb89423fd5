"""A cell solved on two processors gives the files that it gives on one, byte for byte."""

import sys
import threading
from pathlib import Path
from typing import Any

import pytest

from cellplan import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.runs.solve import solve, solve_in_parallel
from cellplan.runs.write_run import write_run

CELLS = Path(__file__).resolve().parents[2] / "cells"
VALUES = {"motion.duration_s": 2.0, "motion.step_s": 0.02}


@pytest.fixture(
    scope="module", params=[pytest.param("planar_pair.yaml", marks=pytest.mark.slow), "load_sharing_planar.yaml"]
)
def cell(request: Any) -> Cell:
    return load_cell(CELLS / request.param).with_values(VALUES)


def files(folder: Path) -> dict[str, bytes]:
    """All files of a folder by their place in it."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.usefixtures("two_processors")
def test_files_are_the_same_on_one_processor_and_on_two(cell: Cell, tmp_path: Path) -> None:
    if sys.platform != "linux" or threading.active_count() > 1:
        pytest.skip("there are no copies of this process here")
    stages: list[str] = []

    solution = solve_in_parallel(cell, progress=lambda stage, _: stages.append(stage))
    write_run(solution, tmp_path / "two", keep_rejected=True)
    write_run(solve(cell), tmp_path / "one", keep_rejected=True)

    assert files(tmp_path / "one") == files(tmp_path / "two")
    assert "checking tool errors and joints" in stages


def test_on_one_processor_the_clearance_is_checked_too(cell: Cell) -> None:
    assert solve_in_parallel(cell).runs[0].report.clearance.pair_count > 0
