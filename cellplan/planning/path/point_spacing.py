"""Listed points that lie too near each other to guide a curve, and how far a smooth curve leaves their sides."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.curve import BezierCurve
from cellplan.geometry.transforms import Array
from cellplan.model.task.task import SampledPath, TimedPath
from cellplan.planning.path.formatting import in_mm, length

NEAR_SMOOTH: Final = 0.01  # [-] of the distance to their other neighbours: a smooth curve turns with such a pair …
NEAR_STRAIGHT: Final = 1e-4  # [-] … and straight sides do not: there it is a point written twice with rounding
UNEVEN: Final = 0.1  # [-] of the longer side at a point: the shorter one alone gives the direction there
WIDEST_TURN: Final = np.deg2rad(20.0)  # [rad] at such a point: the longer side bends by up to 5 % of its length
BULGE: Final = 4.0 / 27.0  # [-] of a side's length, times the sine of the angle at one end: the bend of a cubic
MOST_JOINED_MM: Final = 1.0  # [mm] farther points are joined by hand
LOOKED_AT: Final = 33  # places of each side at which a curve is held against it


def refuse_near_points(
    points: Array, path: SampledPath | TimedPath | None, *, where: str, is_closed: bool, is_smooth: bool
) -> None:
    """Refuse points that are nearly one point, and a smooth curve whose direction hangs on a very short side.

    Args:
        points: Points as listed, shape (N, 3); all differ.
        path: Where they come from, for messages; None for a list in the cell file.
        is_closed: Whether the last point is joined to the first.
        is_smooth: Whether a smooth curve joins them.
    """
    ends = np.vstack([points, points[:1]]) if is_closed else points
    sides = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    share = NEAR_SMOOTH if is_smooth else NEAR_STRAIGHT
    k, others = _isolated(sides, share, is_closed=is_closed)
    if k is not None:
        cure = "leave one out"
        if isinstance(path, SampledPath) and 1e3 * sides[k] < MOST_JOINED_MM:
            enough = 10.0 ** np.ceil(np.log10(1e3 * sides[k] * (1.0 + 1e-6)))
            cure += f", or join them with csv: {{file: {path.source}, join_mm: {enough:g}}}"
        raise InputError(
            f"{where}: expected points that are at least {100.0 * share:g} % of the distance to their other neighbours "
            f"apart ({length(others)} mm), but {named_points(k, len(points), path)} are {length(sides[k])} mm apart at "
            f"{in_mm(ends[k])}; {cure}"
        )
    if is_smooth:
        _refuse_bends(ends, sides, path, where=where, is_closed=is_closed)


def refuse_near_times(path: TimedPath, where: str) -> None:
    """Refuse two rows of a trajectory between which hardly any time passes."""
    steps = np.diff(path.times)
    k, others = _isolated(steps, NEAR_SMOOTH, is_closed=path.is_closed)
    if k is not None:
        raise InputError(
            f"{where}: expected rows that are at least {100.0 * NEAR_SMOOTH:g} % of the time to their other neighbours "
            f"apart ({others:.6g} s), but {named_points(k, len(path.times), path)} are {steps[k]:.6g} s apart, at "
            f"{path.times[k]:.6g} s: a smooth motion takes its speed from them; leave one out"
        )


def largest_bulge(curve: BezierCurve) -> float:
    """Largest distance in [m] of a curve from the straight line between the knots of each of its spans."""
    share = np.linspace(0.0, 1.0, LOOKED_AT)
    low, width = curve.knots[:-1, None], np.diff(curve.knots)[:, None]
    u = np.minimum(low + share * width, curve.knots[1:, None])
    p, _ = curve.evaluate(u.ravel(), (float(curve.knots[0]), float(curve.knots[-1])))
    from_start = p.reshape(*u.shape, 3) - curve.control[:, None, 0]
    chord = (curve.control[:, -1] - curve.control[:, 0])[:, None]
    square = np.maximum(np.sum(chord**2, axis=2), np.finfo(float).tiny)
    along = np.clip(np.sum(from_start * chord, axis=2) / square, 0.0, 1.0)
    return float(np.linalg.norm(from_start - along[..., None] * chord, axis=2).max())


def named_points(k: int, count: int, path: SampledPath | TimedPath | None) -> str:
    """The two points of a side, with their lines."""
    return f"points {k + 1} and {(k + 1) % count + 1}{_lines(path, k, (k + 1) % count)}"


def _isolated(sides: Array, share: float, *, is_closed: bool) -> tuple[int | None, float]:
    """The first side that is shorter than a share of each of its neighbours, and the shorter one of these."""
    if len(sides) < 2:
        return None, 0.0
    before, after = np.roll(sides, 1), np.roll(sides, -1)
    if not is_closed:
        before[0], after[-1] = np.inf, np.inf
    others = np.minimum(before, after)
    is_near = sides < share * others
    k = int(np.argmax(is_near))
    return (k, float(others[k])) if is_near[k] else (None, 0.0)


def _refuse_bends(
    ends: Array, sides: Array, path: SampledPath | TimedPath | None, *, where: str, is_closed: bool
) -> None:
    """Refuse a turn at a point between a very short side and a long one, which would bend with the short one."""
    t = np.diff(ends, axis=0) / sides[:, None]
    before, after = (t, np.roll(t, -1, axis=0)) if is_closed else (t[:-1], t[1:])
    turns = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), np.sum(before * after, axis=1))
    pairs = np.stack([sides, np.roll(sides, -1)])[:, : len(turns)]
    is_bad = (pairs.min(axis=0) < UNEVEN * pairs.max(axis=0)) & (turns > WIDEST_TURN)
    if not np.any(is_bad):
        return
    bends = BULGE * pairs.max(axis=0) * np.sin(np.minimum(turns, np.pi / 2.0))
    k = int(np.argmax(np.where(is_bad, bends, 0.0)))
    place = (k + 1) % (len(sides) if is_closed else len(ends))
    short, long = sorted(pairs[:, k])
    raise InputError(
        f"{where}: expected a smooth curve to turn by at most {np.rad2deg(WIDEST_TURN):g} deg between sides of less "
        f"than a tenth of each other's length, but at point {place + 1}{_lines(path, place)}, {in_mm(ends[k + 1])}, it "
        f"turns by {np.rad2deg(turns[k]):.3g} deg between sides of {length(short)} and {length(long)} mm: the longer "
        f"one would bend by about {length(round(bends[k], 6))} mm; add points between, leave points out, or set "
        "smooth: false"
    )


def _lines(path: SampledPath | TimedPath | None, *places: int) -> str:
    """Lines of points in their file: `` (p.csv, lines 4 and 5)``."""
    if path is None:
        return ""
    given = path.lines if isinstance(path, SampledPath) else ()
    rows = given or range(2, len(path.points) + 2)  # below the header
    return f" ({path.source}, line{'s' if len(places) > 1 else ''} {' and '.join(str(rows[k]) for k in places)})"
