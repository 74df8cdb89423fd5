"""Plain CSV: what is written is read back to the same rounded numbers, and nothing else is taken for it."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import open_gate
from cellplan.errors import InputError
from cellplan.export.csv import read_csv, render_csv
from cellplan.model.verified_run import VerifiedRun


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


def test_a_file_has_one_line_of_names_with_units_and_a_row_per_instant(run: VerifiedRun) -> None:
    files = render_csv(run)

    lines = files["left.csv"].splitlines()
    assert lines[0] == "time_s,A_deg,B_deg,C_deg"
    assert lines[1] == "0.000000000,50.000000000,-85.000000000,35.000000000"
    assert len(lines) == 1 + len(run.motions[0].schedule.times)
    assert not any("#" in text for text in files.values())


def test_what_is_read_back_is_what_was_verified_but_for_half_a_unit_of_the_last_decimal(run: VerifiedRun) -> None:
    (read,) = read_csv(run, render_csv(run))

    for robot, table in run.motions[0].tables.items():
        assert read[robot].joints == table.joints
        assert np.abs(np.rad2deg(read[robot].q - table.q)).max() <= 0.5e-9 + 1e-13  # room for the arithmetic
        assert np.abs(read[robot].times - table.times).max() <= 0.5e-9


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("time_s", "t", "left.csv:1: expected the names 'time_s,A_deg,B_deg,C_deg', got 't,A_deg,B_deg,C_deg'"),
        ("A_deg,B_deg", "B_deg,A_deg", "left.csv:1: expected the names "),
        ("50.000000000", "nan", "left.csv:2: expected 4 numbers with 9 decimals, got '0.000000000,nan"),
        ("50.000000000", "50.0", "left.csv:2: expected 4 numbers with 9 decimals, got "),
        ("50.000000000,", "", "left.csv:2: expected 4 numbers with 9 decimals, got "),
        ("\n", "\r\n", "left.csv:1: expected the names "),
    ],
)
def test_anything_else_is_refused(run: VerifiedRun, old: str, new: str, finding: str) -> None:
    files = render_csv(run)
    files["left.csv"] = files["left.csv"].replace(old, new)

    with pytest.raises(InputError) as refusal:
        read_csv(run, files)

    assert str(refusal.value).startswith(finding)


def test_a_file_that_was_cut_off_is_refused(run: VerifiedRun) -> None:
    files = render_csv(run)
    files["left.csv"] = files["left.csv"][:-1]

    with pytest.raises(InputError, match=r"left\.csv: expected the last row to end with a line break"):
        read_csv(run, files)
