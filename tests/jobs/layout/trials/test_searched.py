"""Searches with bases and tools as they are: what is free, and a joint path from the search to the written cell."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan import LayoutRequest, LayoutResult, Stop, load_cell, search_layout, solve
from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.result import path_text
from cellplan.jobs.layout.trials import trial
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.jobs.layout.trials.searched import freed, searched_cell
from cellplan.jobs.layout.trials.trial import Begin, _Begin
from cellplan.jobs.layout.variable_records import path_record
from cellplan.model.seeds import generator
from cellplan.search.spline_path.problem import PathProblem
from cellplan.search.spline_path.spline_problem import perturbed_path

CELLS = Path(__file__).resolve().parents[4] / "cells"
FOUR = CELLS / "four_robots.yaml"
BRIEF = ("motion.step_s=0.004", "solver.gain_per_s=200", "checks.clearance_mm=10")


@pytest.fixture(scope="module")
def request_of_path() -> LayoutRequest:
    return LayoutRequest(cell=FOUR, settings=BRIEF, free=("path",), margin=15.0)


@pytest.fixture(scope="module")
def ready(request_of_path: LayoutRequest) -> PreparedSearch:
    return prepared(request_of_path)


def test_words_are_keys_of_what_may_change() -> None:
    cell = load_cell(FOUR)

    assert freed(cell, ["start", "path"]) == {"reis.start_deg": True, "reis.path": True}
    assert set(freed(cell, ["weights"])) == {f"{robot.name}.weights" for robot in cell.robots}
    assert set(freed(cell, ["spin"])) == {f"tasks.{task.name}.spin_deg" for task in cell.tasks}


@pytest.mark.parametrize(
    "values",
    [
        {"tasks.circle.free": ["spin"]},
        {"tasks.circle.axes": ["x", "y", "z"]},
        {"tasks.circle.process": {"feed_mm_s": 100, "ramp_mm": 20}},
    ],
)
def test_a_path_is_motion_in_the_null_space_where_operators_do_not_just_follow(values: dict[str, object]) -> None:
    assert freed(load_cell(FOUR).with_values(values), ["path"]) == {"null_space": True}


def test_a_path_and_motion_in_the_null_space_are_one_line() -> None:
    request = LayoutRequest(cell=FOUR, vary=("reis.path", "null_space"))

    with pytest.raises(InputError, match=r"layout\.vary\.null_space: unexpected key beside reis\.path: leave one of"):
        searched_cell(request)


def test_joint_paths_of_a_part_at_rest_are_one_line() -> None:
    request = LayoutRequest(cell=FOUR, settings=("motion.mode=part_at_rest",), free=("path",))

    with pytest.raises(InputError, match=r"motion\.mode: expected simultaneous where joint paths may change"):
        searched_cell(request)


def test_another_word_is_one_line() -> None:
    with pytest.raises(InputError, match=r"^--free: expected some of .*path.*, got 'paht', did you mean 'path'"):
        freed(load_cell(FOUR), ["paht"])


def test_bases_and_tools_stay_whatever_the_cell_says() -> None:
    request = LayoutRequest(cell=CELLS / "find_a_layout.yaml", free=("start", "weights"))

    settings = searched_cell(request).layout

    assert settings is not None
    assert settings.margin > 0.0
    assert {str(range_.kind) for range_ in settings.ranges} == {"start", "weight"}


@pytest.mark.slow
def test_beside_a_path_start_and_weights_mean_nothing() -> None:
    both = prepared(LayoutRequest(cell=FOUR, settings=BRIEF, free=("start", "weights", "path", "spin"), margin=15.0))

    assert both.unled is not None
    assert {name.split(".")[2].partition("_")[0] for name in both.coarse.names} == {"path", "spin"}
    assert {name.split(".")[-1].partition("[")[0] for name in both.unled.coarse.names} == {
        "start_deg",
        "weights",
        "spin_deg",
    }


@pytest.mark.slow
def test_the_first_path_is_near_the_motion_of_the_cell(ready: PreparedSearch) -> None:
    assert ready.unled is not None
    along = ready.coarse.evaluate(ready.coarse.given, ready.given_start)
    resolved = ready.unled.coarse.evaluate(ready.unled.coarse.given, ready.given_start)

    assert along is not None
    assert resolved is not None
    np.testing.assert_allclose(along.q[[0, -1]], resolved.q[[0, -1]], atol=2e-3)
    at = [np.abs(ready.coarse.times - time).argmin() for time in ready.unled.coarse.times]
    assert np.degrees(np.abs(along.q[at] - resolved.q)[:, :6]).max() < 2.0


def test_perturbations_of_a_path_are_smooth_and_every_tool_follows(ready: PreparedSearch) -> None:
    problem = ready.coarse
    assert isinstance(problem, PathProblem)
    point = perturbed_path(problem, problem.given, ready.given_start, generator("test", 0), size=0.6)

    assert point is not None
    change = (point.x - problem.given).reshape(problem.path.given.coefficients.shape)
    assert np.degrees(np.abs(change)).max() > 0.5
    assert np.abs(np.diff(change, 3, axis=0)).max() < 0.2 * np.abs(change).max()


def test_the_record_says_how_far_the_path_is_from_the_given_motion(ready: PreparedSearch) -> None:
    x = ready.coarse.given.copy()
    x[:84:6] += np.radians(20.0)  # the first joint, all along

    record = path_record(ready, x)

    assert record["departure_deg"] == pytest.approx(20.0)
    assert record["departure_mm"] is None
    assert path_text(dict(record)) == (
        "reis.path: 14 coefficients a joint, largest departure 20 deg from the given motion"
    )


def test_paths_begin_at_the_last_motion_that_they_can_follow(
    ready: PreparedSearch, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert ready.unled is not None
    begins = [(ready.unled.coarse.given, ready.given_start + k) for k in range(4)]
    stages = iter(begins[1:])
    path = ready.coarse.given
    followed = {1.0: 0.9, 0.0: 1.4}  # cycles by the place of the stage; nothing follows the later two

    def path_of(_: PreparedSearch, begin: Begin) -> _Begin | None:
        place = float(begin[1][0] - ready.given_start[0])
        return _Begin(path, begin[1], unled=begin) if round(place) in followed else None

    def improved(problem: object, x: Array, start: Array, *_: object) -> SimpleNamespace | None:
        if problem is ready.coarse:
            cycle = followed[round(float(start[0] - ready.given_start[0]))]
            return SimpleNamespace(violation=0.0, objective=cycle, x=x, start=start)
        following = next(stages, None)
        return following and SimpleNamespace(x=following[0], start=following[1])

    monkeypatch.setattr(trial, "_path_of", path_of)
    monkeypatch.setattr(trial, "_halfway", lambda *_: None)
    monkeypatch.setattr(trial, "improve", improved)
    begin = trial._led(ready, ready.unled, begins[0])

    assert begin is not None
    assert begin.start is begins[1][1]


@pytest.fixture(scope="module")
def searched(request_of_path: LayoutRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[LayoutResult, Path]:
    folder = tmp_path_factory.mktemp("path") / "study"
    return search_layout(request_of_path, folder, stop=Stop(trials=1)), folder


@pytest.mark.slow
def test_the_written_path_passes_solve_and_is_searched_further(searched: tuple[LayoutResult, Path]) -> None:
    result, folder = searched
    best = result.record["best"]
    assert best is not None
    assert best["cycle_s"] is not None
    given = result.record["given"]["cycle_s"]
    cell = load_cell(folder / "best.yaml")

    solution = solve(cell)
    again = prepared(LayoutRequest(cell=folder / "best.yaml", free=("path",), margin=15.0))
    point = again.coarse.evaluate(again.coarse.given, again.given_start)

    assert solution.passed
    assert given is not None
    assert cell.robot("reis").path is not None
    assert best["cycle_s"] < 0.8 * given
    assert point is not None
    np.testing.assert_allclose(point.q[-1], solution.motion.q[-1], atol=1e-4)
