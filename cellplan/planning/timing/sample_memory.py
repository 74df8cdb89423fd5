"""Room for the samples of all joints: refused in advance, with the memory that it would take."""

import math
from typing import Final

from cellplan.errors import InputError
from cellplan.model.cell import Cell

MOST_VALUES: Final = 10_000_000  # [-] samples times joints: 24 joints for seven minutes at 1 ms
BYTES_OF_A_VALUE: Final = 600  # [bytes] that a solve takes for each at most: measured 420 with few bodies


def require_memory(cell: Cell, samples: int) -> None:
    """Refuse a clock whose samples of all joints do not fit an ordinary machine.

    Raises:
        InputError: With the memory that they would take, and the shortest step that fits.
    """
    joints = sum(len(robot.model.joints) for robot in cell.robots)
    if samples * joints <= MOST_VALUES:
        return
    least = cell.motion.step * samples * joints / MOST_VALUES
    digits = 10.0 ** (math.floor(math.log10(least)) - 1)
    raise InputError(
        f"{cell.origin.at('motion.step_s')}: expected at most {MOST_VALUES} samples times joints, got {samples} x "
        f"{joints}, which take about {samples * joints * BYTES_OF_A_VALUE / 1e9:.2g} GB of memory; make the step at "
        f"least {math.ceil(least / digits) * digits:g} s"
    )
