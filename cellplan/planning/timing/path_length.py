"""Length of a stacked joint path: a parameter by which the joints move at unit speed, also where they come to rest.

The joints are counted in shares of their top speeds, so that turning and sliding ones can be added: a length of 1 s is
a second in which one joint alone moves at its top speed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.joint_path import JointPath

STEPS_BETWEEN_BREAKS: Final = 12  # [-] intervals of integration between two breaks of the path
FEWEST_STEPS: Final = 2000  # [-] intervals of integration of a whole path
REST_SHARE: Final = 1e-6  # [-] of the largest speed over the nominal time: a slower path is at rest
KINK: Final = 1e-3  # [-] change of the unit direction of the path at a break: a larger one is a corner
BEHIND: Final = 3e-9  # [s] behind a break: its later side
HALVINGS: Final = 60  # of an interval: down to the last digit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathStretch:
    """A stretch of a path between two rests of all joints."""

    path: JointPath  # the whole path
    scale: Array  # seconds that each joint takes for a unit of its position at its top speed, shape (nq,)
    sigma: Array  # nominal times in [s] from its beginning to its end, shape (M,)
    lengths: Array  # length of path behind each of them in [s], from 0, increasing, shape (M,)
    rates: Array  # derivative of the length by the nominal time there, shape (M,)

    @property
    def length(self) -> float:
        """Length of the stretch in [s]."""
        return float(self.lengths[-1])

    def at(self, lengths: Array) -> Array:
        """Nominal times in [s] at lengths, shape (N,): by halving of the cubic through lengths and rates."""
        k = np.clip(np.searchsorted(self.lengths, lengths, side="right") - 1, 0, len(self.lengths) - 2)
        width = self.sigma[k + 1] - self.sigma[k]
        rise = self.lengths[k + 1] - self.lengths[k]
        slopes = self.rates[k] * width, self.rates[k + 1] * width
        share = lengths - self.lengths[k]
        low, high = np.zeros_like(share), np.ones_like(share)
        for _ in range(HALVINGS):
            u = 0.5 * (low + high)
            value = u * u * (3.0 - 2.0 * u) * rise + u * (1.0 - u) * ((1.0 - u) * slopes[0] - u * slopes[1])
            low, high = np.where(value < share, u, low), np.where(value < share, high, u)
        nominal: Array = self.sigma[k] + 0.5 * (low + high) * width
        nominal[lengths <= 0.0], nominal[lengths >= self.length] = self.sigma[0], self.sigma[-1]
        return nominal

    def directions(self, sigma: Array) -> Array:
        """Derivatives of the joints by the length at increasing nominal times in [s], shape (N, nq).

        At a rest the direction is that beside it.
        """
        velocities = self.path.at(sigma, 1)
        speeds = np.linalg.norm(velocities * self.scale, axis=1)
        known = np.flatnonzero(speeds > REST_SHARE * self.rates.max())
        nearest = known[np.clip(np.searchsorted(known, np.arange(len(sigma))), 0, len(known) - 1)]
        return velocities[nearest] / speeds[nearest, None]


def stretches(path: JointPath, top_speeds: Array) -> list[PathStretch]:
    """The stretches of a path between rests of all joints; where all stand still for a while, there is none.

    A corner that the path passes at speed ends a stretch as well: joints can pass it at rest only.

    Args:
        top_speeds: Largest speeds of the joints in [rad/s] or [m/s], shape (nq,).
    """
    scale = 1.0 / top_speeds
    count = max(STEPS_BETWEEN_BREAKS, -(-FEWEST_STEPS // max(1, len(path.breaks) - 1)))
    inner = np.arange(count) / count
    sigma = np.append((path.breaks[:-1, None] + np.diff(path.breaks)[:, None] * inner).ravel(), path.end)
    rates = np.linalg.norm(path.at(sigma, 1) * scale, axis=1)
    moves = rates > REST_SHARE * rates.max(initial=0.0)
    joined = moves[:-1] | moves[1:]  # an interval at one end of which the joints move
    ends = set(np.flatnonzero(~moves).tolist()) | {0, len(sigma) - 1}
    ends |= {count * k for k in _kinks(path, scale)}
    cuts = sorted(ends)
    pieces = []
    for first, last in pairwise(cuts):
        if joined[first] and last > first:
            pieces.append(_stretch(path, scale, sigma[first : last + 1]))
    return pieces


def _stretch(path: JointPath, scale: Array, sigma: Array) -> PathStretch:
    """One stretch: its length by Gauss's rule with three points between neighbouring nominal times."""
    points, weights = np.polynomial.legendre.leggauss(3)
    width = np.diff(sigma)
    inside = (sigma[:-1, None] + 0.5 * width[:, None] * (1.0 + points)).ravel()
    speeds = np.linalg.norm(path.at(inside, 1) * scale, axis=1).reshape(-1, 3)
    lengths = np.append(0.0, np.cumsum(0.5 * width * (speeds @ weights)))
    rates = np.linalg.norm(path.at(sigma, 1) * scale, axis=1)
    rates[0] = np.linalg.norm(path.at(sigma[:1] + BEHIND, 1) * scale)
    return PathStretch(path=path, scale=scale, sigma=sigma, lengths=lengths, rates=rates)


def _kinks(path: JointPath, scale: Array) -> Sequence[int]:
    """Numbers of the inner breaks at which the direction of the path jumps."""
    inner = path.breaks[1:-1]
    before, after = path.at(inner, 1) * scale, path.at(inner + BEHIND, 1) * scale
    speeds = np.minimum(np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1))
    is_slow = speeds <= REST_SHARE * speeds.max(initial=0.0)
    safe = np.where(is_slow, 1.0, speeds)[:, None]
    turn = np.linalg.norm(before / safe - after / safe, axis=1)
    return [int(k) + 1 for k in np.flatnonzero(~is_slow & (turn > KINK))]
