"""Rows with times as formats of joint tables share them: one clock, paths of files, decimals of a robot."""

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.programs.elements.joints import LARGEST

NANO: Final = 1_000_000_000  # [ns/s]


def file_path(program: str | None, file: str) -> str:
    """Path of a file of a program in the folder of the export, as the plain format has it."""
    return file if program is None else f"{program}/{file}"


def decimals_of(robot: Robot, usual: int) -> int:
    """Decimals of a robot's positions in its controller's own language: its own, or else those of the format."""
    stated = None if robot.control is None else robot.control.decimals
    return usual if stated is None else stated


def cycle_of(robot: Robot) -> float:
    """Cycle in [s] at which the controller of a robot takes positions."""
    stated = None if robot.control is None else robot.control.cycle_ms
    return robot.controller_cycle if stated is None else stated.si


def times_of(rows: RobotRows) -> Array:
    """Times of rows in [s], shape (N,), which must be there, begin at 0 and rise."""
    times = rows.times
    if times is None:
        raise InputError(f"robot '{rows.robot}': expected rows with times, got none")
    if len(times) != len(rows) or len(times) < 2 or times[0] != 0.0 or not np.all(np.diff(times) > 0.0):
        raise InputError(f"robot '{rows.robot}': expected two rows or more, with times that rise from 0")
    if not times[-1] < LARGEST:
        raise InputError(f"robot '{rows.robot}': expected times below {LARGEST:g} s, got {times[-1]:g}")
    return times


def nanoseconds(times: Array, *, robot: str) -> list[int]:
    """Times in [s], shape (N,), as whole nanoseconds, no two of which may be the same."""
    whole = [round(time * NANO) for time in times.tolist()]
    if any(late <= early for early, late in pairwise(whole)):
        raise InputError(f"robot '{robot}': expected rows that are a nanosecond apart or more")
    return whole


def shared_clock(program: ProgramRows, robots: Collection[str]) -> Array:
    """The one clock of some robots in a program in [s], shape (N,); ``InputError`` where they have several."""
    first, *others = robots
    clock = times_of(program.robots[first])
    for name in others:
        if not np.array_equal(times_of(program.robots[name]), clock):
            raise InputError(f"robot '{name}': expected rows at the same times as those of '{first}'")
    return clock


def are_near(times: Array, others: Sequence[float] | Array, tolerance: float) -> Flags:
    """Which times, shape (N,), are the same as one of some others."""
    ordered = np.sort(np.array([-np.inf, *others, np.inf]))
    after = np.searchsorted(ordered, times)
    return np.minimum(ordered[after] - times, times - ordered[after - 1]) <= tolerance


def require_paths(files: Mapping[str, str], expected: Collection[str]) -> None:
    """Make sure that an export holds exactly some files."""
    missing = sorted(set(expected) - set(files))
    if missing:
        raise InputError(f"{missing[0]}:1: expected a file of the export, got none")
    other = sorted(set(files) - set(expected))
    if other:
        raise InputError(f"{other[0]}:1: expected no such file in the export, got one")
