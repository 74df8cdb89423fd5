"""Joint path: the stacked joint vector as a smooth function of the nominal time."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.geometry.transforms import Array
from cellplan.model.task.task import TIME_TOLERANCE

CUBIC = 3


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Joints of all robots over the nominal time: polynomials between breaks, continuous where two of them meet."""

    start: Array  # stacked joint vector at the beginning, shape (nq,), in [rad] or [m]
    # nominal times in [s] at which the pieces begin and the last one ends, increasing, shape (pieces + 1,)
    breaks: Array
    nodes: Sequence[Array]  # stacked joint vectors at the Chebyshev points of each piece, shape (nq, degree + 1) each

    @classmethod
    def through(cls, times: Array, q: Array) -> "JointPath":
        """The cubic Hermite interpolant of rows: slopes are central differences, and zero at both ends.

        Args:
            times: Times of the rows in [s], increasing, shape (N,).
            q: Stacked joint vectors, shape (N, nq).
        """
        slopes = np.zeros_like(q)
        slopes[1:-1] = (q[2:] - q[:-2]) / (times[2:] - times[:-2])[:, None]
        u = chebyshev(CUBIC).nodes
        rise = u * u * (3.0 - 2.0 * u)
        step = np.diff(times)[:, None]
        shapes = zip(
            (1.0 - rise, rise, u * (1.0 - u) ** 2, -u * u * (1.0 - u)),
            (q[:-1], q[1:], step * slopes[:-1], step * slopes[1:]),
            strict=True,
        )
        nodes = sum(values[..., None] * shape for shape, values in shapes)
        return cls(q[0], times, list(np.asarray(nodes)))

    @property
    def end(self) -> float:
        """Last nominal time in [s]."""
        return float(self.breaks[-1])

    @property
    def last(self) -> Array:
        """Stacked joint vector at the end, shape (nq,)."""
        return self.nodes[-1][:, -1] if len(self.nodes) else self.start

    def at(self, sigma: Array, derivative: int = 0) -> Array:
        """Stacked joint vectors, or their derivatives by the nominal time, shape (N, nq).

        Args:
            sigma: Increasing nominal times in [s] within the path, shape (N,); at a break the piece before it counts.
            derivative: 0 for positions, 1 for velocities, 2 for accelerations.
        """
        q = np.tile(self.start if derivative == 0 else np.zeros_like(self.start), (len(sigma), 1))
        cuts = np.searchsorted(sigma, self.breaks[1:] + TIME_TOLERANCE, side="right")
        first = 0
        for begin, length, nodes, last in zip(
            self.breaks[:-1], np.diff(self.breaks), self.nodes, cuts.tolist(), strict=True
        ):
            if last > first:
                basis = chebyshev(nodes.shape[1] - 1)
                matrix = basis.values(np.clip((sigma[first:last] - begin) / length, 0.0, 1.0))
                for _ in range(derivative):
                    matrix = matrix @ basis.derivative / length
                end = nodes[:, -1:]  # what is added to it is exactly zero at the end and for joints that stand still
                change = (nodes - end) @ matrix.T
                q[first:last] = (change if derivative else end + change).T
            first = last
        return q
