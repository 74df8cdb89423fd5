"""Configuration of an arm as FANUC controllers state it: three letters, and the turns of axes 4, 5 and 6.

F and N tell the sides of axis 5 apart, U and D those of the line through axes 2 and 3, T and B those of axis 1. Axis 5
bends the tool down where it is negative and axis 4 at zero, which is N; the letters U and T are those of the zero of
the controller, upright with the forearm forward. Turns count from -180 to 180 degrees as none.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.programs.elements.joints import Axes, to_numbers
from cellplan.programs.elements.wrist import sides_at_zero, wrist_sides

LETTERS: Final = ("NF", "UD", "TB")  # by whether axis 5 is positive, the elbow down, the wrist behind axis 1
TURN: Final = 360.0  # [deg]
SIGN_DECIMALS: Final = 6  # of a degree: a position that is shown as zero is not positive


def configuration(robot: Robot, q: Array) -> NDArray[np.int_]:
    """Places of the three letters, then turns of axes 4 to 6, shape (N, 6), of joints in [rad] or [m], shape (N, n).

    ``InputError`` unless the last six joints are those of an arm with a wrist of three axes that meet.
    """
    is_other = wrist_sides(robot, q) * np.sign(sides_at_zero(robot, both=True)) < 0.0
    numbers = to_numbers(robot, q, decimals=SIGN_DECIMALS)[:, list(Axes.of(robot).arm)]
    turns = np.floor(numbers[:, 3:] / TURN + 0.5).astype(int)
    return np.column_stack([numbers[:, 4] > 0.0, is_other[:, 1], is_other[:, 0], turns])


def configuration_text(row: NDArray[np.int_]) -> str:
    """A configuration as a point states it, such as ``N U T, 0, 0, 0``."""
    letters = " ".join(both[place] for both, place in zip(LETTERS, row[:3].tolist(), strict=True))
    return ", ".join([letters, *map(str, row[3:].tolist())])


def read_configuration(words: str) -> list[int]:
    """The configuration of letters with spaces between, and three turns behind commas."""
    letters, *turns = words.split(",")
    return [*(both.index(letter) for both, letter in zip(LETTERS, letters.split(), strict=True)), *map(int, turns)]
