r"""Targets of RAPID as text: joint targets, targets on the part, frames, and the configuration of an arm.

Configuration data are numbers of quarter turns of axes 1, 4 and 6, counted from zero downwards as well (0 for 0 to 90
degrees, -1 for -90 to 0), and ``cfx`` from 0 to 7: twice two signs of the place of the wrist and the sign of axis 5
(RAPID reference, confdata):

.. math:: cfx = 4 [\text{wrist behind axis 1}] + 2 [\text{wrist behind the lower arm}] + [\text{axis 5 negative}]
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Station
from cellplan.model.units import MM
from cellplan.programs.elements.conventions import QUATERNION_DECIMALS, quaternions
from cellplan.programs.elements.joints import Axes, to_numbers
from cellplan.programs.elements.text import fixed
from cellplan.programs.elements.wrist import sides_at_zero, wrist_sides
from cellplan.programs.formats.rapid.units import ABSENT, DECIMALS, EXTERNAL_AXES, RapidUnit, rapid_task

QUARTER: Final = 90.0  # [deg]


def joint_targets(unit: RapidUnit, q: Array) -> list[str]:
    """Joint targets ``[[6],[6]]`` of positions in [rad] or [m], shape (N, n)."""
    numbers = to_numbers(unit.robot, q, decimals=unit.decimals)
    arm = _fields(numbers[:, unit.axes.arm], unit.decimals) if unit.has_tool else [",".join([ABSENT] * 6)] * len(q)
    return [f"[[{axes}],[{rest}]]" for axes, rest in zip(arm, _external(unit, numbers), strict=True)]


def part_targets(unit: RapidUnit, q: Array, X_PT: Array) -> list[str]:
    """Targets ``[[3],[4],[4],[6]]`` of tool tips on the part: place, quaternion, configuration, external axes.

    Args:
        q: Its joints in [rad] or [m], shape (N, n), whose configuration is stated.
        X_PT: Its tool tip in the part frame, shape (N, 4, 4), in [m].
    """
    places = _fields(X_PT[:, :3, 3] * MM, unit.decimals)
    turns = _fields(quaternions(X_PT[:, :3, :3]), QUATERNION_DECIMALS)
    configurations = [",".join(map(str, row)) for row in configuration(unit.robot, q).tolist()]
    rest = _external(unit, to_numbers(unit.robot, q, decimals=unit.decimals))
    return [
        f"[[{place}],[{turn}],[{conf}],[{ext}]]"
        for place, turn, conf, ext in zip(places, turns, configurations, rest, strict=True)
    ]


def frame_text(X: Array, decimals: int) -> str:
    """A frame ``[[x,y,z],[w,x,y,z]]`` in [mm] of a pose in [m], shape (4, 4)."""
    place = _fields(X[None, :3, 3] * MM, decimals)[0]
    return f"[[{place}],[{_fields(quaternions(X[None, :3, :3]), QUATERNION_DECIMALS)[0]}]]"


def configuration(robot: Robot, q: Array) -> NDArray[np.int_]:
    """Configuration data cf1, cf4, cf6, cfx, shape (N, 4), of an arm with joints ``q`` in [rad] or [m], shape (N, n).

    Which side is in front follows from the zero of the controller, at which the arm is stretched forward.

    ``InputError`` unless the last six joints are those of an arm with a wrist of three axes that meet.
    """
    behind = wrist_sides(robot, q) * np.sign(sides_at_zero(robot, both=True)) < 0.0
    numbers = to_numbers(robot, q, decimals=6)[:, list(Axes.of(robot).arm)]
    quarters = np.floor(numbers[:, [0, 3, 5]] / QUARTER).astype(int)
    cfx = 4 * behind[:, 0] + 2 * behind[:, 1] + (numbers[:, 4] < 0.0)
    return np.column_stack([quarters, cfx])


def _external(unit: RapidUnit, numbers: Array) -> list[str]:
    """External axes of every row, those that the unit does not have marked as absent."""
    count = len(unit.axes.external)
    missing = [ABSENT] * (EXTERNAL_AXES - count)
    if not count:
        return [",".join(missing)] * len(numbers)
    return [",".join([field, *missing]) for field in _fields(numbers[:, unit.axes.external], unit.decimals)]


def _fields(numbers: Array, decimals: int) -> list[str]:
    """Rows of numbers with fixed decimals."""
    return [",".join(fixed(number, decimals) for number in row) for row in numbers.tolist()]


def work_object_text(frame: ExportFrame, station: Station) -> str:
    """A work object: moved by the unit of the holder, or fixed in the base of the controller."""
    X = pose() if station.X is None else station.X
    part, none = frame_text(X, DECIMALS), frame_text(pose(), DECIMALS)
    if station.holder is None:
        return f'[FALSE,TRUE,"",{part},{none}]'
    control = frame.robot(station.holder).control
    tasks = frame.cell.controllers[control.id].tasks if control else {}
    return f'[FALSE,FALSE,"{tasks[rapid_task(frame, station.holder)]}",{none},{part}]'
