"""Plain CSV: what is written is read back to the same rounded numbers, and nothing else is taken for it."""

from pathlib import Path

import numpy as np
import pytest
from builders.run_jobs import job_of_run

from cellplan import open_gate
from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.formats.csv import read_csv, render_csv


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def job(run: VerifiedRun) -> ExportJob:
    return job_of_run(run)


def test_a_file_has_one_line_of_names_with_units_and_a_row_per_instant(run: VerifiedRun, job: ExportJob) -> None:
    files = render_csv(job)

    lines = files["left.csv"].splitlines()
    assert lines[0] == "time_s,A_deg,B_deg,C_deg"
    assert lines[1] == "0.000000000,50.000000000,-85.000000000,35.000000000"
    assert len(lines) == 1 + len(run.motions[0].schedule.times)
    assert not any("#" in text for text in files.values())


def test_what_is_read_back_is_what_was_verified_but_for_half_a_unit_of_the_last_decimal(
    run: VerifiedRun, job: ExportJob
) -> None:
    (read,) = read_csv(job.frame, render_csv(job))

    assert list(read.robots) == [robot.name for robot in run.cell.robots]
    for robot, table in run.motions[0].tables.items():
        assert np.abs(np.rad2deg(read.robots[robot].q - table.q)).max() <= 0.5e-9 + 1e-13  # room for the arithmetic
        assert np.abs(read.robots[robot].times - table.times).max() <= 0.5e-9


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("time_s", "t", "left.csv:1: expected the names 'time_s,A_deg,B_deg,C_deg', got 't,A_deg,B_deg,C_deg'"),
        ("A_deg,B_deg", "B_deg,A_deg", "left.csv:1: expected the names "),
        ("50.000000000", "nan", "left.csv:2: expected 4 numbers with 9 decimals, got '0.000000000,nan"),
        ("50.000000000", "50.0", "left.csv:2: expected 4 numbers with 9 decimals, got "),
        ("50.000000000,", "", "left.csv:2: expected 4 numbers with 9 decimals, got "),
        ("\n", "\r\n", "left.csv:1: expected the names "),
        ("\n0.000000000", "\n0.000000001", "left.csv:2: expected a first row at 0 s"),
        ("\n0.050000000", "\n0.025000000", "left.csv:4: expected a time after 0.025 s, got 0.025 s"),
        ("\n0.050000000", "\n0.050000001", "right.csv:4: expected 0.050000001 s as in the file of 'left', "),
    ],
)
def test_anything_else_is_refused(job: ExportJob, old: str, new: str, finding: str) -> None:
    files = render_csv(job)
    files["left.csv"] = files["left.csv"].replace(old, new)

    with pytest.raises(InputError) as refusal:
        read_csv(job.frame, files)

    assert str(refusal.value).startswith(finding)


def test_a_file_that_was_cut_off_is_refused(job: ExportJob) -> None:
    files = render_csv(job)
    files["left.csv"] = files["left.csv"][:-1]

    with pytest.raises(InputError, match=r"left\.csv: expected the last row to end with a line break"):
        read_csv(job.frame, files)


def test_a_file_that_lacks_its_last_row_is_refused(job: ExportJob) -> None:
    files = render_csv(job)
    files["right.csv"] = files["right.csv"].rsplit("\n", 2)[0] + "\n"

    with pytest.raises(InputError, match=r"right\.csv:42: expected 1\.0+ s as in the file of 'left', got the end"):
        read_csv(job.frame, files)


def test_a_file_too_few_or_too_many_is_refused(job: ExportJob) -> None:
    files = render_csv(job)

    with pytest.raises(InputError, match=r"other\.csv: expected no such file"):
        read_csv(job.frame, {**files, "other.csv": files["left.csv"]})
    del files["idle.csv"]
    with pytest.raises(InputError, match=r"idle\.csv: expected this file among the programs, got none"):
        read_csv(job.frame, files)
