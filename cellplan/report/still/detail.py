"""What matters in a picture: the points with their label, and an enlarged view of them."""

from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import bounding_sphere
from cellplan.report.still.camera import Camera
from cellplan.report.still.painter import Painter, solid_facets
from cellplan.report.still.picture import ShownSolid, StillPicture

CONNECTION_SHARE: Final = 0.3  # [-] of the detail that the connection of two points fills
LEAST_SHOWN: Final = 0.06  # [m] across a detail of two points
PLACE_SHOWN: Final = 0.4  # [m] across a detail of one place
ENLARGED: Final = 1.8  # [-] a detail is shown where it is larger by more than this
RING, SPOT = 150, 40  # radius round a place, and of a point
ABOVE: Final = 110  # from the points to their label
HIDDEN: Final = 0.003  # [m] below what is painted over it
SMALLEST_FRAME: Final = 60  # half edge of the frame round what is enlarged


@dataclass(frozen=True, slots=True, kw_only=True)
class DetailWindow:
    """A square of the sheet: its left upper corner and its edge."""

    x: int
    y: int
    edge: int


def mark(picture: StillPicture, camera: Camera) -> str:
    """The points that matter, with their label above."""
    if not len(picture.mark):
        return ""
    seen = np.rint(camera.project(picture.mark)[:, :2]).astype(int).tolist()
    if len(seen) == 1:
        x, y = seen[0]
        parts, top = [f'<circle class="ring" cx="{x}" cy="{y}" r="{RING}"/>'], y - RING
    else:
        (a, b), (c, d) = seen
        x, top, path = (a + c) // 2, min(b, d), f"M{a} {b}L{c} {d}"
        parts = [f'<path class="halo" d="{path}"/>', f'<path class="near" d="{path}"/>']
        parts += [f'<circle class="spot" cx="{x}" cy="{y}" r="{SPOT}"/>' for x, y in ((a, b), (c, d))]
    if picture.label:
        parts.append(f'<text class="value" x="{x}" y="{top - ABOVE}">{escape(picture.label)}</text>')
    return "\n".join(parts)


def is_worth_it(picture: StillPicture, camera: Camera, edge: int) -> bool:
    """Whether a detail with an edge on the sheet shows more than the picture does."""
    return len(picture.mark) > 0 and edge / _shown(picture, camera) > ENLARGED * camera.scale


def detail(picture: StillPicture, camera: Camera, window: DetailWindow, classes: dict[tuple[str, int], str]) -> str:
    """What matters, enlarged in a window without what hides it, with a frame round its place in the picture."""
    scale = window.edge / _shown(picture, camera)
    low = np.array([window.x, window.y], dtype=np.float64)
    high, place = low + window.edge, low + 0.5 * window.edge
    middle = picture.mark.mean(axis=0)
    close = Camera(axes=camera.axes, middle=camera.axes[:2] @ middle, scale=scale, place=place)
    near = [
        solid for solid in picture.solids if _reaches(solid, close, low, high) and not _hides(solid, picture, close)
    ]
    x, y, edge = window.x, window.y, window.edge
    factor = scale / camera.scale
    box = f'x="{x}" y="{y}" width="{edge}" height="{edge}" rx="40"'
    return "\n".join(
        [
            _framed_place(camera.project(middle)[:2], max(SMALLEST_FRAME, 0.5 * edge * camera.scale / scale), window),
            f'<clipPath id="still-detail"><rect {box}/></clipPath>',
            f'<rect class="sheet" {box}/>',
            '<g clip-path="url(#still-detail)">',
            Painter(close, low, high, classes, place).paths(near, picture.lines),
            mark(picture, close),
            "</g>",
            f'<rect class="frame" {box}/>',
            f'<text class="note" x="{x}" y="{y + edge + 210}">{factor:.{0 if factor >= 3.0 else 1}f} × enlarged</text>',
        ]
    )


def _framed_place(at: Array, half: float, window: DetailWindow) -> str:
    """Frame round what is enlarged, and lines from it to the window."""
    x, y = round(float(at[0] - half)), round(float(at[1] - half))
    size = round(2.0 * half)
    leads = "".join(
        f"M{x + size} {y + down}L{window.x} {window.y + below}" for down, below in ((0, 0), (size, window.edge))
    )
    return f'<path class="lead" d="{leads}"/>\n<rect class="frame" x="{x}" y="{y}" width="{size}" height="{size}"/>'


def _shown(picture: StillPicture, camera: Camera) -> float:
    """Length in [m] that a detail shows from edge to edge."""
    if len(picture.mark) == 1:
        return PLACE_SHOWN
    across = float(np.linalg.norm(camera.axes[:2] @ (picture.mark[1] - picture.mark[0])))
    return max(LEAST_SHOWN, across / CONNECTION_SHARE)


def _hides(solid: ShownSolid, picture: StillPicture, camera: Camera) -> bool:
    """Whether a solid that does not matter itself is painted over what does."""
    if solid.name in picture.marked:
        return False
    corners = camera.project(solid_facets(solid, camera))
    sides = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    for point in camera.project(np.concatenate([picture.mark, picture.mark.mean(axis=0)[None]])):
        apart = point - corners
        turns = sides[..., 0] * apart[..., 1] - sides[..., 1] * apart[..., 0]
        is_over = (turns <= 0.0).all(axis=1) & (normals[:, 2] < 0.0)
        above = np.einsum("ij,ij->i", normals, apart[:, 0]) / np.where(is_over, normals[:, 2], -1.0)
        if (is_over & (above < -HIDDEN)).any():
            return True
    return False


def _reaches(solid: ShownSolid, camera: Camera, low: Array, high: Array) -> bool:
    """Whether the sphere round a solid reaches into a rectangle of the sheet."""
    centre, radius = bounding_sphere(solid.shape)
    at = camera.project(centre @ solid.X_WS[:3, :3].T + solid.X_WS[:3, 3])[:2]
    beyond = np.maximum(np.maximum(low - at, at - high), 0.0)
    return bool(np.linalg.norm(beyond) <= camera.scale * radius)
