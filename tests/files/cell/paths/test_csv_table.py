"""Toolpath tables are read as they are meant, and findings name line and column."""

import os
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.cell.paths.csv_table import read_toolpath_csv
from cellplan.model.task.task import SampledPath, TimedPath

HEADER = "x_mm,y_mm,z_mm\n"


@pytest.fixture
def read(tmp_path: Path):
    def read_text(text: str | bytes, **words: bool) -> SampledPath | TimedPath:
        file = tmp_path / "weld.csv"
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return read_toolpath_csv(file, **({"is_smooth": False, "is_closed": False} | words))

    return read_text


def findings_of(read, text: str | bytes) -> list[str]:
    with pytest.raises(InputError) as caught:
        read(text)
    return str(caught.value).split("\n")


def test_positions_are_read_in_metres(read) -> None:
    path = read(HEADER + "0,-1.5,2e2\n 10 , .5 ,-3.\n", is_smooth=True, is_closed=True)

    assert path.points.tolist() == pytest.approx(np.array([[0.0, -0.0015, 0.2], [0.01, 0.0005, -0.003]]))
    assert (path.axes, path.rotations) == (None, None)
    assert (path.is_smooth, path.is_closed, path.source) == (True, True, "weld.csv")


def test_columns_may_stand_in_any_order(read) -> None:
    path = read("k,z_mm,i,y_mm,j,x_mm\n0,3,0,2,1,1\n0,6,1,5,0,4\n")

    assert np.allclose(path.points, [[0.001, 0.002, 0.003], [0.004, 0.005, 0.006]])
    assert np.allclose(path.axes, [[0, 1, 0], [1, 0, 0]])


def test_axes_are_brought_to_length_one(read) -> None:
    path = read("x_mm,y_mm,z_mm,i,j,k\n0,0,0,0.577,0.577,0.577\n1,0,0,0,0,-1\n")

    assert np.allclose(np.linalg.norm(path.axes, axis=1), 1.0, atol=1e-15)
    assert np.allclose(path.axes[0], np.full(3, 3.0**-0.5))


def test_quaternions_turn_the_tool_into_the_part_frame(read) -> None:
    path = read("x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,0,0,1,0,0\n1,0,0,0.70710678,0,0.70710678,0\n")

    assert np.allclose(path.rotations[0], np.diag([1, -1, -1]))
    assert np.allclose(path.rotations[1] @ [0, 0, 1], [1, 0, 0], atol=1e-8)


@pytest.mark.parametrize(
    "text", ["\ufeff" + HEADER + "0,0,0\n1,0,0", HEADER.replace("\n", "\r\n") + "0,0,0\r\n1,0,0\r\n"]
)
def test_byte_order_marks_and_windows_line_ends_are_read(read, text: str) -> None:
    assert len(read(text).points) == 2


def test_blank_lines_at_the_end_and_quotes_round_values_are_read(read) -> None:
    assert len(read('"x_mm","y_mm","z_mm"\n"0",0,0\n1,"0",0\n\n  \n').points) == 2


REFUSED = {
    "a word": ("0,0,0\nabc,0,0\n", ["weld.csv:3: column 'x_mm': expected a number, got 'abc'"]),
    "nothing": ("0,0,\n1,0,0\n", ["weld.csv:2: column 'z_mm': expected a number, got ''"]),
    "not a number": (
        "0,nan,0\n1,0,-inf\n",
        [
            "weld.csv:2: column 'y_mm': expected a finite number, got 'nan'",
            "weld.csv:3: column 'z_mm': expected a finite number, got '-inf'",
        ],
    ),
    "python's own spelling": ("1_000,0,0\n1,0,0\n", ["weld.csv:2: column 'x_mm': expected a number, got '1_000'"]),
    "digits of other scripts": ("١,0,0\n1,0,0\n", ["weld.csv:2: column 'x_mm': expected a number, got '١'"]),
    "metres that are microns": (
        "1e300,0,0\n1,0,0\n",
        ["weld.csv:2: column 'x_mm': expected at most 100000 mm either way, got 1e300"],
    ),
    "decimal commas": (
        "1,5,2,5,3,5\n1,0,0\n",
        ["weld.csv:2: expected 3 values, got 6; separate values with ',' and write decimals with '.'"],
    ),
    "semicolons": ("1;2;3\n1,0,0\n", ["weld.csv:2: expected 3 values, got 1"]),
    "a blank line inside": (
        "0,0,0\n\n1,0,0\n",
        ["weld.csv:3: expected a row of numbers, got a blank line; leave it out"],
    ),
    "an open quote": ('"0,0,0\n1,0,0\n', ["weld.csv:2: expected closed quotes, got an odd number of '\"'"]),
    "one point": ("0,0,0\n", ["weld.csv: expected at least 2 points below the header, got 1"]),
    "a null byte": ("0,0,0\n1,\x00,0\n", ["weld.csv:3: expected plain text, got control character 0x00"]),
}


@pytest.mark.parametrize("name", REFUSED)
def test_rows_that_are_no_numbers_are_refused_with_line_and_column(read, name: str) -> None:
    rows, expected = REFUSED[name]

    assert findings_of(read, HEADER + rows) == expected


HEADERS = {
    "metres": ("x_m,y_mm,z_mm", ["weld.csv:1: unknown column 'x_m', lengths are in mm: write x_mm"]),
    "inches": ("x_mm,y_in,z_mm", ["weld.csv:1: unknown column 'y_in', lengths are in mm: write y_mm"]),
    "no unit": ("x,y,z", [f"weld.csv:1: unknown column '{a}', lengths are in mm: write {a}_mm" for a in "xyz"]),
    "a slip": ("x_mm,y_mn,z_mm", ["weld.csv:1: unknown column 'y_mn', did you mean 'y_mm'?"]),
    "a stranger": (
        "x_mm,y_mm,z_mm,speed",
        ["weld.csv:1: unknown column 'speed', allowed are t_s, x_mm, y_mm, z_mm, i, j, k, qw, qx, qy, qz"],
    ),
    "a column twice": ("x_mm,y_mm,z_mm,x_mm", ["weld.csv:1: expected column 'x_mm' once, got it 2 times"]),
    "no z": ("x_mm,y_mm", ["weld.csv:1: expected columns x_mm, y_mm, z_mm, but z_mm is missing"]),
    "half an axis": ("x_mm,y_mm,z_mm,i,j", ["weld.csv:1: expected columns i, j, k, but k is missing"]),
    "both orientations": (
        "x_mm,y_mm,z_mm,i,j,k,qw,qx,qy,qz",
        ["weld.csv:1: expected axes (i, j, k) or quaternions (qw, qx, qy, qz), got both"],
    ),
    "semicolons": (
        "x_mm;y_mm;z_mm",
        ["weld.csv:1: expected columns separated by ',', got ';'; export with ',' and a decimal point"],
    ),
    "none": (
        "0,1,2",
        [f"weld.csv:1: unknown column '{n}', the first line names the columns: x_mm, y_mm, z_mm" for n in "012"],
    ),
}


@pytest.mark.parametrize("name", HEADERS)
def test_headers_that_name_other_columns_are_refused(read, name: str) -> None:
    header, expected = HEADERS[name]

    assert findings_of(read, header + "\n0,0,0\n1,0,0\n") == expected


def test_an_empty_file_is_refused(read) -> None:
    assert findings_of(read, "")[0].startswith("weld.csv:1: unknown column ''")


def test_axes_without_a_direction_and_quaternions_that_are_not_of_length_one_are_refused(read) -> None:
    assert findings_of(read, "x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0,0\n1,0,0,0,0,1\n2,0,0,0,0,0\n") == [
        "weld.csv:2: expected a tool axis (i, j, k) of a length, got 0 (2 times, the last in line 4)"
    ]
    assert findings_of(read, "x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,0,1,1,0,0\n1,0,0,1,0,0,0\n") == [
        "weld.csv:2: expected a quaternion (qw, qx, qy, qz) of length 1, got 1.41421"
    ]


def test_at_most_twenty_findings_are_listed(read) -> None:
    lines = findings_of(read, HEADER + "".join(f"a{k},0,0\n" for k in range(100)))

    assert len(lines) == 21
    assert lines[-1] == "weld.csv:22: and so on: stopped reading after 20 findings"


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        ("x_mm,y_mm,z_mm,qw,qx,qy,qz", "0,0,0,1,1,1,1", "expected a quaternion (qw, qx, qy, qz) of length 1, got 2"),
        ("x_mm,y_mm,z_mm", "0,0,", "column 'z_mm': expected a number, got ''"),
    ],
)
def test_equal_findings_are_one_line_with_their_number(read, header: str, row: str, words: str) -> None:
    expected = [f"weld.csv:2: {words} (61 times, the last in line 62)"]

    assert findings_of(read, f"{header}\n" + f"{row}\n" * 61) == expected


@pytest.mark.parametrize("length", [1.00444, 0.9, 1.5, 1e-3])
def test_axes_of_any_length_are_directions_as_in_a_cell_file(read, length: float) -> None:
    path = read(f"x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,{0.6 * length},{-0.8 * length}\n1,0,0,0,0,{-length}\n")

    assert np.allclose(path.axes, [[0.0, 0.6, -0.8], [0.0, 0.0, -1.0]], atol=1e-12)


@pytest.mark.parametrize(("is_closed", "lines"), [(False, (2, 3, 5, 6, 7)), (True, (2, 3, 5, 6))])
def test_points_within_the_stated_distance_are_joined_and_keep_their_lines(tmp_path, is_closed, lines) -> None:
    rows = "0,0,0,0,0,-1\n10,0,0,0,0,-1\n10.001,0,0,1,0,0\n10,10,0,0,0,-1\n0,10,0,0,0,-1\n0,0.005,0,1,0,0\n"
    (tmp_path / "weld.csv").write_text("x_mm,y_mm,z_mm,i,j,k\n" + rows, encoding="utf-8")

    path = read_toolpath_csv(tmp_path / "weld.csv", is_smooth=True, is_closed=is_closed, join=1e-5)

    assert path.lines == lines
    assert path.join == 1e-5
    assert len(path.points) == len(path.axes) == len(lines)


def test_all_findings_come_as_one_error(read) -> None:
    with pytest.raises(InvalidFileError) as caught:
        read(HEADER + "a,0,0\nb,0,0\n")

    assert len(caught.value.findings) == 2


def test_bytes_that_are_not_utf_8_are_refused(read) -> None:
    assert findings_of(read, HEADER.encode() + b"0,0,0\n1,\xff,0\n") == [
        "weld.csv:3: expected text in UTF-8, got byte 0xff"
    ]


def test_only_regular_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    for name in ("pipe.csv", "."):
        with pytest.raises(InputError, match=": expected a regular file, got a folder, a pipe or a device"):
            read_toolpath_csv(tmp_path / name, is_smooth=False, is_closed=False, source=name)


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_toolpath_csv(tmp_path / "weld.csv", is_smooth=False, is_closed=False, source="paths/weld.csv")

    assert str(caught.value) == "paths/weld.csv: no such file"


def test_too_many_points_are_refused(read) -> None:
    assert findings_of(read, HEADER + "0,0,0\n" * 200_001) == ["weld.csv: expected at most 200000 points, got 200001"]


def test_too_large_a_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "weld.csv"
    with file.open("wb") as stream:
        stream.truncate(50_000_001)

    with pytest.raises(InputError, match=r"weld\.csv: expected a file of at most 50 MB, got a larger one"):
        read_toolpath_csv(file, is_smooth=False, is_closed=False)


TIMED = "t_s,x_mm,y_mm,z_mm\n"


def test_a_column_of_instants_makes_a_trajectory(read) -> None:
    path = read(TIMED + "0,0,0,0\n0.5,10,0,0\n1.5,10,0,0\n")

    assert isinstance(path, TimedPath)
    assert path.times.tolist() == [0.0, 0.5, 1.5]
    assert path.points[:, 0].tolist() == [0.0, 0.01, 0.01]  # standing still is no slip here
    assert path.duration == 1.5


def test_instants_must_start_at_zero_and_increase(read) -> None:
    assert findings_of(read, TIMED + "0.1,0,0,0\n0.2,1,0,0\n0.2,2,0,0\n0.1,3,0,0\n") == [
        "weld.csv:2: column 't_s': expected 0 in the first row, got 0.1; a task is shifted by its start_s",
        "weld.csv:4: column 't_s': expected a time after 0.2 of the row before, got 0.2",
        "weld.csv:5: column 't_s': expected a time after 0.2 of the row before, got 0.1",
    ]
    assert findings_of(read, TIMED + "0,0,0,0\n1e7,1,0,0\n") == [
        "weld.csv:3: column 't_s': expected at most 1000000 s either way, got 1e7"
    ]
    assert findings_of(read, TIMED + "0,0,0,0\n1e-9,1,0,0\n") == [
        "weld.csv:3: column 't_s': expected a time after 0 of the row before, got 1e-09"
    ]


@pytest.mark.parametrize("word", ["t", "time", "Time_s", "t_ms"])
def test_other_words_for_time_are_corrected(read, word: str) -> None:
    (line,) = findings_of(read, f"{word},x_mm,y_mm,z_mm\n0,0,0,0\n1,1,0,0\n")

    assert line == f"weld.csv:1: unknown column '{word}', times are in s: write t_s"


def test_a_closed_trajectory_ends_exactly_where_it_starts(read) -> None:
    rows = "t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,9,0,0,1,0,0,0\n2,9,9,0,1,0,0,0\n"

    path = read(rows + "3,0.0004,0,0,-1,0,0,0\n", is_closed=True)

    assert np.array_equal(path.points[-1], path.points[0])
    assert np.array_equal(path.rotations[-1], path.rotations[0])


def test_a_closed_trajectory_that_does_not_come_back_is_refused(read) -> None:
    rows = "t_s,x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0,0,1\n1,9,0,0,0,0,1\n2,9,9,0,0,0,1\n"
    with pytest.raises(InvalidFileError) as caught:
        read(rows + "3,0.5,0,0,0,1,0\n", is_closed=True)
    with pytest.raises(InvalidFileError) as too_short:
        read(TIMED + "0,0,0,0\n1,1,0,0\n2,0,0,0\n", is_closed=True)

    assert str(caught.value).split("\n") == [
        "weld.csv:5: expected a closed trajectory to end at the point of its first row, but it ends 0.5 mm from it; "
        "repeat the first row at the end of the cycle",
        "weld.csv:5: expected a closed trajectory to end with the orientation of its first row",
    ]
    assert str(too_short.value) == "weld.csv:4: expected at least 4 rows for a closed trajectory, got 3"
