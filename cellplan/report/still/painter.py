"""Solids and lines as SVG paths, the farthest first; no facets that face away, all others shaded by the light."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.shapes import bounding_sphere
from cellplan.geometry.transforms import transform_points
from cellplan.report.still.camera import Camera
from cellplan.report.still.facets import facets, sides, silhouette
from cellplan.report.still.picture import Colour, ShownLine, ShownSolid

LINE: Final = -1  # tone of lines: the colour itself, without a fill
LEVELS: Final = 10  # [-] tones of one colour
AMBIENT: Final = 0.62  # [-] of the light comes from everywhere
BRIGHTEST: Final = 1.22  # [-] of the colour, in full light
LAMP: Final = (-0.42, 0.66, 0.62)  # direction to the lamp along right, up and towards the viewer
FACING: Final = 1e-6  # [-] facets that are seen more sharply edge-on are left out: rounding
DEPTH_STEP: Final = 1e-5  # [m] depths that differ by less are equal, so that rounding does not decide
CREASE: Final = 0.8  # [-] cosine between neighbouring facets below which their common edge is drawn
MOST_FACETS: Final = 2800  # [-] of a picture, those that face away among them; with more solids each has fewer
DEVIATION: Final = 15.0  # units of the sheet by which a round solid may differ from its facets
COARSEST: Final = 4.0  # [-] times that
SHORTEST_EDGE: Final = 32  # units of the sheet along both axes together: shorter ones do not show
LIFT: Final = 0.06  # [m] by which a line is nearer than the surface that it lies on
RUN: Final = 8  # [-] pieces of a line that are painted together
SAME_POINT: Final = 6  # decimals of corners in [m] that are one corner


def tones(normals: Array) -> Indices:
    """Tone of facets with unit normals along right, up and towards the viewer, shape (K, 3): 0 is the darkest."""
    lamp = np.asarray(LAMP) / np.linalg.norm(LAMP)
    lit = np.clip(normals @ lamp, 0.0, 1.0) + 0.18 * np.clip(normals[:, 2], 0.0, 1.0)
    return np.minimum(LEVELS - 1, np.floor(LEVELS * lit / 1.18 + 1e-6)).astype(np.intp)


def tone_colour(colour: str, tone: int) -> str:
    """A colour in a tone; what is brighter than the colour goes towards white."""
    factor = AMBIENT + (BRIGHTEST - AMBIENT) * tone / (LEVELS - 1)
    channels = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
    if factor <= 1.0:
        mixed = [factor * channel for channel in channels]
    else:
        mixed = [channel + (factor - 1.0) * 1.6 * (255 - channel) for channel in channels]
    return "#" + "".join(f"{min(255, round(channel)):02x}" for channel in mixed)


def mixed(colour: str, other: str, share: float) -> str:
    """A colour with a share of another."""
    pairs = [(int(colour[k : k + 2], 16), int(other[k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round((1 - share) * a + share * b):02x}" for a, b in pairs)


def rules(prefix: str, used: Iterable[tuple[str, Colour, int]]) -> tuple[str, str]:
    """CSS of tones: for light surroundings, and what is different in dark ones.

    Args:
        prefix: Selector of the picture.
        used: Class, colour and tone of each.
    """
    light, dark = [], []
    for name, colour, tone in used:
        light.append(f"{prefix} .{name}{{{_paint(colour.light, tone)}}}")
        if colour.dark != colour.light:
            dark.append(f"{prefix} .{name}{{{_paint(colour.dark, tone)}}}")
    return "\n".join(light), "\n".join(dark)


def _paint(colour: str, tone: int) -> str:
    if tone == LINE:
        return f"fill:none;stroke:{colour};stroke-linecap:round"
    value = tone_colour(colour, tone)
    return f"fill:{value};stroke:{value}"


@dataclass(frozen=True, slots=True, eq=False)
class Mesh2D:
    """Facets of all solids on the sheet."""

    corners: Array  # corners on the sheet with their depths, shape (K, 4, 3)
    normals: Array  # unit normals along right, up and towards the viewer, shape (K, 3)
    solids: Indices  # number of the solid of each, shape (K,)


@dataclass(slots=True)
class Painter:
    """Paints with one camera."""

    camera: Camera
    low: Array  # left upper corner of what is shown of the sheet, shape (2,)
    high: Array  # right lower corner, shape (2,)
    # names of the classes of materials and tones, filled while painting
    classes: dict[tuple[str, int], str] = field(default_factory=dict)
    focus: Array | None = None  # point of the sheet, shape (2,), near which facets must be in order; None: everywhere

    def paths(self, solids: Sequence[ShownSolid], lines: Sequence[ShownLine]) -> str:
        """SVG of solids and lines."""
        mesh = self._mesh(solids)
        edges = sheet_edges(mesh)
        depths = [mesh.corners[:, :, 2].mean(axis=1) if self.focus is None else depths_near(mesh.corners, self.focus)]
        pieces = [piece for line in lines for piece in self._pieces(line)]
        depths.append(np.array([depth for depth, _ in pieces]))
        order = np.argsort(np.round(np.concatenate(depths) / DEPTH_STEP), kind="stable")
        corners = np.rint(mesh.corners[:, :, :2]).astype(np.int64)
        names = [
            self._class(solids[solid].material, tone)
            for solid, tone in zip(mesh.solids.tolist(), tones(mesh.normals).tolist(), strict=True)
        ]
        drawing = _Paths()
        texts = _polygons(corners)
        for index in order.tolist():
            if index >= len(names):
                drawing.add_piece(pieces[index - len(names)][1])
                continue
            drawing.add(names[index], texts[index])
            for first, second in edges.get(index, ()):
                (x, y), (u, v) = corners[index, first].tolist(), corners[index, second].tolist()
                if abs(u - x) + abs(v - y) > SHORTEST_EDGE:
                    drawing.add("e", f"M{x} {y}l{u - x} {v - y}")
        return drawing.text()

    def _mesh(self, solids: Sequence[ShownSolid]) -> Mesh2D:
        """Facets that face the viewer and lie within what is shown."""
        placed = self._placed(solids)
        counts = [len(corners) // 4 for corners in placed]
        world = np.concatenate([np.zeros((0, 3)), *placed]).reshape(-1, 4, 3)
        owners = np.repeat(np.arange(len(solids)), counts)
        normals = np.cross(world[:, 2] - world[:, 0], world[:, 3] - world[:, 1]) @ self.camera.axes.T
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-15)
        corners = self.camera.project(world)
        seen = normals[:, 2] > FACING
        seen &= (corners[:, :, :2].max(axis=1) >= self.low).all(axis=1)
        seen &= (corners[:, :, :2].min(axis=1) <= self.high).all(axis=1)
        return Mesh2D(corners[seen], normals[seen], owners[seen])

    def _placed(self, solids: Sequence[ShownSolid]) -> list[Array]:
        """Corners of the facets of each solid in the world, shape (4 K, 3): as many as a picture may have."""
        coarser, facets = 1.0, self._facets(solids, 1.0)
        while sum(map(len, facets)) > 4 * MOST_FACETS and coarser < COARSEST:
            coarser *= 2.0
            facets = self._facets(solids, coarser)
        beyond = sum(map(len, facets)) - 4 * MOST_FACETS
        sizes = np.round([bounding_sphere(solid.shape)[1] for solid in solids], 6)
        for index in np.argsort(sizes, kind="stable").tolist():  # the smallest first
            if beyond <= 0:
                break
            flat = silhouette(solids[index].shape, solids[index].X_WS, self.camera.axes).reshape(-1, 3)
            beyond -= len(facets[index]) - len(flat)
            facets[index] = flat
        return facets

    def _facets(self, solids: Sequence[ShownSolid], coarser: float) -> list[Array]:
        """Corners of the facets of each solid in the world, shape (4 K, 3)."""
        return [solid_facets(solid, self.camera, coarser=coarser).reshape(-1, 3) for solid in solids]

    def _pieces(self, line: ShownLine) -> list[tuple[float, str]]:
        """Depth and path of pieces of a line."""
        seen = self.camera.project(line.points)
        name, pieces = self._class(line.material, LINE), []
        for first in range(0, max(1, len(seen) - 1), RUN):
            run = seen[first : first + RUN + 1]
            if (run[:, :2].max(axis=0) < self.low).any() or (run[:, :2].min(axis=0) > self.high).any():
                continue
            points = " ".join(f"{x} {y}" for x, y in np.rint(run[:, :2]).astype(np.int64).tolist())
            width = round(10.0 * line.width)
            text = f'<path class="{name}" style="stroke-width:{width}" d="M{points}"/>'
            pieces.append((float(run[:, 2].mean()) + LIFT, text))
        return pieces

    def _class(self, material: str, tone: int) -> str:
        key = (material, tone)
        if key not in self.classes:
            self.classes[key] = f"{'l' if tone == LINE else 'c'}{len(self.classes)}"
        return self.classes[key]


def depths_near(corners: Array, focus: Array) -> Array:
    """Depths of facets on the sheet, shape (K, 4, 3), where they are nearest to a point of it, shape (K,)."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    apart = np.clip(focus, low[:, :2], high[:, :2]) - corners[:, 0, :2]
    normals = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    rise = np.einsum("ij,ij->i", normals[:, :2], apart) / np.where(normals[:, 2] == 0.0, np.inf, normals[:, 2])
    return np.clip(corners[:, 0, 2] - rise, low[:, 2], high[:, 2])


def solid_facets(solid: ShownSolid, camera: Camera, *, coarser: float = 1.0) -> Array:
    """Facets of a solid in the world in [m], shape (K, 4, 3), as fine as a camera needs them."""
    corners = facets(solid.shape, sides(solid.shape, coarser * DEVIATION / camera.scale))
    return transform_points(solid.X_WS, corners.reshape(-1, 3)).reshape(-1, 4, 3)


@dataclass(slots=True)
class _Paths:
    """Path elements in their order; neighbours of one class are one element."""

    elements: list[str] = field(default_factory=list)
    name: str = ""
    parts: list[str] = field(default_factory=list)

    def add(self, name: str, path: str) -> None:
        """Add a path of a class."""
        if name != self.name:
            self._close()
            self.name = name
        self.parts.append(path)

    def add_piece(self, element: str) -> None:
        """Add a whole element."""
        self._close()
        self.elements.append(element)

    def text(self) -> str:
        """All elements."""
        self._close()
        return "\n".join(self.elements)

    def _close(self) -> None:
        """End the element that is being collected."""
        if self.parts:
            self.elements.append(f'<path class="{self.name}" d="{"".join(self.parts)}"/>')
        self.parts, self.name = [], ""


def _polygons(corners: Indices) -> list[str]:
    """Paths of quadrilaterals with corners on the grid of the sheet, shape (K, 4, 2)."""
    steps = np.diff(corners, axis=1).reshape(-1, 6)
    first = corners[:, 0]
    rows = np.concatenate([first, steps], axis=1).tolist()
    return [
        f"M{x} {y}l{a} {b} {c} {d}z" if not (e or f) else f"M{x} {y}l{a} {b} {c} {d} {e} {f}z"
        for x, y, a, b, c, d, e, f in rows
    ]


def sheet_edges(mesh: Mesh2D) -> Mapping[int, list[tuple[int, int]]]:
    """Edges where a solid ends on the sheet or has a crease: by facet, the numbers of both corners."""
    if not len(mesh.corners):
        return {}
    count = len(mesh.corners)
    points = np.round(mesh.corners, 2).reshape(-1, 3)
    keys = points @ np.array([1.0, 7919.37, 104729.73]) + 1e8 * np.repeat(mesh.solids, 4)
    _, ids = np.unique(np.round(keys, 1), return_inverse=True)
    ids = ids.reshape(count, 4)
    ends = np.sort(np.stack([ids, np.roll(ids, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    edge = ends[:, 0] * (ids.max() + 1) + ends[:, 1]
    is_edge = ends[:, 0] != ends[:, 1]
    order = np.argsort(edge, kind="stable")
    order = order[is_edge[order]]
    same = edge[order[1:]] == edge[order[:-1]]
    lone = np.ones(len(order), dtype=bool)
    lone[1:] &= ~same
    lone[:-1] &= ~same
    first, second = order[:-1][same], order[1:][same]
    bent = np.einsum("ij,ij->i", mesh.normals[first // 4], mesh.normals[second // 4]) < CREASE
    edges: dict[int, list[tuple[int, int]]] = {}
    for place in [*order[lone].tolist(), *first[bent].tolist()]:
        edges.setdefault(place // 4, []).append((place % 4, (place + 1) % 4))
    return edges
