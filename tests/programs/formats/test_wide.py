"""The wide table: joints as in the plain format, and beside them what the checks found, in the units of the names."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from builders.home_to_home import PICK_AND_PLACE
from builders.run_jobs import job_of_run

from cellplan import Solution, VerifiedRun, export_program, load_cell, open_gate, solve, write_run
from cellplan.errors import InputError
from cellplan.geometry.transforms import inverse, roll_pitch_yaw, rotation_from_rpy
from cellplan.model.report.report import ClearanceClass
from cellplan.programs.formats.csv import render_csv
from cellplan.programs.formats.wide import WideRows, read_wide, wide_columns
from cellplan.programs.wide_table import read_wide_tables, render_wide_tables, solution_rows
from cellplan.runs.overrides import with_overrides
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")

POSE = ["x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg"]


@pytest.fixture(scope="module")
def run(sound: Path) -> VerifiedRun:
    return open_gate(sound / "run", cell=sound / "cell" / "small.yaml")


@pytest.fixture(scope="module")
def text(run: VerifiedRun) -> str:
    files = render_wide_tables(run)
    assert list(files) == ["wide.csv"]
    return files["wide.csv"]


@pytest.fixture(scope="module")
def table(text: str) -> pd.DataFrame:
    return pd.read_csv(io.StringIO(text))


@pytest.fixture(scope="module")
def in_turns(sound: Path) -> Solution:
    return solve(with_overrides(load_cell(sound / "cell" / "small.yaml"), mode="pairwise"))


def test_times_and_joints_are_those_of_the_plain_format(run: VerifiedRun, table: pd.DataFrame) -> None:
    for name, plain in render_csv(job_of_run(run)).items():
        expected = pd.read_csv(io.StringIO(plain))
        robot = name.removesuffix(".csv")
        columns = ["time_s", *(f"{robot}.{joint}" for joint in expected.columns[1:])]
        assert np.array_equal(table[columns].to_numpy(), expected.to_numpy())


def test_phase_path_and_process_are_those_of_the_clock(sound: Path, table: pd.DataFrame) -> None:
    clock = pd.read_csv(sound / "run" / "tables" / "clock.csv", comment="#")

    assert list(table["phase"]) == list(clock["phase"])
    assert np.array_equal(table["path.process"], clock["path_process"])
    np.testing.assert_allclose(table["sigma_s"], clock["sigma_s"], atol=1e-9)
    np.testing.assert_allclose(table["path.s_mm"], clock["path_s_mm"], atol=1e-9)


def test_tool_poses_on_the_part_are_those_of_another_kinematics(run: VerifiedRun, table: pd.DataFrame) -> None:
    model, right = CombinedModel(run.cell), run.cell.index("right")
    for row in (0, 17, 40):
        state = model.state(run.motion.q[row])
        expected = inverse(state.X_WP) @ state.X_WT[right]
        pose = table.loc[row, [f"path.{name}" for name in POSE]].to_numpy(float)
        np.testing.assert_allclose(pose[:3], 1e3 * expected[:3, 3], atol=1e-6)
        np.testing.assert_allclose(rotation_from_rpy(np.deg2rad(pose[3:])), expected[:3, :3], atol=1e-9)


def test_speeds_add_up_to_the_motion_and_feeds_to_the_path(run: VerifiedRun, table: pd.DataFrame) -> None:
    steps = np.diff(table["time_s"])
    for name in ("left.A_deg", "left.C_deg", "right.B_deg", "idle.A_deg"):
        speeds = table[f"{name}_s"]
        assert np.isnan(speeds.iloc[-1])
        np.testing.assert_allclose(np.cumsum(speeds[:-1] * steps), table[name][1:] - table[name][0], atol=1e-7)
    length = run.motions[0].report.accuracy[0].path_length
    assert (table["path.feed_mm_s"][:-1] * steps).sum() == pytest.approx(1e3 * length, rel=1e-3)  # chords of a curve
    peak = run.motions[0].report.speeds["right"].tool_peak
    assert table["right.tool_speed_mm_s"].max() == pytest.approx(1e3 * peak, abs=1e-8)


def test_errors_and_distances_have_the_extremes_of_the_report(run: VerifiedRun, table: pd.DataFrame) -> None:
    report = run.motions[0].report
    error = np.linalg.norm(report.accuracy[0].position_error, axis=1)
    assert table["path.position_error_mm"].max() == pytest.approx(1e3 * error.max(), abs=1e-9)
    for kind, minimum in report.clearance.minima.items():
        if minimum.minimum is not None and kind in report.clearance.curves:
            assert table[f"clearance_{kind}_mm"].min() == pytest.approx(1e3 * minimum.minimum, abs=0.1)


def test_a_distance_is_never_above_what_the_collision_engine_measures(run: VerifiedRun, table: pd.DataFrame) -> None:
    scene = Scene.from_cell(run.cell)
    poses = scene.body_poses(run.motion.q)
    watched = [pair for pair in scene.pairs if pair.solids is not None and pair.rule is Rule.CLEARANCE]
    compared = 0
    for kind in (ClearanceClass.ROBOT_ROBOT, ClearanceClass.ENVIRONMENT, ClearanceClass.SELF):
        pairs = [pair.solids for pair in watched if pair.clearance_class is kind]
        for row in range(0, 41, 8) if pairs else ():
            measured = min(scene.engine.proposed_direction(*pair, poses, sample=row)[0] for pair in pairs if pair)
            assert table[f"clearance_{kind}_mm"][row] <= 1e3 * measured + 1e-6
            compared += 1
    assert compared >= 6


def test_many_angles_are_those_of_one_rotation_after_the_other() -> None:
    rpy = np.random.default_rng(5).uniform([-3.1, -1.5, -3.1], [3.1, 1.5, 3.1], (40, 3))
    np.testing.assert_allclose(roll_pitch_yaw(np.array([rotation_from_rpy(angles) for angles in rpy])), rpy, atol=1e-12)
    upright = np.array([rotation_from_rpy((0.3, 0.5 * np.pi, 0.8))])
    np.testing.assert_allclose(rotation_from_rpy(roll_pitch_yaw(upright)[0]), upright[0], atol=1e-12)


def test_what_is_read_back_is_what_is_verified(run: VerifiedRun, text: str, tmp_path: Path) -> None:
    (read,) = read_wide_tables(run, {"wide.csv": text})
    for robot, joints in run.motions[0].tables.items():
        assert np.abs(read[robot].q - joints.q).max() <= np.deg2rad(0.5e-9) + 1e-15

    assert export_program(run, tmp_path / "wide", form="wide") == ("wide.csv",)
    assert (tmp_path / "wide" / "wide.csv").read_text() == text


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ("left.B_deg", "left.X_deg", r"wide.csv:1: expected one column 'left.B_deg', got 0"),
        ("right.A_deg,", "left.A_deg,", r"wide.csv:1: expected one column 'left.A_deg', got 2"),
        ("50.000000000", "nan", r"wide.csv:2: expected 4 numbers with 9 decimals, got "),
        ("50.000000000,", "", r"wide.csv:2: expected \d+ fields, got \d+"),
        ("\n", "\r\n", r"wide.csv:1: expected line breaks without '\\r'"),
    ],
)
def test_anything_else_is_refused(run: VerifiedRun, text: str, old: str, new: str, finding: str) -> None:
    with pytest.raises(InputError, match=finding):
        read_wide(run.cell, text.replace(old, new, 1), "wide.csv")


def test_a_table_that_was_cut_off_is_refused(run: VerifiedRun, text: str) -> None:
    with pytest.raises(InputError, match="expected the last row to end with a line break"):
        read_wide(run.cell, text[:-1], "wide.csv")


def test_tasks_in_turns_have_a_table_each(in_turns: Solution, sound: Path, tmp_path: Path) -> None:
    write_run(in_turns, tmp_path / "run")
    verified = open_gate(tmp_path / "run", cell=sound / "cell" / "small.yaml")

    assert export_program(verified, tmp_path / "programs", form="wide") == ("path/wide.csv",)


def test_two_columns_of_the_same_name_are_refused(in_turns: Solution) -> None:
    rows = solution_rows(in_turns)
    task = rows.phases[0].schedule.tasks[0]

    class Renamed(WideRows):
        """Its task has the name of a robot with a joint that slides along x."""

        @property
        def tasks(self) -> tuple[str, ...]:
            return (task.task.name, task.task.name)

    twice = Renamed(cell=rows.cell, times=rows.times, sigma=rows.sigma, phases=rows.phases, process=rows.process)
    with pytest.raises(InputError, match=r"expected every column once, got 'path\.feed_mm_s'"):
        wide_columns(twice)


@pytest.mark.slow
def test_a_program_of_two_cycles_is_one_table_that_is_verified(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(f"{PICK_AND_PLACE}  cycles: 2\n", encoding="utf-8")
    solution = solve(load_cell(tmp_path / "cell.yaml"))
    write_run(solution, tmp_path / "run")
    verified = open_gate(tmp_path / "run", cell=tmp_path / "cell.yaml")

    assert export_program(verified, tmp_path / "wide", form="wide") == ("wide.csv",)
    table = pd.read_csv(tmp_path / "wide" / "wide.csv")
    clock = pd.read_csv(tmp_path / "run" / "tables" / "clock.csv", comment="#")
    joints = pd.read_csv(tmp_path / "run" / "tables" / "pen.csv", comment="#")
    assert list(table["phase"]) == list(clock["phase"])
    for name in joints.columns[1:]:
        np.testing.assert_allclose(table[f"pen.{name}"], joints[name], atol=1e-9)
    count = len(table) // 2  # the second cycle repeats the rows of the first, whose last row it begins in
    first, second = table["seam.position_error_mm"][:count], table["seam.position_error_mm"][count:-1]
    np.testing.assert_array_equal(first.to_numpy(), second.to_numpy())


@pytest.mark.slow
def test_rows_that_phases_share_count_to_the_later_one(tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(PICK_AND_PLACE, encoding="utf-8")
    solution = solve(load_cell(tmp_path / "cell.yaml"))
    columns = wide_columns(solution_rows(solution))
    clock = pd.read_csv(io.StringIO(solution.program.clock), comment="#")
    joints = pd.read_csv(io.StringIO(solution.program.tables["pen"]), comment="#")

    assert list(columns["phase"]) == list(clock["phase"])
    for task in ("seam", "ring"):
        at_work = clock["phase"].str.startswith("work") & (clock[f"{task}_process"] == 1)
        assert np.array_equal(columns[f"{task}.process"], clock[f"{task}_process"])
        assert np.isfinite(np.asarray(columns[f"{task}.position_error_mm"])[at_work]).all()
    name = joints.columns[1]
    steps, speeds = np.diff(clock["time_s"]), np.asarray(columns[f"pen.{name}_s"])
    np.testing.assert_allclose(speeds[:-1] * steps, np.diff(joints[name]), atol=1e-7)
    assert np.isnan(speeds[-1])


def test_numpy_reads_it_with_all_names(text: str, table: pd.DataFrame) -> None:
    array = np.genfromtxt(io.StringIO(text), delimiter=",", names=True, deletechars="")

    assert list(array.dtype.names) == list(table.columns)
    for name in table.columns.drop("phase"):
        assert np.array_equal(array[name], table[name], equal_nan=True)
