"""Joint positions as a robot's controller counts them, against those of the model."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ControllerZero:
    r"""How the controller counts joint positions: from which zero, which way round, and with which coupled axes.

    .. math:: c_i = s_i q_i + z_i + \sum_{j < i} k_{ij} c_j

    with the positions c of the controller and q of the model.
    """

    zero: Array  # position z that the controller shows while the model reads zero, in [rad] or [m], shape (n,)
    sign: Array  # sense s, 1 or -1, shape (n,)
    coupling: Array  # factors k of controller positions of earlier joints, shape (n, n), zero on and above the diagonal
    source: str  # where this is known from
    # smallest and largest position that the controller allows of what it shows, in [rad] or [m], shape (n, 2), infinite
    # where none is stated; None where none is at all
    limits: Array | None = None

    def __post_init__(self) -> None:
        """Make sure that both conversions exist."""
        n = len(self.zero)
        if self.sign.shape != (n,) or self.coupling.shape != (n, n):
            raise ValueError(f"controller: expected signs and couplings of {n} joints")
        if not np.all(np.abs(self.sign) == 1.0) or np.any(np.triu(self.coupling)):
            raise ValueError("controller: expected signs of 1 or -1, and couplings to earlier joints only")

    @property
    def is_identity(self) -> bool:
        """Whether the controller counts as the model does."""
        return not np.any(self.zero) and bool(np.all(self.sign == 1.0)) and not np.any(self.coupling)

    def from_model(self, q: Array) -> Array:
        """Positions of the controller for those of the model, both in [rad] or [m], shape (..., n)."""
        positions = self.sign * q + self.zero
        for joint, factors in enumerate(self.coupling):  # a joint counts on earlier ones only
            if np.any(factors):
                positions[..., joint] += positions @ factors
        return positions

    def to_model(self, positions: Array) -> Array:
        """Positions of the model for those of the controller, both in [rad] or [m], shape (..., n)."""
        return self.sign * (positions - positions @ self.coupling.T - self.zero)
