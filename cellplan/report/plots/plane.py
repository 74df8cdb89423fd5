"""The plane from above, to scale: lines in it, cut off at its edges, and a frame with round numbers."""

from itertools import pairwise
from typing import Any, Final

import numpy as np

from cellplan.report.plots.palette import GREY
from cellplan.report.plots.sheet import Line, Panel, Sheet, nice_ticks

TICK: Final = 0.06  # [inch]


def draw_line(sheet: Sheet, panel: Panel, points: Any, *, is_closed: bool = False, **style: Any) -> None:
    """A line in the plane, cut off at the edges of the panel."""
    found = np.array(points, dtype=float)
    found = np.vstack([found, found[:1]]) if is_closed else found
    pieces = [_clipped(panel, one, other) for one, other in pairwise(found)]
    drawn = np.array([row for piece in pieces for row in (*piece, (np.nan, np.nan))]).reshape(-1, 2)
    if len(drawn):
        sheet.marks.append(Line(panel.x(drawn[:, 0]), panel.y(drawn[:, 1]), style))


def draw_axes(sheet: Sheet, panel: Panel, *, across: str = "x in mm", upward: str = "y in mm, upward") -> None:
    """The frame with round numbers, and what they measure."""
    right, top = panel.left + panel.width, panel.bottom + panel.height
    corners = [(panel.left, panel.bottom), (right, panel.bottom), (right, top), (panel.left, top)]
    xs, ys = np.array([*corners, corners[0]]).T
    sheet.marks.append(Line(xs, ys, {"color": GREY, "linewidth": 0.8, "zorder": 3.0}))
    for value in nice_ticks(panel.first, panel.last, 6):
        at = float(panel.x(np.array(value)))
        sheet.marks.append(
            Line(np.array([at, at]), np.array([panel.bottom - TICK, panel.bottom]), {"color": GREY, "linewidth": 0.8})
        )
        sheet.write(at, panel.bottom - 2 * TICK, f"{value:g}", color=GREY, ha="center", va="top")
    for value in nice_ticks(panel.low, panel.high, 6):
        at = float(panel.y(np.array(value)))
        sheet.marks.append(
            Line(np.array([panel.left - TICK, panel.left]), np.array([at, at]), {"color": GREY, "linewidth": 0.8})
        )
        sheet.write(panel.left - 1.5 * TICK, at, f"{value:g}", color=GREY, ha="right", va="center_baseline")
    sheet.write(right, 0.12, across, color=GREY, ha="right")
    sheet.write(0.12, 0.12, upward, color=GREY)


def _clipped(panel: Panel, one: Any, other: Any) -> tuple[Any, ...]:
    """What of a line lies in the panel: both ends, or nothing."""
    low, high = np.array([panel.first, panel.low]), np.array([panel.last, panel.high])
    along, begin, end = other - one, 0.0, 1.0
    for axis in range(2):
        if along[axis] == 0.0:
            if not low[axis] <= one[axis] <= high[axis]:
                return ()
            continue
        shares = sorted(((low[axis] - one[axis]) / along[axis], (high[axis] - one[axis]) / along[axis]))
        begin, end = max(begin, shares[0]), min(end, shares[1])
    return (one + begin * along, one + end * along) if begin < end else ()
