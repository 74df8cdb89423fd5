"""Squares of a grid that outlines cover, and the contours round them; a square has the edge 1 and whole middles."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices

NEAR: Final = 1e-9  # of rounding
SMOOTHED: Final = 0.6  # [-] squares by which a contour may leave the middles of the edges that it follows


def covered(outlines: Array) -> Indices:
    """Squares with the middle in any convex outline, shape (K, C, 2): row, first and last column, shape (M, 3)."""
    first, second = outlines, np.roll(outlines, -1, axis=1)
    low, high = np.ceil(first[..., 1].min(axis=1) - NEAR), np.floor(first[..., 1].max(axis=1) + NEAR)
    most = int((high - low).max()) + 1 if len(first) else 0
    rows = low[:, None] + np.arange(max(most, 0))  # of each outline, shape (K, R)
    height = rows[..., None]
    rise = (second[..., 1] - first[..., 1])[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):  # sides along a row have no one place there
        share = np.clip((height - first[:, None, :, 1]) / rise, 0.0, 1.0)
    run = (second[..., 0] - first[..., 0])[:, None]
    at = first[:, None, :, 0] + np.where(rise == 0.0, 0.0, share) * run
    least, greatest = (pick(first[..., 1], second[..., 1])[:, None] for pick in (np.minimum, np.maximum))
    is_met = (least - NEAR <= height) & (height <= greatest + NEAR)
    flat = is_met & (rise == 0.0)
    begins = np.where(is_met, at, np.inf).min(axis=-1)
    ends = np.where(is_met, at, -np.inf).max(axis=-1)
    beyond = np.broadcast_to(second[:, None, :, 0], flat.shape)
    begins = np.ceil(np.minimum(begins, np.where(flat, beyond, np.inf).min(axis=-1)) - NEAR)
    ends = np.floor(np.maximum(ends, np.where(flat, beyond, -np.inf).max(axis=-1)) + NEAR)
    is_covered = begins <= ends
    return np.stack([rows[is_covered], begins[is_covered], ends[is_covered]], axis=-1).astype(np.intp)


def stretches(squares: Indices) -> Indices:
    """Row, first and last column of each stretch of squares that any of some stretches covers, shape (M, 3)."""
    if not len(squares):
        return squares
    corner, mask = _mask(squares)
    turns = np.diff(mask.astype(np.int8), axis=1)
    begins, ends = np.argwhere(turns > 0), np.argwhere(turns < 0)
    return np.column_stack([begins + corner + (-1, 0), ends[:, 1] + corner[1] - 1])


def contours(squares: Indices) -> list[Array]:
    """Closed lines round stretches of squares, shape (M, 3), holes the other way round; x and y, shape (N, 2) each."""
    if not len(squares):
        return []
    corner, mask = _mask(squares)
    follow = _borders(mask)
    loops = []
    while follow:
        at = start = next(iter(follow))
        step, places = follow[at][0], []
        while True:
            follow[at].remove(step)
            if not follow[at]:
                del follow[at]
            places.append((at[0] + 0.5 * step[0], at[1] + 0.5 * step[1]))
            at = (at[0] + step[0], at[1] + step[1])
            if at == start and at not in follow:
                break
            choices = follow.get(at, [])
            if not choices:
                break
            left = (-step[1], step[0])
            step = left if left in choices else choices[0]
        loops.append(_simplified(np.array(places, dtype=np.float64) - 1.5 + corner[::-1]))
    return loops


def _mask(squares: Indices) -> tuple[Indices, Flags]:
    """Row and column of the first covered square, and which squares are covered, with a free one on every side."""
    corner = np.array([squares[:, 0].min(), squares[:, 1].min()])
    row, first, last = squares.T - corner[[0, 1, 1]][:, None]
    changes = np.zeros((row.max() + 3, last.max() + 4), dtype=np.intp)
    np.add.at(changes, (row + 1, first + 1), 1)
    np.add.at(changes, (row + 1, last + 2), -1)
    return corner, np.cumsum(changes, axis=1)[:, :-1] > 0


def _borders(mask: Flags) -> dict[tuple[int, int], list[tuple[int, int]]]:
    """Edges between covered and free squares by their first corner, as steps with the covered square on the left."""
    borders: dict[tuple[int, int], list[tuple[int, int]]] = {}
    sides = (
        (mask[1:-1, 1:-1] & ~mask[:-2, 1:-1], (0, 0), (1, 0)),
        (mask[1:-1, 1:-1] & ~mask[1:-1, 2:], (1, 0), (0, 1)),
        (mask[1:-1, 1:-1] & ~mask[2:, 1:-1], (1, 1), (-1, 0)),
        (mask[1:-1, 1:-1] & ~mask[1:-1, :-2], (0, 1), (0, -1)),
    )
    for is_border, (right, up), step in sides:
        for row, column in np.argwhere(is_border).tolist():
            borders.setdefault((column + 1 + right, row + 1 + up), []).append(step)
    return borders


def _simplified(line: Array) -> Array:
    """A closed line with as few of its corners as stay near to all of them."""
    far = int(np.argmax(np.sum((line - line[0]) ** 2, axis=1)))
    closed = np.concatenate([line, line[:1]])
    is_corner = np.zeros(len(closed), dtype=bool)
    is_corner[[0, far, -1]] = True
    waiting = [(0, far), (far, len(line))]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        inner, chord = closed[first + 1 : last] - closed[first], closed[last] - closed[first]
        length = float(np.hypot(*chord))
        away = np.abs(inner[:, 0] * chord[1] - inner[:, 1] * chord[0]) / length if length else np.hypot(*inner.T)
        worst = int(np.argmax(np.round(away, 6)))
        if away[worst] > SMOOTHED:
            is_corner[first + 1 + worst] = True
            waiting += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return closed[:-1][is_corner[:-1]] if is_corner[:-1].sum() > 2 else line
