"""Sweeps of real cells, from Python and from the command line."""

import csv
import json
from pathlib import Path

import pytest

from cellplan import load_cell, solve
from cellplan.cli.main import run
from cellplan.errors import InputError
from cellplan.files.cell.changes import read_setting
from cellplan.jobs.sweep.sweep import SweepJob, sweep
from cellplan.report.record.figures import KEY, figures_of
from cellplan.study.variants import read_axis

CELLS = Path(__file__).resolve().parents[3] / "cells"
CELL = CELLS / "planar_pair.yaml"
SLOW = ("motion.step_s=0.02", "solver.integrator=accurate", "tasks.circle.tolerance.position_mm=0.5")
pytestmark = pytest.mark.usefixtures("trials_here", "stored_solutions")
AXIS = "motion.duration_s=1,2,-1"


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a sweep over two durations and one that no cell can have."""
    folder = tmp_path_factory.mktemp("sweep") / "study"
    job = SweepJob(cell=CELL, settings=SLOW, runs=folder)
    sweep(job, [read_axis(AXIS)], folder)
    return folder


@pytest.mark.slow
def test_figures_are_those_of_a_plain_solve(study: Path) -> None:
    record = json.loads((study / "study.json").read_text())
    cell = load_cell(CELL).with_values(dict(map(read_setting, (*SLOW, "motion.duration_s=2"))))
    solution = solve(cell)
    assert record["trials"][1]["figures"] == figures_of([run.report for run in solution.runs]).record(KEY)
    assert record["trials"][1]["figures"]["cycle_time_s"] == 2.0


def test_half_the_time_takes_twice_the_velocity(study: Path) -> None:
    fast, slow, _ = json.loads((study / "study.json").read_text())["trials"]
    ratio = fast["figures"]["max_velocity_ratio"] / slow["figures"]["max_velocity_ratio"]
    assert ratio == pytest.approx(2.0, rel=2e-3)  # slopes of chords: the step is the same, the motion twice as fast


def test_an_invalid_variant_is_a_row_with_its_reason(study: Path) -> None:
    rows = list(csv.DictReader((study / "study.csv").read_text().splitlines()))
    assert [row["status"] for row in rows] == ["passed", "passed", "bad_input"]
    assert rows[2]["reason"] == (
        "planar_pair.yaml with motion.duration_s = -1: motion.duration_s: expected a positive number of seconds, got -1"
    )
    assert rows[2]["cycle_time_s"] == ""


def test_runs_that_are_kept_are_ordinary_runs(study: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert sorted(path.name for path in (study / "runs").iterdir()) == ["0000", "0001"]
    assert run(["verify", str(study / "runs" / "0001")]) == 0
    assert "verified" in capsys.readouterr().out


def test_the_page_shows_every_variant(study: Path) -> None:
    page = (study / "study.html").read_text()
    assert page.count("<tr") == 1 + 3 + page.split('id="origin"')[1].count("<tr")
    assert "2 of 3 passed" in page
    assert "<svg" in page


def test_a_key_that_no_cell_has_is_refused_before_anything_is_solved(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="unknown key, did you mean 'duration_s'"):
        sweep(SweepJob(cell=CELL), [read_axis("motion.duration=1:2:1")], tmp_path / "study")
    assert not (tmp_path / "study").exists()


@pytest.mark.parametrize("option", [("--set", "motion.mode=pairwise"), ("--mode", "pairwise")])
def test_a_key_that_is_set_and_varied_is_refused(
    option: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["sweep", str(CELL), "--vary", "motion.mode=simultaneous,part_at_rest", *option]
    assert run([*arguments, "-o", str(tmp_path / "study"), "--quiet"]) == 2
    expected = "--vary: expected a key that nothing else sets, got 'motion.mode', which is set to pairwise already"
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "study").exists()


def test_the_command_prints_a_row_for_each_variant(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = [option for text in SLOW for option in ("--set", text)]
    arguments = [str(CELL), "--vary", "motion.duration_s=1:2:1", "-o", str(tmp_path / "s"), "--workers", "1", *settings]
    assert run(["sweep", *arguments, "--quiet"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "planar-pair: 2 of 2 variants passed"
    assert [line.split()[:2] for line in lines[2:4]] == [["1", "passed"], ["2", "passed"]]
    assert run(["sweep", *arguments, "--resume", "--plots", "png", "--json", "--quiet"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert {"study.svg", "study.png"} <= {path.name for path in (tmp_path / "s").iterdir()}
    assert record["exit"] == 0
    assert record["study"]["counts"] == {"passed": 2, "failed": 0, "no_solution": 0, "bad_input": 0, "crashed": 0}


def test_a_study_without_a_variant_that_passes_ends_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--set", "motion.step_s=0.02", "-o", str(tmp_path / "s"), "--workers", "1", "--quiet"]
    assert run(["sweep", str(CELL), "--vary", "checks.clearance_mm=500", *options]) == 1
    assert "0 of 1 variants passed" in capsys.readouterr().out
