"""Strict YAML: what is read, what is refused, and where."""

import os
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.files.yaml.reader import parse_yaml, read_yaml
from cellplan.files.yaml.writer import yaml_text


def findings(text: str) -> list[str]:
    document = parse_yaml(text.encode(), file="f.yaml")
    return [str(finding.to_error("f.yaml")) for finding in document.findings]


def reported(data: bytes) -> list[str]:
    try:
        return [finding.text for finding in parse_yaml(data, file="f.yaml").findings]
    except InputError as error:
        return [str(error)]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5),
        ("+5", 5),
        ("-5", -5),
        ("0", 0),
        ("1e-3", 0.001),
        ("-.5", -0.5),
        ("5.", 5.0),
        ("1E+2", 100.0),
        ("true", True),
        ("false", False),
        ("+x", "+x"),
        ("-y", "-y"),
        ("y", "y"),
        ("n", "n"),
        ("1.2.3", "1.2.3"),
        ("'010'", "010"),
        ('"no"', "no"),
        ("'1:30'", "1:30"),
        ("'2010-01-01'", "2010-01-01"),
        ("part.stl", "part.stl"),
        ("notebook", "notebook"),
        ("infinite", "infinite"),
        ("[1, [2, a]]", (1, (2, "a"))),
        ("{b: {c: 1}}", {"b": {"c": 1}}),
    ],
)
def test_plain_values_mean_what_they_say(text: str, value: object) -> None:
    read = parse_yaml(f"a: {text}\n".encode(), file="f.yaml").root["a"]

    assert read == value
    assert type(read) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 010", "f.yaml:1: a: expected a number without leading zeros, got 010; it can be read as octal"),
        ("a: -00.5", "f.yaml:1: a: expected a number without leading zeros, got -00.5; it can be read as octal"),
        (
            "a: 1:30",
            "f.yaml:1: a: '1:30' can be read as a number to base 60; write a decimal number or put it in quotes",
        ),
        ("a: 0x1F", "f.yaml:1: a: expected a decimal number, got 0x1F; write it in tens or put it in quotes"),
        ("a: 0o17", "f.yaml:1: a: expected a decimal number, got 0o17; write it in tens or put it in quotes"),
        ("a: 0b1", "f.yaml:1: a: expected a decimal number, got 0b1; write it in tens or put it in quotes"),
        ("a: 1_000", "f.yaml:1: a: expected digits without '_', got 1_000"),
        ("a: 2010-01-01", "f.yaml:1: a: '2010-01-01' can be read as a date; put it in quotes"),
        ("a: .nan", "f.yaml:1: a: expected a finite number, got .nan"),
        ("a: -.inf", "f.yaml:1: a: expected a finite number, got -.inf"),
        ("a: NaN", "f.yaml:1: a: expected a finite number, got NaN"),
        ("a: 1e400", "f.yaml:1: a: expected a finite number, got 1e400"),
        ("a: 1e-400", "f.yaml:1: a: expected a number that can be distinguished from zero, got 1e-400"),
        ("a: no", "f.yaml:1: a: 'no' can be read as a truth value; write true or false, or put it in quotes"),
        ("a: On", "f.yaml:1: a: 'On' can be read as a truth value; write true or false, or put it in quotes"),
        ("a: TRUE", "f.yaml:1: a: 'TRUE' can be read as a truth value; write true or false, or put it in quotes"),
        ("a:", "f.yaml:1: a: expected a value, got nothing; leave the key out to use its default"),
        ("a: ~", "f.yaml:1: a: expected a value, got nothing; leave the key out to use its default"),
        ("a: null", "f.yaml:1: a: expected a value, got nothing; leave the key out to use its default"),
        ("a: !!float 1", "f.yaml:1: a: YAML tags (!) are not allowed, got 'tag:yaml.org,2002:float'"),
        ("a: !x {b: 1}", "f.yaml:1: a: YAML tags (!) are not allowed, got '!x'"),
        ("a: &b 1", "f.yaml:1: a: YAML anchors (&) are not allowed, got 'b'"),
        ("b: 1\na: [1, 2]\nb: 2", "f.yaml:3: b: duplicate key, first given in line 1"),
        ("a: {b: 1, b: {c: [2]}}", "f.yaml:1: a.b: duplicate key, first given in line 1"),
        ("a:\n  <<: {b: 1}", "f.yaml:2: a: YAML merge keys (<<) are not allowed; write the values out"),
        ("a: 1\n? [b]\n: 2", "f.yaml:2: expected a word as key, got something else"),
        ("a: 1\ntrue: 2", "f.yaml:2: expected a word as key, got true; put it in quotes"),
        (
            "a: 1\nOff: 2",
            "f.yaml:2: 'Off' can be read as a truth value; write true or false, or put it in quotes",
        ),
        ('a: "\\x07"', "f.yaml:1: a: expected printable text, got control character U+0007"),
        ('a: "\\u202e"', "f.yaml:1: a: expected printable text, got control character U+202E"),
        ('"a\\nb": 1', "f.yaml:1: expected a short word as key, got 'a\\nb'"),
        ('a: {"<b>": 1}', "f.yaml:1: a: expected a key without '<' and '>', got '<b>'"),
    ],
)
def test_what_could_mean_two_things_is_refused_where_it_stands(text: str, message: str) -> None:
    assert findings(text) == [message]


def test_on_and_off_are_keys_and_no_values() -> None:
    assert parse_yaml(b"on: {off: 1}", file="f.yaml").root == {"on": {"off": 1}}
    assert parse_yaml(yaml_text({"on": {"off": "on"}}).encode(), file="f.yaml").root == {"on": {"off": "on"}}


def test_an_alias_is_refused_and_the_rest_is_still_read() -> None:
    assert findings("a: &x [1]\nb: *x\nc: 010\n") == [
        "f.yaml:1: a: YAML anchors (&) are not allowed, got 'x'",
        "f.yaml:2: b: YAML aliases (*) are not allowed, got 'x'; write it out",
        "f.yaml:3: c: expected a number without leading zeros, got 010; it can be read as octal",
    ]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "f.yaml: expected a mapping, got an empty file"),
        (b"# only a remark\n", "f.yaml: expected a mapping, got an empty file"),
        (b"\n- 1\n", "f.yaml:2: expected a mapping (key: value) as the whole file"),
        (b"a: 1\n---\nb: 2\n", "f.yaml:2: expected one YAML document, got a second one"),
        (b"%YAML 1.1\n---\na: 1\n", "f.yaml:1: YAML directives (%) are not allowed"),
        (b"a: 1\nb:\n\t- 1\n", "f.yaml:3: not valid YAML: a tab cannot indent, use spaces"),
        (b"a: 1\nb: c: 2\n", "f.yaml:2: not valid YAML: mapping values are not allowed in this context"),
        (b"a: \xff\n", "f.yaml:1: expected UTF-8 text, got byte 0xff"),
        (b"a: 1\r\nb: \xc3\x28\r\n", "f.yaml:2: expected UTF-8 text, got byte 0xc3"),
        (b"a: 1\nb: \x00\n", "f.yaml:2: expected printable text, got control character U+0000"),
        ("a: 1\nb: x\u2028y\n".encode(), "f.yaml:2: expected printable text, got control character U+2028"),
        (b"a: " + b"[" * 40, "f.yaml:1: expected at most 32 levels, got more"),
        (b"- " * 900_000, "f.yaml:1: expected a mapping (key: value) as the whole file"),
        (b"a:\n" + b"- 1\n" * 200_001, "f.yaml:199999: expected at most 200000 values, got more"),
        (b"a: 1\n#" + b"x" * 2_000_000, "f.yaml: expected a file of at most 2 MB, got a larger one"),
    ],
)
def test_a_file_that_is_no_cell_is_refused_as_a_whole(data: bytes, message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml(data, file="f.yaml")

    assert str(caught.value) == message


def test_a_byte_order_mark_and_windows_line_ends_do_not_shift_lines() -> None:
    document = parse_yaml("\ufeffa: 1\r\nb: 2\r\n".encode(), file="f.yaml")

    assert document.root == {"a": 1, "b": 2}
    assert document.line(("b",)) == 2


def test_every_value_and_key_knows_its_line_and_column() -> None:
    document = parse_yaml(b"# remark\na:\n  b: [1,\n      2]\n  c:\n    - d: 3\n", file="f.yaml")

    assert document.values[("a",)] == (2, 1)
    assert document.values[("a", "b")] == (3, 6)
    assert document.values[("a", "b", 1)] == (4, 7)
    assert document.keys[("a", "c")] == (5, 3)
    assert document.line(("a", "c", 0, "d")) == 6
    assert document.line(("a", "nothing", "here")) == 2
    assert document.lines()["a.c[0].d"] == 6


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes in the file system")
def test_a_pipe_is_refused_without_waiting(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "cell.yaml")

    with pytest.raises(InputError, match=r"^c: expected a regular file, got a folder, a pipe or a device$"):
        read_yaml(tmp_path / "cell.yaml", file="c")


def test_a_folder_and_a_missing_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^c: expected a regular file, got a folder, a pipe or a device$"):
        read_yaml(tmp_path, file="c")
    with pytest.raises(InputError, match=r"^c: no such file$"):
        read_yaml(tmp_path / "none.yaml", file="c")


@settings(max_examples=300, deadline=None)
@given(st.one_of(st.binary(max_size=60), st.text(max_size=60).map(lambda text: text.encode("utf-8", "replace"))))
def test_no_bytes_bring_down_the_reader(data: bytes) -> None:
    assert all("\n" not in line for line in reported(data))


@settings(max_examples=300, deadline=None)
@given(st.text(alphabet="a1:-[]{},&*!|>'\"%@`?# \n0.e~<_", max_size=40))
def test_no_yaml_like_text_brings_down_the_reader(text: str) -> None:
    assert all("\n" not in line for line in reported(text.encode()))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_read_back_to_the_same_value(number: float) -> None:
    read = parse_yaml(f"a: {number!r}\n".encode(), file="f.yaml").root["a"]

    assert float(read) == number


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a: 1\nb: 'x\nc: 2\nd: 'y'\n", 2),
        ('a: "x\nb: 1\n', 1),
        ("a: {b: 1\nc: 2\n", 1),
        ("x: 1\na:\n  b: [1, 2\n  c: 3\n", 3),
        ("a: {b: {c: 1}\nd: 5\ne: 6", 1),
        ("a: [\n 1,\n 2\nb: 3\n", 1),
    ],
)
def test_what_is_left_open_is_reported_where_it_opens(text: str, line: int) -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml(text.encode(), file="f.yaml")

    assert str(caught.value).startswith(f"f.yaml:{line}: not valid YAML: ")
    assert str(caught.value).endswith("; what opens here is not closed")


@pytest.mark.parametrize(("text", "line"), [("a:\n  - {x: 1,\n     y: 2\n     z: 3}\n", 4), ("a: 1\nb: ]\n", 2)])
def test_other_slips_are_reported_where_the_parser_stumbles(text: str, line: int) -> None:
    with pytest.raises(InputError) as caught:
        parse_yaml(text.encode(), file="f.yaml")

    assert str(caught.value).startswith(f"f.yaml:{line}: not valid YAML: ")
    assert "opens here" not in str(caught.value)
