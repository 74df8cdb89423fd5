"""Best try: of the transfer moves tried in vain, the one that comes nearest to being free, and what is in its way.

Tried are the straight move of all robots at once, and each order of robots one after the other: each of them on the way
that was found for it, else along both trees with a straight line from the one to the other where they came nearest,
else straight.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from cellplan.certify.bound import Bound, PairBound
from cellplan.certify.certify import certify
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.arrays import Array
from cellplan.model.units import MM
from cellplan.planning.path.formatting import in_mm
from cellplan.scene.collision.distance import nearest_points, point_above
from cellplan.scene.collision.overlap.depth import ground_depth, overlap_depth
from cellplan.scene.pairs import ScenePair
from cellplan.scene.scene import Scene

STEP: Final = 0.05  # [s] between two rows of a try at top speed: some 5 deg of an arm
DEPTHS: Final = 24  # [-] configurations of a try at which a touching pair is measured, and as many at the deepest


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Try:
    """A transfer move that is not free."""

    words: str  # how the robots move
    q: Array  # stacked joint positions in [rad] or [m], shape (K, nq)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlockedTry:
    """A try with the pair that falls short of its demand most."""

    scene: Scene
    tried: Try
    bodies: tuple[str, str]  # names of the pair
    missing: float  # by how much the pair falls short of its demand in [m], its depth included
    row: int  # row of the try at which it does
    words: str  # the pair, the amount and the place
    place: Array | None = None  # where that is in the world in [m], shape (3,); None where nothing is in the way

    @property
    def record(self) -> dict[str, Any]:
        """The same as data in mm, for scripts."""
        return {
            "pair": list(self.bodies),
            "missing_mm": self.missing * MM,
            "place_mm": None if self.place is None else (self.place * MM).tolist(),
            "share_of_try": self.row / (len(self.tried.q) - 1),
            "try": self.tried.words,
        }


class BlockedTransferError(TransferNotFoundError):
    """No transfer move was found, or it begins or ends too close to something.

    Attributes:
        best: The best try; None once the error was sent to another process.
        name: Name of the phase; empty where it is not known.
    """

    def __init__(self, place: str, what: str, best: BlockedTry | None = None, *, name: str = "") -> None:
        """Join place and words."""
        super().__init__(f"{place}: {what}")
        self.place, self.what, self.best, self.name = place, what, best, name

    def __reduce__(self) -> tuple[type["BlockedTransferError"], tuple[str, str]]:
        """Cross to another process as words."""
        return BlockedTransferError, (self.place, self.what)

    @property
    def details(self) -> Mapping[str, object]:
        """What a script reads of it beside its words."""
        return {"blocked": None if self.best is None else {"phase": self.name or None, **self.best.record}}

    def of_phase(self, name: str, between: str) -> "BlockedTransferError":
        """The same with the name of the phase, and between what it is."""
        return BlockedTransferError(self.place, f"{name}, {between}: {self.what}", self.best, name=name)


def best_try(scene: Scene, tries: Iterable[Try]) -> BlockedTry:
    """The try whose worst pair falls short of its demand least; the first of equal ones."""
    return min((blocked_try(scene, attempt) for attempt in tries), key=lambda blocked: round(blocked.missing, 6))


def blocked_try(scene: Scene, tried: Try) -> BlockedTry:
    """The pair that falls short of its demand most in a try, and by how much."""
    bound = certify(scene, tried.q, with_curves=False)
    short = [_shortfall(bound, pair) for pair in bound.pairs if not pair.is_met]
    if not short:  # free at last: only more rows were refused
        return BlockedTry(scene=scene, tried=tried, bodies=("", ""), missing=0.0, row=0, words="nothing is in the way")
    missing, depth, row, pair = max(short, key=lambda entry: entry[0])
    first, second = bound.names(pair)
    is_deep = round(depth * MM, 3) > 0.0  # less is rounding: the bodies touch
    held = f"is {depth * MM:.3g} mm deep in" if is_deep else f"is {pair.proved * MM:.3g} mm from"
    held = "touches" if pair.touches and not is_deep else held
    demand = f", {pair.demand * MM:g} mm are demanded" if pair.keeps_clearance else ""
    place = _place(scene, pair.pair, tried.q[[row]])
    share = f" at {100.0 * row / (len(tried.q) - 1):.0f} % of the try" if np.any(tried.q != tried.q[0]) else ""
    words = f"'{first}' {held} '{second}' near {in_mm(np.round(place, 3))}{share}{demand}"
    bodies = first, second
    return BlockedTry(scene=scene, tried=tried, bodies=bodies, missing=missing, row=row, words=words, place=place)


def _shortfall(bound: Bound, pair: PairBound) -> tuple[float, float, int, PairBound]:
    """By how much a pair falls short of its demand in [m], its depth, and the row at which that is."""
    if not pair.touches:
        return pair.demand - pair.proved, 0.0, round(pair.at), pair
    last = len(bound.q) - 1
    rows = np.unique(np.clip(np.rint(pair.touches), 0, last).astype(np.intp))
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, DEPTHS).round().astype(np.intp))]
    deepest = int(rows[np.argmax(_depths(bound.scene, pair.pair, bound.q[rows]))])
    at = np.linspace(max(0, deepest - 1), min(last, deepest + 1), DEPTHS + 1)
    near = np.array([np.interp(at, np.arange(last + 1), column) for column in bound.q.T]).T
    depth = float(_depths(bound.scene, pair.pair, near).max())
    return pair.demand + depth, depth, deepest, pair


def _place(scene: Scene, pair: ScenePair, q: Array) -> Array:
    """Where a pair is nearest at one configuration of shape (1, nq), in the world in [m], shape (3,).

    Of bodies that touch it is the middle of the smaller one.
    """
    if pair.solids is None:
        poses = scene.pair_poses((pair.first, pair.first), q)
        return point_above(scene.engine, pair.first, poses, X_WS=scene.bodies[pair.second].X_BS, sample=0).first
    poses, (first, second) = scene.pair_poses(pair.solids, q), pair.solids
    nearest = nearest_points(scene.engine, pair.solids, poses, sample=0)
    if nearest.distance > 0.0:
        return 0.5 * (nearest.first + nearest.second)
    return nearest.first if scene.engine.radii[first] <= scene.engine.radii[second] else nearest.second


def _depths(scene: Scene, pair: ScenePair, q: Array) -> Array:
    """Depth of a pair at some configurations of shape (K, nq), in [m], shape (K,)."""
    if pair.solids is None:
        poses = scene.pair_poses((pair.first, pair.first), q)
        X_WS = scene.bodies[pair.second].X_BS
        return ground_depth(scene.engine.bodies[pair.first], poses, pair.first, X_WS=X_WS)
    poses = scene.pair_poses(pair.solids, q)
    return np.array([overlap_depth(scene.engine, pair.solids, poses, sample=k) for k in range(len(q))])


def rows_through(via: Array, velocity: Array) -> Array:
    """Rows along straight lines through via points, shape (K, nq), so dense that top speed takes ``STEP`` for each."""
    rows = [via[:1]]
    for before, after in pairwise(via):
        count = max(1, int(np.ceil(float((np.abs(after - before) / velocity).max()) / STEP)))
        rows.append(before + np.linspace(0.0, 1.0, count + 1)[1:, None] * (after - before))
    return np.concatenate(rows)


def one_by_one(start: Array, paths: Sequence[tuple[slice, Array]]) -> Array:
    """Via points of robots that move one after the other, shape (K, nq).

    Args:
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        paths: Columns of each robot in their order, and its via points, shape (k, n).
    """
    via, q = [start], start
    for columns, path in paths:
        for point in path[1:]:
            q = q.copy()
            q[columns] = point
            via.append(q)
    return np.array(via)
