"""The clock of a program as a table, and gaps between rows: what is written is read, and nothing else is accepted."""

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.files.run.clock_table import last_time, parse_clock, render_clock
from cellplan.files.run.joint_tables import line_of_row, with_gap_lines, without_gap_lines
from cellplan.model.motion.motion import ClockTable

TABLE = ClockTable(
    times=np.array([0.0, 0.1, 0.2, 0.3]),
    sigma=np.array([0.0, 0.1, 0.2, 0.3]),
    phases=("cut", "cut", "weld", "weld"),
    lengths={"cut": np.array([0.0, 0.0125, 0.0125, 0.0125]), "weld": np.array([0.0, 0.0, 0.0, 1e-9])},
    process={"cut": np.array([True, True, False, False]), "weld": np.array([False, False, True, False])},
    gaps={2: "cut to weld"},
)
PROGRAM = "ab" * 32
TEXT = f"""\
# cellplan program clock v1
# cell: bench
# program digest: sha256 {PROGRAM}
time_s,sigma_s,phase,cut_s_mm,cut_process,weld_s_mm,weld_process
0.0,0.0,cut,0.0,1,0.0,0
0.1,0.1,cut,12.5,1,0.0,0
# not part of the program: cut to weld
0.2,0.2,weld,12.5,0,0.0,1
0.3,0.3,weld,12.5,0,0.000001,0
"""


def test_a_clock_is_plain_text() -> None:
    assert render_clock(TABLE, cell="bench", program=PROGRAM) == TEXT


def test_what_is_written_is_what_is_read() -> None:
    read = parse_clock(TEXT, "clock.csv")

    assert (read.cell, read.program, read.table.phases, read.table.gaps) == (
        "bench",
        PROGRAM,
        TABLE.phases,
        TABLE.gaps,
    )
    assert [read.line(row) for row in range(4)] == [5, 6, 8, 9]
    assert np.array_equal(read.table.times, TABLE.times)
    for task in ("cut", "weld"):
        assert read.table.lengths[task] == pytest.approx(TABLE.lengths[task], abs=1e-15)
        assert np.array_equal(read.table.process[task], TABLE.process[task])
    assert render_clock(read.table, cell=read.cell, program=read.program) == TEXT


def test_the_last_time_is_that_of_the_last_row() -> None:
    assert last_time(TEXT, "clock.csv") == 0.3
    with pytest.raises(InputError, match=r"^c:9: expected time_s"):
        last_time(TEXT.replace("\n0.3,", "\nlate,"), "c")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("clock v1", "clock v2", "c:1: expected the line '# cellplan program clock v1', got '# cellplan program clock"),
        ("# cell: bench\n", "", "c:2: expected the line '# cell: NAME', got '# program digest"),
        ("sha256 ab", "sha256 xy", "c:3: expected the line '# program digest: sha256 …', got"),
        ("cut_s_mm,", "", "c:4: expected the column names 'time_s,sigma_s,phase,TASK_s_mm,TASK_process' and so on"),
        ("weld_s_mm,weld_process", "cut_s_mm,cut_process", "c:4: expected the column names"),
        ("12.5,1,", "12.5,2,", "c:6: expected time_s,sigma_s,phase,cut_s_mm,cut_process,weld_s_mm,weld_process, got"),
        ("0.1,0.1,cut", "0.1,nan,cut", "c:6: expected time_s,"),
        ("0.2,0.2,weld", "0.2,0.05,weld", "c:8: sigma_s: expected a time that never falls, got 0.05 after 0.1"),
        ("0.2,0.2,weld", "0.1,0.2,weld", "c:8: time_s: expected a time that grows, got 0.1 after 0.1"),
        ("0.0,0.0,cut", "0.0,0.01,cut", "c:5: sigma_s: expected the first row at 0, got 0.01"),
        ("# not part of", "# part of", "c:7: expected a row, or '# not part of the program: A to B', got '# part of"),
        (TEXT[-30:], TEXT[-30:-1], "c: expected the last row to end with a line break"),
        ("0.3,0.3,weld,12.5,0,0.000001,0\n", "", None),
    ],
)
def test_any_other_text_is_refused_with_its_line(old: str, new: str, message: str | None) -> None:
    text = TEXT.replace(old, new, 1)
    assert text != TEXT
    if message is None:
        assert len(parse_clock(text, "c").table.times) == 3
        return
    with pytest.raises(InputError) as caught:
        parse_clock(text, "c")
    assert str(caught.value).startswith(message)


def test_gap_lines_stand_between_rows_and_count_as_lines() -> None:
    lines = list(with_gap_lines(iter(["a", "b", "c"]), {1: "one to two"}))

    assert lines == ["a", "# not part of the program: one to two", "b", "c"]
    assert without_gap_lines(lines, source="t", first_line=10) == (["a", "b", "c"], {1: "one to two"})
    assert [line_of_row(row, {1: "one to two"}, first_line=10) for row in range(3)] == [10, 12, 13]


@pytest.mark.parametrize(
    "lines",
    [
        ["# not part of the program: one to two", "a"],
        ["a", "# not part of the program: one to two"],
        ["a", "# not part of the program: one to two", "# not part of the program: two to three", "b"],
    ],
)
def test_a_gap_that_is_not_between_two_rows_is_refused(lines: list[str]) -> None:
    with pytest.raises(InputError, match=r"t:\d+: expected '# not part of the program' between two rows only"):
        without_gap_lines(lines, source="t", first_line=1)
