"""Joint tables: what is written is what is read, and nothing else is accepted."""

import contextlib
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.files.run.joint_tables import (
    DECIMALS,
    TableHeader,
    other_header_line,
    parse_header,
    parse_table,
    program_digest,
    render_table,
    replace_header,
    table_body,
)
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel

HEADER = TableHeader(cell="bench", mode="simultaneous", verdict="passed", digests={"cell": "ab12", "program": "cd34"})
CAUTION = (
    "# offline result: run first at reduced speed; not a safety function; the risk assessment stays with the integrator"
)


def robot_with(*names: str, kinds: str = "") -> Robot:
    joints = tuple(
        Joint(
            name=name,
            kind=JointKind.PRISMATIC if kind == "p" else JointKind.REVOLUTE,
            parent=index - 1,
            axis_B=np.array([0.0, 0.0, 1.0]),
            point_B=np.zeros(3),
            lower=-10.0,
            upper=10.0,
            velocity=1.0,
        )
        for index, (name, kind) in enumerate(zip(names, kinds or "r" * len(names), strict=True))
    )
    model = RobotModel(name="m", source="", joints=joints, flange_link=BASE, X_BF=np.eye(4), bodies=())
    tool = Tool(X_FT=np.eye(4), bodies=())
    return Robot(name="arm", model=model, X_WB=np.eye(4), tool=tool, start=None, weights=np.ones(len(joints)))


def rendered(q: Array, kinds: str = "") -> str:
    robot = robot_with(*(f"a{i + 1}" for i in range(q.shape[1])), kinds=kinds)
    return render_table(robot, 0.001 * np.arange(len(q)), q, header=HEADER)


TEXT = rendered(np.deg2rad([[0.0, 10.0], [1.5, -20.25], [3.0, 0.00000125], [4.5, 0.0], [6.0, 1.0]]))


def test_table_reads_as_plain_text() -> None:
    robot = robot_with("rail", "a1", kinds="pr")
    q = np.array([[0.5, np.deg2rad(-12.5)], [0.50025, -0.0], [0.5005, np.deg2rad(1e-7)]])
    text = render_table(robot, np.array([0.0, 0.001, 0.002]), q, header=HEADER)
    assert text == (
        "# cellplan joint table v1\n"
        "# robot: arm\n"
        "# cell: bench\n"
        "# mode: simultaneous\n"
        "# cell digest: sha256 ab12\n"
        "# program digest: sha256 cd34\n"
        "# verdict: passed\n"
        f"{CAUTION}\n"
        "time_s,rail_mm,a1_deg\n"
        "0.0,500.0,-12.5\n"
        "0.001,500.25,0.0\n"
        "0.002,500.5,0.0000001\n"
    )


@given(st.lists(st.floats(-7.0, 7.0), min_size=2, max_size=30))
def test_numbers_read_back_to_the_value_that_was_written(values: list[float]) -> None:
    q = np.array(values)[:, None]
    table = parse_table(rendered(q), "arm.csv")
    quantum = np.deg2rad(10.0**-DECIMALS)
    # half a quantum of rounding, and two roundings of the conversion between radians and degrees
    assert np.all(np.abs(table.q - q) <= 0.5 * quantum + 4 * np.spacing(np.abs(q)))
    assert rendered(table.q) == rendered(q), "what was read back is written again as the same text"


@given(st.lists(st.floats(-5.0, 5.0), min_size=2, max_size=30))
def test_lengths_read_back_to_the_value_that_was_written(values: list[float]) -> None:
    text = rendered(np.array(values)[:, None], kinds="p")
    assert rendered(parse_table(text, "arm.csv").q, kinds="p") == text


@given(st.floats(-1e3, 1e3), st.integers(-15, 0))
def test_no_number_has_an_exponent_or_a_negative_zero(value: float, power: int) -> None:
    q = np.array([[value * 10.0**power], [-0.0]])
    for field in table_body(rendered(q)).split()[1:]:
        assert re.fullmatch(r"[0-9.]+,-?[0-9]+\.[0-9]+", field)
        assert not re.search(r",-0\.0+$", field)


def test_a_joint_at_its_limit_in_degrees_stays_exactly_there() -> None:
    limits = np.deg2rad(np.array([[-185.0, 170.0], [35.7, 0.1]]))
    assert np.array_equal(parse_table(rendered(limits), "arm.csv").q, limits)


@given(st.integers(2, 3000), st.floats(1e-5, 0.1))
def test_instants_read_back_exactly(count: int, step: float) -> None:
    times = step * np.arange(count)
    text = render_table(robot_with("a1"), times, np.zeros((count, 1)), header=HEADER)
    assert np.array_equal(parse_table(text, "arm.csv").times, times)
    assert "e" not in table_body(text).partition("\n")[2]


def test_header_can_be_replaced_without_touching_the_rows() -> None:
    rejected = TableHeader(cell="bench", mode="pairwise", verdict="REJECTED: arm a1\n0.0,9", digests={})
    text = replace_header(TEXT, header=rejected)
    assert table_body(text) == table_body(TEXT)
    assert parse_header(text, "arm.csv").verdict == "REJECTED: arm a1 0.0,9"
    assert parse_table(text, "arm.csv").robot == "arm"


def test_header_reads_back() -> None:
    assert parse_header(TEXT, "arm.csv") == HEADER


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("# cell: bench\n", "# cell: bench\n# note: safe at full speed\n", 4),
        ("# mode: simultaneous\n# cell digest", "# cell digest", None),
        ("# verdict: passed\n", "# verdict: passed\n# verdict of others: passed\n", 8),
        ("# robot: arm\n# cell: bench\n", "# cell: bench\n# robot: arm\n", 2),
        ("# robot: arm\n", "# robot:  arm\n", 2),
    ],
)
def test_a_header_line_that_is_not_written_there_is_found(old: str, new: str, line: int | None) -> None:
    assert old in TEXT
    if line is None:
        with pytest.raises(InputError, match="mode"):
            other_header_line(TEXT.replace(old, new, 1), "arm.csv")
    else:
        assert other_header_line(TEXT.replace(old, new, 1), "arm.csv") == line
    assert other_header_line(TEXT, "arm.csv") is None


def test_a_remark_stands_before_the_verdict_and_reads_back() -> None:
    header = TableHeader(cell="bench", mode="pairwise", verdict="passed", digests={}, remark="corrected by hand")

    text = replace_header(TEXT, header=header)

    assert "# remark: corrected by hand\n# verdict: passed\n" in text
    assert parse_header(text, "t.csv") == header
    assert table_body(text) == table_body(TEXT)


def test_program_digest_depends_on_the_rows_and_not_on_the_header() -> None:
    other_header = replace_header(TEXT, header=TableHeader(cell="x", mode="y", verdict="z", digests={}))
    assert program_digest({"arm": TEXT}) == program_digest({"arm": other_header})
    assert program_digest({"arm": TEXT}) != program_digest({"arm": TEXT.replace("10.0", "10.1")})


def test_table_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"table of 'arm': expected shape \(3, 2\), got \(3, 1\)"):
        render_table(robot_with("a1", "a2"), np.arange(3.0), np.zeros((3, 1)), header=HEADER)


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e12])
def test_number_that_means_nothing_is_never_written(value: float) -> None:
    with pytest.raises(ValueError, match="not finite or absurdly large"):
        rendered(np.array([[0.0], [value]]))


@pytest.mark.parametrize("name", ["a,b", "a b", "a\nb", '"a"', "#a"])
def test_joint_name_that_would_break_the_table_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="cannot stand in a joint table"):
        render_table(robot_with(name), np.arange(2.0), np.zeros((2, 1)), header=HEADER)


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        (
            "table v1",
            "table v2",
            "t.csv:1: expected the line '# cellplan joint table v1', got '# cellplan joint table v2'",
        ),
        ("# robot: arm\n", "", "t.csv: the header has no line '# robot: …'"),
        (
            "# cell: bench",
            "# cell bench",
            "t.csv:3: expected a header line '# key: value', each key once, got '# cell bench'",
        ),
        (
            "# cell: bench",
            "# robot: two",
            "t.csv:3: expected a header line '# key: value', each key once, got '# robot: two'",
        ),
        (CAUTION + "\n", "", f"t.csv:7: expected the header to end with '{CAUTION}'"),
        ("time_s,", "t_s,", "t.csv:9: expected the column names 'time_s,<joint>_deg,…', got 't_s,a1_deg,a2_deg'"),
        ("a2_deg", "a2_rad", "t.csv:9: column 'a2_rad': expected a joint's name with the ending _deg or _mm"),
        ("a2_deg", "a1_mm", "t.csv:9: column 'a1_mm': joint 'a1' stands twice"),
        ("-20.25", "nan", "t.csv:11: a2_deg: expected a plain decimal number such as -12.5, got 'nan'"),
        ("-20.25", "-2e1", "t.csv:11: a2_deg: expected a plain decimal number such as -12.5, got '-2e1'"),
        ("-20.25", "", "t.csv:11: a2_deg: expected a plain decimal number such as -12.5, got ''"),
        ("-20.25", " 3.0", "t.csv:11: a2_deg: expected a plain decimal number such as -12.5, got ' 3.0'"),
        ("-20.25", "1.0,2.0", "t.csv:11: expected 3 numbers, got 4"),
        ("0.002,", "0.001,", "t.csv:12: time_s: expected evenly spaced, growing times (0.002 here), got 0.001"),
        ("\n0.0,", "\n0.5,", "t.csv:10: time_s: expected the first row at 0, got 0.5"),
        ("6.0,1.0\n", "6.0,1", "t.csv: expected the last row to end with a line break; the file is cut off"),
    ],
)
def test_damaged_table_is_refused_with_its_line(old: str, new: str, finding: str) -> None:
    assert old in TEXT
    with pytest.raises(InputError) as caught:
        parse_table(TEXT.replace(old, new, 1), "t.csv")
    assert str(caught.value) == finding


@pytest.mark.parametrize("text", ["", "#", "\n", "hello", "# cellplan joint table v1", "# cellplan joint table v1\n"])
def test_text_that_is_no_table_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"^t\.csv"):
        parse_table(text, "t.csv")


def test_table_without_two_rows_is_refused() -> None:
    with pytest.raises(InputError, match=r"t\.csv: expected at least two rows of numbers, got 1"):
        parse_table("\n".join(TEXT.split("\n")[:-5]) + "\n", "t.csv")


@pytest.mark.slow
@given(st.integers(0, len(TEXT) - 1), st.characters(codec="utf-8"))
def test_one_wrong_character_never_passes_as_another_shape(position: int, char: str) -> None:
    """Any single damage either is refused by name or still gives a whole, finite table."""
    damaged = TEXT[:position] + char + TEXT[position + 1 :]
    with contextlib.suppress(InputError):
        table = parse_table(damaged, "t.csv")
        assert table.q.shape == (len(table.times), len(table.joints))
        assert np.all(np.isfinite(table.q))
