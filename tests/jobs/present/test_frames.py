"""Frames hold what the files hold: values of report.json, of series.json, of study.csv and of the tables."""

import io
import json
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import cellplan
from cellplan import Cell, Report, Solution, VerifiedRun, load_cell, open_gate, solve, tables, to_frame
from cellplan.cli.main import run as run_cli
from cellplan.errors import ExitStatus, InputError, MissingPackageError
from cellplan.files.run.joint_tables import parse_table
from cellplan.jobs.screen import screen
from cellplan.jobs.sweep.result import study_record, study_table
from cellplan.planning.layout_screening import Candidates, Screening
from cellplan.programs.wide_table import render_wide_tables
from cellplan.report.record.figures import KEY, figures_of

pytestmark = pytest.mark.usefixtures("stored_solutions")

UNITS = re.compile(r"_(s|mm|deg|rad|ms|mm_s|deg_s|mm_s2|deg_s2)$|\.(x|y|z|rx|ry|rz)$|_per_h$|_m_or_rad$")
UNIT_BESIDE = {"value", "limit", "min", "max", "lower", "upper", "margin", "travel", "start", "busiest_joint_travel"}
PLAIN = {
    "share",
    "steady_share",
    "cycles",
    "repeat",
    "slower_count",
    "candidate",
    "joints",
    "jerk_limit",
    "share_above_250_mm_s",
}


@pytest.fixture(scope="module")
def cell(sound: Path) -> Cell:
    return load_cell(sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def solution(cell: Cell) -> Solution:
    return solve(cell)


@pytest.fixture(scope="module")
def verified(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def report(solution: Solution) -> Report:
    return solution.runs[0].report


@pytest.fixture(scope="module")
def record(sound: Path) -> dict[str, Any]:
    return json.loads((sound / "run" / "report.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def screening(cell: Cell, solution: Solution) -> Screening:
    start = np.concatenate([robot.start for robot in solution.cell.robots])
    moved = cell.with_values({"robots.right.base.x_mm": 5000})
    return screen(solution.cell, Candidates.of([solution.cell, moved], np.array([start, start])))


def same(value: Any, expected: Any) -> bool:
    """Whether a value of a frame is that of a record, where null is no number."""
    return pd.isna(value) if expected is None else value == expected


def test_joints_and_clearance_are_those_of_the_report(sound: Path, record: dict[str, Any]) -> None:
    joints = to_frame(sound / "run", "joints").set_index(["robot", "joint"])
    expected = {(robot, joint): entry for robot, named in record["joints"].items() for joint, entry in named.items()}
    assert set(joints.index) == set(expected)
    assert all(same(joints.loc[place, key], value) for place, entry in expected.items() for key, value in entry.items())
    clearance = to_frame(sound / "run", "clearance").set_index("class")
    for kind, entry in record["clearance"].items():
        assert all(same(clearance.loc[kind, key], entry[key]) for key in ("minimum_mm", "at_s", "certified"))
        pair = entry["pair"] or [None, None]
        assert all(same(clearance.loc[kind, key], body) for key, body in zip(("first", "second"), pair, strict=True))


def test_checks_and_tasks_are_those_of_the_report(sound: Path, record: dict[str, Any]) -> None:
    checks = to_frame(sound / "run")
    assert list(checks.columns) == ["phase", *record["checks"][0]]
    expected = pd.DataFrame(record["checks"])  # as plain pandas reads the file
    pd.testing.assert_frame_equal(checks.drop(columns="phase"), expected, check_dtype=False)
    flat = pd.json_normalize([{"task": name, **task} for name, task in record["tasks"].items()])
    frame = to_frame(sound / "run", "tasks")
    flat = flat.astype(object).where(flat.notna(), np.nan)
    pd.testing.assert_frame_equal(frame[list(flat.columns)], flat, check_dtype=False)


def test_all_ways_to_a_run_give_the_same_frames(
    sound: Path, solution: Solution, verified: VerifiedRun, report: Report
) -> None:
    for name in (table for table in tables(verified) if table != "motion"):
        frame = to_frame(verified, name)
        for other in (solution, sound / "run"):
            pd.testing.assert_frame_equal(to_frame(other, name), frame, rtol=1e-6, atol=1e-9)
        if name in tables(report):
            listed = report.to_frame(name)
            pd.testing.assert_frame_equal(listed, frame[list(listed.columns)], rtol=1e-6, atol=1e-9)
    pd.testing.assert_frame_equal(solution.to_frame("joints"), to_frame(solution, "joints"))


def test_the_motion_is_the_wide_table(verified: VerifiedRun) -> None:
    frame = verified.to_frame("motion")
    written = pd.read_csv(io.StringIO(render_wide_tables(verified)["wide.csv"]))
    pd.testing.assert_frame_equal(frame, written, check_dtype=False, rtol=0.0, atol=1e-9)
    assert tables(verified)[0] == "motion"


def test_curves_are_those_of_series_json(sound: Path, report: Report) -> None:
    series = json.loads((sound / "run" / "series.json").read_text(encoding="utf-8"))
    frame = to_frame(series)
    assert list(frame["time_s"]) == series["times_s"]
    for robot, joints in series["joints"].items():
        for joint, curves in joints.items():
            assert list(frame[f"{robot}.{joint}.position_deg"]) == curves["position_deg"]
            assert list(frame[f"{robot}.{joint}.speed_deg_s"][:-1]) == curves["speed_deg_s"]
            assert np.isnan(frame[f"{robot}.{joint}.speed_deg_s"].iloc[-1])
    pd.testing.assert_frame_equal(to_frame(sound / "run", "curves").drop(columns="phase"), frame, check_dtype=False)
    listed = report.to_frame("curves")
    pd.testing.assert_frame_equal(listed, frame[list(listed.columns)], rtol=1e-6, atol=1e-6, check_dtype=False)


def test_plain_readers_read_what_our_own_reader_reads(sound: Path) -> None:
    """One line of pandas and one of numpy, as the guide shows them."""
    path = sound / "run" / "tables" / "right.csv"
    table = parse_table(path.read_text(encoding="utf-8"), "right.csv")
    frame = pd.read_csv(path, comment="#")
    with path.open(encoding="utf-8") as file:
        array = np.genfromtxt((line for line in file if not line.startswith("#")), delimiter=",", names=True)

    assert list(frame.columns) == list(array.dtype.names) == ["time_s", *(f"{joint}_deg" for joint in table.joints)]
    for column in frame.columns:
        assert np.array_equal(frame[column], array[column])
    assert np.array_equal(frame["time_s"], table.times)
    np.testing.assert_allclose(np.deg2rad(frame.iloc[:, 1:]), table.q, rtol=1e-15)


def test_a_program_in_turns_names_its_phases(sound: Path) -> None:
    from builders.two_phases import PAIR

    folder = sound.parent / "turns"
    folder.mkdir(exist_ok=True)
    (folder / "turns.yaml").write_text(PAIR, encoding="utf-8")
    both = solve(load_cell(folder / "turns.yaml"))
    motion, joints = both.to_frame(), both.to_frame("joints")

    assert list(dict.fromkeys(motion["phase"])) == list(dict.fromkeys(joints["phase"])) == ["first", "second"]
    clock = pd.read_csv(io.StringIO(both.program.clock), comment="#")
    assert list(motion["phase"]) == list(clock["phase"])
    assert motion.loc[motion["phase"] == "second", "first.position_error_mm"].isna().all()
    last = motion.index[motion["phase"] == "first"][-1]
    assert np.isnan(motion.loc[last, "left.A_deg_s"])  # no step leads from one phase to the next
    whole = pd.read_csv(io.StringIO(both.program.tables["left"]), comment="#")
    np.testing.assert_allclose(motion["left.A_deg"], whole["A_deg"], atol=1e-12)


def test_a_sweep_is_its_table(report: Report) -> None:
    header = {"kind": "sweep", "cell": "small-pair", "settings": {}, "task": None}
    header |= {"vary": {"motion.duration_s": [1, 2]}, "inputs": {}, "versions": {}}
    figures = figures_of([report]).record(KEY)
    trials = [
        {"trial": 0, "values": {"motion.duration_s": 1}, "status": "passed", "reason": "", "figures": figures},
        {"trial": 1, "values": {"motion.duration_s": 2}, "status": "bad_input", "reason": "no, it's", "figures": {}},
    ]
    record = study_record(header, trials)
    frame = to_frame(record)

    expected = pd.read_csv(io.StringIO(study_table(record)), keep_default_na=False, na_values={"cycle_time_s": [""]})
    assert set(frame.columns) == set(expected.columns)
    for name in ("trial", "motion.duration_s", "cycle_time_s", "status", "reason"):
        assert all(same(a, None if pd.isna(b) else b) for a, b in zip(frame[name], expected[name], strict=True))
    assert np.isnan(frame["min_margin_deg"][1])


def test_a_screening_has_a_row_for_each_layout_and_joint(screening: Screening, solution: Solution) -> None:
    layouts, joints = screening.to_frame(), screening.to_frame("joints")
    assert list(layouts["is_followed"]) == [True, False]
    assert len(joints) == 2 * solution.cell.joint_count
    first = joints[joints["candidate"] == 0]
    np.testing.assert_allclose(first["margin"], np.rad2deg(screening.margins[0]), rtol=1e-9)
    assert layouts["min_margin_deg"][0] == pytest.approx(first["margin"].min())
    assert repr(screening).startswith("<Screening of 2 layouts: 1 follow the paths")


def test_every_number_has_a_unit_or_none(sound: Path, solution: Solution, cell: Cell, screening: Screening) -> None:
    silent = set()
    for result in (solution, sound / "run", cell, screening):
        for name in tables(result):
            frame = to_frame(result, name).dropna(axis=1, how="all")
            numbers = [column for column in frame.select_dtypes("number").columns if not UNITS.search(column)]
            rest = {column for column in numbers if not ("unit" in frame and is_in_unit(column))}
            silent |= {column for column in rest if column not in PLAIN and not is_dimensionless(column)}
    assert silent == set()


def is_in_unit(column: str) -> bool:
    """Whether the column ``unit`` says what it is in."""
    return column in UNIT_BESIDE or column.startswith(("peak_", "velocity_", "acceleration_", "jerk_"))


def is_dimensionless(column: str) -> bool:
    """Ratios, counts, flags, and figures of the Jacobian, which mixes units."""
    kinds = ("_ratio", ".process", "singular_value", "condition", "manipulability", "_count", "_trial", "_share")
    return column.endswith(kinds) or column in {"iterations", "slack"}


def test_what_is_no_result_or_has_no_such_table_is_refused(solution: Solution, sound: Path) -> None:
    with pytest.raises(
        InputError, match=r"expected one of the tables motion, checks, joints, .* got 'joint', did you mean 'joints'"
    ):
        solution.to_frame("joint")
    with pytest.raises(InputError, match="expected a result, a record or a path, got list"):
        to_frame([1])
    with pytest.raises(InputError, match="expected a record of cellplan, got one with schema None"):
        to_frame({"joints": {}})
    with pytest.raises(InputError, match=r"nothing\.json: "):
        to_frame(sound / "nothing.json")


def test_without_pandas_the_line_that_installs_it_is_named(solution: Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)

    with pytest.raises(MissingPackageError, match=r"pip install 'cellplan\[frames\]'") as missing:
        solution.to_frame()
    assert isinstance(missing.value, ImportError)
    assert missing.value.status is ExitStatus.BAD_INPUT
    assert tables(solution)[0] == "motion"  # names need no pandas


@pytest.mark.slow
def test_records_of_all_studies_have_tables(sound: Path, cells: Path, tmp_path: Path) -> None:
    """Of real searches, as the commands write them: each table has a row for each entry of the record."""
    pair, quick = str(cells / "planar_pair.yaml"), ["--set", "motion.step_s=0.02", "-q"]
    vary = ["--vary", "right.base={x_mm: [1500, 2300], y_mm: [0, 600]}"]
    commands = {
        "layout": ["layout", pair, *quick, *vary, "--trials", "1"],
        "map": ["map", pair, "--robot", "right", "--grid", "400", "-q"],
        "fastest": ["fastest", pair, "-q"],
    }
    small = str(sound / "cell" / "small.yaml")
    (tmp_path / "errors.yaml").write_text("cellplan_errors: 1\nrobots: {right: {base: {xyz_mm: [0.5, 0, 0]}}}\n")
    commands["rehearse"] = ["rehearse", small, "--errors", str(tmp_path / "errors.yaml"), "-q"]
    commands["compare"] = ["compare", pair, *quick]
    commands["repair"] = ["layout", small, "--repair", "--clearance", "200", "-q"]
    for name, command in commands.items():
        assert run_cli([*command, "-o", str(tmp_path / name)]) in {0, 1}
    assert len(to_frame(tmp_path / "compare")) == len(record_of(tmp_path / "compare" / "study.json")["variants"])
    advice = record_of(tmp_path / "repair" / "advice.json")
    assert list(to_frame(tmp_path / "repair")["text"]) == [remedy["text"] for remedy in advice["remedies"]] != []
    rehearsed = record_of(tmp_path / "rehearse" / "rehearsal.json")["tasks"]["path"]["before"]
    error = to_frame(tmp_path / "rehearse")["before.max_position_error_mm"]
    assert list(error) == [rehearsed["max_position_error_mm"]]
    assert len(to_frame(tmp_path / "layout")) == len(record_of(tmp_path / "layout" / "study.json")["top"])
    assert len(to_frame(tmp_path / "map")) == len(record_of(tmp_path / "map" / "map.json")["places"])
    curve = pd.read_csv(next((tmp_path / "fastest").glob("*.csv")))
    frame = to_frame(tmp_path / "fastest")
    shown = curve[curve["law"].isin(["time_laws", "common_speed"])].reset_index(drop=True)
    np.testing.assert_allclose(frame["cycle_time_s"], shown["cycle_time_s"])
    for place in commands:
        assert cellplan.to_html(tmp_path / place).count("<table") >= 1


def record_of(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))
