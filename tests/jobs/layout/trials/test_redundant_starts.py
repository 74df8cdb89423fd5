"""Operators with more joints than their tasks prescribe: their start varies, and the tools stay on their paths."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.jobs.layout.trials.searched import freed
from cellplan.search.programs.problem import Point

CELL = Path(__file__).resolve().parents[4] / "cells" / "two_robots.yaml"
FREE_SPIN = (
    "tasks.ring.free=[spin]",
    "motion.step_s=0.01",
    "robots.pen.weights=[1, 3, 1, 2, 1, 1]",
    "robots.holder.start_deg=[5.724, 72.702, -47.011, 5.648, -93.373, -16.786]",
    "robots.pen.start_deg=[-6.548, 5.284, 55.396, -8.075, 6.432, -111.295]",
)
STEP = 1e-5  # [-] usual steps of the differences


@pytest.fixture(scope="module")
def ready() -> PreparedSearch:
    return prepared(LayoutRequest(cell=CELL, settings=FREE_SPIN, free=("start", "weights")))


@pytest.fixture(scope="module")
def point(ready: PreparedSearch) -> Point:
    """A layout whose joints have other weights than in the cell, and a start beside the path."""
    x = ready.coarse.given + 0.3 * np.random.default_rng(4).normal(size=len(ready.coarse.names)) * ready.coarse.scale
    point = ready.coarse.evaluate(x, ready.given_start)
    assert point is not None
    return point


def test_the_start_of_an_operator_with_a_free_spin_is_free_too() -> None:
    cell = load_cell(CELL)

    assert set(freed(cell, ["start"])) == {"holder.start_deg"}
    assert set(freed(cell.with_values({"tasks.ring.free": ["spin"]}), ["start"])) == {
        "holder.start_deg",
        "pen.start_deg",
    }


def test_variables_of_the_start_are_those_with_the_tool_on_its_path(ready: PreparedSearch, point: Point) -> None:
    starts = [column for column, name in enumerate(ready.coarse.names) if ".start_deg" in name]

    assert np.allclose(np.sort(point.x[starts]), np.sort(point.q[0]), rtol=0.0, atol=1e-12)
    again = ready.coarse.evaluate(point.x, point.start)
    assert again is not None
    assert np.allclose(again.q, point.q, rtol=0.0, atol=1e-6)


def test_motions_change_with_starts_and_weights_as_their_derivatives_say(ready: PreparedSearch, point: Point) -> None:
    step = STEP * ready.coarse.scale * np.random.default_rng(5).normal(size=len(point.x))
    ahead, behind = (ready.coarse.evaluate(point.x + sign * step, point.start) for sign in (1.0, -1.0))
    assert ahead is not None
    assert behind is not None

    seen = 0.5 * (ahead.q - behind.q)
    assert np.linalg.norm(ready.coarse.derivatives(point).q @ step - seen) < 0.002 * np.linalg.norm(seen)


@pytest.mark.slow
def test_the_best_file_has_the_start_on_the_path(tmp_path: Path) -> None:
    request = LayoutRequest(cell=CELL, settings=FREE_SPIN, free=("start", "weights"))

    result = search_layout(request, tmp_path / "study", stop=Stop(trials=4))

    assert result.best is not None
    best = load_cell(tmp_path / "study" / "best.yaml")
    assert best.robot("pen").start is not None
    assert solve(best).passed
    assert result.best.cycle < 0.9 * float(result.record["given"]["cycle_s"] or 0.0)
