"""Shortened ways: via points left out or moved where the straight line past them is free, then corners rounded off."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.transfer.blended_lines import BlendedLine
from cellplan.planning.transfer.move_check import MoveCheck

SHORTCUTS: Final = 60  # straight lines between two places of the way that are tried
GAIN: Final = 0.01  # [-] share of its length by which a shortcut is shorter at least
HALVINGS: Final = 7  # of what is cut off at a corner, until it is free


def shortened(check: MoveCheck, path: Array, velocity: Array, rng: np.random.Generator) -> Array:
    """A shorter way between the same ends, shape (K', n).

    Args:
        check: Which moves are free.
        path: Via points in [rad] or [m], shape (K, n).
        velocity: Top speeds, shape (n,); lengths are times at these.
    """
    path = _without_detours(check, path)
    for _ in range(SHORTCUTS):
        if len(path) == 2:
            break
        lengths = np.append(0.0, np.cumsum(_lengths(path, velocity)))
        first, last = np.sort(rng.uniform(0.0, lengths[-1], 2))
        a, b = (np.array([np.interp(at, lengths, column) for column in path.T]) for at in (first, last))
        if float(np.linalg.norm((b - a) / velocity)) > (1.0 - GAIN) * (last - first):
            continue
        if check.is_free(a, b):
            before, after = path[lengths < first], path[lengths > last]
            path = np.concatenate([before, [a, b], after])
    return _without_detours(check, path)


def rounded_line(check: MoveCheck, path: Array, columns: slice, velocity: Array) -> BlendedLine:
    """A way with its corners rounded off as far as that is free.

    Args:
        check: Which moves are free.
        path: Via points in [rad] or [m], shape (K, n), K at least 2.
        velocity: Top speeds, shape (n,): between via points the fastest joint goes at its own.
    """
    times = np.append(0.0, np.cumsum((np.abs(np.diff(path, axis=0)) / velocity).max(axis=1)))
    shares = np.ones(len(path))
    for corner in range(1, len(path) - 1):
        for _ in range(HALVINGS):
            line = BlendedLine.through(columns, times, path, shares=shares)
            at, half = times[corner], line.halves[corner]
            if check.are_free(line.at(np.linspace(at - half, at + half, check.samples(path[corner - 1 : corner + 2])))):
                break
            shares[corner] *= 0.5
    return BlendedLine.through(columns, times, path, shares=shares)


def _without_detours(check: MoveCheck, path: Array) -> Array:
    """Via points left out, from each one straight to the last one that is free."""
    vertices = [0]
    while vertices[-1] < len(path) - 1:
        here = vertices[-1]
        free = (k for k in range(len(path) - 1, here + 1, -1) if check.is_free(path[here], path[k]))
        vertices.append(next(free, here + 1))
    return path[vertices]


def _lengths(path: Array, velocity: Array) -> Array:
    """Lengths between neighbouring via points in [s], shape (K - 1,)."""
    return np.linalg.norm(np.diff(path, axis=0) / velocity, axis=1)
