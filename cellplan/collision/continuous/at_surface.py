"""When one body is at the surface of another for the first and for the last time, among the samples of a motion."""

from typing import Final

import numpy as np

from cellplan.collision.continuous.interval_search import SolidSearch
from cellplan.collision.continuous.motion_bound import Motion, Pair
from cellplan.collision.engine import Engine

AT_SURFACE: Final = 1e-4  # [m] nearer than this counts as touching: tracking errors of a micrometre decide nothing here


def surface_span(engine: Engine, pair: Pair, motion: Motion) -> tuple[int, int] | None:
    """First and last sample at which two bodies touch, or very nearly so; None when there is none."""
    search = SolidSearch(engine, pair, motion)
    first = _next(search, backwards=False)
    return None if first is None else (first, first if (last := _next(search, backwards=True)) is None else last)


def _next(search: SolidSearch, *, backwards: bool) -> int | None:
    """The first sample at the surface from one end; samples that are proved to be away from it are passed over."""
    away = np.zeros(len(search.low) + 1, dtype=bool)
    while True:
        is_step_away = search.low > AT_SURFACE
        open_ = np.flatnonzero(~(away | np.append(False, is_step_away) | np.append(is_step_away, False)))
        if not open_.size:
            return None
        sample = int(open_[-1] if backwards else open_[0])
        reading = search.read(sample, 2.0 * AT_SURFACE)
        if reading.touches or reading.bound <= AT_SURFACE:
            return sample
        away[sample] = True
