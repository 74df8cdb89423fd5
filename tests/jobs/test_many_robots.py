"""Many robots round one part: generated cells are solved, and everything about them is certified."""

import importlib.util
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.model.report.report import ClearanceClass, Report
from cellplan.runs.solution import Solution

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "benchmarks" / "generated_cells.py"
COARSE_S = 0.02  # [s] between samples: four seconds are 201 of them
NEAR = 1e-6  # [m] tool error at the samples: tasks are kept there whatever the step is
MOVES = np.deg2rad(1.0)  # [rad] that the positioner goes at least, or it might as well stand still


@pytest.fixture(scope="module")
def cell_with() -> Callable[..., str]:
    """The generator, which is a script and not part of the package."""
    spec = importlib.util.spec_from_file_location("generated_cells", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look themselves up there
    spec.loader.exec_module(module)
    return module.cell_with


def solved(text: str, folder: Path) -> Solution:
    path = folder / "cell.yaml"
    path.write_text(text, encoding="utf-8")
    return solve(load_cell(path))


def assert_proved(report: Report, operators: int) -> None:
    """Every tool on its path, every distance kept and certified, and the part moves."""
    assert report.passed, [check.message for check in report.checks if not check.passed]
    assert len(report.accuracy) == operators
    assert max(np.linalg.norm(task.position_error, axis=1).max() for task in report.accuracy) < NEAR
    assert all(report.clearance.minima[kind].certified for kind in ClearanceClass)
    assert not report.clearance.not_certified
    assert np.ptp(report.q["tray"], axis=0).max() > MOVES


@pytest.mark.slow
def test_eight_robots_are_solved_and_certified(cell_with: Callable[..., str], tmp_path: Path) -> None:
    solution = solved(cell_with(8, step_s=COARSE_S), tmp_path)

    assert_proved(solution.runs[0].report, operators=7)


@pytest.mark.slow
@pytest.mark.parametrize("robots", [4, 16])
def test_rings_of_other_sizes_are_solved_and_certified(
    robots: int, cell_with: Callable[..., str], tmp_path: Path
) -> None:
    solution = solved(cell_with(robots, step_s=COARSE_S), tmp_path)

    assert_proved(solution.runs[0].report, operators=robots - 1)


@pytest.mark.slow
def test_thirty_two_robots_are_solved_and_certified_from_the_command_line(tmp_path: Path) -> None:
    cell, run = tmp_path / "cell.yaml", tmp_path / "run"
    subprocess.run([sys.executable, str(SCRIPT), "32", "-o", str(cell)], check=True, cwd=ROOT)

    subprocess.run(
        [sys.executable, "-m", "cellplan", "solve", str(cell), "--quiet", "-o", str(run)], check=True, cwd=ROOT
    )

    report = json.loads((run / "report.json").read_text(encoding="utf-8"))
    assert report["status"] == "passed"
    assert report["samples"] == 4001
    assert len(report["tasks"]) == 31
    assert max(task["max_position_error_mm"] for task in report["tasks"].values()) < 1e3 * NEAR
    assert all(value["certified"] for value in report["clearance"].values())
    assert len(list((run / "tables").glob("*.csv"))) == 32 + 1  # and the clock
    page = (run / "report.html").read_text(encoding="utf-8")
    assert page.count("<details>") >= 31 + 2 * 32  # a picture of each task, two of each robot


@pytest.mark.slow
def test_the_search_finds_the_start_postures_of_fifteen_operators(
    cell_with: Callable[..., str], tmp_path: Path
) -> None:
    solution = solved(cell_with(16, step_s=COARSE_S, searches=True), tmp_path)

    assert_proved(solution.runs[0].report, operators=15)


@pytest.mark.parametrize("robots", [1, 61])
def test_rings_that_cannot_be_are_refused(robots: int, cell_with: Callable[..., str]) -> None:
    with pytest.raises(ValueError, match=rf"^expected 2 to 60 robots, got {robots}$"):
        cell_with(robots)


def test_the_same_ring_is_written_twice_alike(cell_with: Callable[..., str]) -> None:
    assert cell_with(4) == cell_with(4)
