"""Robots that cannot all go straight: one after the other, or at once in joint space and time; and what is refused."""

import hashlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import thing
from builders.transfer_cells import gantry, scene_of

from cellplan.certify.certify import certify
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import Array, pose
from cellplan.planning.transfer.best_try import Try, best_try, blocked_try
from cellplan.planning.transfer.plan import PlannedTransfer, Rung, plan_transfer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.scene.scene import Scene

RADIUS, CLEARANCE = 0.1, 0.005  # [m]
STEP = 0.02  # [s]: few rows are retimed quickly
FINE = 100  # samples between two rows, 0.2 mm apart at top speed
ROUNDED_BACK = 1e-9  # [m] of distances of circles, computed twice


WALL = (0.05, 1.2)  # [m]


def wall(name: str, size: tuple[float, float], at: tuple[float, float] = (0.0, 0.0)) -> object:
    return thing(name, Box((*size, 0.2)), pose((*at, 0.0)))


def transfer(scene: Scene, start: list[float], goal: list[float], seed: int = 0) -> PlannedTransfer:
    return plan_transfer(
        TransferQuery.of(scene, np.array(start), np.array(goal), seed=seed), retimer=transfer_retimer(scene)
    )


def densely(q: Array) -> Array:
    share = np.arange(FINE)[:, None] / FINE
    return np.concatenate([*(a + share * (b - a) for a, b in pairwise(q)), q[-1:]])


def distance_to_box(centres: Array, size: tuple[float, float]) -> Array:
    """Distance of discs from a rectangle round the origin, by its closed form."""
    outside = np.maximum(np.abs(centres) - 0.5 * np.array(size), 0.0)
    return np.linalg.norm(outside, axis=1) - RADIUS


def assert_at_limits(scene: Scene, transfer: PlannedTransfer) -> None:
    """Rates from row to row, with rest before and after, keep the limits."""
    bounds, step = transfer_retimer(scene).bounds, scene.cell.motion.step
    still = np.zeros((1, transfer.q.shape[1]))
    velocity = np.diff(transfer.q, axis=0) / step
    acceleration = np.diff(np.concatenate([still, velocity, still]), axis=0) / step
    jerk = np.diff(acceleration, axis=0) / step
    for rates, limit in ((velocity, bounds.velocity), (acceleration, bounds.acceleration), (jerk, bounds.jerk)):
        assert float((np.abs(rates) / limit).max()) <= 1.0 + 1e-9


@pytest.fixture(scope="module")
def swapped() -> tuple[Scene, PlannedTransfer]:
    """Two discs that change places: none can go first, so both move at once."""
    scene = scene_of(gantry("a"), gantry("b"), step=STEP)
    return scene, transfer(scene, [-0.5, 0.0, 0.5, 0.0], [0.5, 0.0, -0.5, 0.0])


def round_a_wall() -> tuple[Scene, PlannedTransfer]:
    scene = scene_of(gantry("a"), things=[wall("wall", WALL)], step=STEP)
    return scene, transfer(scene, [-0.5, 0.1], [0.5, 0.1])


@pytest.fixture(scope="module")
def rounded() -> tuple[Scene, PlannedTransfer]:
    """A disc on the other side of a wall that it can go round."""
    return round_a_wall()


def test_a_disc_goes_round_a_wall(rounded: tuple[Scene, PlannedTransfer]) -> None:
    scene, planned = rounded

    assert planned.rungs == {"a": Rung.IN_TURN}
    assert distance_to_box(densely(planned.q), WALL).min() >= CLEARANCE - ROUNDED_BACK
    assert np.array_equal(planned.q[[0, -1]], [[-0.5, 0.1], [0.5, 0.1]])
    assert_at_limits(scene, planned)


def test_discs_whose_ways_cross_go_in_two_legs() -> None:
    scene = scene_of(gantry("a"), gantry("b"), step=STEP)

    move = transfer(scene, [-0.5, 0.0, 0.0, -0.5], [0.5, 0.0, 0.0, 0.5])

    assert move.rungs == {"a": Rung.IN_LEGS, "b": Rung.IN_LEGS}
    moves = np.diff(move.q, axis=0) != 0.0
    assert not np.any(moves[:, :2].any(axis=1) & moves[:, 2:].any(axis=1))
    q = densely(move.q)
    assert np.linalg.norm(q[:, :2] - q[:, 2:], axis=1).min() >= 2.0 * RADIUS + CLEARANCE - ROUNDED_BACK
    assert_at_limits(scene, move)


def test_a_disc_that_blocks_the_goal_of_another_goes_first() -> None:
    scene = scene_of(gantry("a"), gantry("b"), step=STEP)

    move = transfer(scene, [-0.5, 0.0, 0.5, 0.0], [0.5, 0.0, 0.4, 0.5])

    first = int(np.flatnonzero(move.q[:, 0] != -0.5)[0])
    assert move.rungs["a"] in {Rung.STRAIGHT, Rung.IN_LEGS}
    assert np.any(move.q[: first + 1, 2:] != [0.5, 0.0])


def test_discs_that_change_places_move_at_once(swapped: tuple[Scene, PlannedTransfer]) -> None:
    scene, move = swapped

    assert move.rungs == {"a": Rung.IN_TIME, "b": Rung.IN_TIME}
    q = densely(move.q)
    assert np.linalg.norm(q[:, :2] - q[:, 2:], axis=1).min() >= 2.0 * RADIUS + CLEARANCE - ROUNDED_BACK
    assert np.array_equal(move.q[[0, -1]], [[-0.5, 0.0, 0.5, 0.0], [0.5, 0.0, -0.5, 0.0]])
    moves = np.diff(move.q, axis=0) != 0.0
    assert np.any(moves[:, :2].any(axis=1) & moves[:, 2:].any(axis=1))
    assert_at_limits(scene, move)


def test_what_is_found_is_certified_in_its_rows(swapped: tuple[Scene, PlannedTransfer]) -> None:
    scene, move = swapped

    assert certify(scene, move.q).is_met


PROGRAM = """
import hashlib, sys
sys.path[:0] = {paths!r}
from test_ladder import round_a_wall
_, found = round_a_wall()
print(hashlib.sha256(found.q.tobytes() + found.times.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_another_process_finds_the_same_bytes(rounded: tuple[Scene, PlannedTransfer]) -> None:
    _, move = rounded
    here = hashlib.sha256(move.q.tobytes() + move.times.tobytes()).hexdigest()
    paths = [str(Path(__file__).parent), str(Path(__file__).resolve().parents[2])]

    there = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(paths=paths)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )

    assert there.stdout.strip() == here


@pytest.fixture
def heeded_ctrl_c() -> Iterator[None]:
    """Jobs in the background inherit it as ignored."""
    usual = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, usual)


@pytest.mark.usefixtures("heeded_ctrl_c")
def test_a_search_is_left_by_ctrl_c() -> None:
    scene = scene_of(gantry("a"), things=[wall("wall", (0.05, 4.0))], step=STEP)
    stages: list[float] = []

    def interrupt(stage: str, share: float) -> None:
        stages.append(share)
        if share > 0.0:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        plan_transfer(
            TransferQuery.of(scene, np.array([-0.5, 0.0]), np.array([0.5, 0.0]), seed=0),
            retimer=transfer_retimer(scene),
            progress=interrupt,
        )

    assert len([share for share in stages if share > 0.0]) == 1


def test_a_wall_without_a_gap_is_refused_with_what_was_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.planning.transfer.in_turn.SAMPLES", 200)
    scene = scene_of(gantry("a"), things=[wall("wall", (0.05, 4.0))], step=STEP)

    with pytest.raises(TransferNotFoundError) as refused:
        transfer(scene, [-0.5, 0.0], [0.5, 0.0])

    assert str(refused.value) == (
        "<cell>: robots.a: found no transfer move of 'a': at the best try ('a', straight over the gap between its "
        "trees) 'a/disc' is 124 mm deep in 'wall' near (12, 137, 0) mm at 54 % of the try, 5 mm are "
        "demanded; tried were: straight, 'a/disc' touches 'wall', "
        "5 mm are demanded; by "
        "trees in its joint space, 200 configurations drawn (41 reached from the start of 'a' and 36 from its goal); "
        "most often 'a/disc' too close to 'wall' (201 times): state via points of the task, give another home or "
        "start, move what is in the way, or lower the clearance"
    )


def test_discs_that_cannot_pass_each_other_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.planning.transfer.in_time.SAMPLES", 20)
    walls = [wall("left", (3.0, 0.02), (0.0, 0.2)), wall("right", (3.0, 0.02), (0.0, -0.2))]
    scene = scene_of(gantry("a"), gantry("b"), things=walls, step=STEP)

    with pytest.raises(TransferNotFoundError) as refused:
        transfer(scene, [-0.5, 0.0, 0.5, 0.0], [0.5, 0.0, -0.5, 0.0])

    words = str(refused.value)
    assert re.match(
        r"<cell>: robots: found no transfer move of 'a', 'b': at the best try \(all at once, straight\) 'a/disc' is "
        r"50 mm deep in 'b/disc' near \(.*, 0, 0\) mm at \d+ % of the try, 5 mm are demanded; tried were: straight, "
        "'a/disc' touches 'b/disc', 5 mm are demanded; one robot after the other, in 2 orders; all at once "
        "in joint space and time, in 4 orders ",
        words,
    )
    assert "'a/disc' too close to 'b/disc'" in words


@pytest.mark.parametrize("x", [0.0, 0.31])
def test_a_pair_in_the_way_is_as_deep_as_the_closed_form_says(x: float) -> None:
    """A disc pushed straight through a wall is deepest where its way out is half the wall and its own radius."""
    scene = scene_of(gantry("a"), things=[wall("wall", (0.05, 4.0), (x, 0.0))], step=STEP)
    line = np.linspace([-0.9, 0.0], [0.9, 0.0], 40)

    blocked = blocked_try(scene, Try(words="straight", q=line))

    assert blocked.missing == pytest.approx(RADIUS + 0.025 + CLEARANCE, abs=2e-3)  # 25 samples about the deepest row
    assert blocked.bodies == ("a/disc", "wall")
    assert blocked.place == pytest.approx([x, 0.0, 0.0], abs=1.8 / 39)  # the middle of the disc, within a row
    assert blocked.record["share_of_try"] == pytest.approx(0.5 + x / 1.8, abs=1.0 / 39)
    assert blocked.record["pair"] == ["a/disc", "wall"]


def test_the_try_that_misses_least_is_the_best() -> None:
    """A disc that passes 3 mm from the end of a wall is nearer to being free than one that goes through it."""
    scene = scene_of(gantry("a"), things=[wall("wall", (0.05, 0.4))], step=STEP)
    through = Try(words="through", q=np.linspace([-0.5, 0.0], [0.5, 0.0], 20))
    near_miss = Try(words="beside", q=np.linspace([-0.5, 0.303], [0.5, 0.303], 20))

    blocked = best_try(scene, [through, near_miss])

    assert blocked.tried is near_miss
    assert blocked.words.startswith("'a/disc' is 3 mm from 'wall' near (")
    assert blocked.words.endswith(") mm at 53 % of the try, 5 mm are demanded")
    assert blocked.place[:2] == pytest.approx([0.025, 0.2015], abs=2e-3)  # half way between disc and corner of the wall
    assert blocked.missing == pytest.approx(0.002, abs=1e-4)
