"""Streams: rows at the cycle as any CSV reader sees them, figures recomputed from the file, and a way back."""

import csv
import hashlib
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from builders.export_jobs import NAMES, job_of
from builders.stream_jobs import (
    cell_for,
    is_within_limits,
    largest_error,
    round_trip,
    smooth_program,
    timed_job,
    with_latency,
)

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise
from cellplan.model.settings.controllers import KindName
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.formats.stream.writer import render_stream

STREAM = DIALECTS["stream"]
UNIT = {"deg": np.pi / 180.0, "mm": 1e-3}


def table_of(text: str) -> tuple[list[str], Array]:
    """Names and numbers of a stream, by the reader of the standard library."""
    names, *rows = csv.reader(io.StringIO(text))
    return names, np.array(rows, dtype=float)


@pytest.mark.parametrize("seed", range(4))
def test_positions_come_back_within_half_of_the_last_decimal(seed: int) -> None:
    job = timed_job(seed=seed, end=0.8)

    files, (read,) = round_trip(STREAM, job)

    assert sorted(files) == [f"{name}{end}" for name in NAMES[:3] for end in (".csv", ".json")]
    for name, rows in read.robots.items():
        model = job.frame.robot(name).model
        unit = np.array([UNIT[joint.display_unit.name] for joint in model.joints])
        coupled = 1.0 if model.controller is None else 1.0 + np.abs(model.controller.coupling).sum(axis=1)
        inwards = 2.0  # half of the last decimal, or all of it at a limit
        assert np.all(largest_error(job, [read], name) <= inwards * coupled * 0.5e-6 * unit + 1e-14)
        assert is_within_limits(job.frame.robot(name), rows.q)
        assert np.array_equal(rows.process, job.programs[0].robots[name].process)  # type: ignore[arg-type]
        assert rows.qd is None


def test_columns_are_the_axes_of_the_controller_arm_first() -> None:
    files = render_stream(timed_job())

    arm = "A1_deg,A2_deg,A3_deg,A4_deg,A5_deg,A6_deg"
    assert files["alpha.csv"].splitlines()[0] == f"k,t_s,{arm},process"
    assert files["beta.csv"].splitlines()[0] == f"k,t_s,{arm},E1_mm,process"
    assert files["gamma.csv"].splitlines()[0] == "k,t_s,E1_deg,E2_deg,process"
    axes = json.loads(files["beta.json"])["axes"]
    assert [(axis["axis"], axis["joint"], axis["unit"]) for axis in axes][-2:] == [
        ("A6", "a6", "deg"),
        ("E1", "rail", "mm"),
    ]


def test_positions_are_those_that_the_controller_shows() -> None:
    """Zero, sign and coupling by the definition, joint by joint."""
    job = timed_job(seed=1)
    model = job.frame.robot("alpha").model
    zero, q = model.controller, job.programs[0].robots["alpha"].q
    assert zero is not None

    _, table = table_of(render_stream(job)["alpha.csv"])

    shown = np.zeros_like(q)
    for i in range(6):
        shown[:, i] = zero.sign[i] * q[:, i] + zero.zero[i]
        for j in range(i):
            shown[:, i] += zero.coupling[i, j] * shown[:, j]
    assert zero.coupling.any()
    assert np.abs(table[:, 2:8] - np.rad2deg(shown)).max() <= 2e-6


@pytest.mark.parametrize("cycle", [0.002, 0.004, 0.008, 0.012, 0.0125])
def test_rows_lie_on_the_cycle(cycle: float) -> None:
    cell = cell_for("kuka", cycle=cycle)
    job = job_of(cell, smooth_program(cell, cycle=cycle, end=48 * 0.0125), promise=Promise.TIMED)

    files, (read,) = round_trip(STREAM, job)

    rows = list(csv.reader(io.StringIO(files["alpha.csv"])))[1:]
    assert [int(row[0]) for row in rows] == list(range(len(rows)))
    whole = [round(float(row[1]) * 1e6) for row in rows]
    assert whole == [k * round(cycle * 1e6) for k in range(len(rows))]
    assert np.allclose(read.robots["alpha"].times, np.arange(len(rows)) * cycle, rtol=0.0, atol=1e-12)  # type: ignore[arg-type]


def test_figures_beside_a_stream_are_those_of_its_numbers() -> None:
    files = render_stream(timed_job(seed=3))

    for name in NAMES[:3]:
        names, table = table_of(files[f"{name}.csv"])
        record = json.loads(files[f"{name}.json"])
        digest = hashlib.sha256(files[f"{name}.csv"].encode()).hexdigest()
        assert (record["sha256"], record["rows"]) == (digest, len(table))
        assert record["end_s"] == table[-1, 1] == 1.2
        assert (record["cycle_ms"], record["kind"], record["controller"]) == (4.0, "kuka", f"{name}_controller")
        for axis in record["axes"]:
            column = table[:, names.index(f"{axis['axis']}_{axis['unit']}")]
            assert axis["start"] == column[0]
            assert axis["lowest_from_start"] == pytest.approx((column - column[0]).min(), abs=1e-9)
            assert axis["highest_from_start"] == pytest.approx((column - column[0]).max(), abs=1e-9)
            for order, key in enumerate(("peak_per_s", "peak_per_s2", "peak_per_s3"), start=1):
                change = np.abs(np.diff(column, n=order)).max() / 0.004**order
                assert axis[key] == pytest.approx(change, rel=1e-9, abs=1e-5)


def test_a_smooth_motion_keeps_its_acceleration_but_for_rounding() -> None:
    """The quintic has the closed form 10 / sqrt(3) of its travel over its time squared."""
    job = timed_job(seed=3)

    record = json.loads(render_stream(job)["gamma.json"])

    for axis in record["axes"]:
        travel = axis["highest_from_start"] - axis["lowest_from_start"]
        assert axis["peak_per_s2"] <= 10.0 / np.sqrt(3.0) * travel / 1.0**2 + 2e-6 / 0.004**2
        assert axis["peak_per_s2"] >= 0.999 * 10.0 / np.sqrt(3.0) * travel / 1.0**2 - 2e-6 / 0.004**2


def test_streams_begin_and_end_at_rest_and_end_together() -> None:
    cycles = {"alpha": 0.004, "beta": 0.012, "gamma": 0.002}
    cell = cell_for("kuka")
    robots = tuple(
        replace(robot, control=robot.control.changed(cycle_ms=1e3 * cycles[robot.name]))  # type: ignore[type-var]
        for robot in cell.robots
    )
    cell = replace(cell, robots=robots)
    job = job_of(cell, smooth_program(cell, cycle=cycles), promise=Promise.TIMED)

    files, _ = round_trip(STREAM, job)

    for name, cycle in cycles.items():
        _, table = table_of(files[f"{name}.csv"])
        still = int(0.1 / cycle + 1e-9) + 1
        assert np.all(table[:still, 2:-1] == table[0, 2:-1])
        assert np.all(table[-still:, 2:-1] == table[-1, 2:-1])
        assert table[-1, 1] == pytest.approx(1.2)


def test_robots_without_a_controller_are_streamed_too() -> None:
    job = timed_job(seed=1)
    robots = tuple(replace(robot, control=None) for robot in job.frame.cell.robots)
    job = replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=robots, controllers={})))

    files, _ = round_trip(STREAM, job)

    record = json.loads(files["alpha.json"])
    assert (record["controller"], record["kind"], record["latency_ms"]) == (None, None, None)


@pytest.mark.parametrize("kind", ["abb", "ur"])
def test_controllers_that_filter_a_stream_need_a_latency(kind: KindName) -> None:
    job = timed_job(kind)
    unstated = replace(job, frame=replace(job.frame, cell=with_latency(job.frame.cell, None)))

    assert json.loads(render_stream(job)["alpha.json"])["latency_ms"] == 100.0
    with pytest.raises(InputError, match=r"^controllers\.alpha_controller\.latency_ms: expected the time"):
        render_stream(unstated)


def test_a_fanuc_needs_its_counting_of_axis_3() -> None:
    job = timed_job("fanuc")
    alpha, *others = job.frame.cell.robots
    plain = replace(alpha, model=replace(alpha.model, controller=None))
    job = replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=(plain, *others))))

    with pytest.raises(InputError, match=r"^robots\.alpha\.controller_zero: expected how the controller counts axis 3"):
        render_stream(job)


@pytest.mark.parametrize("decimals", [0, 4, 8])
def test_decimals_of_programs_do_not_count_in_a_stream(decimals: int) -> None:
    cell, plain = (cell_for("kuka", decimals=stated) for stated in (decimals, None))
    jobs = [job_of(entry, smooth_program(entry, end=0.5), promise=Promise.TIMED) for entry in (cell, plain)]

    files, (read,) = round_trip(STREAM, jobs[0])

    assert files == render_stream(jobs[1])
    assert largest_error(jobs[0], [read], "alpha").max() <= 4e-6


def off_cycle(job: ExportJob) -> ExportJob:
    """The job with one row between two cycles."""
    (program,) = job.programs
    rows = program.robots["alpha"]
    assert rows.times is not None
    times = rows.times.copy()
    times[5] += 1e-6
    return replace(
        job, programs=(ProgramRows(name=None, robots={**program.robots, "alpha": replace(rows, times=times)}),)
    )


def test_rows_off_the_cycle_and_different_ends_are_refused() -> None:
    cell = cell_for("kuka")
    short = smooth_program(cell, end=0.6).robots["beta"]
    program = replace(smooth_program(cell), robots={**smooth_program(cell).robots, "beta": short})

    with pytest.raises(InputError, match="robot 'alpha': expected rows every 4 ms, got others"):
        render_stream(off_cycle(timed_job()))
    with pytest.raises(
        InputError, match=r"robot 'beta': expected its last row at 1\.200000 s, where 'alpha' ends, got 0\.6"
    ):
        render_stream(job_of(cell, program, promise=Promise.TIMED))


def test_a_cycle_between_microseconds_is_refused() -> None:
    cell = cell_for("kuka", cycle=1.0 / 240.0)
    job = job_of(cell, smooth_program(cell, cycle=1.0 / 240.0), promise=Promise.TIMED)

    with pytest.raises(InputError, match=r"robots\.alpha\.controller\.cycle_ms: expected whole microseconds"):
        render_stream(job)


def test_a_robot_named_as_the_record_of_an_export_is_refused() -> None:
    job = timed_job()
    named = replace(job.frame.cell.robots[0], name="export")
    cell = replace(job.frame.cell, robots=(named,))

    with pytest.raises(InputError, match=r"^robots\.export: expected another name"):
        render_stream(job_of(cell, smooth_program(cell), promise=Promise.TIMED))


def test_same_job_same_text_of_ascii_characters() -> None:
    files = render_stream(timed_job(seed=5, notes=("Größe \u2028 \x00",)))

    assert files == render_stream(timed_job(seed=5, notes=("Größe \u2028 \x00",)))
    assert all(text.isascii() and text.endswith("\n") and "\r" not in text for text in files.values())


@pytest.mark.slow
def test_a_hundred_thousand_rows_keep_all_limits() -> None:
    for seed in (5,):
        cell = cell_for("kuka", seed=seed, cycle=0.002)
        program = smooth_program(cell, seed=seed, end=80.0, rests=(20.0, 40.0, 60.0), cycle=0.002)
        job = job_of(cell, program, promise=Promise.TIMED)

        _, (read,) = round_trip(STREAM, job)

        for name, rows in read.robots.items():
            assert is_within_limits(job.frame.robot(name), rows.q)
            assert largest_error(job, [read], name).max() <= 4e-6 * max(UNIT.values())
