"""What a survey ranks, and which bounds it raises: the same as looking at every pair each time."""

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies

from cellplan.certify import bound
from cellplan.certify import certify as search
from cellplan.certify.certify import certify
from cellplan.certify.pair_state import SEARCH_TOL
from cellplan.certify.survey import CLOSEST_COUNT, Survey
from cellplan.geometry.transforms import Array
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.collision.distance import APART_TOL
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene


def wandering(scene: Scene, samples: int) -> Array:
    rng = np.random.default_rng(5)
    steps = rng.normal(scale=0.01, size=(samples, scene.cell.joint_count))
    return rng.uniform(-1.0, 1.0, scene.cell.joint_count) + np.cumsum(steps, axis=0)


def cutoff_by_definition(known: Array, scene: Scene, row: int) -> float:
    """The last of the closest of all other pairs, or the nearest of the class, whichever is farther."""
    watched = np.array([pair.rule is Rule.CLEARANCE for pair in scene.pairs])
    kinds = np.array([pair.clearance_class for pair in scene.pairs])
    if not watched[row]:
        return APART_TOL
    others = np.sort(known[watched & (np.arange(len(known)) != row)])
    last = others[CLOSEST_COUNT - 1] if len(others) >= CLOSEST_COUNT else np.inf
    return max(APART_TOL, max(known[kinds == kinds[row]].min(), last) - SEARCH_TOL)


def test_cutoffs_are_those_of_the_definition_whatever_is_found() -> None:
    scene = Scene.from_cell(cell_with_bodies(1))
    seen = Survey(scene, wandering(scene, 20))
    known = np.full(len(scene.pairs), np.inf)
    rng = np.random.default_rng(6)

    for row in rng.integers(len(scene.pairs), size=25).tolist():
        distance = float(rng.choice([0.01, 0.02, rng.uniform()]))
        if rng.uniform() < 0.05:
            seen.states[row].note_touches([1.0])
        seen.note_distance(row, distance, 0.0)
        if seen.states[row].touches:
            known[row] = 0.0
        elif scene.pairs[row].rule is Rule.CLEARANCE:
            known[row] = seen.states[row].distance
        cutoffs = [seen.cutoff(row) for row in range(len(scene.pairs))]
        assert cutoffs == [cutoff_by_definition(known, scene, row) for row in range(len(scene.pairs))]
        assert seen.largest_cutoff() >= max(cutoffs)


@pytest.mark.parametrize("seed", [2, 3])
def test_pairs_worked_on_few_at_a_time_give_the_same_bounds(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene.from_cell(cell_with_bodies(seed))
    q = wandering(scene, 400)
    at_once = certify(scene, q)

    for module in (bound, search):
        monkeypatch.setattr(module, "ROWS_AT_ONCE", 7)
    monkeypatch.setattr(search, "PAIR_WORK", 600)
    in_pieces = certify(scene, q)

    assert np.array_equal(in_pieces.low, at_once.low)
    for kind in ClearanceClass:
        rows = [pair.row for pair in at_once.of_class(kind)]
        lowest = in_pieces.lowest_bounds(in_pieces.of_class(kind))
        assert np.array_equal(lowest, at_once.low[rows].min(axis=0, initial=np.inf))
