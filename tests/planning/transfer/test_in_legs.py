"""Moves in legs: the fastest of all ways by enumeration, what backs off, and what is proved of it."""

from itertools import pairwise, product

import numpy as np
import pytest
from builders.transfer_cells import gantry, scene_of

from cellplan.certify.certify import certify
from cellplan.geometry.arrays import Array
from cellplan.planning.transfer.in_legs import LEGS, legs_of
from cellplan.planning.transfer.plan import Rung, plan_transfer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.planning.transfer.reasons import Tried
from cellplan.planning.transfer.straight_moves import StraightMoves
from cellplan.planning.transfer.straight_time import straight_line, straight_rows, straight_steps
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.scene.scene import Scene

RADIUS, CLEARANCE, ROUNDED = 0.1, 0.005, 1e-9  # [m]
STEP = 0.02  # [s]


def discs(count: int) -> Scene:
    return scene_of(*(gantry(name) for name in "abc"[:count]), step=STEP)


def steps_of(ends: list[Array], scene: Scene) -> int:
    """Steps of legs whose robots wait for the slowest one."""
    bounds = transfer_retimer(scene).bounds
    assert np.ptp(bounds.velocity) == np.ptp(bounds.acceleration) == 0.0  # so a stacked move is as long as its longest
    return int(straight_steps(np.array(ends[:-1]), np.array(ends[1:]), bounds, STEP).sum())


def fastest_by_enumeration(scene: Scene, start: Array, goal: Array) -> int | None:
    """Least steps over every choice of a leg for each disc, each certified as a whole."""
    count, best = len(start) // 2, None
    for choice in product(range(LEGS), repeat=count):
        ends = [np.where(np.repeat(np.array(choice) < leg, 2), goal, start) for leg in range(LEGS + 1)]
        legs = [(a, b) for a, b in pairwise(ends) if np.any(a != b)]
        if all(certify(scene, straight_line(a, b), with_minimum=False).is_met for a, b in legs):
            steps = steps_of(ends, scene)
            best = steps if best is None else min(best, steps)
    return best


@pytest.mark.parametrize("seed", [1, 2, 5, 8])
def test_no_choice_of_legs_is_faster(seed: int) -> None:
    scene, rng = discs(3), np.random.default_rng(seed)
    places = np.array([(x, y) for x in (-0.6, 0.0, 0.6) for y in (-0.5, 0.0, 0.5)])
    start, goal = (places[rng.permutation(9)[:3]].ravel() for _ in range(2))

    ends = legs_of(TransferQuery.of(scene, start, goal, seed=0), transfer_retimer(scene), Tried(), StraightMoves(scene))

    best = fastest_by_enumeration(scene, start, goal)
    assert (steps_of(ends, scene) if ends else None) == best


def test_a_disc_that_is_in_nobodys_way_waits_for_nobody() -> None:
    scene = discs(3)
    start = np.array([-0.5, 0.0, 0.0, -0.5, -0.8, -0.8])
    goal = np.array([0.5, 0.0, 0.0, 0.5, 0.2, -0.8])

    planned = plan_transfer(TransferQuery.of(scene, start, goal, seed=0), retimer=transfer_retimer(scene))

    alone = len(straight_rows(start, np.append(goal[:2], start[2:]), transfer_retimer(scene))) - 1
    assert planned.rungs == dict.fromkeys("abc", Rung.IN_LEGS)
    legs = np.diff(planned.q, axis=0) != 0.0
    assert np.any(legs[:, 4] & (legs[:, 0] | legs[:, 3]))
    assert len(planned.q) - 1 == 2 * alone


@pytest.fixture
def in_the_way() -> tuple[Scene, TransferQuery]:
    """A disc that stands in the way of another one at its start as well as at its goal, and has its home beside."""
    scene = discs(2)
    start, goal = np.array([-0.5, 0.0, 0.0, -0.15]), np.array([0.5, 0.0, 0.0, 0.15])
    return scene, TransferQuery.of(scene, start, goal, seed=0, home=np.array([-0.5, 0.0, 0.0, -0.8]))


def test_a_robot_in_the_way_backs_off_and_goes_on(in_the_way: tuple[Scene, TransferQuery]) -> None:
    scene, query = in_the_way

    planned = plan_transfer(query, retimer=transfer_retimer(scene))

    assert planned.rungs == {"a": Rung.IN_LEGS, "b": Rung.IN_LEGS}
    b = planned.q[:, 3]
    assert b[0] == -0.15
    assert b.min() < -2.0 * RADIUS - CLEARANCE
    assert b[-1] == 0.15
    share = np.linspace(0.0, 1.0, 50)[:, None]
    dense = np.concatenate([first + share * (last - first) for first, last in pairwise(planned.q)])
    assert np.linalg.norm(dense[:, :2] - dense[:, 2:], axis=1).min() >= 2.0 * RADIUS + CLEARANCE - ROUNDED
    assert certify(scene, planned.q, with_minimum=False).is_met


def test_without_a_home_nobody_backs_off(in_the_way: tuple[Scene, TransferQuery]) -> None:
    scene, query = in_the_way
    homeless = TransferQuery.of(scene, query.start, query.goal, seed=0)
    tried = Tried()

    assert not legs_of(homeless, transfer_retimer(scene), tried, StraightMoves(scene))
    assert tried.legs > 0
