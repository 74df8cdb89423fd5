"""Speeds of RAPID lines beside that of the tool, the slowest of which sets the pace: none is below what it takes.

External axes may move at their top speeds, as joints are judged where the tool moves at its speed. A turn of the tool
may be as fast as the speeds of the language have it, or as a line takes it.
"""

from collections.abc import Sequence
from itertools import pairwise
from math import ceil
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, rotation_vector
from cellplan.model.units import DEG
from cellplan.programs.formats.rapid.units import RapidUnit

TURN: Final = 500  # [deg/s] of a tool, as the speeds of the language have it
SLIDE, SPIN = 100, 20  # [mm/s] and [deg/s] of external axes


def turn_speed(X: Sequence[Array], feed: float) -> float:
    """Speed in [deg/s] at which a tool turns over poses in [m], each (4, 4), that it passes at a speed in [m/s]."""
    turn = length = 0.0
    for one, other in pairwise(X):
        turn += float(np.linalg.norm(rotation_vector(other[:3, :3] @ one[:3, :3].T)))
        length += float(np.linalg.norm(other[:3, 3] - one[:3, 3]))
    return DEG * turn * feed / length if length else 0.0


def axis_speeds(unit: RapidUnit, turns: Sequence[float]) -> list[int]:
    """Speeds of a turn of the tool, of sliding and of turning external axes in [deg/s], [mm/s] and [deg/s].

    ``turns`` are those that lines take in [deg/s].
    """
    joints = [unit.robot.model.joints[axis] for axis in unit.axes.external]
    tops = {
        is_turn: [ceil(joint.display_unit.scale * joint.velocity) for joint in joints if joint.is_revolute is is_turn]
        for is_turn in (False, True)
    }
    return [max([TURN, *map(ceil, turns)]), max([SLIDE, *tops[False]]), max([SPIN, *tops[True]])]
