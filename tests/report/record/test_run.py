"""``report.json``: the fixed names, printed units, nothing that is not a finite number, the same bytes each time."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.records import phase_record, whole_record
from hypothesis import given
from hypothesis import strategies as st

from cellplan.files.run.folder import RunFolder
from cellplan.model.report.report import ClearanceClass, ClosureAccuracy
from cellplan.model.robot.repeatability import JointDrift, Repeatability
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.report.record.common import as_json, number
from cellplan.report.record.summary import worst_of


def refuse(constant: str) -> Any:
    raise ValueError(f"{constant} is no JSON")


def read(text: str) -> Any:
    return json.loads(text, parse_constant=refuse)


def record_of(run: Any) -> Any:
    return read(as_json(phase_record(run.report, cell=run.cell, provenance=run.provenance)))


def summary_of(runs: Any) -> Any:
    first = runs["circle"]
    reports = {name: run.report for name, run in runs.items()}
    return read(as_json(whole_record(reports, cell=first.cell, provenance=first.provenance)))


def test_names_that_scripts_rely_on_are_there(passed_run: Any) -> None:
    record = record_of(passed_run)
    assert next(iter(record)) == "schema"
    assert record["schema"] == "cellplan.report/1"
    assert {"status", "cycle_time_s", "mode", "samples", "step_s", "singularity", "motion_share", "checks"} <= set(
        record
    )
    assert {"inputs", "versions", "seed", "contacts", "exclusions"} <= set(record)
    assert {"max_position_error_mm", "max_orientation_error_deg"} <= set(record["tasks"]["circle"])
    assert {"min", "max", "lower", "upper", "margin", "peak_velocity", "velocity_limit", "worst_at_s"} <= set(
        record["joints"]["kuka"]["B2"]
    )
    assert list(record["clearance"]) == ["whole", "robot_robot", "self", "part", "environment"]
    assert {"minimum_mm", "pair", "at_s", "certified", "exact", "points_mm", "accuracies_mm"} == set(
        record["clearance"]["whole"]
    )


def test_units_are_degrees_and_millimetres(passed_run: Any) -> None:
    record = record_of(passed_run)
    assert (record["cycle_time_s"], record["samples"], record["step_s"]) == (4.0, 4001, 0.001)
    joint = record["joints"]["kuka"]["B1"]
    assert (joint["lower"], joint["upper"], joint["velocity_limit"], joint["unit"]) == (-185.0, 185.0, 156.0, "deg")
    assert joint["margin"] == pytest.approx(min(joint["min"] + 185.0, 185.0 - joint["max"]), abs=1e-9)
    assert joint["velocity_ratio"] == pytest.approx(joint["peak_velocity"] / 156.0, rel=1e-9)
    task = record["tasks"]["circle"]
    assert task["tolerance"] == {"position_mm": 0.1, "orientation_deg": 0.01}
    assert (task["path_length_mm"], task["start_s"], task["end_s"], task["robot"]) == (630.0, 0.0, 4.0, "kuka")
    assert record["clearance"]["robot_robot"] == {
        "minimum_mm": 213.0,
        "pair": ["kuka/B4", "abb/tool"],
        "at_s": 1.72,
        "certified": True,
        "exact": True,
        "points_mm": [[1200.0, 0.0, 900.0], [1413.0, 0.0, 900.0]],
        "accuracies_mm": None,
    }


def test_task_errors_are_lengths_with_their_instant(passed_run: Any) -> None:
    error = np.zeros((4001, 3))
    error[1234] = [3e-6, 0.0, -4e-6]  # a 3-4-5 triangle
    accuracy = tuple(replace(entry, position_error=error) for entry in passed_run.report.accuracy)
    task = record_of(replace(passed_run, report=replace(passed_run.report, accuracy=accuracy)))["tasks"]["rhombus"]
    assert task["max_position_error_mm"] == pytest.approx(0.005, rel=1e-12)
    assert task["max_position_error_at_s"] == 1.234
    assert task["mean_position_error_mm"] == pytest.approx(0.005 / 4001, rel=1e-9)
    assert task["max_position_error_by_axis_mm"] == {"x": 0.003, "y": 0.0, "z": 0.004}


def test_status_follows_the_checks(passed_run: Any, failed_run: Any) -> None:
    assert record_of(passed_run)["status"] == "passed"
    record = record_of(failed_run)
    assert record["status"] == "failed"
    broken = [check for check in record["checks"] if not check["passed"]]
    assert [check["name"] for check in broken] == ["joint_position", "joint_position", "clearance"]
    assert broken[2]["message"] == "kuka/B5 and abb/A5 collide from 1.204 s to 1.377 s"
    assert record["joints"]["kuka"]["B5"]["margin"] < 0.0


def test_whole_cell_has_the_smallest_distance_of_all_classes(passed_run: Any, failed_run: Any) -> None:
    assert record_of(passed_run)["clearance"]["whole"]["pair"] == ["staubli/C3", "staubli/C6"]
    assert record_of(failed_run)["clearance"]["whole"]["minimum_mm"] == 0.0


def test_whole_cell_is_certified_only_when_every_class_is(passed_run: Any) -> None:
    clearance = passed_run.report.clearance
    certified = clearance.minima

    def whole_of(minima: Any) -> Any:
        report = replace(passed_run.report, clearance=replace(clearance, minima=minima))
        return record_of(replace(passed_run, report=report))["clearance"]["whole"]

    assert whole_of(certified)["certified"] is True
    part = ClearanceClass.PART
    assert whole_of({**certified, part: replace(certified[part], certified=False)})["certified"] is False


def test_closest_pairs_and_the_proof_are_reported(passed_run: Any) -> None:
    record = record_of(passed_run)
    assert record["closest_pairs"][0] == {
        "pair": ["staubli/C3", "staubli/C6"],
        "class": "self",
        "distance_mm": 41.0,
        "at_s": 3.06,
    }
    assert record["clearance_proof"] == {
        "assumption": "every joint moves linearly from each sample to the next",
        "margin": "the required clearance must cover controller deviation, calibration errors and elasticity",
        "not_certified": [],
        "distance_queries": 349,
        "contact_queries": 348,
        "cut_steps": 2,
    }


def test_what_does_not_exist_is_null(rail_run: Any) -> None:
    record = record_of(rail_run)
    endless = record["joints"]["reis"]["D6"]
    assert (endless["lower"], endless["upper"], endless["margin"]) == (None, None, None)
    assert endless["worst_at_s"] == endless["peak_velocity_at_s"]
    assert record["joints"]["reis"]["D1"]["unit"] == "mm"
    nothing = {
        "minimum_mm": None,
        "pair": None,
        "at_s": None,
        "certified": False,
        "exact": False,
        "points_mm": None,
        "accuracies_mm": None,
    }
    assert record["clearance"]["environment"] == nothing


def test_worst_instant_is_that_of_the_limit_which_is_nearer(passed_run: Any) -> None:
    use = replace(passed_run.report.joints[0], margin_at_s=1.0, peak_velocity_at_s=2.0, lower=-1.0, upper=1.0)
    tight = replace(use, margin=0.1, peak_velocity=0.5, velocity_limit=1.0)  # 90 % of the range, 50 % of the speed
    fast = replace(use, margin=0.8, peak_velocity=0.5, velocity_limit=1.0)  # 20 % of the range

    def worst(joint: Any) -> float:
        report = replace(passed_run.report, joints=(joint, *passed_run.report.joints[1:]))
        return float(record_of(replace(passed_run, report=report))["joints"]["reis"]["D1"]["worst_at_s"])

    assert (worst(tight), worst(fast)) == (1.0, 2.0)


def test_roles_tell_who_carries_and_who_works(passed_run: Any, pairwise_runs: Any) -> None:
    assert [entry["role"] for entry in record_of(passed_run)["motion_share"].values()] == [
        "positioner",
        "operator",
        "operator",
        "operator",
    ]
    alone = record_of(pairwise_runs["rhombus"])["motion_share"]
    assert {robot: entry["role"] for robot, entry in alone.items()} == {
        "reis": "positioner",
        "kuka": "idle",
        "abb": "operator",
        "staubli": "idle",
    }


def test_summary_of_several_runs_keeps_the_worst(pairwise_runs: Any) -> None:
    summary = summary_of(pairwise_runs)
    assert (summary["status"], summary["mode"], summary["cycle_time_s"]) == ("failed", "pairwise", 12.0)
    assert {name: run["status"] for name, run in summary["runs"].items()} == {
        "circle": "passed",
        "rhombus": "failed",
        "rectangle": "passed",
    }
    assert summary["runs"]["rhombus"]["folder"] == "rhombus"
    assert list(summary["tasks"]) == ["circle", "rhombus", "rectangle"]
    failed = record_of(pairwise_runs["rhombus"])
    assert summary["joints"]["kuka"]["B5"]["margin"] == failed["joints"]["kuka"]["B5"]["margin"]
    assert summary["clearance"]["whole"]["pair"] == ["kuka/B5", "abb/A5"]
    assert {check["phase"] for check in summary["checks"] if not check["passed"]} == {"rhombus"}


def test_merging_one_run_changes_nothing(passed_run: Any) -> None:
    joints = record_of(passed_run)["joints"]

    assert worst_of([joints]) == joints


def test_same_run_gives_the_same_bytes(failed_run: Any) -> None:
    first = as_json(phase_record(failed_run.report, cell=failed_run.cell, provenance=failed_run.provenance))
    assert as_json(phase_record(failed_run.report, cell=failed_run.cell, provenance=failed_run.provenance)) == first
    assert first.endswith("}\n")


def test_run_folder_knows_the_report_as_its_own(tmp_path: Path, passed_run: Any, pairwise_runs: Any) -> None:
    one = as_json(phase_record(passed_run.report, cell=passed_run.cell, provenance=passed_run.provenance))
    reports = {name: run.report for name, run in pairwise_runs.items()}
    several = as_json(whole_record(reports, cell=passed_run.cell, provenance=passed_run.provenance))
    for text in (one, several, one):  # each replaces the one before, which must be recognised
        with RunFolder(tmp_path / "run") as folder:
            folder.write_text("report.json", text)
        assert (tmp_path / "run" / "report.json").read_text(encoding="utf-8") == text


@given(st.floats(allow_nan=False, allow_infinity=False, min_value=-1e9, max_value=1e9))
def test_numbers_keep_twelve_digits(value: float) -> None:
    shown = number(value)
    assert shown is not None
    assert math.isclose(shown, value, rel_tol=5e-12)  # half a unit of the twelfth digit
    assert not (shown == 0.0 and math.copysign(1.0, shown) < 0.0)


def test_conversion_leaves_no_noise() -> None:
    assert number(math.degrees(math.radians(-185.0))) == -185.0
    assert (number(math.nan), number(math.inf), number(None), number(-0.0)) == (None, None, None, 0.0)


def test_failed_joints_are_reported_with_instant_and_place(passed_run: Any, failed_run: Any) -> None:
    for run, is_met in ((passed_run, True), (failed_run, None)):
        locked = (LockedJointEntry(robot="kuka", joint="B2", from_s=2.0),)
        cell = replace(run.cell, motion=replace(run.cell.motion, locked=locked))

        (record,) = read(as_json(phase_record(run.report, cell=cell, provenance=run.provenance)))["locked_joints"]

        index = list(run.report.times).index(2.0)
        assert (record["robot"], record["joint"], record["from_s"], record["unit"]) == ("kuka", "B2", 2.0, "deg")
        assert record["position"] == pytest.approx(math.degrees(run.report.q["kuka"][index, 1]))
        assert is_met is None or record["tasks_kept"] is is_met
    assert record_of(passed_run)["locked_joints"] == []


def test_speeds_in_the_world_are_reported_in_millimetres_per_second(passed_run: Any) -> None:
    speeds = record_of(passed_run)["speeds"]
    assert speeds["kuka"] == {
        "tool_peak_mm_s": 300.0,
        "tool_peak_at_s": 1.25,
        "share_above_250_mm_s": 0.25,
        "axis_peak_mm_s": 300.0,
        "axis": "C3",
        "axis_peak_at_s": 2.5,
    }


def closure(size: float, turn: float, times: Any) -> ClosureAccuracy:
    wave = np.sin(np.pi * times / times[-1])[:, None]
    axis = np.array([0.6, 0.0, 0.8])
    return ClosureAccuracy(
        robot="abb", axes=(0, 1, 5), position_error=size * wave * axis, orientation_error=turn * wave * axis
    )


def test_closures_are_reported_by_robot_with_what_is_allowed(passed_run: Any) -> None:
    report = replace(passed_run.report, closures=(closure(2e-6, 1e-5, passed_run.report.times),))

    record = read(as_json(phase_record(report, cell=passed_run.cell, provenance=passed_run.provenance)))["closure"]

    assert list(record) == ["abb"]
    assert record["abb"]["max_position_error_mm"] == pytest.approx(2e-3)
    assert record["abb"]["max_orientation_error_deg"] == pytest.approx(math.degrees(1e-5))
    assert record["abb"]["at_s"] == pytest.approx(0.5 * report.times[-1], abs=1e-3)
    assert record["abb"]["allowed"] == {"position_mm": 0.003, "orientation_deg": 0.001}
    assert record["abb"]["axes"] == ["x", "y", "rz"]
    assert record_of(passed_run)["closure"] == {}


def test_the_summary_states_the_worst_closure_of_all_runs(pairwise_runs: Any) -> None:
    first = pairwise_runs["circle"]
    sizes = {"circle": (1e-6, 3e-5), "rhombus": (2e-6, 1e-5)}
    reports = {
        name: replace(pairwise_runs[name].report, closures=(closure(*size, pairwise_runs[name].report.times),))
        for name, size in sizes.items()
    }

    record = read(as_json(whole_record(reports, cell=first.cell, provenance=first.provenance)))["closure"]["abb"]

    assert record["max_position_error_mm"] == pytest.approx(2e-3)
    assert record["max_orientation_error_deg"] == pytest.approx(math.degrees(3e-5))


def drifting(run: Any) -> Any:
    """The run with three cycles in which one joint drifts."""
    drifts = tuple(
        JointDrift(
            robot=use.robot,
            joint=use.joint,
            is_revolute=use.is_revolute,
            drift=np.array([0.0, 0.01, -0.02]) if use.joint == "B2" else np.zeros(3),
            worst=0.02 if use.joint == "B2" else 0.0,
            at_cycle=3 if use.joint == "B2" else 1,
        )
        for use in run.report.joints
    )
    result = Repeatability(cycle_times=np.array([0.0, 1.0, 2.0, 3.0]), drifts=drifts, closes=False)
    return replace(run, report=replace(run.report, repeatability=result))


def test_the_drift_of_every_joint_is_reported_by_task_or_for_all(passed_run: Any, pairwise_runs: Any) -> None:
    assert record_of(passed_run)["repeatability"] == {}
    result = record_of(drifting(passed_run))["repeatability"]["all"]
    runs = {name: drifting(run) for name, run in pairwise_runs.items()}

    assert (result["cycles"], result["period_s"], result["ends_s"], result["closes"]) == (
        3,
        1.0,
        [1.0, 2.0, 3.0],
        False,
    )
    assert (result["worst_drift_deg"], result["joint"], result["at_cycle"]) == (
        pytest.approx(math.degrees(0.02)),
        "kuka B2",
        3,
    )
    assert result["per_joint"]["kuka"]["B2"]["drift"] == pytest.approx([0.0, math.degrees(0.01), -math.degrees(0.02)])
    assert set(summary_of(runs)["repeatability"]) == set(runs)


def test_what_is_judged_of_a_settling_task_stands_beside_all_of_it(passed_run: Any) -> None:
    tasks = tuple(
        replace(task, settle=1.0, repeat=2) if task.name == "circle" else task for task in passed_run.cell.tasks
    )
    error = passed_run.report.accuracy[0].position_error.copy()
    error[0] = [0.3, 0.4, 0.0]
    accuracy = (replace(passed_run.report.accuracy[0], position_error=error), *passed_run.report.accuracy[1:])
    run = replace(
        passed_run,
        cell=replace(passed_run.cell, tasks=tasks),
        report=replace(passed_run.report, accuracy=accuracy),
    )

    task = record_of(run)["tasks"]["circle"]

    assert accuracy[0].task == "circle"
    assert (task["settle_s"], task["judged_from_s"], task["cycles"]) == (1.0, 1.0, 2)
    assert task["max_position_error_with_settling_mm"] == pytest.approx(500.0)
    assert task["max_position_error_mm"] < 1.0
    assert task["max_position_error_at_s"] >= 1.0
    other = record_of(run)["tasks"]["rhombus"]
    assert other["max_position_error_with_settling_mm"] == other["max_position_error_mm"]
