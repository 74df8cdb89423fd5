"""Broken streams are refused with their line, and figures beside them that are not those of their numbers."""

import json
import re
from dataclasses import replace

import pytest
from builders.stream_jobs import cell_for, edited, timed_job, with_line_twice, without_line

from cellplan.errors import InputError
from cellplan.programs.formats.stream.writer import read_stream, render_stream

JOB = timed_job(end=0.6, cycle=0.012, seed=2, robots=("gamma",))
JOB = replace(JOB, frame=replace(JOB.frame, cell=cell_for("kuka", seed=2, cycle=0.012)))
FILES = render_stream(JOB)
TABLE, RECORD = FILES["gamma.csv"], FILES["gamma.json"]
LAST = TABLE.count("\n")
MIDDLE = 1 + LAST // 2


def changed_row(old: str, new: str, line: int = MIDDLE) -> str:
    """The stream with something replaced in one line."""
    lines = TABLE.splitlines(keepends=True)
    assert old in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(old, new, 1)
    return "".join(lines)


ROW = TABLE.splitlines()[MIDDLE - 1]
FIELDS = ROW.split(",")


@pytest.mark.parametrize(
    "row",
    [
        "",
        "x",
        "# remark",
        " " + ROW,
        ROW + " ",
        ROW + ",",
        ROW + ",0",
        ROW[:-2],
        ROW[:-1],
        ROW[:-1] + "2",
        ROW[:-1] + "01",
        ROW[:-1] + "true",
        ROW[:-1] + "-0",
        ROW.replace(",", ";"),
        ROW.replace(",", ", "),
        ROW.replace(".", ","),
        "0" + ROW,
        "+" + ROW,
        ",".join([str(MIDDLE), *FIELDS[1:]]),
        ",".join([FIELDS[0], FIELDS[1] + "0", *FIELDS[2:]]),
        ",".join([FIELDS[0], FIELDS[1][:-1], *FIELDS[2:]]),
        ",".join([FIELDS[0], FIELDS[1][:-1] + "1", *FIELDS[2:]]),
        ",".join([FIELDS[0], "-" + FIELDS[1], *FIELDS[2:]]),
        *(
            ",".join([*FIELDS[:2], number, *FIELDS[3:]])
            for number in (
                "", "nan", "inf", "1e1", "1.0", "1.0000000", "+1.000000", "--1.000000", "-0.000000", "01.000000",
                "1,000000", "1 .000000", "12345678.000000", "0x1.000000", ".000000", "1.00000a",
                '"1.000000"', "1.000000e0",
            )
        ),
    ],
)  # fmt: skip
def test_a_broken_row_is_refused(row: str) -> None:
    text = changed_row(ROW, row)

    with pytest.raises(InputError, match=rf"^gamma\.csv:{MIDDLE}: expected "):
        read_stream(JOB.frame, {**FILES, "gamma.csv": text})


@pytest.mark.parametrize(
    ("text", "line"),
    [
        pytest.param("", 1, id="nothing"),
        pytest.param("\n", 1, id="an empty line"),
        pytest.param(TABLE[:-1], LAST, id="no end of the last line"),
        pytest.param(TABLE[:-8], LAST, id="cut"),
        pytest.param(TABLE.replace("k,t_s", "k,t"), 1, id="other names"),
        pytest.param(TABLE.replace("E1_deg,E2_deg", "E2_deg,E1_deg"), 1, id="names in another order"),
        pytest.param(TABLE.replace("_deg", "_rad"), 1, id="other units"),
        pytest.param(TABLE.replace("\n", "\r\n"), 1, id="other line ends"),
        pytest.param(without_line(TABLE, 1), 1, id="no names"),
        pytest.param(without_line(TABLE, MIDDLE), MIDDLE, id="a row missing"),
        pytest.param(with_line_twice(TABLE, MIDDLE), MIDDLE + 1, id="a row twice"),
        pytest.param(with_line_twice(TABLE, 1), 2, id="names twice"),
        pytest.param(TABLE.splitlines()[0] + "\n", 1, id="no row"),
    ],
)
def test_a_broken_stream_is_refused(text: str, line: int) -> None:
    with pytest.raises(InputError, match=rf"^gamma\.csv:{line}: expected "):
        read_stream(JOB.frame, {**FILES, "gamma.csv": text})


@pytest.mark.parametrize(("line", "where"), [(4, "first"), (LAST - 3, "last")])
def test_a_stream_that_moves_at_an_end_is_refused(line: int, where: str) -> None:
    fields = TABLE.splitlines()[line - 1].split(",")
    text = changed_row(fields[3], f"{float(fields[3]) - 1e-6:.6f}", line)

    with pytest.raises(InputError, match=rf"^gamma\.csv:{line}: expected rest in the {where} 0\.1 s"):
        read_stream(JOB.frame, {**FILES, "gamma.csv": text})


def test_a_stream_that_ends_earlier_is_refused() -> None:
    shorter = TABLE[: TABLE[:-1].rindex("\n") + 1]

    with pytest.raises(InputError, match=r"^gamma\.csv:43: expected rest in the last 0\.1 s"):
        read_stream(JOB.frame, {**FILES, "gamma.csv": shorter})


def test_a_changed_number_is_found_by_figures_or_digest() -> None:
    number = FIELDS[2]
    text = changed_row(number, f"{float(number) + 1e-6:.6f}")

    with pytest.raises(InputError, match=r"^gamma\.json:[0-9]+: expected "):
        read_stream(JOB.frame, {**FILES, "gamma.csv": text})


KEYS = list(json.loads(RECORD))


@pytest.mark.parametrize("key", [key for key in KEYS if key not in {"notes", "axes"}])
def test_another_value_beside_a_stream_is_refused(key: str) -> None:
    line = 1 + RECORD[: RECORD.index(f'\n  "{key}": ') + 1].count("\n")
    text = re.sub(rf'^  "{key}": ([^\n,\[]+)', f'  "{key}": "other"', RECORD, flags=re.MULTILINE)
    assert text != RECORD

    with pytest.raises(InputError, match=rf"^gamma\.json:{line}: expected "):
        read_stream(JOB.frame, {**FILES, "gamma.json": text})


AXIS = list(json.loads(RECORD)["axes"][0])


@pytest.mark.parametrize("key", AXIS)
@pytest.mark.parametrize("axis", [0, 1])
def test_another_figure_of_an_axis_is_refused(key: str, axis: int) -> None:
    text, line = edited(RECORD, f'"{key}": ', f'"{key}": 1', nth=axis)

    with pytest.raises(InputError, match=rf"^gamma\.json:{line}: expected "):
        read_stream(JOB.frame, {**FILES, "gamma.json": text})


def test_spaces_and_notes_beside_a_stream_may_be_others() -> None:
    record = RECORD.replace('": ', '" :\t').replace("the written numbers", "it")

    (read,) = read_stream(JOB.frame, {**FILES, "gamma.json": "\n\n" + record.replace("\n", "\n ") + "\n"})

    assert list(read.robots) == ["gamma"]
