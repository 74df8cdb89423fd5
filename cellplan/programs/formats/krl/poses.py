r"""Poses of KRL as text: frames and ``E6POS`` with status and turn, the configuration of an arm.

Status and turn are sums of bits (Beckhoff, TF5200 programming manual, "Status & Turn"; KUKA, KSS 8.3 for system
integrators), with the wrist where axes 4, 5 and 6 meet:

.. math::

    S &= [\text{wrist behind axis 1}] + 2 [\text{wrist in front of the line through axes 2 and 3}] + 4 [A_5 < 0] \\
    T &= \sum_{i = 1}^{6} 2^{i - 1} [A_i < 0]
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.programs.elements.joints import Axes, to_numbers
from cellplan.programs.elements.wrist import sides_at_zero, wrist_sides

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
