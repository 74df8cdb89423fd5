"""Joint spline: the joints of one robot over the whole common clock as a B-spline, at rest at both ends."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.b_spline import UniformBSpline

REPEATED: Final = 3  # times that the first and the last coefficient count: no speed and no acceleration at the ends
FEWEST: Final = 2  # coefficients: the first and the last configuration


@dataclass(frozen=True, kw_only=True, eq=False)
class JointSpline:
    """A given joint path ``q(s)`` over the share ``s`` of the common clock, smooth to all but its last derivatives.

    The spline is clamped, with evenly spaced knots; its first and its last coefficient count three times, so that the
    joints begin and end at rest and without acceleration. The first coefficient is the start posture.
    """

    coefficients: Array  # configurations in [rad] or [m], shape (M, n), at least two
    degree: int  # degree of the polynomials between two knots, 3 or 5

    def __post_init__(self) -> None:
        """Check that there are ends, and that all numbers are finite."""
        if self.coefficients.ndim != 2 or len(self.coefficients) < FEWEST or not np.isfinite(self.coefficients).all():
            raise ValueError(f"joint spline: expected at least {FEWEST} finite configurations")

    @classmethod
    def fitted(cls, shares: Array, q: Array, *, count: int, degree: int) -> "JointSpline":
        """The spline nearest to a motion in the sense of least squares; its first and its last row are met exactly.

        Args:
            shares: Shares of the clock, increasing from 0 to 1, shape (N,), at least as many as there are coefficients.
            q: Configurations in [rad] or [m], shape (N, n).
        """
        values = basis(shares, count, degree)
        ends = values[:, [0, -1]] @ q[[0, -1]]
        inner, *_ = np.linalg.lstsq(values[:, 1:-1], q - ends, rcond=None)
        return cls(coefficients=np.concatenate([q[:1], inner, q[-1:]]), degree=degree)

    @property
    def start(self) -> Array:
        """Where it begins, shape (n,)."""
        return self.coefficients[0]

    @property
    def knots(self) -> Array:
        """Shares of the clock at which two polynomials meet, the ends left out, shape (K,)."""
        return _functions(len(self.coefficients), self.degree).inner_knots

    def at(self, shares: Array, derivative: int = 0) -> Array:
        """Configurations, or their derivatives by the share, at shares of the clock of shape (N,); shape (N, n)."""
        if derivative:
            return basis(shares, len(self.coefficients), self.degree, derivative) @ self.coefficients
        return self.start + basis(shares, len(self.coefficients), self.degree) @ (self.coefficients - self.start)


def basis(shares: Array, count: int, degree: int, derivative: int = 0) -> Array:
    """What each coefficient of a joint spline contributes at shares of the clock in 0..1, shape (N, count).

    ``shares`` has shape (N,).
    """
    values = _functions(count, degree).basis(shares, derivative)
    first, last = values[:, :REPEATED].sum(axis=1), values[:, -REPEATED:].sum(axis=1)
    return np.column_stack([first, values[:, REPEATED:-REPEATED], last])


def _functions(count: int, degree: int) -> UniformBSpline:
    """The basis functions of so many coefficients."""
    return UniformBSpline(degree=degree, count=count + 2 * (REPEATED - 1))
