"""Torques and powers of the drives of a robot over a run."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from cellplan.model.robot.base_reaction import BaseReaction


@dataclass(frozen=True, slots=True, kw_only=True)
class JointTorque:
    """What one drive does, behind its gears."""

    joint: str  # name of the joint
    is_revolute: bool  # whether it turns, with torques in [N m], rather than slides, with forces in [N]
    peak: float  # largest torque, at the rows and between them, in [N m] or [N]
    peak_at_s: float  # its instant in [s]
    rms: float  # root of the mean square over the run in [N m] or [N]
    limit: float | None  # largest torque of the drive; None when it is not stated

    @property
    def unit(self) -> str:
        """Unit as printed."""
        return "Nm" if self.is_revolute else "N"


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotTorques:
    """What moves and holds one robot over a run, or why that is not known."""

    robot: str  # name of the robot
    # why there are no torques: masses that are not stated, or that no robot has; empty where there are some
    missing: tuple[str, ...] = ()
    duration: float = 0.0  # of the run in [s]
    joints: tuple[JointTorque, ...] = ()  # one entry per driven joint
    # work of the drives in [J]; a drive that brakes gives nothing back
    energy: float = 0.0
    peak_power: float = 0.0  # largest sum of the powers of all drives that do work in [W]
    peak_power_at_s: float = 0.0  # its instant in [s]
    reaction: BaseReaction | None = None  # what its base must hold


def mean_torque(parts: Iterable[tuple[float, float]]) -> float:
    """Root of the mean square in [N m] or [N] over several runs, from those of each and its duration in [s]."""
    known = tuple(parts)
    return math.sqrt(sum(rms * rms * time for rms, time in known) / sum(time for _, time in known))
