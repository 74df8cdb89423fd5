"""Broken ROS 2 trajectories are refused with their line."""

from collections.abc import Callable

import pytest
from builders.stream_jobs import edited, timed_job, with_line_twice, without_line

from cellplan.errors import InputError
from cellplan.programs.formats.ros2.reader import read_ros2
from cellplan.programs.formats.ros2.writer import render_ros2

FILE = "gamma.yaml"  # two joints, 51 points
JOB = timed_job(end=0.6, cycle=0.012, seed=2, robots=("gamma",))
FILES = render_ros2(JOB)
TEXT = FILES[FILE]
LINES = TEXT.splitlines()
NAMES = LINES.index('joint_names: ["gamma/tilt", "gamma/turn"]') + 1
FIRST, LAST = NAMES + 2, len(LINES) - 1
MIDDLE = (FIRST + LAST) // 2


def read(text: str) -> None:
    read_ros2(JOB.frame, {**FILES, FILE: text})


def at(line: int, change: Callable[[str], str]) -> str:
    """The text with one line changed."""
    lines = TEXT.splitlines(keepends=True)
    lines[line - 1] = change(lines[line - 1])
    return "".join(lines)


REPLACED = [  # in a point in the middle
    ("  - {", "  -{"),
    ("  - {", "   - {"),
    ("  - {", "  {"),
    ("  - {", "  * {"),
    ("  - {", "\t- {"),
    ("- {", "- "),
    ("}}", "}"),
    ("}}", "}}}"),
    ("}}", "}} x"),
    ("}}", "}}# x"),
    ("positions", "position"),
    ("positions", "Positions"),
    ("positions:", "positions"),
    ("positions: ", "positions:"),
    ("velocities", "speeds"),
    ("velocities: [", "effort: [0.0], velocities: ["),
    ("time_from_start", "time"),
    ("sec:", "secs:"),
    ("sec: 0", "sec: -1"),
    ("sec: 0", "sec: 0.0"),
    ("sec: 0", "sec: 00"),
    ("sec: 0", "sec: 0x0"),
    ("nanosec: ", "nanosec: 1e"),
    ("nanosec: ", "nanosec: 1000000000"),
    ("nanosec: ", "nanosec: -"),
    (", nanosec", " nanosec"),
    ("], vel", "] vel"),
    ("], vel", ", vel"),
    ("], vel", "0], vel"),
    ("], vel", "e0], vel"),
    ("], vel", ", 0.000000000], vel"),
    ("positions: [", "positions: [0.000000000, "),
    ("positions: [", "positions: [nan, "),
    ("positions: [", "positions: [.inf, "),
    ("positions: [", "positions: [+"),
    ("positions: [", "positions: ['"),
    ("positions: [", "positions: [0"),
    ("positions: [", "positions: [12345678"),
    ("velocities: [", "velocities: [1"),
    ("velocities: [", "velocities: [-0.000000000, "),
    ("positions: [", "positions: [-0.000000000, "),
    (".", ","),
    (".", ""),
    (", ", "; "),
    ("sec: 0", "sec: 0, sec: 0"),
    ("positions", "p\u00f6sitions"),
    ("positions", "positions\x00"),
    ("positions", "positions\u2028"),
    ("\n", "\r\n"),
    ("\n", " ...\n"),
]


@pytest.mark.parametrize(("old", "new"), REPLACED)
def test_a_broken_point_is_refused(old: str, new: str) -> None:
    text = at(MIDDLE, lambda line: line.replace(old, new, 1))
    assert text != TEXT

    with pytest.raises(InputError, match=rf"^gamma\.yaml:{MIDDLE}: expected "):
        read(text)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("joint_names", "joints"),
        ("joint_names: ", "joint_names:"),
        ('"gamma/tilt"', "gamma/tilt"),
        ('"gamma/tilt"', '"tilt"'),
        ('"gamma/tilt"', '"gamma/Tilt"'),
        ('"gamma/tilt", ', ""),
        ('"gamma/tilt", "gamma/turn"', '"gamma/turn", "gamma/tilt"'),
        ('"gamma/turn"', '"gamma/turn", "gamma/third"'),
        ("]", ""),
        ("joint_names", "header: {}\njoint_names"),
        ("joint_names", "- joint_names"),
    ],
)
def test_other_joints_are_refused(old: str, new: str) -> None:
    text, line = edited(TEXT, old, new)

    with pytest.raises(InputError, match=rf"^gamma\.yaml:{line}: expected joint_names: "):
        read(text)


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        pytest.param("", 1, "an ended last line, got the end of the file; it is truncated", id="nothing"),
        pytest.param("\n", 1, "'...' at the end, got the end of the file; it is truncated", id="an empty line"),
        pytest.param(TEXT[: len(TEXT) // 2], None, "an ended last line", id="half of it"),
        pytest.param(without_line(TEXT, LAST + 1), LAST, "'...' at the end", id="no end of the document"),
        pytest.param(without_line(TEXT, NAMES), NAMES, "joint_names", id="no names"),
        pytest.param(without_line(TEXT, NAMES + 1), NAMES + 1, "points:", id="no key of points"),
        pytest.param(with_line_twice(TEXT, NAMES), NAMES + 1, "points:", id="names twice"),
        pytest.param(with_line_twice(TEXT, NAMES + 1), NAMES + 2, "a point of 2 joints", id="key of points twice"),
        pytest.param(
            with_line_twice(TEXT, MIDDLE), MIDDLE + 1, "a later time than that of the point", id="point twice"
        ),
        pytest.param(without_line(TEXT, FIRST), FIRST, "the first point at 0", id="no first point"),
        pytest.param(TEXT + "points:\n", LAST + 2, "nothing after '...'", id="more after the end"),
        pytest.param(TEXT + TEXT, LAST + 1 + NAMES, "nothing after '...'", id="twice"),
        pytest.param(TEXT.replace("\n", "\r\n", 5), 1, "printable ASCII characters", id="two kinds of line end"),
        pytest.param(
            "\n".join([*LINES[: FIRST - 1], LINES[FIRST - 1], "...", ""]), FIRST + 1, "2 points or more", id="one point"
        ),
        pytest.param(
            at(LAST, lambda line: line.replace("velocities: [0.000000000", "velocities: [0.000000001")),
            LAST,
            "velocities of zero at the last point",
            id="moves at the end",
        ),
        pytest.param(
            at(FIRST, lambda line: line.replace("velocities: [0.000000000", "velocities: [0.000000001")),
            FIRST,
            "velocities of zero at the first point",
            id="moves at the begin",
        ),
        pytest.param(
            at(FIRST, lambda line: line.replace("nanosec: 0", "nanosec: 5")), FIRST, "the first point at 0", id="late"
        ),
    ],
)
def test_a_broken_file_is_refused(text: str, line: int | None, message: str) -> None:
    with pytest.raises(InputError) as refusal:
        read(text)

    where = f"gamma.yaml:{'' if line is None else line}"
    assert str(refusal.value).startswith(where)
    assert f": expected {message}" in str(refusal.value)


def test_a_missing_file_and_one_too_many_are_refused() -> None:
    with pytest.raises(InputError, match=r"^gamma\.yaml:1: expected a file of the export, got none"):
        read_ros2(JOB.frame, {path: text for path, text in FILES.items() if path != FILE})
    with pytest.raises(InputError, match=r"^delta\.yaml:1: expected no such file"):
        read_ros2(JOB.frame, {**FILES, "delta.yaml": TEXT})


def test_robots_on_different_clocks_are_refused() -> None:
    job = timed_job(end=0.6, cycle=0.012, seed=2)
    late = at(MIDDLE, lambda line: line.replace("000000}}", "000001}}"))

    with pytest.raises(InputError, match=r"^gamma\.yaml:1: expected points at the same times as in alpha\.yaml"):
        read_ros2(job.frame, {**render_ros2(job), FILE: late})


SPLIT = timed_job(end=1.2, cycle=0.012, seed=2, rests=(0.6,), split=60)
PARTS = render_ros2(SPLIT)


def test_a_missing_part_is_refused() -> None:
    for gone in ("gamma_1_of_2.yaml", "gamma_2_of_2.yaml"):
        with pytest.raises(InputError, match=rf"^{gone}:1: expected a file of the export, got none"):
            read_ros2(SPLIT.frame, {path: text for path, text in PARTS.items() if path != gone})


def test_a_part_that_begins_elsewhere_is_refused() -> None:
    other = {**PARTS, "gamma_2_of_2.yaml": PARTS["gamma_1_of_2.yaml"]}

    with pytest.raises(InputError, match=r"^gamma_2_of_2\.yaml:[0-9]+: expected the last point of the part before"):
        read_ros2(SPLIT.frame, other)
