"""Toolpath: where the tool must be on the part, before any robot or clock is involved."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.curves.arc_length import ArcLength, QuickParameters
from cellplan.geometry.curves.curve import Curve
from cellplan.geometry.curves.orientation import Orientation
from cellplan.geometry.curves.seam_line import SeamPlaces
from cellplan.geometry.transforms import pose_from, rotation_about

TOOL_Z: Final = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Toolpath:
    """Path of one task as tool poses in P over the length along it, cut into pieces at its stops.

    Attributes:
        name: Name of the task.
        tip: Curve of the tool tip in P.
        orientation: Orientation of the tool in P, before its rotation about its own axis.
        arc: Length along the tip curve, or along the line that the tip weaves about.
        stops: Parameters of the tip curve between which the pieces lie, shape (pieces + 1,).
        turn: Angle in [rad] by which the tool turns about its own z axis, uniformly over the whole length.
        is_closed: Whether the last piece ends in the pose in which the first starts, but for the turn.
        runs_on: Whether the closed path passes its start without a corner and without a stop.
        stand_off: Distance in [m], against the tool's axis, from which the tool comes to its start.
        is_timed: Whether the parameter of both curves is the time in [s] since the start: a trajectory keeps its own
            times and may stand still.
        bulge: Largest distance in [m] of a smooth curve from the straight lines between its points, before it is
            projected; None for other curves.
        seam: The seam with its walls by the parameter of the tip curve; None without walls.
        listed: The same by the points and axes that a file lists, where the path was smoothed; else None.
        runs: Lengths in [m] of its run-in and of its run-out, which belong to it; nil without.
        line: Curve that the tip weaves about, along which length and feed are measured; None where it does not weave.
    """

    name: str
    tip: Curve
    orientation: Orientation
    arc: ArcLength
    stops: Array
    turn: float
    is_closed: bool
    runs_on: bool = False
    stand_off: float = 0.0
    is_timed: bool = False
    bulge: float | None = None
    seam: SeamPlaces | None = None
    line: Curve | None = None
    listed: "Toolpath | None" = None
    runs: tuple[float, float] = (0.0, 0.0)

    def __repr__(self) -> str:
        """One line without arrays."""
        return f"<Toolpath of '{self.name}', {1e3 * self.length:.4g} mm, {'closed' if self.is_closed else 'open'}>"

    @property
    def length(self) -> float:
        """Length of the whole path on the surface in [m]."""
        return self.arc.total

    @property
    def without_weave(self) -> "Toolpath":
        """The same with the tip on the line that it weaves about."""
        return self if self.line is None else replace(self, tip=self.line, line=None)

    @property
    def duration(self) -> float:
        """Time for one cycle of a trajectory in [s]."""
        return float(self.stops[-1])

    @property
    def behind(self) -> Array:
        """Length in [m] behind each stop, from zero to the whole length, shape (pieces + 1,)."""
        return self.arc.behind_knots(self.stops)

    @property
    def knots(self) -> Array:
        """Parameters at which the tip curve or the orientation is joined, the ends included, shape (K,)."""
        knots: Array = np.unique(np.concatenate([self.tip.knots, self.orientation.knots, self.stops]))
        return knots[(knots >= self.stops[0]) & (knots <= self.stops[-1])]

    @property
    def pieces(self) -> "tuple[Piece, ...]":
        """The segments between stops, in order; each starts where the previous one ends."""
        behind = self.behind
        lengths = zip(behind[:-1], np.diff(behind), strict=True)
        return tuple(Piece(self, k, float(start), float(length)) for k, (start, length) in enumerate(lengths))

    @property
    def X_PT_start(self) -> Array:
        """Tool tip pose at the start, that of an approach if there is one, shape (4, 4)."""
        X_PT = self.spread(1)[0]
        X_PT[:3, 3] -= self.stand_off * X_PT[:3, 2]
        return X_PT

    def spread(self, count: int) -> Array:
        """Tool tip poses X_PT evenly over the time of a trajectory, else over the length, shape (count, 4, 4)."""
        if self.is_timed:
            return self.at(np.linspace(0.0, self.duration, count))[0]
        return self.poses(np.linspace(0.0, self.length, count))

    def at(self, t: Array) -> tuple[Array, Array]:
        """Poses X_PT, shape (N, 4, 4), and twists in P, shape (N, 6), of a trajectory at times of shape (N,)."""
        interval = (float(self.stops[0]), float(self.stops[-1]))
        p, v = self.tip.evaluate(t, interval)
        R, w = self.orientation.frames(t, interval, p=p, dp=v)
        return pose_from(R, p), np.concatenate([v, w], axis=1)

    def poses(self, s: Array) -> Array:
        """Tool tip poses X_PT, shape (N, 4, 4), at lengths in [m] from the start of the path, shape (N,)."""
        pieces = np.clip(np.searchsorted(self.behind, s, side="right") - 1, 0, len(self.stops) - 2)
        return self.targets(pieces, s)[0]

    def targets(self, pieces: Indices, s: Array, *, quick: QuickParameters | None = None) -> tuple[Array, Array]:
        """Tool poses and their change per length of path.

        Args:
            pieces: Which piece each target belongs to, shape (N,): it says which side counts at a stop.
            s: Lengths in [m] from the start of the path, shape (N,); beyond its piece the nearer end is taken.
            quick: Another way to the parameters at these lengths, for a few at a time.

        Returns:
            Poses X_PT, shape (N, 4, 4), and tool twists in P per length, linear first, shape (N, 6), in [m/m] and
            [rad/m].
        """
        interval = (self.stops[pieces], self.stops[pieces + 1])
        u = (quick or self.arc).parameters(s, interval)
        p, dp = self.tip.evaluate(u, interval)
        on_line, along = (p, dp) if self.line is None else self.line.evaluate(u, interval)
        R, w = self.orientation.frames(u, interval, p=on_line, dp=along)
        twists = np.concatenate([dp, w], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
        if self.turn:
            R = R @ rotation_about(TOOL_Z, self.turn / self.length * np.clip(s, 0.0, self.length))
            twists[:, 3:] += self.turn / self.length * R[:, :, 2]
        return pose_from(R, p), twists


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """Stretch of a toolpath between two stops: its number, the length before it and its own length in [m]."""

    path: Toolpath
    number: int
    start: float
    length: float

    def poses(self, s: Array) -> Array:
        """Tool tip poses X_PT, shape (N, 4, 4), at lengths in [m] from the start of the piece, shape (N,)."""
        return self._targets(s)[0]

    def twists_per_length(self, s: Array) -> Array:
        """Change of the pose per length: tool twists in P, linear first, shape (N, 6), in [m/m] and [rad/m]."""
        return self._targets(s)[1]

    def _targets(self, s: Array) -> tuple[Array, Array]:
        """See `Toolpath.targets`."""
        return self.path.targets(np.full(len(s), self.number), self.start + np.clip(s, 0.0, self.length))
