"""Contacts of places asked together are those of each cell with its base there, and move with the cell."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import displaced, no_tool

from cellplan.certify.growth import signed_distances
from cellplan.geometry.transforms import Array, pose
from cellplan.jobs.base_map.prepared import PreparedMap
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene
from cellplan.search.base_map.verdicts import KEYS, PlaceContact, contacts

NODES = 9
EXACT = 1e-4  # [m] distances of the engine


@pytest.fixture(scope="module")
def swings(ready: PreparedMap) -> tuple[Array, Array]:
    """Bases of the right arm and motions that swing the arms to each other, shapes (K, 4, 4) and (K, N, nq)."""
    rng = np.random.default_rng(3)
    X_WB = np.array(
        [pose((x, 0.3, 0.5), (0.0, 0.0, np.pi + yaw)) for x, yaw in rng.uniform([1.3, -1], [2.4, 1], (8, 2))]
    )
    ends = rng.uniform(-1.0, 1.0, size=(8, 2, 6))
    share = np.linspace(0.0, 1.0, NODES)[:, None]
    return X_WB, (1.0 - share) * ends[:, :1] + share * ends[:, 1:]


def alone(scene: Scene, X_WB: Array, q: Array) -> PlaceContact | None:
    """The pair that falls short by most at the first nodes that show one, of the cell with its base there."""
    cell = scene.cell
    robots = tuple(replace(robot, X_WB=X_WB) if robot.name == "right" else robot for robot in cell.robots)
    placed = Scene.from_cell(replace(cell, robots=robots))
    pairs = [pair for pair in placed.pairs if pair.rule is Rule.CLEARANCE]
    short = np.array([signed_distances(placed, pair, q) - pair.demand for pair in pairs])
    for count in KEYS:
        nodes = np.unique(np.linspace(0, NODES - 1, count).round().astype(int))
        if short[:, nodes].min() < 0.0:
            row, node = np.unravel_index(np.argmin(short[:, nodes]), (len(short), len(nodes)))
            pair = pairs[row]
            return PlaceContact(
                pair=placed.names(pair), distance=float(short[row, nodes[node]] + pair.demand), node=int(nodes[node])
            )
    return None


def test_contacts_are_those_of_each_cell_with_its_base_there(ready: PreparedMap, swings: tuple[Array, Array]) -> None:
    scene, (X_WB, q) = ready.jobs[0].scene, swings

    together = contacts(scene, "right", X_WB, q, standing=False)

    by_themselves = [alone(scene, *entry) for entry in zip(X_WB, q, strict=True)]
    assert [contact is None for contact in together] == [contact is None for contact in by_themselves]
    assert 0 < sum(contact is None for contact in together) < len(together)
    for contact, expected in zip(together, by_themselves, strict=True):
        if contact is not None and expected is not None:
            assert contact.pair == expected.pair
            assert contact.node == expected.node
            assert max(contact.distance, 0.0) == pytest.approx(max(expected.distance, 0.0), abs=EXACT)


def test_contacts_move_with_the_cell(ready: PreparedMap, swings: tuple[Array, Array]) -> None:
    X, (X_WB, q) = pose((0.7, -1.2, 0.4), (0.0, 0.0, 2.0)), swings
    elsewhere = Scene.from_cell(displaced(ready.jobs[0].scene.cell, X))

    here, there = contacts(ready.jobs[0].scene, "right", X_WB, q), contacts(elsewhere, "right", X @ X_WB, q)

    for contact, other in zip(here, there, strict=True):
        assert (contact is None) is (other is None)
        if contact is not None and other is not None:
            assert (contact.pair, contact.node) == (other.pair, other.node)
            assert contact.distance == pytest.approx(other.distance, abs=EXACT)


@pytest.mark.parametrize("depth", [0.004, 0.012])
def test_a_base_that_stands_too_deep_in_the_floor_is_a_contact_of_its_own(ready: PreparedMap, depth: float) -> None:
    """5 mm are allowed; the foot reaches 100 mm below its base, and nothing else of the arm as far without its tool."""
    cell = ready.jobs[0].scene.cell
    robots = tuple(replace(robot, tool=no_tool()) if robot.name == "right" else robot for robot in cell.robots)
    scene = Scene.from_cell(replace(cell, robots=robots))
    sunk = pose((1.9, 0.3, 0.1 - depth), (0.0, 0.0, np.pi))

    (contact,) = contacts(scene, "right", sunk[None], np.zeros((1, 3, 6)))

    assert (contact is None) is (depth < 0.005)
    if contact is not None:
        assert contact.pair == ("right/base", "floor")
        assert contact.distance == pytest.approx(-depth, abs=1e-9)
