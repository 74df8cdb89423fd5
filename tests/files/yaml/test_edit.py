"""Edits in place: the text reads as the edited values, and everything else in it stays."""

import pytest

from cellplan.files.yaml.edit import REMOVED, edited_text
from cellplan.files.yaml.reader import parse_yaml

TEXT = """\
# the head
name: one   # a name
base: {xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 0]}
list:
  - {a: 1, b: 2}   # stays
  - {a: 3}
block:
  first: 1
  second:
    third: [ä, ö]
"""


@pytest.mark.parametrize(
    ("path", "value", "line"),
    [
        (("name",), "two", "name: two   # a name; was name: one"),
        (
            ("base", "xyz_mm"),
            (1.5, 2, 3),
            "base: {xyz_mm: [1.5, 2, 3], rpy_deg: [0, 0, 0]}  # was xyz_mm: [1, 2, 3]",
        ),
        (("list", 0, "b"), 5, "  - {a: 1, b: 5}   # stays; was b: 2"),
        (("list", 1, "c"), {"d": 1}, "  - {a: 3, c: {d: 1}}"),
        (("list", 0, "a"), REMOVED, "  - {b: 2}   # stays"),
        (("block", "new"), True, "  new: true  # new"),
        (("block", "first"), REMOVED, "# removed:   first: 1"),
        (("block", "second"), 7, "  second: 7  # was second: third: [ä, ö]"),
        (("top",), "x", "top: x  # new"),
    ],
)
def test_an_edit_changes_one_line_and_the_text_reads_as_the_new_values(path, value, line):  # type: ignore[no-untyped-def]
    before = parse_yaml(TEXT.encode(), file="x").root

    text = edited_text(TEXT, {path: value})

    assert line in text.splitlines()
    unchanged = [line for line in TEXT.splitlines() if line in text.splitlines()]
    assert len(unchanged) >= len(TEXT.splitlines()) - 2
    node = parse_yaml(text.encode(), file="x").root
    for step in path[:-1]:
        node, before = node[step], before[step]
    assert (path[-1] not in node) if value is REMOVED else (node[path[-1]] == value)
    assert {key: value for key, value in node.items() if key != path[-1]} == {
        key: value for key, value in before.items() if key != path[-1]
    }


def test_edits_at_one_place_go_from_the_innermost_mapping_outwards() -> None:
    text = edited_text(TEXT, {("top",): 1, ("block", "second", "fourth"): 2, ("block", "last"): 3})

    assert text.splitlines()[-3:] == ["    fourth: 2  # new", "  last: 3  # new", "top: 1  # new"]
