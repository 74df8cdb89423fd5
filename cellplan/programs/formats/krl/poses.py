r"""Poses of KRL as text: frames and ``E6POS`` with status and turn, the configuration of an arm.

Status and turn are sums of bits (Beckhoff, TF5200 programming manual, "Status & Turn"; KUKA, KSS 8.3 for system
integrators), with the wrist where axes 4, 5 and 6 meet:

.. math::

    S &= [\text{wrist behind axis 1}] + 2 [\text{wrist in front of the line through axes 2 and 3}] + 4 [A_5 < 0] \\
    T &= \sum_{i = 1}^{6} 2^{i - 1} [A_i < 0]
"""

import re
from collections.abc import Sequence
from itertools import zip_longest
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.programs.elements.conventions import CONVENTIONS
from cellplan.programs.elements.joints import Axes, to_numbers
from cellplan.programs.elements.text import Statement, fixed
from cellplan.programs.elements.wrist import sides_at_zero, wrist_sides
from cellplan.programs.formats.krl.text import AXES, NUMBER

KUKA: Final = CONVENTIONS["kuka"]
_PLAIN: Final = re.compile(NUMBER)
_WHOLE: Final = re.compile(r"[0-9]{1,3}")
SIGN_DECIMALS: Final = 6  # of a degree: a position that is shown as zero is not negative


def status_and_turn(robot: Robot, q: Array) -> NDArray[np.int_]:
    """Status and turn, shape (N, 2), of an arm with joints ``q`` in [rad] or [m], shape (N, n).

    A growing angle of axis 3 moves the wrist to the front of the line through axes 2 and 3.

    ``InputError`` unless the last six joints are those of an arm with a wrist of three axes that meet.
    """
    arm = list(Axes.of(robot).arm)
    zero = robot.model.controller
    second, third = (robot.model.joints[place] for place in arm[1:3])
    grows = float(second.axis_B @ third.axis_B) * (1.0 if zero is None else float(zero.sign[arm[2]]))
    sides = wrist_sides(robot, q) * np.sign([sides_at_zero(robot, both=False)[0], grows])
    is_negative = to_numbers(robot, q, decimals=SIGN_DECIMALS)[:, arm] < 0.0
    status = (sides[:, 0] < 0.0) + 2 * (sides[:, 1] > 0.0) + 4 * is_negative[:, 4]
    return np.column_stack([status, is_negative @ (2 ** np.arange(6))])


class KrlPose(NamedTuple):
    """A pose of a data file."""

    X: Array  # in [m], shape (4, 4)
    status_and_turn: tuple[int, int] | None  # None for a frame
    external: tuple[float, ...]  # positions of external axes as they are written


def frame_text(X: Array, decimals: int) -> str:
    """A frame ``{X ..,Y ..,Z ..,A ..,B ..,C ..}`` of a pose in [m], shape (4, 4)."""
    numbers = zip(KUKA.labels, KUKA.numbers(X).tolist(), strict=True)
    return "{" + ",".join(f"{name} {fixed(number, decimals)}" for name, number in numbers) + "}"


def components(values: Sequence[float], decimals: int) -> str:
    """Components of a point: all axes of the arm, then all external ones, unused ones at zero."""
    return ",".join(f"{axis} {fixed(value, decimals)}" for axis, value in zip_longest(AXES, values, fillvalue=0.0))


def pose_text(X: Array, state: Sequence[int], external: Sequence[float], *, decimals: int) -> str:
    """A point ``{X ..,S ..,T ..,E1 ..}`` with status and turn, and all external axes, unused ones at zero."""
    status, turn = state
    axes = zip_longest(AXES[6:], external, fillvalue=0.0)
    rest = [f"S {status}", f"T {turn}", *(f"{name} {fixed(number, decimals)}" for name, number in axes)]
    return f"{frame_text(X, decimals)[:-1]},{','.join(rest)}" + "}"


def read_pose(line: Statement, text: str, *, is_frame: bool) -> KrlPose:
    """The pose that a declaration has between its braces, with status, turn and external axes unless it is a frame.

    An ``InputError`` has file and line.
    """
    names = KUKA.labels if is_frame else (*KUKA.labels, "S", "T", *AXES[6:])
    parts = [part.split() for part in text.split(",")]
    if [part[0].upper() for part in parts if len(part) == 2] != list(names):
        raise line.error(f"{', '.join(names)}, each once and in this order")
    for name, number in parts:
        if not (_WHOLE if name.upper() in "ST" else _PLAIN).fullmatch(number):
            raise line.error("plain decimal numbers, whole ones of S and T", f"{name} {number}")
    values = [float(number) for _, number in parts]
    status_and_turn = None if is_frame else (int(values[6]), int(values[7]))
    return KrlPose(KUKA.pose(np.array(values[:6])), status_and_turn, tuple(values[8:]))
