"""Joint lines: the cost as a function of one joint alone, and where on that line it is least."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.planning.methods.support.search_cost import Expansion

ROUND: Final = 1e-12  # share of the largest aa: how well a way must be a circle on the axes that count to pass for one


@dataclass(frozen=True, slots=True, eq=False)
class JointLines:
    r"""The cost along every joint, for all joints at once.

    .. math:: h(\theta) = h_0 - 2 s \, a e - 2 (1 - c) \, n e + s^2 a a + (1 - c)^2 n n + 2 s (1 - c) \, a n

    with ``s = sin(theta)``, ``c = cos(theta)`` for joints that turn, ``s = theta``, ``c = 1`` for those that slide.
    Where all three axes of the place count, or the joint's axis stands square on those that do, ``aa = nn`` and
    ``an = 0``, and as ``s^2 + (1 - c)^2 = 2 (1 - c)``:

    .. math:: h(\theta) = k_0 + k_1 \sin\theta + k_2 \cos\theta, \quad
              k_1 = -2 \, a e, \quad k_2 = 2 (n e - a a), \quad k_0 = h_0 - k_2

    ([Nicolato2007]_ Eq. 3.13; the paper's Eq. 3.14 lacks the factor 2). Otherwise terms in ``sin^2``, ``sin cos`` stay.
    """

    ae: Array  # ``sum a . e`` over all points and directions, shape (nq,); so with the others
    ne: Array  # ``sum n . e``
    aa: Array  # ``sum a . a``
    nn: Array  # ``sum n . n``
    an: Array  # ``sum a . n``
    turns: Flags  # whether the joint moves the tools on circles, shape (nq,)

    def gain(self, theta: Array) -> Array:
        """By how much the cost falls when each joint alone moves by theta, shape (..., nq)."""
        turns = self.turns
        s = np.where(turns, np.sin(theta), theta)
        d = np.where(turns, 2.0 * np.sin(0.5 * theta) ** 2, 0.0)
        return 2.0 * (s * self.ae + d * self.ne) - s * s * self.aa - d * d * self.nn - 2.0 * s * d * self.an

    def best(self, lowest: Array, highest: Array) -> Array:
        r"""Moves that make the cost least along each joint alone, within bounds that include 0.

        On a circle the minimum is at ``atan2(-k_1, -k_2)``, on a parabola at ``ae / aa`` (Eqs. 3.20, 3.22; the paper's
        arctangent leaves open which of the two extremes it is). A joint that no move helps stays.

        Args:
            lowest: Largest move downwards, not above 0, shape (nq,).
            highest: Largest move upwards, not below 0, shape (nq,).
        """
        slide = self.ae / np.where(self.aa > 0.0, self.aa, 1.0)
        theta = np.where(self.turns, np.arctan2(self.ae, self.aa - self.ne), slide)
        best: Array = np.clip(theta, lowest, highest)
        is_skewed = np.maximum(np.abs(self.nn - self.aa), np.abs(self.an)) > ROUND * self.aa.max()
        for i in np.flatnonzero(self.turns & is_skewed):
            best[i] = self._best_of_skewed(int(i), float(lowest[i]), float(highest[i]))
        return np.where(self.gain(best) > 0.0, best, 0.0)

    def _best_of_skewed(self, i: int, lowest: float, highest: float) -> float:
        r"""Least cost along a joint whose way shows as an ellipse on the axes that count.

        With ``t = tan(theta / 2)`` the stationary points are the real roots of
        ``(ae - 2 an) t^4 + 2 (2 nn - aa - ne) t^3 + 6 an t^2 + 2 (aa - ne) t - ae``, and ``theta = pi`` if the first
        coefficient vanishes.
        """
        ae, ne, aa, nn, an = (float(coefficients[i]) for coefficients in (self.ae, self.ne, self.aa, self.nn, self.an))
        roots = np.roots([ae - 2 * an, 2 * (2 * nn - aa - ne), 6 * an, 2 * (aa - ne), -ae])
        angles = 2.0 * np.arctan(roots.real)  # whatever is no root is only tried in vain
        tried: Array = np.clip(np.concatenate([angles, [-np.pi, np.pi]]), lowest, highest)
        s, d = np.sin(tried), 2.0 * np.sin(0.5 * tried) ** 2
        gain = 2.0 * (s * ae + d * ne) - s * s * aa - d * d * nn - 2.0 * s * d * an
        return float(tried[np.argmax(gain)])


def joint_lines(expansion: Expansion) -> JointLines:
    """The cost along every joint from a configuration."""
    e, a, n = expansion.e, expansion.a, expansion.n
    return JointLines(
        ae=e @ a,
        ne=e @ n,
        aa=np.einsum("ij,ij->j", a, a),
        nn=np.einsum("ij,ij->j", n, n),
        an=np.einsum("ij,ij->j", a, n),
        turns=expansion.turns,
    )
