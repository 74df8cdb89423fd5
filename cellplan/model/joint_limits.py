"""Joint limits: those of several joints as arrays."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.robot import Joint


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointLimits:
    """Limits of n joints, in the order of a stacked joint vector."""

    lower: Array  # lowest positions in [rad] or [m], shape (n,); -inf where there is none
    upper: Array  # highest positions in [rad] or [m], shape (n,); inf where there is none
    velocity: Array  # largest speeds in [rad/s] or [m/s], shape (n,)
    acceleration: Array  # largest accelerations in [rad/s^2] or [m/s^2], shape (n,); inf where none is known
    is_revolute: NDArray[np.bool_]  # whether a joint is revolute rather than prismatic, shape (n,)

    @classmethod
    def of(cls, joints: Iterable[Joint]) -> "JointLimits":
        """The limits of given joints."""
        listed = tuple(joints)
        known = [np.inf if joint.acceleration is None else joint.acceleration for joint in listed]
        return cls(
            lower=_frozen([joint.lower for joint in listed]),
            upper=_frozen([joint.upper for joint in listed]),
            velocity=_frozen([joint.velocity for joint in listed]),
            acceleration=_frozen(known),
            is_revolute=np.array([joint.is_revolute for joint in listed], dtype=bool),
        )

    @property
    def is_bounded(self) -> NDArray[np.bool_]:
        """Whether a joint has both position limits, shape (n,)."""
        return np.isfinite(self.lower) & np.isfinite(self.upper)


def _frozen(values: list[float]) -> Array:
    """A read-only array, as it is shared."""
    array = np.array(values, dtype=float)
    array.flags.writeable = False
    return array
