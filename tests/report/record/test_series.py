"""``series.json``: agrees with the figures of the report, is complete and reproducible."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.records import phase_record
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cellplan.model.motion.motion import Motion
from cellplan.report.record import series as module
from cellplan.report.record.common import as_json
from cellplan.report.record.series import series, series_json, series_text

RELATIVE = 1e-6  # seven digits are written, which may be wrong by 5e-7


def motion_of(run: Any) -> Motion:
    times = run.report.times
    steps = len(times) - 1
    slack = np.zeros(steps)
    slack[700] = 0.25
    q = np.concatenate(list(run.report.q.values()), axis=1)
    return Motion(times=times, q=q, iterations=1.0 + np.arange(steps) % 3, slack=slack)


def written(run: Any, motion: Motion | None = None) -> Any:
    """The report with its series under a key of their own."""
    record = json.loads(as_json(phase_record(run.report, cell=run.cell, provenance=run.provenance, motion=motion)))
    return record | {"series": json.loads(series_json(run.report, motion))}


def test_largest_errors_and_their_instants_are_found_again(passed_run: Any) -> None:
    record = written(passed_run)
    times = np.array(record["series"]["times_s"])
    for name, task in record["tasks"].items():
        for kind, unit in (("position", "mm"), ("orientation", "deg")):
            errors = np.array(record["series"]["tasks"][name][f"{kind}_error_{unit}"])
            assert errors.max() == pytest.approx(task[f"max_{kind}_error_{unit}"], rel=RELATIVE)
            assert times[errors.argmax()] == task[f"max_{kind}_error_at_s"]
            assert errors.mean() == pytest.approx(task[f"mean_{kind}_error_{unit}"], rel=RELATIVE)


@pytest.mark.parametrize("run", ["passed_run", "rail_run"])
def test_ranges_speeds_and_travel_of_all_joints_are_found_again(run: str, request: pytest.FixtureRequest) -> None:
    record = written(request.getfixturevalue(run))
    times = np.array(record["series"]["times_s"])
    for robot, joints in record["joints"].items():
        for joint, use in joints.items():
            curves, unit = record["series"]["joints"][robot][joint], use["unit"]
            position, speed = np.array(curves[f"position_{unit}"]), np.array(curves[f"speed_{unit}_s"])
            rounding = RELATIVE * np.abs(position).max()
            assert (position.min(), position.max()) == pytest.approx((use["min"], use["max"]), abs=rounding)
            assert np.abs(speed).max() == pytest.approx(use["peak_velocity"], rel=RELATIVE)
            fastest = np.flatnonzero(times == use["peak_velocity_at_s"])
            assert np.abs(speed[fastest]) == pytest.approx(use["peak_velocity"], rel=RELATIVE)
            assert np.abs(speed * np.diff(times)).sum() == pytest.approx(use["travel"], rel=RELATIVE)


def test_a_speed_belongs_to_the_step_that_begins_at_its_instant(passed_run: Any) -> None:
    tree = series(passed_run.report)
    curves = tree["joints"]["kuka"]["B2"]
    moved = curves["position_deg"][:-1] + curves["speed_deg_s"] * np.diff(tree["times_s"])
    np.testing.assert_allclose(moved, curves["position_deg"][1:], atol=1e-12)


def test_smallest_singular_values_and_conditions_are_found_again(passed_run: Any) -> None:
    record = written(passed_run)
    curves, least = record["series"]["conditioning"], record["singularity"]
    assert min(curves["smallest_singular_value"]) == pytest.approx(least["stack"]["minimum"], rel=RELATIVE)
    for name in ("condition", "squared_condition", "manipulability"):
        assert min(curves[name]) == pytest.approx(least[name]["minimum"], rel=RELATIVE)
    np.testing.assert_allclose(curves["squared_condition"], np.square(curves["condition"]), rtol=2 * RELATIVE)


def test_what_the_steps_took_stands_in_the_series_and_in_short(passed_run: Any) -> None:
    motion = motion_of(passed_run)

    record = written(passed_run, motion)

    assert record["series"]["iterations"][:4] == [1, 2, 3, 1]
    assert record["series"]["slack"][699:702] == [0, 0.25, 0]
    assert record["solver"]["iterations"] == {"mean": 1.99975, "max": 3.0, "max_at_s": 0.002}
    assert record["solver"]["slack"]["max"] == 0.25
    assert record["solver"]["slack"]["max_at_s"] == 0.7


def test_what_was_not_counted_is_null(passed_run: Any) -> None:
    uncounted = replace(motion_of(passed_run), iterations=None, slack=None)
    for motion in (None, uncounted):
        record = written(passed_run, motion)
        assert (record["series"]["iterations"], record["series"]["slack"]) == (None, None)
        assert (record["solver"]["iterations"], record["solver"]["slack"]) == (None, None)


def lengths(tree: Any) -> set[tuple[str, int]]:
    """Length of every array, by whether it belongs to instants or to steps; but for the clearance."""
    result = set()
    for name, value in tree.items():
        if isinstance(value, dict) and name != "clearance":
            result |= lengths(value)
        elif isinstance(value, np.ndarray):
            is_of_steps = name.startswith("speed") or name in {"iterations", "slack"}
            result.add(("steps" if is_of_steps else "instants", len(value)))
    return result


@pytest.mark.parametrize(
    ("most", "every", "count"),
    [(4000, 1, 4001), (3999, 2, 2001), (1000, 4, 1001), (999, 5, 801), (600, 7, 573), (1, 4000, 2)],
)
def test_long_motions_are_thinned_and_keep_both_ends(
    passed_run: Any, monkeypatch: pytest.MonkeyPatch, most: int, every: int, count: int
) -> None:
    monkeypatch.setattr(module, "MAX_STEPS", most)

    tree = series(passed_run.report, motion_of(passed_run))

    assert tree["every"] == every
    assert lengths(tree) == {("instants", count), ("steps", count - 1)}
    assert count <= most + 1
    times = passed_run.report.times
    np.testing.assert_array_equal(tree["times_s"][:-1], times[:-1:every])
    assert tree["times_s"][-1] == times[-1]
    np.testing.assert_array_equal(tree["iterations"], 1.0 + np.arange(0, len(times) - 1, every) % 3)


def test_each_array_is_one_line(passed_run: Any) -> None:
    text = series_json(passed_run.report)
    lines = text.splitlines()
    assert lines[1:3] == ['  "schema": "cellplan.series/1",', '  "every": 1,']
    arrays_at = [line for line in lines if "[" in line]
    assert all(line.rstrip(",").endswith("]") for line in arrays_at)
    assert len(arrays_at) == 1 + 3 * 2 + 4 + 24 * 2 + 1 + 4  # the last five: clearance of four classes
    assert text.endswith("\n}\n")


def test_the_report_is_small_and_has_no_series(passed_run: Any) -> None:
    text = as_json(phase_record(passed_run.report, cell=passed_run.cell, provenance=passed_run.provenance))
    assert "series" not in json.loads(text)
    assert len(text) < 100_000  # four robots, 4001 samples: the series have 4.5 MB


def test_the_same_run_gives_the_same_bytes(passed_run: Any, make_run: Any) -> None:
    again = make_run()
    first, second = (series_text(series(run.report, motion_of(run))) for run in (passed_run, again))
    assert first == second


@given(arrays(float, st.integers(1, 20), elements=st.floats(width=64)))
def test_every_number_is_json_with_seven_digits(values: Any) -> None:
    read = json.loads(series_text({"values": values}), parse_constant=pytest.fail)["values"]
    for value, shown in zip(values, read, strict=True):
        if not math.isfinite(value):
            assert shown is None
        else:
            assert shown == pytest.approx(value, rel=6e-7, abs=1e-307)
            assert not (shown == 0 and math.copysign(1.0, shown) < 0.0)


def test_instants_keep_the_digits_of_the_report(passed_run: Any) -> None:
    times = passed_run.report.times / 3.0
    record = written(replace(passed_run, report=replace(passed_run.report, times=times)))
    np.testing.assert_allclose(record["series"]["times_s"], times, rtol=6e-12)  # half a unit of the twelfth digit
    assert record["series"]["times_s"][-1] == record["cycle_time_s"]


def test_names_cannot_break_out_of_their_place(passed_run: Any) -> None:
    accuracy = (replace(passed_run.report.accuracy[0], task='x": [1], "y'),)
    tree = series(replace(passed_run.report, accuracy=accuracy))
    assert list(json.loads(series_text(tree))["tasks"]) == ['x": [1], "y']


def test_the_clearance_of_each_class_is_found_again_at_its_minimum(passed_run: Any) -> None:
    record = written(passed_run)
    curves = record["series"]["clearance"]
    minima = {key: value for key, value in record["clearance"].items() if key != "whole"}

    assert set(curves) == {"times_s", *(f"{key}_mm" for key, value in minima.items() if value["pair"])}
    for key, value in minima.items():
        if value["pair"]:
            curve = curves[f"{key}_mm"]
            assert curve[curves["times_s"].index(value["at_s"])] == pytest.approx(value["minimum_mm"], rel=RELATIVE)
            assert min(curve) == pytest.approx(value["minimum_mm"], rel=RELATIVE)


def test_without_curves_the_clearance_is_empty(passed_run: Any) -> None:
    clearance = replace(passed_run.report.clearance, curves={})

    assert series(replace(passed_run.report, clearance=clearance))["clearance"] == {}
