"""ROS 2 trajectories: read by YAML as messages that a controller takes, and read back to the same points."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import yaml
from builders.export_jobs import job_of
from builders.stream_jobs import (
    cell_for,
    is_within_limits,
    largest_error,
    round_trip,
    smooth_program,
    timed_job,
)

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise, RobotRows
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.formats.ros2.reader import read_ros2
from cellplan.programs.formats.ros2.writer import render_ros2

ROS2 = DIALECTS["ros2"]
HALF = 0.5e-9 + 1e-15  # [rad], [m] half of the last decimal, and room for the arithmetic
PLAIN = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]+)?")


def with_rows(job: ExportJob, **changes: object) -> ExportJob:
    """The job with something changed in the rows of its first robot."""
    (program,) = job.programs
    first = job.frame.robots[0]
    rows = replace(program.robots[first], **changes)  # type: ignore[arg-type]
    return replace(job, programs=(replace(program, robots={**program.robots, first: rows}),))


def on_times(job: ExportJob, times: np.ndarray) -> ExportJob:
    """The job with other times of all robots, its speeds scaled so that they fit."""
    (program,) = job.programs
    robots = {}
    for name, rows in program.robots.items():
        assert rows.times is not None
        assert rows.qd is not None
        velocities = np.zeros_like(rows.q)
        h, s = np.diff(times)[:, None], np.diff(rows.q, axis=0) / np.diff(times)[:, None]
        velocities[1:-1] = (h[:-1] * s[1:] + h[1:] * s[:-1]) / (h[:-1] + h[1:])
        robots[name] = replace(rows, times=times, qd=velocities)
    return replace(job, programs=(ProgramRows(name=program.name, robots=robots),))


@pytest.mark.parametrize("seed", range(4))
def test_points_and_speeds_come_back_within_half_of_the_last_decimal(seed: int) -> None:
    job = timed_job(seed=seed, end=0.9)

    _, (read,) = round_trip(ROS2, job)

    for name, rows in read.robots.items():
        mine = job.programs[0].robots[name]
        assert mine.qd is not None
        assert rows.qd is not None
        limits = 2.0 * HALF  # a position at a limit is rounded inwards
        assert largest_error(job, [read], name).max() <= limits
        assert np.abs(rows.qd - mine.qd).max() <= HALF
        assert np.abs(rows.times - mine.times).max() <= HALF
        assert is_within_limits(job.frame.robot(name), rows.q)
        assert rows.process is None
        assert rows.marks == ()


def test_yaml_reads_messages_with_numbers_of_the_right_kind_and_size() -> None:
    job = timed_job(seed=2, end=0.5, cycle=0.02)
    assert job.frame.promise is Promise.TIMED

    for path, text in render_ros2(job).items():
        message = yaml.safe_load(text)
        robot = job.frame.robot(path.removesuffix(".yaml"))
        names = [f"{robot.name}/{joint.name}" for joint in robot.model.joints]
        assert list(message) == ["joint_names", "points"]
        assert message["joint_names"] == names
        for point in message["points"]:
            assert list(point) == ["positions", "velocities", "time_from_start"]
            assert all(type(number) is float for key in ("positions", "velocities") for number in point[key])
            assert len(point["positions"]) == len(point["velocities"]) == len(names)
            assert all(type(point["time_from_start"][key]) is int for key in ("sec", "nanosec"))
            assert 0 <= point["time_from_start"]["nanosec"] < 10**9
        whole = [
            10**9 * point["time_from_start"]["sec"] + point["time_from_start"]["nanosec"] for point in message["points"]
        ]
        assert whole[0] == 0
        assert min(np.diff(whole)) > 0
        assert set(message["points"][0]["velocities"]) == set(message["points"][-1]["velocities"]) == {0.0}
        numbers = re.findall(r"[-+0-9.eE]*[0-9][-+0-9.eE]*", text[text.index("points:") :])
        assert all(PLAIN.fullmatch(number) for number in numbers)


def test_positions_count_from_the_model_in_radians_and_metres() -> None:
    job = timed_job(seed=3, end=0.5, cycle=0.02)
    (program,) = job.programs

    message = yaml.safe_load(render_ros2(job)["beta.yaml"])

    written = np.array([point["positions"] for point in message["points"]])
    assert np.abs(written - program.robots["beta"].q).max() <= 2.0 * HALF
    assert message["joint_names"][0] == "beta/rail"


def test_speeds_are_the_derivative_of_the_positions() -> None:
    job = timed_job(seed=4)

    _, (read,) = round_trip(ROS2, job)

    for rows in read.robots.values():
        assert rows.qd is not None
        assert rows.times is not None
        h = rows.times[1]
        central = (rows.q[2:] - rows.q[:-2]) / (2.0 * h)
        jerk = np.abs(np.diff(rows.q, n=3, axis=0)).max() / h**3
        bend = jerk * h**2 / 6.0  # of a central difference
        jump = np.abs(np.diff(rows.q, n=2, axis=0)).max() / h / 4.0  # in the step that a rest ends in
        assert np.abs(rows.qd[1:-1] - central).max() <= bend + jump + 1e-6


@pytest.mark.parametrize(
    ("second", "expected"),
    [
        (0.9999999999, (1, 0)),
        (0.99999999949, (0, 999999999)),
        (1.9999999996, (2, 0)),
        (0.1 + 0.2, (0, 300000000)),
        (123456.7890123456, (123456, 789012346)),
    ],
)
def test_nanoseconds_carry_into_seconds(second: float, expected: tuple[int, int]) -> None:
    job = timed_job(end=0.3, cycle=0.1, seed=1)
    times = np.array([0.0, 0.5, 1.0, 1.5]) * second
    times[3] = 2.0 * second

    text = render_ros2(on_times(job, times))["alpha.yaml"]

    point = yaml.safe_load(text)["points"][2]["time_from_start"]
    assert (point["sec"], point["nanosec"]) == expected


def test_rows_within_one_nanosecond_are_refused() -> None:
    job = timed_job(end=0.3, cycle=0.1, seed=1)
    still = {name: replace(rows, q=rows.q[[0, 0, 0, 0]]) for name, rows in job.programs[0].robots.items()}
    job = replace(job, programs=(ProgramRows(name=None, robots=still),))

    with pytest.raises(InputError, match="expected rows that are a nanosecond apart or more"):
        render_ros2(on_times(job, np.array([0.0, 1.0, 1.0 + 2e-10, 2.0])))


def test_a_long_program_is_split_where_all_robots_rest() -> None:
    job = timed_job(seed=5, end=1.2, cycle=0.02, rests=(0.3, 0.6, 0.9), split=25)

    files, (read,) = round_trip(ROS2, job)

    assert len(files) == 12
    for name in job.frame.robots:
        parts = [yaml.safe_load(files[f"{name}_{part}_of_4.yaml"])["points"] for part in (1, 2, 3, 4)]
        assert max(map(len, parts)) <= 25
        for part in parts:
            assert part[0]["time_from_start"] == {"sec": 0, "nanosec": 0}
            assert set(part[0]["velocities"]) == set(part[-1]["velocities"]) == {0.0}
        for early, late in pairwise(parts):
            assert early[-1]["positions"] == late[0]["positions"]
        assert np.array_equal(read.robots[name].times, np.round(job.programs[0].robots[name].times, 9))  # type: ignore[arg-type]
        assert largest_error(job, [read], name).max() <= 2.0 * HALF


def test_a_split_without_rests_says_how_many_points_it_takes() -> None:
    job = timed_job(seed=5, end=2.4, cycle=0.01, rests=(0.5,), split=100)

    with pytest.raises(InputError) as refusal:
        render_ros2(job)

    assert str(refusal.value).startswith("--split: expected 181 or more, as a trajectory can be split only where all")
    assert "0.500 s to 2.300 s, got 100" in str(refusal.value)


def test_a_message_that_is_too_long_asks_for_a_split() -> None:
    job = timed_job(end=1.2, cycle=1e-5, robots=("gamma",))

    with pytest.raises(InputError, match=r"^--split: expected the most points .* as the program has 120001"):
        render_ros2(job)


def test_a_split_into_single_points_is_refused() -> None:
    with pytest.raises(InputError, match=r"^--split: expected 2 points or more, got 1"):
        render_ros2(timed_job(split=1))


def test_a_robot_that_moves_at_its_last_row_is_refused() -> None:
    job = timed_job(end=0.6, cycle=0.01)
    rows = job.programs[0].robots["alpha"]
    assert rows.qd is not None
    half = len(rows) // 2
    cut = {
        name: RobotRows(robot=name, q=rows.q[:half], qd=rows.qd[:half], times=rows.times[:half])  # type: ignore[index]
        for name, rows in job.programs[0].robots.items()
    }

    with pytest.raises(InputError, match="robot 'alpha': expected rest at its last row"):
        render_ros2(replace(job, programs=(ProgramRows(name=None, robots=cut),)))


@pytest.mark.parametrize(
    "wrong",
    [
        pytest.param(lambda qd: -qd, id="the other way round"),
        pytest.param(lambda qd: 1.1 * qd, id="a tenth too fast"),
        pytest.param(np.rad2deg, id="degrees"),
        pytest.param(np.zeros_like, id="zeros"),
        pytest.param(lambda qd: np.roll(qd, 3, axis=0), id="three rows late"),
        pytest.param(lambda qd: qd[:, ::-1], id="joints in another order"),
        pytest.param(lambda qd: 0.004 * qd, id="per cycle"),
    ],
)
def test_speeds_that_do_not_fit_the_positions_are_refused(wrong: "np.ufunc") -> None:
    job = timed_job(seed=1)
    rows = job.programs[0].robots["alpha"]
    other = wrong(rows.qd)
    other[[0, -1]] = 0.0
    files = render_ros2(with_rows(job, qd=other))

    with pytest.raises(InputError, match=r"alpha\.yaml:[0-9]+: expected a velocity of joint a[1-6] near the slopes"):
        read_ros2(job.frame, files)


def test_one_wrong_speed_is_refused_with_its_line() -> None:
    job = timed_job(seed=1)
    rows = job.programs[0].robots["alpha"]
    assert rows.qd is not None
    other = rows.qd.copy()
    other[150, 0] += 0.2
    files = render_ros2(with_rows(job, qd=other))
    line = 1 + files["alpha.yaml"].split("points:")[0].count("\n") + 1 + 150

    with pytest.raises(InputError, match=rf"^alpha\.yaml:{line}: expected a velocity of joint a1"):
        read_ros2(job.frame, files)


@pytest.mark.parametrize("decimals", [0, 5, 7])
def test_decimals_of_programs_do_not_count_in_a_trajectory(decimals: int) -> None:
    cell, plain = (cell_for("ros", decimals=stated) for stated in (decimals, None))
    jobs = [job_of(entry, smooth_program(entry), promise=Promise.TIMED) for entry in (cell, plain)]

    files, (read,) = round_trip(ROS2, jobs[0])

    assert files == render_ros2(jobs[1])
    assert largest_error(jobs[0], [read], "alpha").max() <= 1e-9 + 1e-15


def test_names_of_joints_cannot_break_out() -> None:
    job = timed_job(end=0.6, cycle=0.012)
    cell = job.frame.cell
    names = ['a"]', "ä: {b}", "x #y", "\\n\n", "\U0001f600", "yes"]
    model = cell.robots[0].model
    joints = tuple(replace(joint, name=name) for joint, name in zip(model.joints, names, strict=True))
    robots = (replace(cell.robots[0], model=replace(model, joints=joints)), *cell.robots[1:])
    job = replace(job, frame=replace(job.frame, cell=replace(cell, robots=robots)), notes=("a\nb: [", "äöü # ]]"))

    files, _ = round_trip(ROS2, job)

    assert all(letter == "\n" or " " <= letter <= "~" for letter in files["alpha.yaml"])
    assert yaml.safe_load(files["alpha.yaml"])["joint_names"] == [f"alpha/{name}" for name in names]


def test_same_job_same_text() -> None:
    assert render_ros2(timed_job(seed=7)) == render_ros2(timed_job(seed=7))


def test_tasks_have_folders() -> None:
    cell = cell_for("ros")
    programs = [smooth_program(cell, name=name, seed=k, end=0.5) for k, name in enumerate(("one", "two"))]
    job = job_of(cell, *programs, promise=Promise.TIMED)

    files, read = round_trip(ROS2, job)

    assert sorted(files) == [f"{task}/{robot}.yaml" for task in ("one", "two") for robot in ("alpha", "beta", "gamma")]
    assert [program.name for program in read] == ["one", "two"]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("points:\n", "points:   # all of them\n\n  # a remark\n"),
        ("positions: [", "positions:  [  "),
        ("], velocities", "  ] ,  velocities"),
        ("  - {", "  -   { "),
        ("nanosec: 0}}", "nanosec:  0 }  } # first"),
        ("joint_names: [", "joint_names:   [ "),
        ('", "', '" ,   "'),
        ("...\n", "...  # end\n\n# after\n"),
        ("\n", "\n# before\n"),
        ("  - {", "- {"),
        ("\n", "\r\n"),
    ],
)
def test_harmless_variants_are_read(old: str, new: str) -> None:
    job = timed_job(end=0.4, cycle=0.02)
    files = render_ros2(job)
    (same,) = read_ros2(job.frame, files)

    (read,) = read_ros2(job.frame, {path: text.replace(old, new) for path, text in files.items()})

    assert all(np.array_equal(read.robots[name].q, rows.q) for name, rows in same.robots.items())
    assert yaml.safe_load(files["beta.yaml"].replace(old, new))


@pytest.mark.slow
def test_a_hundred_thousand_rows_keep_all_limits() -> None:
    for seed in (5,):
        job = timed_job(seed=seed, end=40.0, rests=(10.0, 20.0, 30.0), cycle=0.001)

        _, (read,) = round_trip(ROS2, job)

        for name, rows in read.robots.items():
            assert is_within_limits(job.frame.robot(name), rows.q)
            assert largest_error(job, [read], name).max() <= 2.0 * HALF
