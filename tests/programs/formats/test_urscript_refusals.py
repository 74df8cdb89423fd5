"""Broken URScript programs are refused with their line."""

from dataclasses import replace

import pytest
from builders.export_jobs import job_of
from builders.stream_jobs import smooth_program, ur_cell, with_line_twice, without_line

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise
from cellplan.programs.formats.urscript.reader import read_urscript
from cellplan.programs.formats.urscript.writer import render_urscript

FILE = "beta.script"


def sequence() -> ExportJob:
    """Two arms that meet at three rows; rows before and after the last one are blended."""
    cell = ur_cell(robots=2)
    program = smooth_program(cell, cycle=0.1, end=1.6)
    rows = {name: replace(robot, marks=(0, 4, 10)) for name, robot in program.robots.items()}
    return job_of(cell, ProgramRows(name=None, robots=rows), promise=Promise.SEQUENCE_ONLY, blend=0.5, robots=("beta",))


def timed() -> ExportJob:
    """An arm that follows 101 rows."""
    cell = ur_cell(robots=2)
    return job_of(cell, smooth_program(cell, cycle=0.008, end=0.8), promise=Promise.TIMED, robots=("beta",))


JOBS = {"sequence": sequence(), "timed": timed()}
FILES = {kind: render_urscript(job) for kind, job in JOBS.items()}
TEXTS = {kind: files[FILE] for kind, files in FILES.items()}


def line_of(kind: str, begin: str, nth: int = 0) -> int:
    """Line of the n-th instruction that begins so, from 1."""
    lines = TEXTS[kind].splitlines()
    return [k for k, line in enumerate(lines, start=1) if line.strip().startswith(begin)][nth]


def refused_at(kind: str, text: str) -> tuple[int, str]:
    """Line and text of a refusal."""
    with pytest.raises(InputError) as caught:
        read_urscript(JOBS[kind].frame, {**FILES[kind], FILE: text})
    file, line, message = str(caught.value).split(":", 2)
    assert file == FILE
    assert message.startswith(" expected ")
    return int(line), message


def changed(kind: str, line: int, old: str, new: str) -> str:
    lines = TEXTS[kind].splitlines(keepends=True)
    assert old in lines[line - 1]
    lines[line - 1] = lines[line - 1].replace(old, new, 1)
    return "".join(lines)


NUMBERS = [
    ("[", "[0.000000000, "),
    ("[", "[nan, "),
    ("[", "[2"),
    ("[", "[+"),
    ("[", "[["),
    ("[", "("),
    ("[", "p["),
    ("[", "d2r(["),
    (", ", "; "),
    (", ", " "),
    (".", ","),
    (".", ""),
    (".", ".0"),
    ("]", ""),
    ("]", "e0]"),
    ("]", "*1]"),
    ("]", "0]"),
    ("]", "], 0"),
    ("\n", ";\n"),
    ("\n", " x\n"),
    ("\n", "\\\n"),
    ("\n", "\r\n"),
    (")", ""),
    (")", "))"),
    ("(", ""),
]
SERVO = [
    ("servoj", "servoJ"),
    ("servoj", "servoc"),
    ("servoj", "movej"),
    ("servoj", "end servoj"),
    ("t=0.008", "t=0.002"),
    ("t=0.008", "t=8"),
    ("t=0.008, ", ""),
    ("a=0", "a=1"),
    ("lookahead_time=0.100", "lookahead_time=0.010"),
    ("lookahead_time=0.100", "lookahead=0.100"),
    ("gain=300", "gain=3000"),
    ("gain=300", "gain=300, gain=300"),
    (", gain=300", ""),
]
MOVE = [
    ("movej", "MoveJ"),
    ("movej", "movel"),
    ("movej", "x = movej"),
    ("a=20.000", "a=0.000"),
    ("a=20.000", "a=200.000"),
    ("a=20.000", "a=-1.000"),
    ("a=20.000, ", ""),
    (", v=", ", v=-"),
    (", v=", ", v=9"),
    (", v=", ", t="),
    (", v=", ", r=0.0100, v="),
    (", v=", ", w="),
    ("r=", "r=-"),
    ("r=", "r=1"),
    ("r=", "r=0.0, r="),
]


@pytest.mark.parametrize(("old", "new"), [*NUMBERS, *SERVO])
def test_a_broken_servoj_is_refused(old: str, new: str) -> None:
    line = line_of("timed", "servoj", 30)

    number, _ = refused_at("timed", changed("timed", line, old, new))

    assert number == line


@pytest.mark.parametrize(("old", "new"), [*NUMBERS, *MOVE])
def test_a_broken_movej_is_refused(old: str, new: str) -> None:
    lines = TEXTS["sequence"].splitlines()
    line = next(k for k, text in enumerate(lines, start=1) if ", r=" in text)

    number, _ = refused_at("sequence", changed("sequence", line, old, new))

    assert number == line


@pytest.mark.parametrize(
    ("begin", "nth", "old", "new", "later"),
    [
        ("def", 0, "beta", "alpha", 0),
        ("def", 0, "beta", "Beta", 0),
        ("def", 0, "()", "(x)", 0),
        ("def", 0, ":", "", 0),
        ("def", 0, "def", "thread", 0),
        ("set", 0, "False", "True", 0),
        ("set", 0, "(1", "(2", 0),
        ("set", 1, "True", "False", 0),
        ("set", 1, "True", "true", 0),
        ("set", 1, "(1", "(0", 0),
        ("set", 1, "standard", "configurable", 0),
        ("set", 2, "False", "True", 0),
        ("while", 0, "not ", "", 0),
        ("while", 0, "(0)", "(1)", 0),
        ("while", 0, "while", "if", 0),
        ("while", 0, ":", "", 0),
        ("while", 0, "_in", "_out", 0),
        ("while", 1, "while ", "while not ", 0),
        ("sync", 0, "sync()", "sleep(0.1)", 0),
        ("sync", 0, "sync()", "sync", 0),
        ("end", 0, "end", "End", 0),
        ("end", -1, "end", "END", 0),
        ("end", -1, "end", "end end", 0),
        ("movej", 0, "v=0.250", "v=0.251", 0),
        ("movej", 0, "a=0.500", "a=5.000", 0),
        ("movej", 4, ")", ", r=0.0100)", 1),
        ("movej", -1, ")", ", r=0.0100)", 0),
    ],
)
def test_a_broken_sequence_is_refused(begin: str, nth: int, old: str, new: str, later: int) -> None:
    line = line_of("sequence", begin, nth)

    number, _ = refused_at("sequence", changed("sequence", line, old, new))

    assert number == line + later


@pytest.mark.parametrize("nth", range(14))
def test_a_handshake_with_an_instruction_missing_or_twice_is_refused(nth: int) -> None:
    first = line_of("sequence", "set", 0)
    others = [first, *(line_of("sequence", "set", 1) + k for k in range(8))]
    line = others[nth % len(others)]
    text = without_line(TEXTS["sequence"], line) if nth % 2 else with_line_twice(TEXTS["sequence"], line)

    number, _ = refused_at("sequence", text)

    assert line <= number <= line + 2  # a second end ends the program: what follows is one too many


@pytest.mark.parametrize("kind", JOBS)
def test_a_file_cut_anywhere_is_refused(kind: str) -> None:
    text = TEXTS[kind]
    for cut in range(0, len(text), 1 + len(text) // 12):
        number, _ = refused_at(kind, text[:cut])
        assert number <= 1 + text.count("\n", 0, cut)
    lines = text.splitlines(keepends=True)
    for count in range(0, len(lines), 19):
        _, message = refused_at(kind, "".join(lines[:count]))
        assert "truncated" in message or "an instruction" in message


@pytest.mark.parametrize(
    ("kind", "text", "line"),
    [
        ("timed", TEXTS["timed"] + "beta()\n", TEXTS["timed"].count("\n") + 1),
        ("timed", TEXTS["timed"] + TEXTS["timed"], None),
        ("timed", without_line(TEXTS["timed"], line_of("timed", "stopj")), line_of("timed", "stopj")),
        ("timed", with_line_twice(TEXTS["timed"], line_of("timed", "stopj")), line_of("timed", "stopj") + 1),
        ("timed", with_line_twice(TEXTS["timed"], line_of("timed", "movej")), line_of("timed", "movej") + 1),
        ("timed", without_line(TEXTS["timed"], line_of("timed", "movej")), line_of("timed", "movej")),
        ("timed", without_line(TEXTS["timed"], line_of("timed", "def")), line_of("timed", "def")),
        ("timed", changed("timed", line_of("timed", "stopj"), "stopj(", "stopj(1"), line_of("timed", "stopj")),
        ("timed", changed("timed", line_of("timed", "stopj"), "stopj", "stopl"), line_of("timed", "stopj")),
        ("timed", changed("timed", line_of("timed", "servoj"), "servoj", "popup(\u201cx\u201d)\n  servoj"), None),
        ("sequence", TEXTS["timed"], line_of("timed", "movej")),
        ("timed", TEXTS["sequence"], line_of("sequence", "set")),
    ],
)
def test_other_programs_are_refused(kind: str, text: str, line: int | None) -> None:
    number, _ = refused_at(kind, text)

    assert line is None or number in {line, line + 1}


def test_positions_beyond_two_turns_are_refused_with_their_line() -> None:
    line = line_of("timed", "servoj", 10)
    lines = TEXTS["timed"].splitlines()
    number = lines[line - 1].partition("[")[2].partition(",")[0]

    result, message = refused_at("timed", changed("timed", line, number, "12.566370615"))

    assert result == line
    assert message == " expected joint a1 within two turns, got 12.566371 rad"


def test_files_are_those_of_the_robots() -> None:
    frame, files = JOBS["timed"].frame, FILES["timed"]

    with pytest.raises(InputError, match=r"^beta\.script:1: expected a file of the export, got none"):
        read_urscript(frame, {})
    with pytest.raises(InputError, match=r"^gamma\.script:1: expected no such file"):
        read_urscript(frame, {**files, "gamma.script": TEXTS["timed"]})
