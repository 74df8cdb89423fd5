"""Corners: the rows that a target may round, of all robots of a program, and within which share of their segments."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, RobotRows
from cellplan.programs.elements.joints import Axes, in_step
from cellplan.programs.elements.process import switches_in_motion
from cellplan.programs.elements.timed_rows import are_near

LARGEST_SHARE: Final = 0.5  # [-] controllers cut zones to half of a segment
SAME_TIME: Final = 1e-7  # [s] rows nearer than this are at one instant
AT_REST: Final = 1e-9  # [rad] or [m] a robot that moves no joint by more stands still


def may_round(program: ProgramRows, units: Collection[Sequence[str]] = ()) -> dict[str, Flags]:
    """Rows that targets may round, by robot, shape (N,).

    These are all rows but the first and the last one, marks, rows at which the process of any robot of the program goes
    on or off unless they end a line of that robot, and rows at which a robot rests or its tool has to stop. Robots of a
    unit, which move in step, round the same rows: those that none of the moving ones must not round.
    """
    switch_times = _switch_times(program)
    flags = {}
    for name, rows in program.robots.items():
        free = np.ones(len(rows), dtype=bool)
        free[[0, -1, *rows.marks, *rows.stops]] = False
        is_switch = switches(rows) if rows.times is None else are_near(rows.times, switch_times, SAME_TIME)
        flags[name] = free & (~is_switch | (switches(rows) & rows.on_seam))  # there its rounding says whether it stops
    result = dict[str, Flags]()
    for unit in units or [[name] for name in flags]:
        moving = {name: moves(program.robots[name]) for name in unit}
        allowed = [
            flags[name] & (~np.any(moves_there, axis=0) | _runs(program.robots[name], moves_there))
            for name, moves_there in moving.items()
        ]
        moves_any = np.logical_or.reduce([np.any(moves_there, axis=0) for moves_there in moving.values()])
        result |= dict.fromkeys(unit, np.logical_and.reduce(allowed) & moves_any)
    return {name: result[name] for name in flags}


def units_of(frame: ExportFrame) -> list[tuple[str, ...]]:
    """Exported robots by what moves in step."""
    return list(dict.fromkeys(in_step(frame, name) for name in frame.robots))


def row_shares(job: ExportJob, program: ProgramRows) -> Mapping[str, Array]:
    """Share of the shorter neighbouring segment within which each row of a job may be rounded, by robot, shape (N,).

    It is what the rows state, or else that of the job for all rows that may be rounded.

    What a zone does to a unit without a tool is known too little: it counts as rounded within half of its segments,
    beyond which no controller goes.
    """
    chosen = {name: chosen_shares(job, rows) for name, rows in program.robots.items()}
    if not any(np.any(shares > 0.0) for shares in chosen.values()):
        return chosen
    free = may_round(program, units_of(job.frame))
    has_arm = {name: bool(Axes.of(job.frame.robot(name)).arm) for name in free}
    return {
        name: np.where(free[name] & (share > 0.0), share if has_arm[name] else LARGEST_SHARE, 0.0)
        for name, share in chosen.items()
    }


def chosen_shares(job: ExportJob, rows: RobotRows) -> Array:
    """Share of its segments that is chosen for each row of a robot, whether it may be rounded or not, shape (N,)."""
    return np.full(len(rows), job.blend) if rows.rounding is None else rows.rounding


def moves(rows: RobotRows) -> Flags:
    """Whether a robot moves to each row, and from each row on, shape (2, N)."""
    moved = np.any(np.abs(np.diff(rows.q, axis=0)) > AT_REST, axis=1)
    return np.stack([np.append([False], moved), np.append(moved, [False])])


def _runs(rows: RobotRows, moving: Flags) -> Flags:
    """Rows that a robot passes without coming to rest, shape (N,)."""
    runs: Flags = np.all(moving, axis=0)
    return runs if rows.qd is None else runs & np.any(rows.qd != 0.0, axis=1)


def switches(rows: RobotRows) -> Flags:
    """Rows at which the process of a robot goes on or off, shape (N,)."""
    flags = np.zeros(len(rows), dtype=bool)
    if rows.process is not None:
        flags[1:] = rows.process[1:] != rows.process[:-1]
    return flags


def stops_at(cell: Cell, task: str, rows: RobotRows, row: int) -> bool:
    """Whether a tool stops at a row of its task: robots wait, or its process is switched where no run goes on."""
    if row in rows.marks or rows.process is None or not switches(rows)[row]:
        return row in rows.marks
    return not switches_in_motion(cell, task, on=bool(rows.process[row]))


def _switch_times(program: ProgramRows) -> Array:
    """Times in [s] at which the process of any robot goes on or off, increasing."""
    times = [rows.times[switches(rows)] for rows in program.robots.values() if rows.times is not None]
    return np.unique(np.concatenate([np.zeros(0), *times]))
