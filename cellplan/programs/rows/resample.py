"""Resampling: rows of a program on the cycle of each controller, between two stretches of rest."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.model.task.task import TIME_TOLERANCE
from cellplan.programs.rows.interpolant import HermiteRows, resting, row_velocities
from cellplan.programs.rows.rows import times_of

REST: Final = 0.1  # [s] at least, of standstill before and after a program
MICRO: Final = 1_000_000  # cycles are whole microseconds
LONGEST: Final = MICRO  # [us] a longer common multiple of the cycles would hold robots for seconds
TIME_DECIMALS: Final = 12  # decimals kept of k * cycle, so that 0.001 * 3 reads 0.003


def resampled(cell: Cell, program: ProgramRows, cycle_of: Mapping[str, float]) -> ProgramRows:
    """A program with the rows of each robot on the cycle of its controller.

    Positions and speeds are those of the cubic Hermite curve through the rows with their speeds. All robots hold for
    ``lead_time`` first, so every row is later by that time, and then for as long at least; they end together, after a
    whole number of cycles of each.

    Cycles are in [s]; robots without one are left out. ``InputError`` where they have no common multiple within a
    second.
    """
    lead = lead_time(cycle_of)
    common = _common_cycle(cycle_of)
    last = max(float(times_of(rows)[-1]) for rows in program.robots.values())
    end = common * math.ceil((round(MICRO * (lead + last)) + round(MICRO * REST)) / common) / MICRO
    on_cycle = {
        name: _on_cycle(cell.robot(name), rows, cycle_of[name], lead=lead, end=end)
        for name, rows in program.robots.items()
        if name in cycle_of
    }
    return replace(program, robots=on_cycle)


def lead_time(cycle_of: Mapping[str, float]) -> float:
    """Time in [s] by which resampled rows are later: a tenth of a second, or what more all cycles go into.

    ``InputError`` where the cycles have no common multiple within a second.
    """
    common = _common_cycle(cycle_of)
    return common * math.ceil(round(MICRO * REST) / common) / MICRO


def _common_cycle(cycle_of: Mapping[str, float]) -> int:
    """Least common multiple of all cycles in [us]."""
    cycles = {name: round(MICRO * cycle) for name, cycle in cycle_of.items()}
    for name, cycle in cycles.items():
        if cycle < 1 or abs(cycle / MICRO - cycle_of[name]) > TIME_TOLERANCE:
            raise InputError(
                f"robots.{name}.controller.cycle_ms: expected whole microseconds, got {1e3 * cycle_of[name]:g} ms"
            )
    common = math.lcm(*cycles.values())
    if common > LONGEST:
        shown = ", ".join(f"{name} {1e3 * cycle_of[name]:g} ms" for name in cycles)
        raise InputError(
            f"controllers: expected cycles that meet within {LONGEST / MICRO:g} s, so that all robots end together, "
            f"got {shown}"
        )
    return common


def _on_cycle(robot: Robot, rows: RobotRows, cycle: float, *, lead: float, end: float) -> RobotRows:
    """Rows of one robot on its cycle."""
    if rows.qd is None:
        raise ValueError(f"rows of '{robot.name}': expected speeds")
    times = np.round(np.arange(round(end / cycle) + 1) * cycle, TIME_DECIMALS)
    curve = HermiteRows(times=times_of(rows), q=rows.q, qd=rows.qd)
    lower, upper = robot.model.lower, robot.model.upper
    resampled_rows = np.clip(
        curve.at(times - lead), np.minimum(lower, rows.q.min(axis=0)), np.maximum(upper, rows.q.max(axis=0))
    )
    process = None
    if rows.process is not None:
        before = np.searchsorted(times_of(rows), times - lead + TIME_TOLERANCE, side="right") - 1
        process = rows.process[np.clip(before, 0, len(rows) - 1)] & (before >= 0)
    return replace(
        rows,
        stops=(),
        q=resampled_rows,
        times=times,
        qd=row_velocities(times, resampled_rows, rests=resting(resampled_rows), lower=lower, upper=upper),
        process=process,
        marks=_marks_on_cycle(rows, times - lead),
    )


def _marks_on_cycle(rows: RobotRows, times: Array) -> tuple[int, ...]:
    """The first row at or after each mark, at times in [s] of the program, shape (M,)."""
    at = times_of(rows)[list(rows.marks)]
    return tuple(np.searchsorted(times, at - TIME_TOLERANCE).tolist())
