"""Sums of joint angles that a dress pack, or a cable, allows."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array, Flags

ROUNDING = 1e-9  # [rad] of written angles


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSum:
    """A range of the sum of some joint angles of a robot."""

    joints: tuple[str, ...]  # names of the joints
    columns: tuple[int, ...]  # their numbers
    lower: float  # least sum in [rad]
    upper: float  # largest sum in [rad]

    def of(self, q: Array) -> Array:
        """The sum at configurations of shape (..., n) in [rad], shape (...)."""
        return q[..., list(self.columns)].sum(axis=-1)

    def holds(self, q: Array) -> Flags:
        """Whether configurations of shape (..., n) have it in its range, shape (...)."""
        total = self.of(q)
        return np.logical_and(total >= self.lower - ROUNDING, total <= self.upper + ROUNDING)
