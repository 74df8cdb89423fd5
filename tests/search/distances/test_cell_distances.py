"""Distances of layouts against scenes built from the changed cells, and their derivatives against differences."""

import numpy as np
import pytest
from search.distances.conftest import SomeVariables

from cellplan.geometry.transforms import Array
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances

WITHIN = 0.08
STEP = 1e-5
DEEP = 0.03


@pytest.fixture(scope="module")
def distances(scene: Scene, variables: SomeVariables) -> CellDistances:
    return CellDistances.of(scene, variables)


@pytest.fixture(scope="module")
def x(variables: SomeVariables) -> Array:
    return variables.given + np.random.default_rng(3).uniform(-0.03, 0.03, len(variables.given))


@pytest.fixture(scope="module")
def q(variables: SomeVariables) -> Array:
    start = np.concatenate([robot.start for robot in variables.cell.robots if robot.start is not None])
    return start + np.random.default_rng(0).uniform(-0.1, 0.1, (3, len(start)))


def test_distances_are_those_of_a_scene_built_from_the_changed_cell(
    distances: CellDistances, variables: SomeVariables, x: Array, q: Array
) -> None:
    near = distances.near(x, q, WITHIN)
    built = Scene.from_cell(variables.placed(x))
    result = built.near(q, WITHIN)
    rules = {built.names(pair): pair.rule for pair in built.pairs}
    expected = {
        (built.names(built.pairs[row]), k): d
        for row, k, d in zip(result.rows.tolist(), result.samples.tolist(), result.distances, strict=True)
    }
    known = {
        (distances.pairs[row].names, k): d
        for row, k, d in zip(near.rows.tolist(), near.samples.tolist(), near.distances, strict=True)
        if row < len(built.pairs)
    }
    assert len(known) > 30
    for key, distance in known.items():
        if distance > -DEEP:  # a deeper overlap has no one way out
            assert expected[key] == pytest.approx(distance, abs=2.5e-3 if rules[key[0]] is Rule.PROCESS else 1e-6)
    once = {pair.names for pair in distances.pairs if pair.is_fixed}
    fixed = {pair.names for pair in distances.pairs if pair.within_robot and pair.is_fixed}
    missed = {key for key in expected if key not in known and key[0] not in fixed and not (key[1] and key[0] in once)}
    assert {rules[names] for names, _ in missed} <= {Rule.PROCESS}


def test_derivatives_are_those_of_differences(
    distances: CellDistances, variables: SomeVariables, x: Array, q: Array
) -> None:
    n, nq = len(x), q.shape[1]
    dq = np.random.default_rng(5).normal(size=(len(q), nq, n))
    near = distances.near(x, q, WITHIN)
    exact = distances.derivatives(near, x, dq)
    result = np.full_like(exact, np.nan)
    keys = list(zip(near.rows.tolist(), near.samples.tolist(), strict=True))
    for j, unit in enumerate(np.eye(n)):
        sides = []
        for sign in (1.0, -1.0):
            side = distances.near(x + sign * STEP * unit, q + sign * STEP * dq[..., j], 2.0 * WITHIN)
            sides.append(
                dict(zip(zip(side.rows.tolist(), side.samples.tolist(), strict=True), side.distances, strict=True))
            )
        result[:, j] = [(sides[0][key] - sides[1][key]) / (2.0 * STEP) for key in keys]
    is_close = np.abs(result - exact) < 1e-3 * (1.0 + np.abs(result))
    assert is_close.mean() > 0.95  # where faces or edges are parallel any of their nearest points may count
    shapes = is_close[:, -4:]
    assert shapes.mean() > 0.95
    assert np.abs(exact[:, -4:]).max() > 0.1
