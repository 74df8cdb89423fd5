"""Changed values of a cell: steps, and what undo and redo come back to."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.session.changes import Changes

X, YAW, WEIGHTS = "robots.pen.base.x_mm", "robots.pen.base.yaw_deg", "robots.pen.weights"
CELLS = Path(__file__).resolve().parents[2] / "cells"
PAIR = load_cell(CELLS / "two_robots.yaml")
SET = st.fixed_dictionaries({}, optional={X: st.integers(1900, 2100), YAW: st.integers(170, 190)})
WEIGHT = st.builds(lambda at, value: {f"{WEIGHTS}[{at}]": value}, st.integers(0, 5), st.integers(1, 3))
ALL = st.builds(lambda value: {WEIGHTS: [value] * 6}, st.integers(1, 3))
STEPS = st.lists(st.one_of(SET.filter(bool), WEIGHT, ALL), min_size=1, max_size=6)


def _document(changes: Changes, cell: Cell) -> Any:
    return cell.with_values(changes.values).origin.document


@given(STEPS)
def test_undo_and_redo_lead_through_the_same_cells(steps: list[dict[str, object]]) -> None:
    changes, cell = Changes(PAIR.with_values({WEIGHTS: [1] * 6})), PAIR.with_values({WEIGHTS: [1] * 6})
    documents = [cell.origin.document]
    for step in steps:
        changes.set(step)
        changes.complete()
        documents.append(_document(changes, cell))
        assert all(changes.value(address) == value for address, value in step.items())

    for document in documents[-2::-1]:
        changes.undo()
        assert _document(changes, cell) == document
    assert not changes.can_undo
    assert not changes.values
    for document in documents[1:]:
        changes.redo()
        assert _document(changes, cell) == document
    assert not changes.can_redo


def test_a_drag_is_one_step_until_it_is_complete() -> None:
    changes = Changes(PAIR)

    for x in (2001, 2002, 2003):
        changes.set({X: x})
    changes.complete()
    changes.set({X: 2010})
    changes.undo()

    assert changes.values == {X: 2003}
    changes.undo()
    assert changes.values == {}
    changes.undo()
    assert changes.values == {}


def test_what_follows_from_a_step_is_undone_and_done_again_with_it() -> None:
    changes = Changes(PAIR)
    changes.add({YAW: 185})
    assert changes.values == {}

    changes.set({X: 2001})
    changes.set({X: 2002})
    changes.complete()
    changes.add({YAW: 181, X: 2003})
    changes.add({YAW: 182})
    after = changes.values

    assert after == {X: 2003, YAW: 182}
    changes.undo()
    assert changes.values == {}
    changes.redo()
    assert changes.values == after


def test_a_new_change_ends_what_could_be_done_again() -> None:
    changes = Changes(PAIR)
    changes.set({X: 2001})
    changes.undo()

    changes.set({YAW: 181})
    changes.redo()

    assert changes.values == {YAW: 181}


def test_values_of_the_file_are_no_change_and_a_reset_can_be_undone() -> None:
    changes = Changes(PAIR)
    changes.set({X: 2000.0})
    assert changes.values == {}
    changes.complete()
    changes.set({X: 1990, YAW: 175})

    changes.reset()
    assert changes.values == {}
    changes.undo()

    assert changes.values == {X: 1990, YAW: 175}


@pytest.mark.parametrize("is_taken", [False, True])
def test_steps_at_what_another_cell_does_not_have_are_dropped(is_taken: bool) -> None:
    other = load_cell(CELLS / "planar_pair.yaml")
    changes = Changes(PAIR)
    changes.set({"motion.duration_s": 7})
    changes.set({X: 2001})

    changes.move_to(other, is_taken=is_taken)

    assert changes.values == ({} if is_taken else {"motion.duration_s": 7})
    changes.undo()
    assert changes.values == ({"motion.duration_s": 7} if is_taken else {"motion.duration_s": 4})
