"""Repeatability: whether the joints come back when all tools do."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.units import DisplayUnit, joint_unit

CYCLE_TOL = 1e-9  # [-] of the whole time: cycles that differ by less are equally long


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointDrift:
    """How far one joint is at the end of each cycle from where it was at its start."""

    robot: str  # name of the robot
    joint: str  # name of the joint
    is_revolute: bool  # whether it turns rather than slides
    drift: Array  # position at the end less position at the start of each cycle in [rad] or [m], shape (cycles,)
    worst: float  # largest drift of a cycle, without its sign
    at_cycle: int  # the cycle in which it is largest, counted from 1

    @property
    def display_unit(self) -> DisplayUnit:
        """Unit in which its positions are printed."""
        return joint_unit(is_revolute=self.is_revolute)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Repeatability:
    """Whether the joints come back when all tools do."""

    cycle_times: Array  # times in [s] at which all tools are at their start together, shape (cycles + 1,)
    drifts: tuple[JointDrift, ...]  # one entry per joint of every robot
    closes: bool  # whether every joint comes back in every cycle, so that the program may be repeated as it is

    @property
    def cycles(self) -> int:
        """How many cycles there are."""
        return len(self.cycle_times) - 1

    @property
    def period(self) -> float | None:
        """Length of a cycle in [s]; None when the cycles differ in length."""
        lengths = np.diff(self.cycle_times)
        return float(lengths.mean()) if np.ptp(lengths) <= CYCLE_TOL * self.cycle_times[-1] else None
