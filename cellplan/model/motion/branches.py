"""Branches: where the robots of an earlier run began, and how far a start was moved from where it was put."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array

SEED_TURN: Final = np.radians(10.0)  # [rad] that a joint of a given start is moved at most: farther, it is a mistake
SEED_SLIDE: Final = 0.05  # [m] likewise of a joint that slides


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Branches:
    """Configurations of an earlier run in [rad] or [m], shape (n,) each, the branches of which another run keeps."""

    run: str  # name of its folder
    digest: str  # SHA-256 of its manifest
    starts: Mapping[str, Array]  # start posture by robot
    homes: Mapping[str, Array]  # home by robot
    tasks: Mapping[str, Array]  # configuration at the start of each task (or of a holder's straight move), by its name


@dataclass(frozen=True, slots=True, kw_only=True)
class MovedStart:
    """A start posture that was corrected onto its path or grasp."""

    robot: str  # name of the robot
    task: str  # task or grasp that it begins at
    position: float  # how far off the path or grasp its tool was in [m]
    orientation: float  # likewise in [rad]
    joint: str  # joint that was moved most
    moved: float  # by how much in [rad] or [m]
    is_revolute: bool  # whether that joint turns
    run: str  # name of the run that it is from; empty for a start that the cell gives
