"""Verdicts of a map are those of a cell that is written with its base there."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan import BaseGrid
from cellplan.geometry.arrays import Array
from cellplan.jobs.base_map.prepared import PreparedMap, prepared
from cellplan.model.units import MM
from cellplan.search.base_map.verdicts import (
    PlaceVerdict,
    Verdict,
    best_first,
    counts,
    judge,
    over_phases,
    verdicts_at_start,
)


def judged(ready: PreparedMap) -> tuple[list[PlaceVerdict], dict[int, PlaceVerdict]]:
    """What the starts say of every place, and the verdicts of the motions."""
    ((q, at),), (job,) = ready.starts(), ready.jobs
    verdicts, inside = verdicts_at_start(job, q, at)
    return verdicts, judge(job, q[inside], at[inside])


def test_a_place_has_the_verdict_of_the_cell_that_is_written_with_its_base_there(ready: PreparedMap) -> None:
    at_start, by_motion = judged(ready)
    kinds = {verdict.verdict for verdict in by_motion.values()}
    assert Verdict.PASSES in kinds
    for kind in kinds:
        place, verdict = next((place, one) for place, one in by_motion.items() if one.verdict is kind)
        x, y = MM * ready.jobs[0].places.X_WB[place, :2, 3]
        base = {"robots.right.base.x_mm": float(x), "robots.right.base.y_mm": float(y)}
        cell = ready.cell.with_values({**base, "robots.right.start_deg": np.degrees(_start(verdict)).tolist()})

        _, alone = judged(prepared(cell, "right", BaseGrid(x=(x, x), y=(y, y))))

        assert alone[0].verdict is kind
        np.testing.assert_allclose(_start(alone[0]), _start(verdict), atol=1e-7)
        for name in ("margin", "speed", "acceleration", "cycle", "distance", "at"):
            values = [np.nan if (value := getattr(one, name)) is None else value for one in (alone[0], verdict)]
            np.testing.assert_allclose(*values, rtol=1e-4, atol=1e-4, err_msg=name)
        assert (alone[0].pair, alone[0].joint, alone[0].fast) == (verdict.pair, verdict.joint, verdict.fast)
    assert len(at_start) == len(ready.jobs[0].places)


def _start(verdict: PlaceVerdict) -> Array:
    assert verdict.start is not None
    return verdict.start


def test_speeds_and_cycles_scale_with_the_time_of_the_motion(ready: PreparedMap) -> None:
    """Twice the time: half of the speeds, a quarter of the accelerations, and the same shortest cycle."""
    factor = 2.0
    timed = ready.cell.with_values({"motion.duration_s": 3.0 * factor, "motion.step_s": 0.03 * factor})
    other = prepared(timed, "right", BaseGrid(x=(1700, 1700), y=(300, 300)))
    place = next(k for k, X in enumerate(ready.jobs[0].places.X_WB) if np.allclose(MM * X[:2, 3], (1700.0, 300.0)))

    here, there = judged(ready)[1][place], judged(other)[1][0]

    assert here.speed is not None
    assert here.acceleration is not None
    assert np.sqrt(here.acceleration) > here.speed  # so that it is what the cycle follows from
    assert here.cycle == pytest.approx(3.0 * np.sqrt(here.acceleration), rel=1e-9)
    assert there.speed == pytest.approx(here.speed / factor, rel=1e-6)
    assert there.acceleration == pytest.approx(here.acceleration / factor**2, rel=1e-6)
    assert there.cycle == pytest.approx(here.cycle, rel=1e-6)
    assert there.margin == pytest.approx(here.margin, rel=1e-6)


def test_the_best_is_the_fastest_then_the_one_with_the_widest_margin() -> None:
    plain = PlaceVerdict(verdict=Verdict.PASSES, cycle=2.0, margin=0.1, start=np.zeros(3))
    places = [
        replace(plain, cycle=3.0),
        replace(plain, verdict=Verdict.COLLISION, cycle=1.0),
        plain,
        replace(plain, margin=0.2),
    ]

    assert best_first(places) == [3, 2, 0]
    assert counts(places) == {
        Verdict.PASSES: 3,
        Verdict.COLLISION: 1,
        **dict.fromkeys((Verdict.SPEED, Verdict.LIMIT, Verdict.OUT_OF_REACH), 0),
    }
    assert places[1].or_better(None) is places[1]
    assert places[1].or_better(plain) is plain
    assert plain.or_better(places[1]) is plain
    assert plain.or_better(places[3]) is places[3]  # the earlier one of two alike


def test_over_phases_a_place_fails_by_the_first_that_fails_and_else_has_the_worst_figures_and_the_whole_cycle() -> None:
    near = PlaceVerdict(
        verdict=Verdict.PASSES,
        start=np.zeros(3),
        joint=("right", "A"),
        margin=0.1,
        fast=("left", "B"),
        speed=0.5,
        acceleration=0.1,
        cycle=2.0,
    )
    fast = replace(near, joint=("right", "B"), margin=0.2, fast=("left", "C"), speed=0.2, acceleration=0.49, cycle=3.0)
    failing = [replace(near, verdict=kind, phase=phase) for phase, kind in enumerate((Verdict.SPEED, Verdict.LIMIT))]

    both = over_phases([near, fast])

    assert over_phases([near]) is near
    assert over_phases([near, *failing]) is failing[0]
    assert (both.joint, both.margin, both.fast, both.cycle) == (("right", "A"), 0.1, ("left", "C"), 5.0)
    assert (both.speed, both.acceleration) == (0.2, 0.49)  # the square root of 0.49 is more than 0.5
    assert len(both.starts) == 2
