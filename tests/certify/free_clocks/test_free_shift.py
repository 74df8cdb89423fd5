"""The largest shift of two programs that keeps a demand: closed forms, and no smaller shift breaks it."""

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies, program
from builders.scene_builders import make_cell, placed, slide_model

from cellplan.certify.free_clocks import free_shift as search
from cellplan.certify.free_clocks.free_clocks import ClockRegion, band, certify_regions
from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.certify.free_clocks.free_shift import SHIFT_SHARE, SHIFT_TOL, ShiftBound, free_shift
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.scene import Scene

RADIUS = 0.1  # [m] of both balls
GAP = 0.05  # [m] between them where they pass each other
SPEED = 0.8  # [m/s] of both
AHEAD = 0.4  # [m] by which the second one is ahead on one clock
TIMES = 0.05 * np.arange(41)


def passing(demand: float) -> tuple[Scene, Array]:
    """Two balls that slide along parallel lines at one speed, the second one ahead."""
    ball = slide_model(Sphere(RADIUS))
    cell = make_cell(
        placed("one", ball),
        placed("two", ball, base=pose((0.0, 2.0 * RADIUS + GAP, 0.0))),
        checks=ChecksEntry(clearance_mm=1e3 * demand, contact_zone_mm=0.0),
    )
    return Scene.from_cell(cell), np.column_stack([SPEED * TIMES, SPEED * TIMES + AHEAD])


def shift_of(demand: float, *, most: float) -> ShiftBound:
    scene, q = passing(demand)
    return free_shift(FreeMotion(scene, q), TIMES, "one", "two", most=most)


@pytest.mark.parametrize("demand", [0.06, 0.1, 0.2])
def test_balls_of_one_speed_may_be_shifted_until_they_are_as_near_as_is_demanded(demand: float) -> None:
    left = np.sqrt((2.0 * RADIUS + demand) ** 2 - (2.0 * RADIUS + GAP) ** 2)  # [m] one may be ahead of the other
    allowed = (AHEAD - left) / SPEED

    shift = shift_of(demand, most=0.6)

    assert allowed * (1.0 - SHIFT_SHARE) - SHIFT_TOL - 1e-3 <= shift.shift <= allowed + 1e-4  # readings: 0.05 mm
    assert shift.bodies == ("one/block", "two/block")


def test_nothing_limits_the_shift_of_what_never_comes_near() -> None:
    assert shift_of(0.5 * GAP, most=2.0) == ShiftBound(shift=2.0)


def test_what_is_too_near_on_one_clock_allows_no_shift() -> None:
    assert shift_of(AHEAD, most=0.2).shift == 0.0


@pytest.mark.parametrize("seed", [4, 5])
def test_a_band_of_the_proved_shift_is_proved_as_a_region_too(seed: int) -> None:
    scene = Scene.from_cell(cell_with_bodies(seed))
    q = program(scene.cell, seed, samples=6, stride=0.05)
    times = 0.1 * np.arange(6)
    first, second = (robot.name for robot in scene.cell.robots[:2])

    shift = free_shift(FreeMotion(scene, q), times, first, second, most=0.4)
    inside = ClockRegion(first=first, second=second, rectangles=band(times, -0.85 * shift.shift, 0.85 * shift.shift))

    assert shift.shift == 0.0 or certify_regions(scene, q, [inside])[0].is_met
    assert (shift.bodies is None) is (shift.shift == 0.4)


def test_a_robot_that_stands_still_allows_any_shift_of_what_passes_it() -> None:
    scene, q = passing(0.5 * GAP)
    q[:, 1] = 0.8

    shift = free_shift(FreeMotion(scene, q), TIMES, "one", "two", most=0.2)

    assert shift == ShiftBound(shift=0.2)


def test_the_distance_on_one_clock_allows_a_shift_before_any_box_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "FLOOR_READINGS", 0)
    monkeypatch.setattr(search, "MAX_READINGS", 0)
    demand = 0.1
    apart = np.hypot(AHEAD, 2.0 * RADIUS + GAP) - 2.0 * RADIUS

    shift = shift_of(demand, most=0.6)

    assert shift.shift == pytest.approx((apart - demand) / SPEED, abs=2e-3)  # 1 mm of distance is left unproved
    assert shift.shift <= (apart - demand) / SPEED
    assert shift.bodies == ("one/block", "two/block")


@pytest.mark.parametrize("demand", [0.06, 0.1])
def test_proving_the_distance_on_one_clock_first_leads_to_the_same_shift(
    demand: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = shift_of(demand, most=0.6).shift
    monkeypatch.setattr(search, "FLOOR_READINGS", 0)

    assert shift_of(demand, most=0.6).shift == pytest.approx(plain, rel=2.0 * SHIFT_SHARE)


def test_what_is_too_near_without_a_shift_is_found_there() -> None:
    shift = shift_of(AHEAD, most=0.2)

    assert shift.at is not None
    assert shift.at[0] == shift.at[1]
