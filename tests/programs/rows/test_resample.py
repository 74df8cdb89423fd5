"""Rows on the cycle of each controller: the same motion, at rest at both ends, and all robots end together."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.moved_rows import smooth_rows

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.measures.accelerations import point_accelerations
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.programs.rows.interpolant import resting, row_velocities
from cellplan.programs.rows.resample import lead_time, resampled

CYCLES = {"table": 0.012, "kuka": 0.004}


@pytest.fixture(scope="module")
def cell(cells: Path) -> Cell:
    return load_cell(cells / "turntable.yaml")


def _peak(times: np.ndarray, q: np.ndarray) -> float:
    return float(np.abs(point_accelerations(times, q)).max())


def test_a_finer_cycle_keeps_the_peak_acceleration_where_straight_motion_between_rows_does_not(cell: Cell) -> None:
    program = smooth_rows(cell, seed=1, count=201)
    rows = program.robots["kuka"]

    result = resampled(cell, program, CYCLES).robots["kuka"]

    peak = _peak(rows.times, rows.q)
    linear = np.stack([np.interp(result.times - 0.108, rows.times, column) for column in rows.q.T], axis=1)
    assert _peak(result.times, result.q) == pytest.approx(peak, rel=0.01)
    assert _peak(result.times, linear) > 1.5 * peak


def test_the_motion_is_that_of_the_run_later_by_the_lead(cell: Cell) -> None:
    program = smooth_rows(cell, seed=2)
    lead = lead_time(CYCLES)

    result = resampled(cell, program, CYCLES)

    for name, rows in result.robots.items():
        full = program.robots[name]
        expected = np.stack([np.interp(rows.times - lead, full.times, column) for column in full.q.T], axis=1)
        np.testing.assert_allclose(rows.q, expected, atol=3e-5)  # a sag of 1.2 rad/s2 over 10 ms is 1.5e-5 rad
        shared = np.isin(np.round(rows.times - lead, 9), np.round(full.times, 9))
        np.testing.assert_allclose(rows.q[shared], expected[shared], atol=1e-12)


def test_all_robots_rest_at_both_ends_and_end_together_after_whole_cycles(cell: Cell) -> None:
    result = resampled(cell, smooth_rows(cell, seed=3, count=397), CYCLES).robots

    assert {float(rows.times[-1]) for rows in result.values()} == {4.176}
    for name, rows in result.items():
        np.testing.assert_allclose(np.diff(rows.times), CYCLES[name], atol=1e-12)
        for rest in (rows.times <= 0.1, rows.times >= rows.times[-1] - 0.1):
            assert np.ptp(rows.q[rest], axis=0).max() == 0.0
        assert np.all(rows.qd[[0, -1]] == 0.0)


def test_the_process_and_the_marks_stay_with_the_motion(cell: Cell) -> None:
    program = smooth_rows(cell, seed=4)
    marked = {name: replace(rows, marks=(0, 100, 300, 400)) for name, rows in program.robots.items()}
    lead = lead_time(CYCLES)

    result = resampled(cell, replace(program, robots=marked), CYCLES).robots

    for name, rows in result.items():
        on = rows.times[rows.process] - lead
        assert 1.0 <= on[0] < 1.0 + CYCLES[name]
        assert 3.0 - CYCLES[name] <= on[-1] < 3.0
        marks = rows.times[list(rows.marks)] - lead
        assert np.all((marks >= np.array([0, 1, 3, 4]) - 1e-9) & (marks < np.array([0, 1, 3, 4]) + CYCLES[name]))


def test_a_joint_that_runs_at_its_limit_is_not_taken_beyond_it(cell: Cell) -> None:
    robot = cell.robot("kuka")
    lower, upper = (np.array([getattr(joint, side) for joint in robot.model.joints]) for side in ("lower", "upper"))
    times = 0.01 * np.arange(101)
    q = np.zeros((101, 6)) + 0.5 * (lower + upper)
    q[:, 0] = np.minimum(upper[0], upper[0] - 0.5 + 0.51 * np.sin(np.pi * times) ** 2)
    qd = row_velocities(times, q, rests=resting(q), lower=lower, upper=upper)
    rows = RobotRows(robot="kuka", q=q, times=times, qd=qd)

    result = resampled(cell, ProgramRows(name=None, robots={"kuka": rows}), {"kuka": 0.004})

    assert result.robots["kuka"].q[:, 0].max() == upper[0]


def test_cycles_that_do_not_meet_within_a_second_are_refused(cell: Cell) -> None:
    with pytest.raises(InputError, match=r"expected cycles that meet within 1 s, .*, got table 8.333 ms, kuka 4 ms"):
        resampled(cell, smooth_rows(cell, seed=1), {"table": 0.008333, "kuka": 0.004})


def test_a_cycle_of_no_whole_microseconds_is_refused(cell: Cell) -> None:
    with pytest.raises(InputError, match=r"robots.kuka.controller.cycle_ms: expected whole microseconds"):
        lead_time({"kuka": 0.0041234567})
