"""Weave: a tip that swings about its seam while it travels along it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.arc_length import ArcLength
from cellplan.geometry.curves.curve import BezierCurve, Curve, Interval, by_differences, cubic_fit
from cellplan.geometry.curves.orientation import Orientation
from cellplan.geometry.curves.rerun import RerunSeam
from cellplan.geometry.curves.seam_line import SeamPlaces
from cellplan.geometry.transforms import cross
from cellplan.model.task.seam import Weave, WeaveForm
from cellplan.model.task.task import Task, TimeLaw, TimeLawKind
from cellplan.model.task.time_law import advance
from cellplan.planning.path.curve import PathCurve
from cellplan.planning.path.formatting import in_mm
from cellplan.planning.path.standing import StandingFrame, StandingTravel

TURN: Final = 0.1  # [-] of a stroke from edge to edge, in which it comes to its speed or from it
STROKE_LAW: Final = TimeLaw(kind=TimeLawKind.STEADY, ramp=TURN)
DIRECTION_FIT: Final = 1e-7  # [-] of unit vectors across a seam: a weave of 10 mm is off by a nanometre
SAME_KNOT: Final = 1e-9  # [-] of a wavelength: knots nearer to one another are one, but for rounding
NO_JUMP: Final = 1e-7  # [m] of a tip at a corner


@dataclass(frozen=True, slots=True, eq=False)
class _Strokes:
    """One wavelength of a weave as strokes between points of the cross-section, and rests at its edges."""

    ends: Array  # length in [m] at which each stroke begins, and the one at which the last ends, shape (K + 1,)
    points: Array  # where each begins, and where the last ends: along the seam, left, out in [m], shape (K + 1, 3)
    lead: float  # length in [m] of the first stroke that lies before the start of the seam

    @classmethod
    def of(cls, weave: Weave) -> "_Strokes":
        """From edge to edge, from the middle of a stroke on; of a triangle from its root over both edges."""
        left, right = ([0.0, side * weave.side, weave.out] for side in (1.0, -1.0))
        moving = weave.wavelength - sum(weave.dwells)
        if weave.form is WeaveForm.TRIANGLE:
            lead, stroke, points = 0.0, moving / 3.0, [[0.0] * 3, left, left, right, right, [0.0] * 3]
            lengths = [stroke, weave.dwells[0], stroke, weave.dwells[1], stroke]
        else:
            lead, stroke, points = 0.25 * moving, 0.5 * moving, [right, left, left, right, right]
            lengths = [stroke, weave.dwells[0], stroke, weave.dwells[1]]
        is_long = np.append(True, np.array(lengths) > 0.0)
        return cls(np.append(0.0, np.cumsum(lengths))[is_long], np.array(points)[is_long], lead)


def weave_offsets(weave: Weave, s: Array) -> tuple[Array, Array]:
    """Where the tip is from the seam: along it, to its left and out of it.

    Args:
        s: Lengths in [m] from the start of the seam, shape (N,).

    Returns:
        Offsets in [m] and their change per length, shape (N, 3) each.
    """
    if weave.form is WeaveForm.CIRCLE:
        angle, k = 2.0 * np.pi * s / weave.wavelength, 2.0 * np.pi / weave.wavelength
        cosine, sine, zero = np.cos(angle), np.sin(angle), np.zeros_like(s)
        return weave.side * np.stack([cosine, sine, zero], 1), k * weave.side * np.stack([-sine, cosine, zero], 1)
    strokes = _Strokes.of(weave)
    phase = np.mod(s + strokes.lead, weave.wavelength)
    stroke = np.clip(np.searchsorted(strokes.ends, phase, side="right") - 1, 0, len(strokes.ends) - 2)
    width = np.diff(strokes.ends)[stroke]
    share = np.clip((phase - strokes.ends[stroke]) / width, 0.0, 1.0)
    if weave.form is WeaveForm.SINE:
        done, rate = 0.5 - 0.5 * np.cos(np.pi * share), 0.5 * np.pi * np.sin(np.pi * share)
    else:
        law = advance(STROKE_LAW, share)
        done, rate = law.share, law.rate
    move = np.diff(strokes.points, axis=0)[stroke]
    return strokes.points[stroke] + done[:, None] * move, (rate / width)[:, None] * move


def weave_knots(weave: Weave, length: float, *, others: Sequence[float] = ()) -> Array:
    """Lengths in [m] from the start of a seam at which a weave or something else is joined, up to its end."""
    if weave.form is WeaveForm.CIRCLE:
        inside, lead = np.linspace(0.0, weave.wavelength, 5)[:-1], 0.0
    else:
        strokes = _Strokes.of(weave)
        ends, lead = strokes.ends, strokes.lead
        ramps = TURN * np.diff(ends) if weave.form is not WeaveForm.SINE else np.zeros(len(ends) - 1)
        inside = np.unique(np.concatenate([ends[:-1], ends[:-1] + ramps, ends[1:] - ramps]))
        inside = inside[inside < ends[-1]]
    knots = np.sort(np.append((_periods(weave, length + lead) + inside).ravel() - lead, others))
    apart = SAME_KNOT * weave.wavelength
    return knots[(knots > apart) & (knots < length - apart) & (np.diff(knots, prepend=-np.inf) > apart)]


def standing_travel(weave: Weave, line: Curve, arc: ArcLength) -> StandingTravel:
    """The travel of a tip along a line with a length that stands for the dwells of its weave."""
    strokes = _Strokes.of(weave)
    is_rest = ~np.diff(strokes.points, axis=0).any(axis=1)
    starts = _periods(weave, arc.total + strokes.lead) - strokes.lead
    begins, ends = ((starts + it[is_rest]).ravel().tolist() for it in (strokes.ends[:-1], strokes.ends[1:]))
    rate = weave.wavelength / (weave.wavelength - sum(weave.dwells))
    return StandingTravel.of(line, arc, list(zip(begins, ends, strict=True)), rate=rate)


def _periods(weave: Weave, length: float) -> Array:
    """Lengths in [m] at which the periods of a weave begin, as many as a length takes, shape (n, 1)."""
    return weave.wavelength * np.arange(0.0, np.ceil(length / weave.wavelength))[:, None]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _AcrossSeam:
    """A unit vector along or across a seam: along it, to its left seen along the tool, or out of it."""

    line: Curve
    orientation: Orientation
    which: int

    @property
    def knots(self) -> Array:
        """Those of the seam and of the orientation."""
        first, last = self.line.knots[[0, -1]]
        knots = np.union1d(self.line.knots, self.orientation.knots)
        return knots[(knots >= first) & (knots <= last)]

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Vectors and their rates, see `cellplan.geometry.curves.curve.Curve`."""
        return by_differences(self._vectors, self.knots, u, interval)

    def _vectors(self, u: Array, interval: Interval) -> Array:
        """The vectors at parameters of shape (N,)."""
        p, dp = self.line.evaluate(u, interval)
        t = dp / np.linalg.norm(dp, axis=1, keepdims=True)
        z = self.orientation.frames(u, interval, p=p, dp=dp)[0][:, :, 2]
        out = np.sum(z * t, axis=1, keepdims=True) * t - z
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        return (t, cross(out, t), out)[self.which]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WovenCurve:
    """The curve of a tip that weaves about its seam; see `cellplan.geometry.curves.curve.Curve`."""

    line: Curve  # the seam
    arc: ArcLength  # its length
    weave: Weave
    directions: tuple[tuple[int, BezierCurve], ...]  # unit vectors of the offsets that are not zero
    travel: StandingTravel | None  # of a tip that stands for the dwells; None of one that travels evenly
    knots: Array
    about: Curve | None = None  # another line by the same parameter that the tip weaves about, with the same offsets

    @classmethod
    def of(cls, line: Curve, arc: ArcLength, weave: Weave, orientation: Orientation) -> "WovenCurve":
        """Weave about a line with a length, across a tool with an orientation along it."""
        moves = np.array([weave.form is WeaveForm.CIRCLE, True, weave.out > 0.0])
        directions = tuple(
            (k, cubic_fit(_AcrossSeam(line=line, orientation=orientation, which=k), tolerance=DIRECTION_FIT))
            for k in np.flatnonzero(moves).tolist()
        )
        whole = (float(line.knots[0]), float(line.knots[-1]))
        knots = np.unique(np.concatenate([curve.knots for _, curve in directions]))
        travel = standing_travel(weave, line, arc) if weave.stands else None
        others = () if travel is None else travel.joints.tolist()
        joints = arc.parameters(weave_knots(weave, arc.total, others=others), whole)
        knots = np.union1d(joints, knots if travel is None else travel.knots(knots))
        return cls(line=line, arc=arc, weave=weave, directions=directions, travel=travel, knots=knots)

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives."""
        offsets, rates = weave_offsets(self.weave, self.arc.lengths(u))
        speed = np.linalg.norm(self.line.evaluate(u, interval)[1], axis=1, keepdims=True)
        v, within, pace = (u, interval, 1.0) if self.travel is None else self.travel.at(u, interval)
        p, dp = (self.about or self.line).evaluate(v, within)
        dp = pace * dp
        for k, curve in self.directions:
            d, dd = curve.evaluate(v, within)
            p = p + offsets[:, k, None] * d
            dp = dp + speed * rates[:, k, None] * d + offsets[:, k, None] * pace * dd
        return p, dp


class WovenPath(NamedTuple):
    """What a tip that weaves follows."""

    tip: WovenCurve
    orientation: Orientation
    seam: SeamPlaces | None

    def about(self, line: Curve, orientation: Orientation) -> tuple[WovenCurve, Orientation]:
        """The same weave about another line by the same parameter, and another orientation along that."""
        travel = self.tip.travel
        if travel is not None:
            orientation = StandingFrame(frame=orientation, travel=travel)
        return replace(self.tip, about=line), orientation


def woven_path(task: Task, weave: Weave, drawing: PathCurve, arc: ArcLength, orientation: Orientation) -> WovenPath:
    """What a tip that weaves about the path of a task follows.

    Raises:
        InputError: The tip would jump at a corner, or stand elsewhere than the path stops.
    """
    curve = WovenCurve.of(drawing.curve, arc, weave, orientation)
    stops = drawing.stops
    for before, here, after in zip(stops[:-2], stops[1:-1], stops[2:], strict=True):
        u = np.array([here])
        sides = [curve.evaluate(u, interval)[0][0] for interval in ((before, here), (here, after))]
        if weave.stands or np.linalg.norm(sides[1] - sides[0]) > NO_JUMP:
            why = "would stand on before and after it" if weave.stands else "would jump"
            raise InputError(
                f"{task.where('path.weave')}: expected corners that are rounded, as a weave across each side "
                f"{why} at {in_mm(drawing.curve.evaluate(u, (before, here))[0][0])}; write corners: "
                "{blend_mm: 5}"
            )
    travel, seam = curve.travel, drawing.seam
    if travel is not None:
        orientation = StandingFrame(frame=orientation, travel=travel)
        seam = None if seam is None else RerunSeam(seam=seam, rerun=travel)
    return WovenPath(curve, orientation, seam)
