"""Which jobs a search can judge, and what is said of the others."""

from pathlib import Path

import pytest

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.search.synchronous import is_searchable, refuse_other_methods

CELL = Path(__file__).resolve().parents[2] / "cells" / "planar_pair.yaml"


@pytest.mark.parametrize(
    ("values", "is_known"),
    [
        ({}, True),
        ({"program": {}}, True),
        ({"program": {}, "motion.timing": "fastest"}, True),
        ({"motion.timing": "fastest"}, False),
        ({"motion.mode": "pairwise"}, False),
        ({"program": {}, "motion.cyclic": True}, False),
    ],
)
def test_programs_are_searched_and_single_motions_only_as_they_are_written(
    values: dict[str, object], is_known: bool
) -> None:
    assert is_searchable(load_cell(CELL).with_values(values)) == is_known


def test_a_timing_that_is_not_known_is_named_with_what_is_expected() -> None:
    cell = load_cell(CELL).with_values({"motion.timing": "fastest"})

    with pytest.raises(InputError, match=r"motion\.timing: expected as_written for a map, got 'fastest'"):
        refuse_other_methods(cell, "a map")
