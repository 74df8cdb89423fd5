"""Figures of a live motion: what each is, its limit, whether it is kept, and what binds at which time."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell, Timing, joint_at
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Record
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.figures import PeakValues
from cellplan.search.programs.layout_problem import distances_at
from cellplan.search.programs.problem import Distances
from cellplan.session.blocks import Block
from cellplan.session.motion import LiveMotion

KEYS: Final = 33  # [-] configurations of a motion at which distances are asked
WITHIN: Final = 0.08  # [m] beyond what is demanded of them, up to which they are figures
NEARER: Final = 0.005  # [m] by which bodies are likely to come nearer from one change to the next
TOUCHING: Final = 1e-9  # [m] bodies of which less is demanded may touch
DEPTH_TOL: Final = 1e-6  # [m] by which what is held or stands may be deeper than allowed: rounding
DECIMALS: Final = 4  # of figures and times


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A figure of a block, in the unit that it is shown in."""

    name: str  # margin, travel, velocity, acceleration, clearance, cycle, …
    value: float | None  # None where nothing is near
    unit: str
    limit: float | None  # None without a limit
    is_met: bool  # whether the limit is kept
    binds: str = ""  # what comes nearest to the limit
    at: float | None = None  # when, in [s]

    @property
    def record(self) -> Record:
        """The figure as plain values."""
        return {
            "name": self.name,
            "value": None if self.value is None else round(self.value, DECIMALS) + 0.0,
            "unit": self.unit,
            "limit": self.limit,
            "is_met": self.is_met,
            "binds": self.binds,
            "at": None if self.at is None else round(self.at, DECIMALS),
        }

    @property
    def words(self) -> str:
        """The figure in a few words."""
        value = "none" if self.value is None else f"{self.value:.4g} {self.unit}"
        what = f" ({self.binds})" if self.binds else ""
        return f"{self.name} {value}{what}{'' if self.at is None else f' at {self.at:.3f} s'}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loads:
    """How near the joints of a motion come to their limits."""

    beyond: PeakValues  # distances beyond position limits in [rad] or [m], negative within, shape (N, nq)
    speeds: PeakValues  # shares of the speed limits, shape (N, nq)
    accelerations: PeakValues  # shares of the acceleration limits, 0 without one, shape (N, nq)

    @classmethod
    def of(cls, cell: Cell, motion: LiveMotion) -> "Loads":
        """Those of the joints of a cell."""
        limits, times = cell.joint_limits, motion.times
        made = PeakValues.of if len(times) > 2 and not motion.is_planned else _at_nodes
        return cls(
            beyond=made(times, np.maximum(limits.lower - motion.q, motion.q - limits.upper)),
            speeds=made(times, motion.qd / limits.velocity, in_magnitude=True),
            accelerations=made(times, motion.qdd / acceleration_limits(cell), in_magnitude=True),
        )

    @property
    def factor(self) -> float:
        """How many times as long as it is the motion would have to last to use its limits fully."""
        return max(float(self.speeds.value.max()), float(np.sqrt(self.accelerations.value.max())))

    def worst(self, cell: Cell) -> Array:
        """The largest share of a limit at each node: 1 at a position limit, 0 in the middle of a range, shape (N,)."""
        limits = cell.joint_limits
        half = 0.5 * (limits.upper - limits.lower)
        with np.errstate(invalid="ignore"):
            ranges = np.where(np.isfinite(half), 1.0 + self.beyond.value / np.where(half > 0.0, half, 1.0), 0.0)
        return np.maximum(np.maximum(ranges, self.speeds.value), self.accelerations.value).max(axis=1)


def _at_nodes(times: Array, values: Array, *, in_magnitude: bool = False) -> PeakValues:  # noqa: ARG001
    return PeakValues.at_nodes(values, in_magnitude=in_magnitude)


def joint_figures(cell: Cell, motion: LiveMotion, loads: Loads) -> Iterator[Figure]:
    """Margins, speeds, accelerations and the shortest cycle."""
    turning, times, is_timed = cell.joint_limits.is_revolute, motion.times, cell.motion.timing is Timing.AS_WRITTEN
    for name, which, scale, unit in (("margin", turning, DEG, "deg"), ("travel", ~turning, MM, "mm")):
        if np.isfinite(loads.beyond.value[:, which]).any():
            place = _highest(loads.beyond.value, which)
            value = -float(loads.beyond.value[place])
            yield Figure(
                name=name,
                value=scale * value,
                unit=unit,
                limit=0.0,
                is_met=value >= 0.0,
                binds=_joint(cell, place[1]),
                at=float(times[place[0]]),
            )
    for name, shares in (("velocity", loads.speeds.value), ("acceleration", loads.accelerations.value)):
        if shares.any():
            place = _highest(shares, np.ones(shares.shape[1], dtype=bool))
            value = 100.0 * float(shares[place])
            yield Figure(
                name=name,
                value=value,
                unit="%",
                limit=100.0 if is_timed else None,
                is_met=value <= 100.0 or not is_timed,
                binds=_joint(cell, place[1]),
                at=float(times[place[0]]),
            )
    if motion.is_followed:
        seconds = loads.factor * float(times[-1] - times[0])
        yield Figure(name="cycle", value=seconds, unit="s", limit=None, is_met=True)


def clearance_figures(block: Block, motion: LiveMotion, spare: float = WITHIN) -> Iterator[Figure]:
    """The smallest distance of bodies, and the greatest depth beyond what is allowed where one holds or stands.

    Args:
        block: The block.
        motion: Its motion; distances are those at some of its nodes.
        spare: About what the smallest distance is beyond what is demanded, in [m]; one that is near makes it quicker.
    """
    least = min(TOUCHING, block.bodies.most_demanded)
    for within in sorted({min(max(spare + NEARER, 0.0), WITHIN), WITHIN}):
        nearest, deepest = _least(_distances(block.bodies, motion, within), least)
        if nearest is not None and nearest.spare <= within:
            break
    if nearest is None:
        limit = MM * block.cell.checks.clearance_mm.si
        yield Figure(name="clearance", value=None, unit="mm", limit=limit, is_met=True)
    else:
        yield _of_pair("clearance", block, motion, nearest)
    if deepest is not None and deepest.spare < -DEPTH_TOL:
        yield _of_pair("depth", block, motion, deepest)


class _Least(NamedTuple):
    """The pair of bodies that comes nearest to what is demanded of it."""

    distances: Distances
    row: int  # its place among them

    @property
    def spare(self) -> float:
        """Distance in [m] beyond what is demanded."""
        return float(self.distances.values[self.row] - self.distances.demands[self.row])


def _distances(bodies: CellDistances, motion: LiveMotion, within: float) -> Distances:
    """Near pairs at some nodes of a motion."""
    nodes = np.unique(np.linspace(0, len(motion.times) - 1, KEYS).round().astype(np.intp))
    return distances_at(bodies, motion.x, motion.q, nodes, within)


def _least(distances: Distances, least: float) -> tuple[_Least | None, _Least | None]:
    """The pair nearest to its demand of those that must be so far apart in [m], and that of the others."""
    spare, is_apart = distances.values - distances.demands, distances.demands >= least
    rows = (np.flatnonzero(which) for which in (is_apart, ~is_apart))
    first, second = (_Least(distances, int(some[np.argmin(spare[some])])) if len(some) else None for some in rows)
    return first, second


def _of_pair(name: str, block: Block, motion: LiveMotion, least: _Least) -> Figure:
    """Distance of two bodies, or how deep they are in each other."""
    distances, row = least.distances, least.row
    scale = MM if name == "clearance" else -MM
    return Figure(
        name=name,
        value=scale * float(distances.values[row]),
        unit="mm",
        limit=scale * float(distances.demands[row]),
        is_met=least.spare >= 0.0,
        binds=" - ".join(block.bodies.pairs[int(distances.pairs[row])].names),
        at=float(motion.times[distances.nodes[row]]),
    )


def _highest(values: Array, which: Flags) -> tuple[int, int]:
    """Node and column of the largest value of some columns."""
    node, column = np.unravel_index(int(np.where(which, values, -np.inf).argmax()), values.shape)
    return int(node), int(column)


def _joint(cell: Cell, column: int) -> str:
    return "/".join(joint_at(cell, column))
