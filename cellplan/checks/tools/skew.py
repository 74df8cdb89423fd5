r"""Tool error on a part that another controller carries: what it grows to when the two clocks are apart.

Time t counts on the clock of the part. A tool whose clock is ahead by s is where its program has it at t + s, so that
on the part it is displaced by its own way in the world between t and t + s; where only some components are constrained,
only their share counts, seen in the part at t. No tool gets farther than its way, and its speed v within a step of the
program is bounded by the chord of the step and half of the largest second derivative (``certify.free_motion``):

.. math:: e(t, s) \le e(t, 0) + \int_t^{t + s} v(u)\,du

holds at every skew, not only at those that are tried. Angles likewise, with the speed at which the tool turns.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.transforms import Array, inverse
from cellplan.measures.tool_errors import errors_on_part
from cellplan.model.cell.cell import Relation
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

MAX_PARTS: Final = 16  # finer steps that the fastest steps are cut into
MAX_FINE: Final = 4096  # rows of all these
BISECTIONS: Final = 30  # of an allowed skew
ALL_AXES: Final = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorGrowth:
    """What one error grows by: a bound of it at some times, and what is allowed."""

    times: Array  # times in [s], ascending, shape (K,)
    sums: Array  # bound of the way from the first of them on in [m] or [rad], shape (K,)
    turns: Array  # angle in [rad] by which the part has turned, where that matters, shape (K,); zero where it does not
    whole: Array  # bound of the way in all components, likewise
    rows: Array  # times in [s] at which the error is judged, shape (N,)
    errors: Array  # error in [m] or [rad] there without a skew, shape (N,)
    limit: float  # allowed error

    def growth(self, shift: float) -> Array:
        """Bound of what is added to the error at each of the rows by either clock being ahead by so much, (N,)."""
        growth = np.zeros(len(self.rows))
        for later in (self.rows + shift, self.rows - shift):
            travel = np.abs(self._at(self.sums, later) - self._at(self.sums, self.rows))
            if self.turns.any():
                turned = np.abs(self._at(self.turns, later) - self._at(self.turns, self.rows))
                turned += float(np.diff(self.turns).max(initial=0.0))  # the step that begins before the later time
                travel += turned * np.abs(self._at(self.whole, later) - self._at(self.whole, self.rows))
            np.maximum(growth, travel, out=growth)
        return growth

    def largest(self, shift: float) -> float:
        """Upper bound of the error at any skew up to this, in [m] or [rad]."""
        return float((self.errors + self.growth(shift)).max(initial=0.0))

    def allowed(self) -> tuple[float, float | None]:
        """Largest skew in [s] that keeps the limit, inf for any, and the time of the row that limits it."""
        if not len(self.rows):
            return np.inf, None
        if self.turns.any():
            return self._bisected()
        here, budget = self._at(self.sums, self.rows), self.limit - self.errors
        ahead = self._reached(here + budget) - self.rows
        back = self.rows + self._reached_back(here - budget)
        shifts = np.where(budget < 0.0, 0.0, np.minimum(ahead, back))
        worst = int(np.argmin(shifts))
        return float(shifts[worst]), float(self.rows[worst]) if np.isfinite(shifts[worst]) else None

    def _bisected(self) -> tuple[float, float | None]:
        low, high = 0.0, float(self.times[-1] - self.times[0])
        if self.largest(high) <= self.limit:
            return np.inf, None
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if self.largest(middle) <= self.limit else (low, middle)
        return low, float(self.rows[int(np.argmax(self.errors + self.growth(high)))])

    def _at(self, sums: Array, times: Array) -> Array:
        return np.interp(times, self.times, sums)

    def _reached(self, goals: Array) -> Array:
        """Last time at which the sum is no more than each goal; inf where it never is more."""
        return np.where(goals >= self.sums[-1], np.inf, _crossing(self.sums, self.times, goals))

    def _reached_back(self, goals: Array) -> Array:
        """First time at which the sum is no less than each goal, with the other sign; inf where it always is."""
        crossed = _crossing(self.sums[-1] - self.sums[::-1], -self.times[::-1], self.sums[-1] - goals)
        return np.where(goals <= self.sums[0], np.inf, crossed)


def _crossing(sums: Array, times: Array, goals: Array) -> Array:
    """Last time at which an ascending sum is no more than each goal."""
    after = np.clip(np.searchsorted(sums, goals, side="right"), 1, len(sums) - 1)
    rise = sums[after] - sums[after - 1]
    share = np.clip((goals - sums[after - 1]) / np.where(rise > 0.0, rise, 1.0), 0.0, 1.0)
    return times[after - 1] + share * (times[after] - times[after - 1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolTravel:
    """How a tool moves on the part when its clock is shifted."""

    position: ErrorGrowth  # in [m]
    orientation: ErrorGrowth  # in [rad]
    speed: float  # bound of the largest speed of the tool in the constrained components in [m/s]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Mover:
    """A robot over the rows of a program."""

    chain: ScrewChain  # its kinematics
    q: Array  # its positions in [rad] or [m], shape (N, n)
    # largest second derivative of its tool tip in each step in [m], shape (N - 1,); see ``lever_arms.Chain``
    bend: Array
    turn_bend: Array  # likewise of a unit vector that turns with the tool

    @classmethod
    def of(cls, scene: Scene, arms: LeverArms, robot: str, *, q: Array, steps: Array) -> "Mover":
        """A robot of a scene, with the steps of all axes (``LeverArms.steps``)."""
        levers = arms.tool(robot, seen_by=None)
        return cls(chain=scene.chains[robot], q=q, bend=levers.bend(steps), turn_bend=levers.turn_bend(steps))

    def poses(self, rows: Array) -> Array:
        """Its tool tip in the world at places between the rows, shape (M, 4, 4)."""
        before = np.minimum(rows.astype(np.intp), len(self.q) - 2)
        share = (rows - before)[:, None]
        return self.chain.tool_poses((1.0 - share) * self.q[before] + share * self.q[before + 1])

    def nodes(self) -> Array:
        """All rows, and places between them where the tool is so fast that finer steps bound its speed better."""
        chords = np.linalg.norm(np.diff(self.chain.tool_poses(self.q)[:, :3, 3], axis=0), axis=1)
        fast = np.flatnonzero(chords + 0.5 * self.bend >= chords.max(initial=0.0))
        parts = min(MAX_PARTS, MAX_FINE // max(1, len(fast)))
        rows = np.arange(len(self.q), dtype=float)
        if parts < 2:
            return rows
        between = fast[:, None] + np.arange(1, parts) / parts
        return np.sort(np.append(rows, between.ravel()))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShiftedTool:
    """A tool on a part that another robot carries, at the rows of a program."""

    relation: Relation  # the task, or the grasp of a further holder
    mover: Mover  # the robot of the tool
    carrier: Mover  # the robot that carries the part
    X_CP: Array  # the part in the tool frame of that robot
    desired: Array  # desired poses on the part at the rows, shape (N, 4, 4)
    limits: tuple[float, float]  # largest position error in [m] and orientation error in [rad]
    first: int = 0  # first row at which errors are judged

    def travel(self, times: Array) -> ToolTravel:
        """What the errors of the tool grow by, at times of the rows in [s], shape (N,)."""
        mover, nodes = self.mover, self.mover.nodes()
        X_WT, parts = mover.poses(nodes), np.diff(nodes)
        step = np.minimum(nodes[:-1].astype(np.intp), len(times) - 2)
        X_PT = inverse(self.carrier.chain.tool_poses(self.carrier.q) @ self.X_CP) @ mover.chain.tool_poses(mover.q)
        at = np.interp(nodes, np.arange(len(times)), times)
        moved, bend = np.diff(X_WT[:, :3, 3], axis=0), mover.bend[step] * parts**2
        whole = _summed(np.linalg.norm(moved, axis=1) + 0.5 * bend)
        constrained, turns = self._constrained(nodes, moved, bend, whole)
        turned = self._turned(X_WT, mover.turn_bend[step] * parts**2, X_PT)
        errors = errors_on_part(X_PT, self.desired, self.relation)[self.first :]
        common = {"times": at, "rows": times[self.first :]}
        lengths, angles = np.linalg.norm(errors[:, :3], axis=1), np.linalg.norm(errors[:, 3:], axis=1)
        still = np.zeros(len(at))
        return ToolTravel(
            position=ErrorGrowth(
                sums=constrained, turns=turns, whole=whole, errors=lengths, limit=self.limits[0], **common
            ),
            orientation=ErrorGrowth(
                sums=turned, turns=still, whole=turned, errors=angles, limit=self.limits[1], **common
            ),
            speed=float((np.diff(constrained) / np.diff(at)).max(initial=0.0)),
        )

    def depth_growth(self, times: Array, depth: float, limit: float, *, reach: float) -> ErrorGrowth:
        """What the depth of the tool grows by: no more than its points move on the part.

        Args:
            times: Times of the rows in [s], shape (N,).
            depth: Largest depth in [m] on one clock.
            limit: What is allowed in [m].
            reach: Largest distance in [m] of what counts of the tool from its tip.
        """
        X_WT, mover = self.mover.poses(np.arange(len(times), dtype=float)), self.mover
        speeds = np.linalg.norm(np.diff(X_WT[:, :3, 3], axis=0), axis=1) + 0.5 * mover.bend
        speeds += reach * (_norms(np.diff(X_WT[:, :3, :3], axis=0)) + 0.5 * mover.turn_bend)
        sums, still = _summed(speeds), np.zeros(len(times))
        return ErrorGrowth(
            times=times, sums=sums, turns=still, whole=sums, rows=times, errors=still + depth, limit=limit
        )

    def _constrained(self, nodes: Array, moved: Array, bend: Array, whole: Array) -> tuple[Array, Array]:
        """Way of the tool in the constrained components at the nodes, and how far the part has turned, (K,) each.

        With all of them the part's turn does not matter: a length is the same however it is seen.
        """
        axes, still = [axis for axis in self.relation.axes if axis < 3], np.zeros(len(nodes))
        if len(axes) in (0, 3):
            return (whole if axes else still), still
        R_WP = (self.carrier.poses(nodes) @ self.X_CP)[:, :3, :3]
        seen = np.einsum("nji,nj->ni", R_WP[:-1], moved)[:, axes]
        step = np.minimum(nodes[:-1].astype(np.intp), len(self.carrier.turn_bend) - 1)
        turn = _norms(np.diff(R_WP, axis=0)) + 0.5 * self.carrier.turn_bend[step] * np.diff(nodes) ** 2
        return _summed(np.linalg.norm(seen, axis=1) + 0.5 * bend), _summed(turn)

    def _turned(self, X_WT: Array, bend: Array, X_PT: Array) -> Array:
        """Angle by which the tool has turned in the world, as far as it matters, at the nodes, shape (K,)."""
        axes = [axis for axis in self.relation.axes if axis > 2]
        if not axes:
            return np.zeros(len(X_WT))
        change = np.diff(X_WT[:, :3, :3], axis=0)
        chord = np.linalg.norm(change[:, :, 2], axis=1) if self.relation.is_spin_free else _norms(change)
        return _summed((chord + 0.5 * bend) * (self._stretched(X_PT) if len(axes) < 3 else 1.0))

    def _stretched(self, X_PT: Array) -> float:
        """How much faster than a tool turns one component of its rotation vector may grow.

        That is half of the angle of the error in all components by its sine; inf beyond a half turn.
        """
        relation = replace(self.relation, axes=ALL_AXES)
        full = np.linalg.norm(errors_on_part(X_PT, self.desired, relation)[:, 3:], axis=1)
        half = 0.5 * (float(full.max(initial=0.0)) + self.limits[1])
        if not half < 0.5 * np.pi:
            return float(np.inf)
        return half / float(np.sin(half)) if half > 0.0 else 1.0


def _summed(travels: Array) -> Array:
    """Sums of ways from the first node on, shape (K,)."""
    return np.append(0.0, np.cumsum(travels))


def _norms(change: Array) -> Array:
    """Spectral norms of differences of rotations, shape (M, 3, 3)."""
    return np.sqrt(0.5) * np.linalg.norm(change, axis=(1, 2))
