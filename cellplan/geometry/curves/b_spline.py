"""B-splines over the shares 0..1 of a motion: clamped at both ends, their knots evenly spaced."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cellplan.geometry.arrays import Array


@dataclass(frozen=True, kw_only=True)
class UniformBSpline:
    """The basis of clamped B-splines with evenly spaced knots (de Boor 1978)."""

    degree: int  # degree of the polynomials between two knots
    count: int  # number of basis functions, at least ``degree + 1``

    def __post_init__(self) -> None:
        """Check that there are enough functions for the degree."""
        if self.degree < 1 or self.count <= self.degree:
            raise ValueError(f"B-spline of degree {self.degree}: expected more than {self.degree} functions")

    @property
    def inner_knots(self) -> Array:
        """Shares at which two polynomials meet, the ends left out, shape (count - degree - 1,)."""
        return np.linspace(0.0, 1.0, self.count - self.degree + 1)[1:-1]

    @cached_property
    def _knots(self) -> Array:
        """All knots, those at the ends ``degree + 1`` times, shape (count + degree + 1,)."""
        ends = np.ones(self.degree + 1)
        return np.concatenate([0.0 * ends, self.inner_knots, ends])

    def basis(self, shares: Array, derivative: int = 0) -> Array:
        r"""Values of all basis functions at shares in 0..1, (N,), or their derivatives by the share, shape (N, count).

        By the recursion of Cox and de Boor, :math:`B_{i,p} = w_{i,p} B_{i,p-1} + (1 - w_{i+1,p}) B_{i+1,p-1}` with
        :math:`w_{i,p}(x) = (x - t_i) / (t_{i+p} - t_i)`; the derivative of :math:`B_{i,p}` is :math:`p` times the
        difference of the two functions over their spans.
        """
        knots, x = self._knots, np.asarray(shares, dtype=float)[:, None]
        span = np.clip(np.searchsorted(knots, x[:, 0], side="right") - 1, self.degree, self.count - 1)
        values = (np.arange(len(knots) - 1) == span[:, None]).astype(float)
        for degree in range(1, self.degree + 1):
            widths = knots[degree:] - knots[:-degree]
            inverse = np.divide(1.0, widths, out=np.zeros_like(widths), where=widths > 0.0)
            if degree > self.degree - derivative:
                slopes = degree * values * inverse
                values = slopes[:, :-1] - slopes[:, 1:]
                continue
            rise = (x - knots[:-degree]) * inverse * values
            fall = (knots[degree:] - x) * inverse * values
            values = rise[:, :-1] + fall[:, 1:]
        return values
