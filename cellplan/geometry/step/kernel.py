"""Solids, faces and edges of a boundary representation; the door to OpenCASCADE, the extra ``step``.

Lengths are in [m] outside of this file and in [mm] inside it, as OpenCASCADE reads them.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property
from importlib.util import find_spec
from itertools import pairwise
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags, Indices

MM: Final = 1e3  # [mm/m]
ON_FACE: Final = 1e-5  # [mm] a point this near to the border of a face is on it
NO_STEP: Final = "expected the package cadquery-ocp-novtk, got none: pip install 'cellplan[step]'"
NEAREST: Final = 1e-7  # [mm] of the nearest point of a surface
SPREAD: Final = 9  # points of an edge that stand for it
LENGTH_TOL: Final = 1e-9  # [mm] of the length of a curve
FACET_ANGLE: Final = 0.35  # [rad] between neighbouring facets: a small hole stays round
SURFACES: Final = ("plane", "cylinder", "cone", "sphere", "torus", "spline", "spline", "revolution", "extrusion")
CURVES: Final = ("line", "circle", "ellipse", "hyperbola", "parabola", "spline", "spline", "offset", "other")


def require_step(file: str) -> None:
    """Refuse to read a STEP file where OpenCASCADE is not installed."""
    if find_spec("OCP") is None:
        raise InputError(f"{file}: {NO_STEP}")


class Face:
    """A face of a solid: its surface, its border and the side on which there is no material."""

    def __init__(self, shape: Any) -> None:
        """Prepare a face of the library."""
        from OCP.BRep import BRep_Tool
        from OCP.BRepAdaptor import BRepAdaptor_Surface
        from OCP.IntTools import IntTools_FClass2d
        from OCP.ShapeAnalysis import ShapeAnalysis_Surface
        from OCP.TopAbs import TopAbs_REVERSED

        self.shape = shape
        self.box = _box(shape)
        self.kind = SURFACES[min(_number(BRepAdaptor_Surface(shape).GetType()), len(SURFACES) - 1)]
        self._surface = BRep_Tool.Surface_s(shape)
        self._analysis = ShapeAnalysis_Surface(self._surface)
        self._border = IntTools_FClass2d(shape, ON_FACE)
        self._sign = -1.0 if shape.Orientation() == TopAbs_REVERSED else 1.0
        self._plane = _plane(BRepAdaptor_Surface(shape)) if self.kind == "plane" else None

    @cached_property
    def area(self) -> float:
        """Area in [m^2]."""
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps

        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(self.shape, properties)
        return float(properties.Mass()) / MM**2

    @cached_property
    def middle(self) -> Array:
        """Centre of the area in [m], shape (3,); of a curved face it lies off the surface."""
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps

        properties = GProp_GProps()
        BRepGProp.SurfaceProperties_s(self.shape, properties)
        centre = properties.CentreOfMass()
        return np.array([centre.X(), centre.Y(), centre.Z()]) / MM

    def project(self, points: Array, near: Array | None = None) -> tuple[Array, Array, Array]:
        """Parameters, shape (N, 2), nearest points on the whole surface and outward normals there, shape (N, 3).

        With parameters near those of the points, shape (N, 2), a surface of splines is searched from there.
        """
        from OCP.gp import gp_Pnt, gp_Pnt2d

        if self._plane is not None:
            origin, axes = self._plane[0], self._plane[1:]
            uv = MM * (points - origin) @ axes[:2].T
            feet = points - np.outer((points - origin) @ axes[2], axes[2])
            return uv, feet, np.tile(self._sign * axes[2], (len(points), 1))
        uv = np.empty((len(points), 2))
        for index, (x, y, z) in enumerate(MM * points):
            if near is None:
                place = self._analysis.ValueOfUV(gp_Pnt(x, y, z), NEAREST)
            else:
                place = self._analysis.NextValueOfUV(gp_Pnt2d(*near[index]), gp_Pnt(x, y, z), NEAREST)
            uv[index] = place.X(), place.Y()
        feet, normals = self.at(uv)
        return uv, feet, normals

    def at(self, uv: Array) -> tuple[Array, Array]:
        """Points and outward unit normals at parameters, shape (N, 2), of the surface; shape (N, 3) each."""
        from OCP.gp import gp_Pnt, gp_Vec

        feet, normals = np.empty((len(uv), 3)), np.empty((len(uv), 3))
        p, du, dv = gp_Pnt(), gp_Vec(), gp_Vec()
        for index, (u, v) in enumerate(uv):
            self._surface.D1(u, v, p, du, dv)
            feet[index] = p.X() / MM, p.Y() / MM, p.Z() / MM
            normals[index] = du.Crossed(dv).XYZ().X(), du.Crossed(dv).Y(), du.Crossed(dv).Z()
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        return feet, self._sign * normals / np.where(length > 0.0, length, 1.0)

    def border(self) -> list["Edge"]:
        """Edges round the face and round its holes, and those along which a closed surface meets itself."""
        from OCP.BRep import BRep_Tool
        from OCP.TopAbs import TopAbs_EDGE
        from OCP.TopoDS import TopoDS

        shapes = [TopoDS.Edge(shape) for shape in explored(self.shape, TopAbs_EDGE)]
        return [Edge(shape, (0, 0), (1.0, 1.0)) for shape in shapes if not BRep_Tool.Degenerated_s(shape)]

    def holds(self, uv: Array) -> Flags:
        """Whether points at parameters, shape (N, 2), lie within the border of the face or on it, shape (N,)."""
        from OCP.gp import gp_Pnt2d
        from OCP.TopAbs import TopAbs_OUT

        return np.array([self._border.Perform(gp_Pnt2d(u, v)) != TopAbs_OUT for u, v in uv], dtype=bool)

    def bounds(self) -> tuple[float, float, float, float]:
        """Range of the parameters: first and last of u, then of v."""
        from OCP.BRepTools import BRepTools

        low_u, high_u, low_v, high_v = BRepTools.UVBounds_s(self.shape)
        return low_u, high_u, low_v, high_v


class Edge:
    """An edge of a solid between two of its faces."""

    def __init__(self, shape: Any, faces: tuple[int, int], turns: tuple[float, float]) -> None:
        """Prepare an edge of the library.

        Args:
            faces: Places of its faces in the list of the solid.
            turns: Of each face 1.0 where it is on the left of the edge, seen from outside along its parameter, else -1.
        """
        from OCP.BRepAdaptor import BRepAdaptor_Curve

        self.shape = shape
        self.faces = faces
        self.turns = turns
        self.box = _box(shape)
        self._curve = BRepAdaptor_Curve(shape)
        self.kind = CURVES[min(_number(self._curve.GetType()), len(CURVES) - 1)]
        self.span = float(self._curve.FirstParameter()), float(self._curve.LastParameter())

    def at(self, t: Array) -> tuple[Array, Array]:
        """Points in [m] and unit tangents at parameters, shape (N,); shape (N, 3) each."""
        from OCP.gp import gp_Pnt, gp_Vec

        p, d = gp_Pnt(), gp_Vec()
        points, tangents = np.empty((len(t), 3)), np.empty((len(t), 3))
        for index, parameter in enumerate(t):
            self._curve.D1(parameter, p, d)
            points[index] = p.X() / MM, p.Y() / MM, p.Z() / MM
            tangents[index] = d.X(), d.Y(), d.Z()
        return points, tangents / np.linalg.norm(tangents, axis=1, keepdims=True)

    def lengths(self, t: Array) -> Array:
        """Lengths in [m] along the edge behind parameters that increase, shape (N,)."""
        from OCP.GCPnts import GCPnts_AbscissaPoint

        steps = [GCPnts_AbscissaPoint.Length_s(self._curve, a, b, LENGTH_TOL) for a, b in pairwise(t)]
        return np.concatenate([[0.0], np.cumsum(steps)]) / MM

    @property
    def is_closed(self) -> bool:
        """Whether it ends where it begins."""
        ends, _ = self.at(np.array(self.span))
        return bool(np.linalg.norm(ends[1] - ends[0]) * MM < ON_FACE)


class Solid:
    """A solid of a STEP file at its place, with the names that it and its faces and edges have there."""

    def __init__(self, shape: Any, name: str, names: dict[int, str]) -> None:
        """Prepare a solid of the library.

        Args:
            names: Names of faces and edges by the hash of their shape, which does not depend on its direction.
        """
        from OCP.TopAbs import TopAbs_FACE
        from OCP.TopoDS import TopoDS

        self.shape = shape
        self.name = name
        self.box = _box(shape)
        self._classifier: Any = None
        self.faces = [Face(TopoDS.Face(face)) for face in explored(shape, TopAbs_FACE)]
        self.edges, self.smooth_count = _edges(self.faces)
        self.names_of_faces = [names.get(hash(face.shape)) for face in self.faces]
        self.names_of_edges = [names.get(hash(edge.shape)) for edge in self.edges]

    def holds(self, points: Array) -> Flags:
        """Whether points in [m], shape (N, 3), lie in the solid or on its surface, shape (N,)."""
        from OCP.BRepClass3d import BRepClass3d_SolidClassifier
        from OCP.gp import gp_Pnt
        from OCP.TopAbs import TopAbs_OUT

        low, high = self.box
        is_near = np.all((points >= low) & (points <= high), axis=1)
        if self._classifier is None:
            self._classifier = BRepClass3d_SolidClassifier(self.shape)
        for index in np.flatnonzero(is_near):
            self._classifier.Perform(gp_Pnt(*(MM * points[index])), 1e-7)
            is_near[index] = self._classifier.State() != TopAbs_OUT
        return is_near

    def penetrates(self, other: "Solid", depth: float) -> bool:
        """Whether both have more room in common than a layer of a depth in [m] along an axis of the file."""
        from OCP.BRepAlgoAPI import BRepAlgoAPI_Common
        from OCP.TopAbs import TopAbs_SOLID

        common = BRepAlgoAPI_Common(self.shape, other.shape).Shape()
        return any(bool(np.all(np.subtract(*_box(it)[::-1]) > depth)) for it in explored(common, TopAbs_SOLID))

    @cached_property
    def corners(self) -> Array:
        """Points in [m] spread over all edges, their ends included, shape (N, 3)."""
        return np.concatenate([edge.at(np.linspace(*edge.span, SPREAD))[0] for edge in self.edges])

    @property
    def is_sound(self) -> bool:
        """Whether the library finds its topology and geometry in order, and it encloses a volume."""
        from OCP.BRepCheck import BRepCheck_Analyzer
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps

        properties = GProp_GProps()
        BRepGProp.VolumeProperties_s(self.shape, properties)
        return bool(BRepCheck_Analyzer(self.shape).IsValid()) and properties.Mass() > 0.0

    @property
    def looseness(self) -> float:
        """Greatest distance in [m] by which the faces and edges of the file miss each other where they meet."""
        from OCP.BRep import BRep_Tool
        from OCP.TopAbs import TopAbs_EDGE, TopAbs_VERTEX

        return max(float(BRep_Tool.MaxTolerance_s(self.shape, kind)) for kind in (TopAbs_EDGE, TopAbs_VERTEX)) / MM

    def facets(self, deviation: float) -> Iterator[tuple[Array, Indices, float]]:
        """Triangles of each face: corners in [m], shape (V, 3), indices, shape (M, 3), and their deviation in [m].

        The deviation is measured in the middles of the triangles and of their sides.
        """
        from OCP.BRep import BRep_Tool
        from OCP.BRepMesh import BRepMesh_IncrementalMesh
        from OCP.TopLoc import TopLoc_Location

        BRepMesh_IncrementalMesh(self.shape, MM * deviation, False, FACET_ANGLE, False)
        for face in self.faces:
            location = TopLoc_Location()
            mesh = BRep_Tool.Triangulation_s(face.shape, location)
            if mesh is None:
                raise InputError(f"{self.name}: a face could not be meshed")
            move = location.Transformation()
            nodes = [mesh.Node(k + 1).Transformed(move) for k in range(mesh.NbNodes())]
            corners = np.array([(p.X(), p.Y(), p.Z()) for p in nodes]) / MM
            indices = np.array([mesh.Triangle(k + 1).Get() for k in range(mesh.NbTriangles())], dtype=np.int64) - 1
            off = 0.0
            if face.kind != "plane":
                uv = np.array([(mesh.UVNode(k + 1).X(), mesh.UVNode(k + 1).Y()) for k in range(mesh.NbNodes())])
                off = _deviation(face, corners, uv, indices, deviation)
            yield corners, indices if face._sign > 0.0 else indices[:, ::-1], off


def first_hits(solids: Sequence[Solid], points: Array, direction: Array) -> tuple[Array, Array]:
    """Points in [m] and outward normals at which lines through points, shape (N, 3), come into solids from outside.

    Lines run against a unit direction, shape (3,). Rows of lines that miss all solids are not a number.
    """
    from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
    from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector

    corners = np.concatenate([np.stack(solid.box) for solid in solids])
    far = float(np.max(corners @ direction)) + float(np.ptp(corners, axis=0).max())
    meetings = []
    for solid in solids:
        meetings.append(IntCurvesFace_ShapeIntersector())
        meetings[-1].Load(solid.shape, ON_FACE)
    faces = {hash(face.shape): face for solid in solids for face in solid.faces}
    feet, normals = np.full(points.shape, np.nan), np.full(points.shape, np.nan)
    starts = points + np.outer(far - points @ direction, direction)
    for index, start in enumerate(MM * starts):
        line, nearest = gp_Lin(gp_Pnt(*start), gp_Dir(*-direction)), np.inf
        for meeting in meetings:
            meeting.PerformNearest(line, 0.0, nearest)
            if meeting.IsDone() and meeting.NbPnt() and meeting.WParameter(1) < nearest:
                nearest = meeting.WParameter(1)
                face, uv = faces[hash(meeting.Face(1))], [(meeting.UParameter(1), meeting.VParameter(1))]
        if np.isfinite(nearest):
            (feet[index],), (normals[index],) = face.at(np.array(uv))
    return feet, normals


def _deviation(face: Face, corners: Array, uv: Array, indices: Indices, likely: float) -> float:
    """Greatest distance in [m] of the middles of triangles and of their sides from a surface.

    Parameters in the middle lead near to the nearest point, but not at the tip of a cone: where the distance is more
    than is likely, the nearest point itself is looked for.
    """
    weights = np.array([[1.0, 1.0, 1.0], [0.0, 1.5, 1.5], [1.5, 0.0, 1.5], [1.5, 1.5, 0.0]]) / 3.0
    middles = np.einsum("wk,mkx->wmx", weights, corners[indices]).reshape(-1, 3)
    on_surface, normals = face.at(np.einsum("wk,mkx->wmx", weights, uv[indices]).reshape(-1, 2))
    off = np.abs(np.sum((middles - on_surface) * normals, axis=1))
    far = off > likely
    if np.any(far):
        off[far] = np.linalg.norm(middles[far] - face.project(middles[far])[1], axis=1)
    return float(off.max())


def _plane(surface: Any) -> Array:
    """Origin in [m], both axes and the normal of the parameters of a plane, shape (4, 3)."""
    place = surface.Plane().Position()
    origin, x, y = place.Location(), place.XDirection(), place.YDirection()
    axes = np.array([[d.X(), d.Y(), d.Z()] for d in (x, y)])
    return np.array([[origin.X() / MM, origin.Y() / MM, origin.Z() / MM], *axes, np.cross(*axes)])


def explored(shape: Any, kind: Any) -> Iterator[Any]:
    """Parts of a shape of one kind, each as often as it is used."""
    from OCP.TopExp import TopExp_Explorer

    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _edges(faces: list[Face]) -> tuple[list[Edge], int]:
    """Edges at which two faces meet, and the number of others: seams of a closed surface and tips of cones."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FORWARD, TopAbs_REVERSED
    from OCP.TopoDS import TopoDS

    sides: dict[int, list[tuple[Any, int, float]]] = {}  # by the hash of the edge, in which its direction has no part
    for place, face in enumerate(faces):
        for shape in explored(face.shape, TopAbs_EDGE):
            if not BRep_Tool.Degenerated_s(TopoDS.Edge(shape)):
                turn = -1.0 if shape.Orientation() == TopAbs_REVERSED else 1.0
                sides.setdefault(hash(shape), []).append((shape, place, turn))
    edges, others = [], 0
    for uses in sides.values():
        if len(uses) == 2 and uses[0][1] != uses[1][1]:
            (shape, first, turn), (_, second, other) = uses
            forward = TopoDS.Edge(shape.Oriented(TopAbs_FORWARD))
            edges.append(Edge(forward, (first, second), (turn, other)))
        else:
            others += 1
    return edges, others


def _number(word: Any) -> int:
    """Place of a word of the library in its list."""
    return int(word.value) if hasattr(word, "value") else int(word)


def _box(shape: Any) -> tuple[Array, Array]:
    """Lowest and highest corner in [m] of the box round a shape, shape (3,) each."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    low, high = box.CornerMin(), box.CornerMax()
    return np.array([low.X(), low.Y(), low.Z()]) / MM, np.array([high.X(), high.Y(), high.Z()]) / MM
