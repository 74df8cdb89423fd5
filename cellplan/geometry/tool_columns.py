"""A tool as thin columns along its axis, and how deep each of them stands in a part.

The depth of a column is the length of it that lies inside the part or beyond, from where it first enters. A column
whose back end lies inside already has entered where its line did so last.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.line_spans import Spans, line_spans
from cellplan.geometry.shapes import Box, Mesh, Solid, bounding_box, support_point

GRAZE_TOL: Final = 1e-5  # [m] an axis free this far to the side, or a back end so near the far side, only touches
SIDE_TOL: Final = 1e-4  # [m] what the side of a body reaches into a wall along it by less is touching, not depth
EDGE_TOL: Final = 1e-6  # [m] columns of a rim stand this far within it, so that rounding does not lose them
HALF_FRACTION: Final = 0.5  # [-] a column that is less than half as deep just beside grazes
RIM_COLUMN_COUNT: Final = 24  # on the rim of a body's outline
# [-] shares of the rim's radius at which columns stand as well
RING_FRACTIONS: Final = (0.9, 0.75, 0.6, 0.45, 0.3, 0.15)
LINES_AT_ONCE: Final = 200_000  # lines followed at once: memory


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Columns:
    """Columns of a tool along its z axis, in the tool frame."""

    points: Array  # places of the lines across the axis in [m], shape (L, 2)
    guards: Indices  # lines beside each that must be about as deep for its depth to count, shape (L, G)
    line: Indices  # the line of each column, shape (C,)
    back: Array  # where the column begins along z in [m], shape (C,)
    front: Array  # where it ends, shape (C,)

    @property
    def reach(self) -> float:
        """Largest distance of a column from the tool tip in [m]."""
        across = np.hypot(*self.points[self.line].T)
        along = np.maximum(np.abs(self.back), np.abs(self.front))
        return float(np.hypot(across, along).max(initial=0.0))

    @property
    def radius(self) -> float:
        """Half the widest extent of the columns across the axis in [m]."""
        return 0.5 * float(np.ptp(self.points[self.line], axis=0).max()) if len(self.line) else 0.0


def axis_depths(length: float, shape: Solid, X_ST: Array) -> Array:
    """Depth of a tool's axis in [m] for each pose, shape (N,); an axis that runs along a surface does not count.

    So much of the axis counts, back from the tip, in [m]. Poses are in the frame of the part's shape, shape (N, 4, 4).
    """
    axis = np.array([[0.0, 0.0]])
    depth = depths(_along_axis(axis, length), shape, X_ST)
    deep = depth > GRAZE_TOL
    if np.any(deep):
        offsets = GRAZE_TOL * np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
        depth[deep] = depths(_along_axis(np.concatenate([axis, offsets]), length), shape, X_ST[deep])
    return depth


def _along_axis(points: Array, length: float) -> Columns:
    """Columns of one length that end beside the tip; each is guarded by all but the first, or by itself."""
    count = len(points)
    return Columns(
        points=points,
        guards=np.broadcast_to(np.arange(min(1, count - 1), count), (count, max(1, count - 1))),
        line=np.arange(count),
        back=np.full(count, -length),
        front=np.zeros(count),
    )


def body_columns(shape: Solid, X_TS: Array, zone: float) -> Columns:
    """Columns of a body of a tool: on its outline seen along the axis, on rings within, and round the tool's axis.

    The figures are exact on these columns. Where a part is convex, the deepest point of a flat-ended body lies on the
    rim or in the middle; between two columns of the rim the depth is missed by at most ``1 - cos(7.5 deg)`` (0.9 %) of
    what it varies over the body. A round end of radius r that leans by up to 30 deg is missed by at most 0.5 % of r. A
    bump of the part that is thinner than the columns are apart may stand between them.

    A body that is wider than ``zone``, a radius round the tool's axis in [m], is sampled more densely within.
    """
    centre, rim = _outline(shape, X_TS)
    lengths = np.linalg.norm(rim - centre, axis=1)
    unit = (rim - centre) / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    on_rim = centre + np.maximum(lengths - EDGE_TOL, 0.0)[:, None] * unit
    within = centre + np.maximum(lengths - SIDE_TOL, 0.5 * lengths)[:, None] * unit
    others = [centre[None], *(centre + share * (rim[1::2] - centre) for share in RING_FRACTIONS)]
    if np.linalg.norm(rim, axis=1).max() > zone:
        others += [zone * share * _directions()[:, :2] for share in (1.0, *RING_FRACTIONS)]
    points = np.concatenate([on_rim, within, *others])
    guards = np.arange(len(points))
    guards[: len(rim)] += len(rim)
    R, p = X_TS[:3, :3], X_TS[:3, 3]
    starts = (np.column_stack([points, np.zeros(len(points))]) - p) @ R
    spans = line_spans(shape, starts, np.broadcast_to(R[2], starts.shape))
    return Columns(points=points, guards=guards[:, None], line=spans.line, back=spans.enter, front=spans.leave)


def depths(columns: Columns, shape: Solid, X_ST: Array) -> Array:
    """Depth of the deepest column in [m] for each pose of a tool, shape (N,); 0 where the tool is free.

    Poses are in the frame of the part's shape, shape (N, 4, 4).
    """
    step = max(1, LINES_AT_ONCE // max(1, len(columns.line)))
    batches = [_depths(columns, shape, X_ST[k : k + step]) for k in range(0, len(X_ST), step)]
    return np.concatenate(batches) if batches else np.zeros(0)


def _depths(columns: Columns, shape: Solid, X_ST: Array) -> Array:
    """See `depths`."""
    poses, lines, count = len(X_ST), len(columns.points), len(columns.line)
    R, p = X_ST[:, :3, :3], X_ST[:, :3, 3]
    across = columns.points[columns.line]
    points = p[:, None, :] + across @ np.swapaxes(R[:, :, :2], 1, 2)
    directions = np.broadcast_to(R[:, None, :, 2], points.shape)
    spans = _spans_near(columns, shape, points.reshape(-1, 3), directions.reshape(-1, 3))
    pose, column = np.divmod(spans.line, max(count, 1))
    entered = (spans.leave > columns.back[column] + GRAZE_TOL) & (spans.enter < columns.front[column])
    depth = np.zeros(poses * lines)
    place = pose * lines + columns.line[column]
    np.maximum.at(depth, place[entered], (columns.front[column] - spans.enter)[entered])
    by_line = depth.reshape(poses, lines)
    at_guards = by_line[:, columns.guards].min(axis=2)
    counted = np.where(at_guards < HALF_FRACTION * by_line, at_guards, by_line)
    return counted.max(axis=1)


def _spans_near(columns: Columns, shape: Solid, points: Array, directions: Array) -> Spans:
    """Where the lines of columns run inside a part; of a mesh only columns that reach into the box round it count."""
    if not isinstance(shape, Mesh):
        return line_spans(shape, points, directions)
    middle, half = bounding_box(shape)
    x, y, z = (2.0 * (half + EDGE_TOL)).tolist()
    in_box = line_spans(Box((x, y, z)), points - middle, directions)
    column = in_box.line % len(columns.line)
    reaches = (in_box.leave >= columns.back[column]) & (in_box.enter <= columns.front[column])
    near = in_box.line[reaches]
    spans = line_spans(shape, points[near], directions[near])
    return replace(spans, line=near[spans.line])


def _directions() -> Array:
    """Unit directions across the tool's axis, shape (RIM_COLUMN_COUNT, 3)."""
    angle = 2.0 * np.pi * np.arange(RIM_COLUMN_COUNT) / RIM_COLUMN_COUNT
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(RIM_COLUMN_COUNT)])


def _outline(shape: Solid, X_TS: Array) -> tuple[Array, Array]:
    """Middle and rim of a body's convex outline seen along the tool's axis, shapes (2,) and (2 RIM_COLUMN_COUNT, 2).

    The rim has the body's farthest points in even directions and, in turns with them, the points at even angles.
    """
    n = _directions()
    R, p = X_TS[:3, :3], X_TS[:3, 3]
    farthest = np.array([(R @ support_point(shape, direction @ R) + p)[:2] for direction in n])
    centre = (
        0.5 * (farthest.min(axis=0) + farthest.max(axis=0)) if not isinstance(shape, Mesh) else farthest.mean(axis=0)
    )
    facing = n[:, :2] @ n[:, :2].T
    height = np.sum((farthest - centre) * n[:, :2], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = np.where(facing > HALF_FRACTION, height[:, None] / facing, np.inf).min(axis=0)
    rim = np.empty((2 * RIM_COLUMN_COUNT, 2))
    rim[0::2], rim[1::2] = farthest, centre + away[:, None] * n[:, :2]
    return centre, rim


def line_depths(X_FT: Array, shape: Solid, X_ST: Array, *, zone: float, is_all: bool) -> Array:
    """Depth of the axis of a tool in [m] for each pose, from the flange's side to the tip, shape (N,).

    The axis counts from the tip back to where the flange stands beside it, and at least through the contact zone. A
    tool may also reach round and point back at its flange; then its bodies say where it goes round. Where there are
    none it is a straight line to the side of the flange.

    Poses of the tool are in the frame of the part's shape, shape (N, 4, 4); ``zone`` is the radius of the contact zone
    in [m], and ``is_all`` says that this line is all that is known of the tool.
    """
    along = float(X_FT[:3, 3] @ X_FT[:3, 2])
    depth = axis_depths(max(along, zone), shape, X_ST)
    if is_all and along < -EDGE_TOL:
        turned = X_ST * np.array([1.0, -1.0, -1.0, 1.0])  # half a turn about x: the columns of y and z
        depth = np.maximum(depth, axis_depths(-along, shape, turned))
    return depth
