"""JSON programs: what any JSON reader finds, the way back, and broken documents refused with their line."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import job_of
from builders.stream_jobs import (
    cell_for,
    edited,
    is_within_limits,
    largest_error,
    round_trip,
    smooth_program,
    timed_job,
    with_line_twice,
    without_line,
)

from cellplan.errors import InputError
from cellplan.model.report.exported import ProgramRows, Promise
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.json_tree import parsed
from cellplan.programs.formats.json_tables import read_json, render_json

JSON = DIALECTS["json"]
UNIT = {"deg": np.pi / 180.0, "mm": 1e-3}


@pytest.mark.parametrize("seed", range(3))
def test_positions_and_flags_come_back_within_half_of_the_last_decimal(seed: int) -> None:
    job = timed_job(seed=seed, end=0.8)

    files, (read,) = round_trip(JSON, job)

    assert list(files) == ["program.json"]
    for name, rows in read.robots.items():
        mine = job.programs[0].robots[name]
        unit = np.array([UNIT[joint.display_unit.name] for joint in job.frame.robot(name).model.joints])
        assert np.all(largest_error(job, [read], name) <= 1e-9 * unit + 1e-15)
        assert is_within_limits(job.frame.robot(name), rows.q)
        assert np.abs(rows.times - mine.times).max() <= 0.5e-9  # type: ignore[operator]
        assert np.array_equal(rows.process, mine.process)  # type: ignore[arg-type]


def test_any_reader_finds_times_positions_and_flags() -> None:
    """Positions count from the model; what is said of the controller gives the positions that it shows."""
    job = timed_job(seed=2, end=0.6)
    text = render_json(job)["program.json"]

    record = json.loads(text)

    assert (record["schema"], record["program"], record["promise"], record["time_unit"]) == (
        "cellplan.program/1",
        None,
        "timed",
        "s",
    )
    assert record["rows"] == len(record["times"]) == 151
    for entry in record["robots"]:
        rows, robot = job.programs[0].robots[entry["name"]], job.frame.robot(entry["name"])
        units = np.array([UNIT[joint["unit"]] for joint in entry["joints"]])
        q = np.array(entry["positions"]) * units
        assert np.abs(q - rows.q).max() <= 2e-11
        assert entry["process"] == [int(flag) for flag in rows.process]  # type: ignore[union-attr]
        zero = robot.model.controller
        for place, joint in enumerate(entry["joints"]):
            if zero is None:
                assert joint["controller"] is None
                continue
            assert joint["controller"]["sign"] == zero.sign[place]
            assert joint["controller"]["zero"] * units[place] == pytest.approx(zero.zero[place], abs=1e-11)
            names = [other["name"] for other in entry["joints"]]
            couplings = {names[other]: zero.coupling[place, other] for other in np.flatnonzero(zero.coupling[place])}
            assert joint["controller"]["coupling"] == couplings


def test_numbers_are_plain_decimals() -> None:
    text = render_json(timed_job(seed=1, end=0.5))["program.json"]

    record = json.loads(text, parse_float=str)

    numbers = [
        *record["times"],
        *(number for robot in record["robots"] for row in robot["positions"] for number in row),
    ]
    assert all(re.fullmatch(r"-?(0|[1-9][0-9]*)\.[0-9]{9}", number) for number in numbers)
    assert not any(re.fullmatch(r"-0\.0+", number) for number in numbers)


def test_one_document_for_each_task() -> None:
    cell = cell_for("kuka")
    programs = [smooth_program(cell, name=name, seed=k, end=0.4) for k, name in enumerate(("one", "two"))]
    job = job_of(cell, *programs, promise=Promise.TIMED)

    files, read = round_trip(JSON, job)

    assert list(files) == ["one/program.json", "two/program.json"]
    assert [json.loads(text)["program"] for text in files.values()] == ["one", "two"]
    assert max(largest_error(job, read, name).max() for name in job.frame.robots) <= 2e-11


def test_robots_without_controllers_and_flags_are_written_too() -> None:
    job = timed_job(end=0.5)
    robots = tuple(replace(robot, control=None) for robot in job.frame.cell.robots)
    plain = {name: replace(rows, process=None, qd=None) for name, rows in job.programs[0].robots.items()}
    cell = replace(job.frame.cell, robots=robots, controllers={})
    job = replace(job, frame=replace(job.frame, cell=cell), programs=(ProgramRows(name=None, robots=plain),))

    _, (read,) = round_trip(JSON, job)

    assert all(rows.process is None for rows in read.robots.values())


def test_robots_on_different_clocks_are_refused() -> None:
    job = timed_job(end=0.5)
    rows = job.programs[0].robots["beta"]
    late = replace(rows, times=1.1 * rows.times)  # type: ignore[operator]
    program = ProgramRows(name=None, robots={**job.programs[0].robots, "beta": late})

    with pytest.raises(InputError, match="robot 'beta': expected rows at the same times as those of 'alpha'"):
        render_json(replace(job, programs=(program,)))


def test_same_job_same_text_of_ascii_characters() -> None:
    notes = ('Größe "\u2028" \x00 \\',)
    text = render_json(timed_job(seed=5, end=0.4, notes=notes))["program.json"]

    assert text == render_json(timed_job(seed=5, end=0.4, notes=notes))["program.json"]
    assert text.isascii()
    assert json.loads(text)["notes"] == list(notes)


@pytest.mark.slow
def test_a_hundred_thousand_rows_keep_all_limits() -> None:
    for seed in (5,):
        job = timed_job(seed=seed, end=160.0, rests=(40.0, 80.0))

        _, (read,) = round_trip(JSON, job)

        for name, rows in read.robots.items():
            assert is_within_limits(job.frame.robot(name), rows.q)
            assert largest_error(job, [read], name).max() <= 2e-11


JOB = timed_job(end=0.3, cycle=0.01, seed=2, notes=("first", "second"))
TEXT = render_json(JOB)["program.json"]
LINES = TEXT.splitlines()
TIME = LINES.index("    0.100000000,") + 1
ROW = next(k for k, line in enumerate(LINES, start=1) if line.startswith("        [")) + 5
FLAG = len(LINES) - 8


def at(line: int, old: str, new: str) -> str:
    """The text with something replaced in one line."""
    lines = TEXT.splitlines(keepends=True)
    assert old in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(old, new, 1)
    return "".join(lines)


def refusal(text: str) -> str:
    with pytest.raises(InputError) as caught:
        read_json(JOB.frame, {"program.json": text})
    return str(caught.value)


@pytest.mark.parametrize(
    ("line", "old", "new"),
    [
        *((TIME, "0.100000000", new) for new in ("0.1", "0.1000000000", "1e-1", "-0.100000000", "0.085000000")),
        *((TIME, "0.100000000", new) for new in ('"0.100000000"', "null", "[0.100000000]", "NaN", "00.100000000", "")),
        *(
            (TIME, "0.100000000", new)
            for new in ("+0.100000000", "0,100000000", ".100000000", "0.100000000x", "Infinity")
        ),
        *((ROW, "[", new) for new in ("[0.000000000, ", "[1, ", "[nan, ", "[-0.000000000, ", "[}", "{", "", '["x", ')),
        *((ROW, "[", new) for new in ("[1.0000000000, ", "[1.00000000, ", "[1e3, ", "[01.000000000, ", "[,")),
        *((ROW, "],", new) for new in ("]],", "};", ",],", "] ]", ", 0.000000000],", ", null],")),
        *((FLAG, "0", new) for new in ("2", "true", "0.0", "-1", '"0"', "", "0 0")),
        (ROW, "], ", "]; ") if "], " in LINES[ROW - 1] else (ROW, "],", "];"),
    ],
)
def test_a_broken_value_is_refused(line: int, old: str, new: str) -> None:
    message = refusal(at(line, old, new))

    number = int(re.match(r"program\.json:([0-9]+): expected ", message)[1])  # type: ignore[index]
    opening = {TIME: LINES.index('  "times": [') + 1, FLAG: max(k for k in range(FLAG) if "process" in LINES[k]) + 1}
    assert number in {line, line + 1, opening.get(line, line)}  # an array of numbers is named by its first line


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"schema"', '"scheme"'),
        ("cellplan.program/1", "cellplan.program/2"),
        ('"cell": "test"', '"cell": "other"'),
        ('"program": null', '"program": "one"'),
        ('"program": null', '"program": 0'),
        ('"promise": "timed"', '"promise": "sequence only"'),
        ('"promise": "timed"', "promise: timed"),
        ('"promise": "timed",', '"promise": "timed", "promise": "timed",'),
        ('"promise": "timed",', '"promise": "timed", "more": 1,'),
        ('"zero": "positions count from the zero of the model"', '"zero": "positions count from the controller"'),
        ('"rows": 31', '"rows": 30'),
        ('"rows": 31', '"rows": 31.0'),
        ('"rows": 31', '"rows": "31"'),
        ('"time_unit": "s"', '"time_unit": "ms"'),
        ('"time_unit": "s"', "\"time_unit\": 's'"),
        ('"first"', "1.0"),
        ('"first"', "null"),
        ('"first"', '"fir\tst"'),
        ('"first"', '"fir\\qst"'),
        ('"first"', '"f\u00efrst"'),
        ('"name": "beta"', '"name": "alpha"'),
        ('"name": "alpha"', '"name": null'),
        ('"model": "elbow"', '"model": "wrist"'),
        ('"unit": "mm"', '"unit": "deg"'),
        ('"name": "a2"', '"name": "A2"'),
        ('"sign": -1', '"sign": 1'),
        ('"zero": -90.000000000', '"zero": 90.000000000'),
        ('"a2": 1.000000000', '"a2": -1.000000000'),
        ('"a2": 1.000000000', '"a1": 1.000000000'),
        ('"controller": null', '"controller": {}'),
        ('"positions"', '"joint_positions"'),
        ('"process"', '"flags"'),
    ],
)
def test_another_head_is_refused(old: str, new: str) -> None:
    text, line = edited(TEXT, old, new)

    message = refusal(text)

    number = int(re.match(r"program\.json:([0-9]+): expected ", message)[1])  # type: ignore[index]
    first = TEXT.count("\n", 0, TEXT.rindex("{", 0, TEXT.index(old))) + 1
    assert number in {line, first, line + 1}  # a missing key is named by the line of its object


@pytest.mark.parametrize(
    ("text", "line"),
    [
        pytest.param("", 1, id="nothing"),
        pytest.param("[]", 1, id="an array"),
        pytest.param("null", 1, id="null"),
        pytest.param(TEXT + "x", len(LINES) + 1, id="more"),
        pytest.param(TEXT + TEXT, len(LINES) + 1, id="twice"),
        pytest.param("\ufeff" + TEXT, 1, id="a byte order mark"),
        pytest.param("[" * 50, 1, id="deep"),
        pytest.param(without_line(TEXT, len(LINES)), len(LINES), id="no end"),
        pytest.param(without_line(TEXT, 1), 1, id="no begin"),
        pytest.param("// remark\n" + TEXT, 1, id="a comment"),
    ],
)
def test_what_is_no_such_document_is_refused(text: str, line: int) -> None:
    assert refusal(text).startswith(f"program.json:{line}: expected ")


def test_a_document_cut_anywhere_is_refused_at_its_end_or_before() -> None:
    for cut in range(1, len(TEXT) - 2, 409):
        message = refusal(TEXT[:cut])
        number = int(re.match(r"program\.json:([0-9]+): expected ", message)[1])  # type: ignore[index]
        assert 1 <= number <= 1 + TEXT.count("\n", 0, cut)


def test_a_row_that_is_missing_or_twice_is_refused() -> None:
    table = next(k for k, line in enumerate(LINES, start=1) if '"positions": [' in line)
    for text in (without_line(TEXT, ROW), with_line_twice(TEXT, ROW)):
        assert refusal(text).startswith(f"program.json:{table}: expected an array of 31 rows")
    assert re.match(r"program\.json:[0-9]+: expected ", refusal(without_line(TEXT, TIME)))
    assert "two times or more that rise from 0" in refusal(
        with_line_twice(TEXT, TIME).replace('"rows": 31', '"rows": 32')
    )


def test_files_are_those_of_the_programs() -> None:
    with pytest.raises(InputError, match=r"^program\.json:1: expected a file of the export, got none"):
        read_json(JOB.frame, {})
    with pytest.raises(InputError, match=r"^more\.json:1: expected no such file"):
        read_json(JOB.frame, {"program.json": TEXT, "more.json": TEXT})


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "").replace("  ", ""),
        lambda text: text.replace(",", " ,\n\t"),
        lambda text: text.replace('": ', '"\r\n:  '),
        lambda text: (
            json.dumps(json.loads(text, parse_float=lambda number: f"@{number}@")).replace('"@', "").replace('@"', "")
        ),
        lambda text: "\n\n" + text + "\n \n",
    ],
)
def test_spaces_between_values_may_be_others(change: "type") -> None:
    (same,) = read_json(JOB.frame, {"program.json": TEXT})

    (read,) = read_json(JOB.frame, {"program.json": change(TEXT)})

    assert all(np.array_equal(read.robots[name].q, rows.q) for name, rows in same.robots.items())


@pytest.mark.parametrize("seed", range(5))
def test_the_parser_takes_what_the_standard_library_takes(seed: int) -> None:
    """Random edits: where the standard library finds a document, so does ours, and the other way round."""
    rng, source = (
        np.random.default_rng(seed),
        '{"a": [1, 2.5, -3e2], "b": {"c": "x\\n\\u00e9", "d": [true, null, []]}, "e": ""}',
    )
    signs = list('{}[],:"0123456789.eE+-\\ ntrufalse\n')
    for _ in range(300):
        letters = list(source)
        for place in rng.integers(0, len(letters), rng.integers(1, 3)).tolist():
            letters[place] = signs[int(rng.integers(len(signs)))]
        text = "".join(letters)
        assert is_json(text) == is_ours(text), text


def is_json(text: str) -> bool:
    try:
        json.loads(text, object_pairs_hook=each_once)
    except ValueError:
        return False
    return True


def each_once(pairs: list[tuple[str, object]]) -> dict[str, object]:
    if len({key for key, _ in pairs}) < len(pairs):
        raise ValueError("a key twice")
    return dict(pairs)


def is_ours(text: str) -> bool:
    try:
        parsed(text, "x.json")
    except InputError:
        return False
    return True
