"""JSON is read back strictly: what the program did not write is refused, and the place is named."""

import pytest

from cellplan.errors import InputError
from cellplan.files.input.json_reader import parse_json, required


def test_an_object_reads_as_it_was_written() -> None:
    assert parse_json(b'{"a": [1, 2.5, null], "b": {"c": "\xc3\xa9"}}', "r.json") == {
        "a": [1, 2.5, None],
        "b": {"c": "é"},
    }


@pytest.mark.parametrize(
    ("data", "finding"),
    [
        (b'{"a": 1, "a": 2}', "r.json: key 'a' stands twice"),
        (b'{"a": NaN}', "r.json: expected finite numbers, got NaN"),
        (b'{"a": -Infinity}', "r.json: expected finite numbers, got -Infinity"),
        (b"[1]", "r.json: expected a JSON object, got a list of 1"),
        (b'{\n"a": 1,\n}', "r.json:3: expected JSON: "),
        (b'{\n"a": "\xff"}', "r.json:2: expected text in UTF-8, got byte 0xff"),
        (b"", "r.json:1: expected JSON: "),
        (b'{"a":' * 100_000, "r.json: expected JSON of a few levels, got a deeply nested one"),
    ],
)
def test_anything_else_is_refused(data: bytes, finding: str) -> None:
    with pytest.raises(InputError) as refusal:
        parse_json(data, "r.json")

    assert str(refusal.value).startswith(finding)


@pytest.mark.parametrize(
    ("record", "finding"),
    [
        ({}, "r.json: n: missing"),
        ({"n": "1"}, "r.json: n: expected a whole number, got '1'"),
        ({"n": True}, "r.json: n: expected a whole number, got true"),
    ],
)
def test_a_required_value_has_its_type(record: dict[str, object], finding: str) -> None:
    with pytest.raises(InputError) as refusal:
        required(record, "n", int, file="r.json")

    assert str(refusal.value) == finding
