"""Branches: where the robots of an earlier run began, and how far a start was moved from where it was put."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellplan.geometry.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Branches:
    """Configurations of an earlier run in [rad] or [m], shape (n,) each, the branches of which another run keeps."""

    run: str  # name of its folder
    digest: str  # SHA-256 of its manifest
    starts: Mapping[str, Array]  # start posture by robot
    homes: Mapping[str, Array]  # home by robot
    tasks: Mapping[str, Array]  # where its robot begins it, by task or straight move of a holder


@dataclass(frozen=True, slots=True, kw_only=True)
class MovedStart:
    """A start that was the seed of the one that was used."""

    robot: str  # name of the robot
    task: str  # task or grasp that it begins at
    position: float  # how far its tool was from there in [m]
    orientation: float  # likewise in [rad]
    joint: str  # joint that was moved most
    moved: float  # by how much in [rad] or [m]
    is_revolute: bool  # whether that joint turns
    run: str  # name of the run that it is from; empty for a start that the cell gives
