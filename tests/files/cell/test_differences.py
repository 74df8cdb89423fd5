"""Differences between cell files are exactly the values that were changed."""

from pathlib import Path

import pytest

from cellplan import load_cell
from cellplan.files.cell.differences import document_differences
from cellplan.files.cell.write import written_document


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"motion.duration_s": 3}, {"motion.duration_s": [4, 3]}),
        ({"robots.kuka.base.x_mm": 900}, {"robots.kuka.base.xyz_mm[0]": [1175, 900]}),
        (
            {"motion.mode": "pairwise", "checks.clearance_mm": 8},
            {"motion.mode": ["simultaneous", "pairwise"], "checks.clearance_mm": [5, 8]},
        ),
        ({"robots.kuka.start_deg": "auto"}, None),
        ({}, {}),
    ],
)
def test_a_change_is_found_again_and_nothing_else(cells: Path, values: dict[str, object], expected: object) -> None:
    cell = load_cell(cells / "four_robots.yaml")
    differences = document_differences([written_document(cell), written_document(cell.with_values(values))])
    if expected is None:  # a list beside a word is shown whole
        assert list(differences) == ["robots.kuka.start_deg"]
        assert len(differences["robots.kuka.start_deg"][0]) == 6
        assert differences["robots.kuka.start_deg"][1] == "auto"
    else:
        assert differences == expected


def test_what_only_some_have_is_named_once_at_its_top() -> None:
    documents = [{"tasks": {"a": {"robot": "x"}}}, {"tasks": {}}, {"tasks": {"a": {"robot": "x"}}}]
    assert document_differences(documents) == {"tasks.a": [{"robot": "x"}, None, {"robot": "x"}]}


def test_lists_and_tuples_with_the_same_entries_are_the_same() -> None:
    assert document_differences([{"a": {"b": [1, 2]}}, {"a": {"b": (1, 2)}}]) == {}
    assert document_differences([{"a": [1]}, {"a": (1, 2)}]) == {"a": [[1], [1, 2]]}
