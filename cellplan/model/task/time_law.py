"""Time laws: how the share of a stretch that is done grows with the share of its time."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.task.task import Task, TimeLaw, TimeLawKind

HALVINGS: Final = 60  # of the interval 0..1: down to the last digit
REST_TO_REST = TimeLaw(kind=TimeLawKind.QUINTIC)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Advance:
    """Share of a stretch that is done and its first two derivatives by the share of the time, shape (N,) each."""

    share: Array
    rate: Array
    acceleration: Array


def advance(law: TimeLaw, tau: Array, ramp: Array | float | None = None, drops: Array | None = None) -> Advance:
    """How far a law has come at shares ``tau`` of the time, 0..1, shape (N,).

    Constant: ``sigma = tau``. Quintic: ``sigma = 10 tau^3 - 15 tau^4 + 6 tau^5``, at rest and without acceleration at
    both ends. Trapezoid: even speeding up and slowing down, each during ``ramp`` of the time, at rest at both ends.
    Steady: likewise, with accelerations that start and end at zero.

    ``ramp`` is the share of the time that a ramp takes, one for all or shape (N,), or shape (N, 2) where the first and
    the last one of a steady law differ; None for that of the law. ``drops``
    are the shares of the top speed that a steady law lacks at its begin and at its end, shape (N, 2): 1 at rest, 0
    where there is no ramp; None for rest at both ends.
    """
    share = law.ramp if ramp is None else ramp
    match law.kind:
        case TimeLawKind.CONSTANT:
            return Advance(share=tau, rate=np.ones_like(tau), acceleration=np.zeros_like(tau))
        case TimeLawKind.QUINTIC:
            rest = 1.0 - tau
            return Advance(
                share=tau**3 * (10.0 - tau * (15.0 - 6.0 * tau)),
                rate=30.0 * (tau * rest) ** 2,
                acceleration=60.0 * tau * rest * (1.0 - 2.0 * tau),
            )
        case TimeLawKind.TRAPEZOID:
            return _trapezoid(tau, _of_ends(share)[0])
        case TimeLawKind.STEADY:
            return _steady(tau, _of_ends(share), np.ones(2) if drops is None else drops.T)


def peak_rate(law: TimeLaw) -> float:
    """Largest rate of a law: how much faster than the mean speed its fastest moment is."""
    match law.kind:
        case TimeLawKind.CONSTANT:
            return 1.0
        case TimeLawKind.QUINTIC:
            return 1.875
        case TimeLawKind.TRAPEZOID | TimeLawKind.STEADY:
            return 1.0 / (1.0 - law.ramp)


def reached_at(law: TimeLaw, share: Array, ramp: Array | float | None = None, drops: Array | None = None) -> Array:
    """Shares of the time, 0..1, at which a law has come to shares of the stretch, shape (N,): by halving.

    See `advance` for ramps and drops.
    """
    tau: Array = np.where(share >= 1.0, 1.0, 0.0)
    is_inside = (share > 0.0) & (share < 1.0)
    inside, inside_ramp = share[is_inside], ramp[is_inside] if isinstance(ramp, np.ndarray) else ramp
    inside_drops = None if drops is None else drops[is_inside]
    if not len(inside):
        return tau
    low, high = np.zeros_like(inside), np.ones_like(inside)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        is_short = advance(law, middle, inside_ramp, inside_drops).share < inside
        low, high = np.where(is_short, middle, low), np.where(is_short, high, middle)
    tau[is_inside] = 0.5 * (low + high)
    return tau


def _of_ends(ramp: Array | float) -> tuple[Array | float, Array | float]:
    """Shares of the time of the first ramp and of the last."""
    return (ramp[:, 0], ramp[:, 1]) if isinstance(ramp, np.ndarray) and ramp.ndim > 1 else (ramp, ramp)


def _steady(tau: Array, ramps: tuple[Array | float, Array | float], drops: Array) -> Advance:
    """As a trapezoid, but with the rate ``1 - d + d (3 x^2 - 2 x^3)`` of the top one at a share x of a ramp.

    ``drops`` has the d of the first ramp and of the last one, shape (2,) or (2, N).
    """
    (first, last), (rise, fall) = drops, ramps
    v = 1.0 / (1.0 - 0.5 * (first * rise + last * fall))
    inside = [(tau < rise) & (first > 0.0), (1.0 - tau < fall) & (last > 0.0)]
    up, down = _ramp(tau, rise, first), _ramp(1.0 - tau, fall, last)
    return Advance(
        share=np.select(inside, [v * up.share, 1.0 - v * down.share], v * (tau - 0.5 * rise * first)),
        rate=np.select(inside, [v * up.rate, v * down.rate], v),
        acceleration=np.select(inside, [v * up.acceleration, -v * down.acceleration], 0.0),
    )


def _ramp(tau: Array, ramp: Array | float, drop: Array) -> Advance:
    """Speeding up from ``1 - drop`` to a rate of 1 in a ramp, at shares of the time."""
    x = np.minimum(tau / ramp, 1.0)
    return Advance(
        share=ramp * (drop * x**3 * (1.0 - 0.5 * x) + (1.0 - drop) * x),
        rate=drop * x * x * (3.0 - 2.0 * x) + (1.0 - drop),
        acceleration=drop * 6.0 / ramp * x * (1.0 - x),
    )


def _trapezoid(tau: Array, ramp: Array | float) -> Advance:
    """Speeding up to the rate ``v = 1 / (1 - ramp)``, keeping it, and slowing down in mirror image."""
    v = 1.0 / (1.0 - ramp)
    rest = 1.0 - tau
    parts = [tau < ramp, rest < ramp]
    return Advance(
        share=np.select(parts, [0.5 * v * tau**2 / ramp, 1.0 - 0.5 * v * rest**2 / ramp], v * (tau - 0.5 * ramp)),
        rate=np.select(parts, [v * tau / ramp, v * rest / ramp], v),
        acceleration=np.select(parts, [np.full_like(tau, v / ramp), np.full_like(tau, -v / ramp)], 0.0),
    )


def stand_off(times: Array, task: Task, X_PT: Array, *, V_PT_P: Array, end: float) -> None:
    """Shift the poses before the start and after the end of a task, in place, where it asks for it.

    An approach goes straight along the tool's axis, from rest to rest, and is over when the path starts; leaving begins
    when the path ends. Before and after that the tool rests off the part.

    Times and ``end``, at which the tool leaves the end of its path, are in [s], shape (N,). Poses are held still before
    the start and after the end of the path, shape (N, 4, 4), and twists are zero there, shape (N, 6).
    """
    if task.approach is not None:
        _back_off(X_PT, V_PT_P, task.start - times, distance=task.approach.distance, duration=task.approach.duration)
    if task.retract is not None:
        _back_off(X_PT, V_PT_P, times - end, distance=task.retract.distance, duration=-task.retract.duration)


def _back_off(X_PT: Array, V_PT_P: Array, away: Array, *, distance: float, duration: float) -> None:
    """Shift poses that are ``away`` in [s] from an end of the path; a negative duration is that of leaving."""
    off = away > 0.0
    law = advance(REST_TO_REST, np.clip(away[off] / abs(duration), 0.0, 1.0))
    z = X_PT[off, :3, 2]
    X_PT[off, :3, 3] -= (distance * law.share)[:, None] * z
    V_PT_P[off, :3] += (distance / duration * law.rate)[:, None] * z
