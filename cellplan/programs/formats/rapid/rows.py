"""Rows of a RAPID program from its targets."""

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, pose_from, quaternion_to_rotation
from cellplan.model.report.exported import RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.formats.rapid.moves import RapidMove, Zone
from cellplan.programs.formats.rapid.units import EXTERNAL_AXES, TIME_DECIMALS, RapidUnit
from cellplan.programs.formats.zones import axis_shares, part_shares, tool_shares

UNIT_TOL: Final = 1e-5  # [-] by which the quaternion of a target may miss unit length
TIME_TOL: Final = 1e-9  # [s] rounding of sums of durations

_NUMBER: Final = r"-?[0-9]{1,7}(?:\.[0-9]{1,12})?"
_AXIS: Final = rf"(?:{_NUMBER}|9[Ee]\+?0?9)"
_AXES: Final = rf"\[({_AXIS}(?:,{_AXIS}){{5}})\]"
_JOINTS: Final = re.compile(rf"\[{_AXES},{_AXES}\]")
_PART: Final = re.compile(
    rf"\[\[({_NUMBER}(?:,{_NUMBER}){{2}})\],\[({_NUMBER}(?:,{_NUMBER}){{3}})\],"
    rf"\[(-?[0-9]{{1,3}}(?:,-?[0-9]{{1,3}}){{3}})\],{_AXES}\]"
)
_ABSENT: Final = 9e9


def rows_of(unit: RapidUnit, moves: Sequence[RapidMove], marks: tuple[int, ...]) -> RobotRows:
    """Rows of a robot, whose targets must be its own; ``q`` of an arm is NaN at targets on the part."""
    is_cartesian = np.array([move.is_cartesian for move in moves])
    arm, external = np.zeros((len(moves), 6)), np.zeros((len(moves), EXTERNAL_AXES))
    X_PT, turns = np.full((len(moves), 4, 4), np.nan), np.full((len(moves), 4), 0, dtype=int)
    for place, move in enumerate(moves):
        match = (_PART if move.is_cartesian else _JOINTS).fullmatch(move.target)
        if match is None:
            move.statement.refuse("a target [[3],[4],[4],[6]]" if move.is_cartesian else "a target [[6],[6]]")
        external[place] = _numbers(match[4] if move.is_cartesian else match[2])
        if move.is_cartesian:
            X_PT[place] = _pose(move, _numbers(match[1]), _numbers(match[2]))
            turns[place] = _configuration(move, match[3])
        else:
            arm[place] = _numbers(match[1])
    _require_axes(unit, moves, arm, external, is_cartesian)
    numbers = np.zeros((len(moves), len(unit.robot.model.joints)))
    numbers[:, unit.axes.external] = external[:, : len(unit.axes.external)]
    if unit.has_tool:
        numbers[:, unit.axes.arm] = arm
    q = from_numbers(unit.robot, numbers)
    if np.any(is_cartesian):
        q[is_cartesian, unit.axes.arm[0] :] = np.nan
    any_part = bool(np.any(is_cartesian))
    return RobotRows(
        robot=unit.robot.name,
        q=q,
        times=_times(moves),
        marks=marks,
        X_PT=X_PT if any_part else None,
        configuration=turns if any_part else None,
        rounding=rounding(unit, [move.zone for move in moves], q, X_PT[:, :3, 3]),
    )


def rounding(unit: RapidUnit, zones: Sequence[Zone], q: Array, p: Array) -> Array:
    """Share of the shorter neighbouring segment within which each row is rounded, shape (N,).

    Args:
        q: Positions in [rad] or [m], shape (N, n); those of the arm are NaN at targets on the part.
        p: Position of the tool on the part in [m], shape (N, 3); NaN at all other targets.
    """
    tool, turns, slides = (np.array([zone[place] for zone in zones]) for place in range(3))
    if not unit.has_tool:
        return axis_shares(unit.robot, q, turns, slides)
    on_part = part_shares(p, tool / MM)
    is_known = np.all(np.isfinite(q), axis=1)
    is_known[1:-1] &= is_known[:-2] & is_known[2:]
    return np.where(is_known, tool_shares(unit.robot, np.nan_to_num(q), np.where(is_known, tool / MM, 0.0)), on_part)


def _times(moves: Sequence[RapidMove]) -> Array:
    """Times of rows in [s] from their durations, on whole multiples of the last decimal where they are meant so."""
    times = np.cumsum([move.duration for move in moves])
    even = np.rint(times * 10.0**TIME_DECIMALS) / 10.0**TIME_DECIMALS
    return np.where(np.abs(times - even) < TIME_TOL, even, times)


def _pose(move: RapidMove, place: Array, turn: Array) -> Array:
    """Pose of a target, shape (4, 4)."""
    if abs(np.linalg.norm(turn) - 1.0) > UNIT_TOL:
        move.statement.refuse("a quaternion of unit length")
    return pose_from(quaternion_to_rotation(turn), place / MM)


def _configuration(move: RapidMove, text: str) -> list[int]:
    """Configuration data of a target."""
    numbers = [int(number) for number in text.split(",")]
    if not 0 <= numbers[3] <= 7:
        move.statement.refuse("cfx of 0 to 7", str(numbers[3]))
    return numbers


def _numbers(text: str) -> Array:
    """Numbers of a list."""
    return np.array([float(number) for number in text.split(",")])


def _require_axes(
    unit: RapidUnit, moves: Sequence[RapidMove], arm: Array, external: Array, is_cartesian: NDArray[np.bool_]
) -> None:
    """Each row has the axes of the robot, and 9E9 for all others."""
    count = len(unit.axes.external)
    is_absent = external == _ABSENT
    bad = np.any(is_absent[:, :count], axis=1) | ~np.all(is_absent[:, count:], axis=1)
    unused = arm == _ABSENT
    bad_arm = (np.any(unused, axis=1) if unit.has_tool else ~np.all(unused, axis=1)) & ~is_cartesian
    for rows, expected in (
        (bad, f"{count} external axes of robot '{unit.robot.name}', and 9E9 for the others"),
        (bad_arm, "six axes of the arm" if unit.has_tool else "9E9 for the axes of an arm"),
    ):
        if np.any(rows):
            moves[int(np.argmax(rows))].statement.refuse(expected)
