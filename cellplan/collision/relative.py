r"""What a distance at one sample proves at others: two bodies cannot come closer faster than they move.

If x is a point of B and X(k) the pose of B seen from A at sample k, then

.. math:: d(k') \ge d(k) - \max_x |X(k') x - X(k) x| \ge d(k) - |c(k') - c(k)| - \rho \, |R(k') - R(k)|_2

with the centre c and radius :math:`\rho` of a sphere round B; the same holds for A seen from B. For convex bodies
the direction that proves the distance at k, carried along with A or with B, proves one at k' as well. Both are exact
statements about samples, whatever happens between them.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.certificate import supports
from cellplan.collision.engine import Engine
from cellplan.collision.measure import Reading
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array

Samples = NDArray[np.intp]

SUPPORT_WORK: Final = 200_000  # [-] products of a direction and a vertex worth spending on one reading: about 0.5 ms
ROUNDING: Final = 1e-9  # [m] taken off what is carried over, so that rounding never lifts a bound above the truth


class RelativeMotion:
    """One pair of bodies over all samples, each seen from the other."""

    def __init__(self, engine: Engine, pair: tuple[int, int], poses: BodyPoses) -> None:
        """Work out the pose of the second body seen from the first at each sample."""
        first, second = pair
        self._a, self._b = engine.bodies[first], engine.bodies[second]
        self._R_WA = poses.R[first]
        R_AW = np.swapaxes(poses.R[first], 1, 2)
        self._R_AB = R_AW @ poses.R[second]
        self._p_AB = (R_AW @ (poses.p[second] - poses.p[first])[..., None])[..., 0]
        self._b_in_A = self._p_AB + self._R_AB @ self._b.centre
        self._a_in_B = ((self._a.centre - self._p_AB)[:, None, :] @ self._R_AB)[:, 0]
        self._work = sum(len(body.hull.vertices) for body in (self._a, self._b) if isinstance(body.hull, Mesh))

    def travel(self, sample: int, others: Samples) -> Array:
        """Farthest that any point of one body moves as seen from the other between a sample and others, in [m]."""
        change = (self._R_AB[others] - self._R_AB[sample]).reshape(-1, 9)
        turn = np.sqrt(0.5 * np.einsum("ij,ij->i", change, change))  # |R' - R|_F = sqrt(2) |R' - R|_2
        moved_b = np.linalg.norm(self._b_in_A[others] - self._b_in_A[sample], axis=1) + self._b.radius * turn
        moved_a = np.linalg.norm(self._a_in_B[others] - self._a_in_B[sample], axis=1) + self._a.radius * turn
        farthest: Array = np.minimum(moved_a, moved_b)
        return farthest

    def carry(self, reading: Reading, sample: int, *, others: Samples, lower: Array) -> None:
        """Raise the lower bounds at other samples (an array over all samples) by what a reading proves there."""
        if reading.bound > 0.0:
            lower[others] = np.maximum(lower[others], reading.bound - self.travel(sample, others) - ROUNDING)
        if reading.direction is not None:
            near = self._affordable(sample, others)
            lower[near] = np.maximum(lower[near], self._carried_direction(reading.direction, sample, near) - ROUNDING)

    def _affordable(self, sample: int, others: Samples) -> Samples:
        """Those of the others next to the sample for which support functions are not too much work."""
        if not self._work:
            return others
        half = max(8, SUPPORT_WORK // (2 * self._work))
        place = int(np.searchsorted(others, sample))
        return others[max(0, place - half) : place + half]

    def _carried_direction(self, n: Array, sample: int, others: Samples) -> Array:
        """Distance in [m] that a direction, held fast in A or in B, proves between the hulls at other samples."""
        n_A = n @ self._R_WA[sample]
        n_A = n_A / np.linalg.norm(n_A)
        n_B = n_A @ self._R_AB[sample]
        R, p = self._R_AB[others], self._p_AB[others]
        a, b = self._a.hull, self._b.hull
        fixed_in_A = p @ n_A - supports(a, n_A[None])[0] - supports(b, -(n_A @ R))
        turning = R @ n_B
        fixed_in_B = np.einsum("ij,ij->i", turning, p) - supports(a, turning) - supports(b, -n_B[None])[0]
        proved: Array = np.maximum(fixed_in_A, fixed_in_B) - self._a.looseness - self._b.looseness
        return proved
