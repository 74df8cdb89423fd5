"""Sums of joint angles that a dress pack, or a cable, allows."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array, Flags

ROUNDING = 1e-9  # [rad] of written angles


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSum:
    """A range of the sum of some joint angles of a robot.

    Attributes:
        joints: Names of the joints.
        columns: Their numbers.
        lower: Least sum in [rad].
        upper: Largest sum in [rad].
    """

    joints: tuple[str, ...]
    columns: tuple[int, ...]
    lower: float
    upper: float

    def of(self, q: Array) -> Array:
        """The sum at configurations of shape (..., n) in [rad], shape (...)."""
        total: Array = q[..., list(self.columns)].sum(axis=-1)
        return total

    def holds(self, q: Array) -> Flags:
        """Whether configurations of shape (..., n) have it in its range, shape (...)."""
        total = self.of(q)
        return np.logical_and(total >= self.lower - ROUNDING, total <= self.upper + ROUNDING)
