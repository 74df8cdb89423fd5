"""Figures of motions: joint margins, speeds and accelerations at their worst, and their derivatives."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import NotFiniteError
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import joint_at
from cellplan.search.kernel.job import Job
from cellplan.search.kernel.run import Motions

FIGURES: Final = ("distance from its lower limit", "distance from its upper limit", "speed", "acceleration")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Peaks:
    """Largest values of functions of time known at nodes: of the parabola through a node and its neighbours."""

    value: Array  # the largest values, shape (K, n)
    node: Indices  # the nodes in the middle, shape (K, n), from 1 to N - 2
    shares: Array  # shares of the values before, at and after that node, (K, n, 3); signed for magnitudes

    @classmethod
    def of(cls, times: Array, values: Array, *, in_magnitude: bool = False) -> "Peaks":
        """Those of values at times in [s], shapes (K, N, n) and (N,), N at least 3."""
        seen = np.abs(values) if in_magnitude else values
        node = np.clip(np.argmax(seen, axis=1), 1, len(times) - 2)
        around = np.stack([node - 1, node, node + 1], axis=-1)
        near = np.take_along_axis(seen, np.moveaxis(around, -1, 1), axis=1)
        before, here, after = np.moveaxis(near, 1, 0)
        back, ahead = times[node] - times[node - 1], times[node + 1] - times[node]
        with np.errstate(divide="ignore", invalid="ignore"):
            rise, fall = (here - before) / back, (here - after) / ahead
            offset = np.nan_to_num((rise * ahead - fall * back) / (2.0 * (rise + fall)))
            is_inside = (rise >= 0.0) & (fall >= 0.0) & (rise + fall > 0.0) & (back > 0.0) & (ahead > 0.0)
            shares = _parabola(np.where(is_inside, offset, 0.0), back, ahead)
        best = np.eye(3)[np.argmax(near, axis=1)]
        shares = np.where(is_inside[..., None], shares, best)
        value = _weighted(shares, np.moveaxis(near, 1, -1))
        if in_magnitude:
            signed = np.take_along_axis(values, np.moveaxis(around, -1, 1), axis=1)
            shares = shares * np.moveaxis(np.sign(signed), 1, -1)
        return cls(value=value, node=node, shares=shares)

    def derivatives(self, candidate: int, of_values: Array) -> Array:
        """Derivatives of one candidate's peaks from those of the values at the nodes, shape (N, n, p) to (n, p)."""
        around = self.node[candidate][:, None] + np.arange(-1, 2)
        near = of_values[around, np.arange(around.shape[0])[:, None]]
        return np.einsum("ni,nip->np", self.shares[candidate], near)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PeakValues:
    """Values of functions of time at their nodes, or where one is highest among its neighbours that of the parabola."""

    value: Array  # the values, shape (N, n)
    shares: Array  # shares of the values before, at and after the node, (N, n, 3); signed for magnitudes

    @classmethod
    def of(cls, times: Array, values: Array, *, in_magnitude: bool = False) -> "PeakValues":
        """Those of values at times in [s], shapes (N, n) and (N,)."""
        seen = np.abs(values) if in_magnitude else values
        shares = np.zeros((*values.shape, 3))
        shares[..., 1] = 1.0
        near = np.stack([np.roll(seen, 1, axis=0), seen, np.roll(seen, -1, axis=0)], axis=-1)
        back, ahead = (np.diff(times)[part, None] for part in (slice(None, -1), slice(1, None)))
        before, here, after = np.moveaxis(near[1:-1], -1, 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            rise, fall = (here - before) / back, (here - after) / ahead
            offset = (rise * ahead - fall * back) / (2.0 * (rise + fall))
            is_inside = (rise >= 0.0) & (fall >= 0.0) & (rise + fall > 0.0) & (back > 0.0) & (ahead > 0.0)
            curved = _parabola(np.where(is_inside, offset, 0.0), back, ahead)
        shares[1:-1] = np.where(is_inside[..., None], curved, shares[1:-1])
        value = _weighted(shares, near)
        if in_magnitude:
            signs = np.sign(values)
            shares *= np.stack([np.roll(signs, 1, axis=0), signs, np.roll(signs, -1, axis=0)], axis=-1)
        return cls(value=value, shares=shares)

    @classmethod
    def at_nodes(cls, values: Array, *, in_magnitude: bool = False) -> "PeakValues":
        """Those of the nodes alone, of values of shape (N, n)."""
        shares = np.zeros((*values.shape, 3))
        shares[..., 1] = np.sign(values) if in_magnitude else 1.0
        return cls(value=np.abs(values) if in_magnitude else values, shares=shares)

    def derivatives(self, nodes: Indices, columns: Indices, of_values: Array) -> Array:
        """Derivatives of some of them from those of the values at the nodes, shape (N, n, p) to (M, p)."""
        last = len(self.value) - 1
        shares = self.shares[nodes, columns]
        derivatives = shares[:, 1, None] * of_values[nodes, columns]
        derivatives += shares[:, 0, None] * of_values[np.maximum(nodes - 1, 0), columns]
        return derivatives + shares[:, 2, None] * of_values[np.minimum(nodes + 1, last), columns]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionFigures:
    """What layouts are judged by, of each joint."""

    beyond_lower: Peaks  # how far it goes below its lower limit in [rad] or [m]; negative where room is left
    beyond_upper: Peaks  # likewise above its upper limit
    speeds: Peaks  # its largest speed as a share of its limit
    accelerations: Peaks  # its largest acceleration likewise; 0 without a limit

    @classmethod
    def of(cls, job: Job, motions: Motions) -> "MotionFigures":
        """The figures of motions; of those that lost a path they are not valid."""
        limits, times = job.limits, job.times
        figures = cls(
            beyond_lower=Peaks.of(times, limits.lower - motions.q),
            beyond_upper=Peaks.of(times, motions.q - limits.upper),
            speeds=Peaks.of(times, motions.qd / limits.velocity, in_magnitude=True),
            accelerations=Peaks.of(times, job.rates @ (motions.qd / limits.acceleration), in_magnitude=True),
        )
        peaks = (figures.beyond_lower, figures.beyond_upper, figures.speeds, figures.accelerations)
        for name, peak in zip(FIGURES, peaks, strict=True):
            refuse_not_finite(name, peak.value[motions.is_followed], lambda column: joint_at(job.cell, column))
        return figures

    @property
    def margins(self) -> Array:
        """Smallest distance of each joint from its limits in [rad] or [m], negative beyond, shape (K, nq)."""
        return -np.maximum(self.beyond_lower.value, self.beyond_upper.value)


def refuse_not_finite(name: str, values: Array, joint_names: Callable[[int], tuple[str, str]]) -> None:
    """Refuse figures of joints, shape (K, nq), that are no numbers, or infinite, with the joint of the first.

    Figures are negative where margin is left, so an infinite margin is -inf and passes.
    """
    bad = ~(values < np.inf)
    if bad.any():
        place, column = np.argwhere(bad)[0].tolist()
        raise NotFiniteError(
            f"{'/'.join(joint_names(column))}: expected a finite {name} in the search, got {values[place, column]}"
        )


def _weighted(shares: Array, near: Array) -> Array:
    """Sums of shares of three values; no share of an infinite one, as the margin of an endless joint is, is nothing."""
    return np.multiply(shares, near, out=np.zeros_like(near), where=shares != 0.0).sum(axis=-1)


def _parabola(offset: Array, back: Array, ahead: Array) -> Array:
    """Lagrange's shares of three values ``back`` before a place, at it and ``ahead`` after it, at an offset from it."""
    first = offset * (offset - ahead) / (back * (back + ahead))
    last = offset * (offset + back) / (ahead * (back + ahead))
    return np.stack([first, 1.0 - first - last, last], axis=-1)
