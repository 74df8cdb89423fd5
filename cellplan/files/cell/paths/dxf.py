"""DXF drawings: the curves of one layer; the door to ezdxf, the extra ``dxf``, for reading."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any, Final, NamedTuple, NoReturn

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.paths.csv_table import FARTHEST, METRES_PER_MM
from cellplan.files.input.files import read_regular_file
from cellplan.files.input.findings import did_you_mean, listed, shown
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.flat_curves import (
    Branch,
    Contour,
    FlatArc,
    FlatCurve,
    FlatSpline,
    bulged,
    chained,
    repeated,
)

NO_DXF: Final = "expected the package ezdxf, got none: pip install 'cellplan[dxf]'"
MOST_BYTES: Final = 30_000_000
MOST_CURVES: Final = 100_000  # lines, arcs and splines of a drawing, those of its blocks counted as often as they stand
DEEPEST: Final = 16  # blocks within blocks
MOST_LISTED: Final = 12  # layers in a message
FLAT_MM: Final = 1e-6  # [mm] heights of a drawing that are below this are rounding
SHORTEST_MM: Final = 1e-3  # [mm] a shorter curve is a point
UPRIGHT: Final = 1e-9  # [-] by which the normal of a flat entity may differ from +z or -z
UNITS: Final = {"mm": 1.0, "cm": 10.0, "m": 1e3, "inch": 25.4, "ft": 304.8}  # [mm]
OF_CODES: Final = {1: "inch", 2: "ft", 4: "mm", 5: "cm", 6: "m"}  # of $INSUNITS
CURVES: Final = "LINE, ARC, CIRCLE, ELLIPSE, LWPOLYLINE, POLYLINE and SPLINE"
SUB_ENTITIES: Final = frozenset({"VERTEX", "SEQEND", "ATTRIB"})  # they belong to the entity before them
CURVE_FITTED: Final = 2 | 4  # flags of a POLYLINE with vertices that a program has added
IS_MESH: Final = 16 | 64  # flags of a POLYLINE that is a surface
LAYER_CODE: Final = 8  # group code of a layer
_LINE_OF: Final = re.compile(r"(?:near|at) line:?\s+(\d+)\.?")


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawingSettings:
    """What a cell says of a drawing."""

    source: str  # name of the file for messages
    layer: str
    unit: str | None  # unit of lengths; None for that of the file
    join: float  # distance in [m] within which ends of curves meet


class FlatDrawing(NamedTuple):
    """Contours of a layer in [m], and what of the file is not part of them."""

    contours: list[Contour]
    remark: str


class _Record(NamedTuple):
    """An entity of the model space in the text of the file."""

    kind: str
    line: int


def require_dxf(file: str) -> None:
    """Refuse to read a DXF file where ezdxf is not installed."""
    if find_spec("ezdxf") is None:
        raise InputError(f"{file}: {NO_DXF}")


def read_drawing(path: Path, settings: DrawingSettings) -> FlatDrawing:
    """Contours of a layer, in the order of the first curve of each in the file.

    Raises:
        InputError: The file cannot be read or is damaged; its unit is not known, or another one; it has no such layer,
            or there is anything on it that is no flat curve; curves branch, or one is there twice.
    """
    text = _text(path, settings.source)
    records, unit_code = _scan(text, settings.source)
    reader = _Reader(settings, _scale(unit_code, settings))
    document = _document(text, settings.source)
    try:
        reader.read(document, records)
    except _failures() as error:
        reader.refuse(f"expected a sound entity, but ezdxf says: {' '.join(str(error).split())}")
    return reader.drawing()


@dataclass(slots=True)
class _Reader:
    """What the entities up to one have given."""

    settings: DrawingSettings
    scale: float  # [m] of a unit of the file
    line: int = 0  # of the entity of the model space that is read; 0 where it is not known
    name: str = ""  # kind and handle of the entity that is read
    runs: list[list[FlatCurve]] = field(default_factory=list)
    names: list[tuple[int, str]] = field(default_factory=list)  # line and name of the entity of each run
    count: int = 0  # of curves, on all layers
    layers: Counter[str] = field(default_factory=Counter)  # entities by layer
    unused: Counter[str] = field(default_factory=Counter)

    def refuse(self, text: str) -> NoReturn:
        """Refuse the file for a reason in the entity that is read."""
        place = f":{self.line}" if self.line else ""
        raise InputError(f"{self.settings.source}{place}: {self.name}: {text}")

    def read(self, document: Any, records: list[_Record]) -> None:
        """All entities of the model space; those of paper spaces are counted."""
        entities = list(document.modelspace())
        kinds = [entity.dxftype() for entity in entities]
        lines = [record.line for record in records] if kinds == [record.kind for record in records] else []
        for place, entity in enumerate(entities):
            self.line = lines[place] if lines else 0
            self._entity(entity, _layer(entity), depth=0)
        on_paper = sum(len(layout) for layout in document.layouts if layout.name != "Model")
        self.unused["entities in paper space"] += on_paper

    def drawing(self) -> FlatDrawing:
        """The contours of the layer."""
        file, layer = self.settings.source, self.settings.layer
        if not self.runs:
            known = [f"{name} ({count})" for name, count in sorted(self.layers.items())]
            others = f" and {len(known) - MOST_LISTED} more" if len(known) > MOST_LISTED else ""
            has = f"it has entities on {listed(known[:MOST_LISTED])}{others}" if known else "it has none at all"
            raise InputError(
                f"{file}: expected curves on the layer {shown(layer)}, got none{did_you_mean(layer, [*self.layers])}; "
                f"{has}"
            )
        if pair := repeated(self.runs, self.settings.join):
            (self.line, self.name), (line, name) = (self.names[place] for place in pair)
            where = f" in line {line}" if line else ""
            self.refuse(f"expected each curve once, got the one of {name}{where} again; delete one of them")
        contours = chained(self.runs, self.settings.join)
        if isinstance(contours, Branch):
            self.line, self.name = self.names[contours.runs[-1]]
            x, y = contours.point / METRES_PER_MM
            names = listed([name for _, name in (self.names[place] for place in contours.runs)])
            self.refuse(f"expected at most two ends of curves at x {x:.3f}, y {y:.3f} mm, got those of {names}")
        counted = [f"{what} ({count})" for what, count in sorted(self.unused.items()) if count]
        number = f"{len(contours)} contour{'s' if len(contours) > 1 else ''} of {len(self.runs)} entities"
        rest = f"; not used: {listed(counted)}" if counted else ""
        return FlatDrawing(contours, f"{file}: layer {layer}: {number}{rest}")

    def _entity(self, entity: Any, layer: str, *, depth: int) -> None:
        """One entity; a block reference stands for what its block has."""
        handle = entity.dxf.handle or getattr(entity.source_of_copy, "dxf", entity.dxf).handle
        kind = entity.dxftype()
        self.name = f"{kind} #{handle}"
        if kind == "INSERT":
            self._block(entity, layer, depth=depth)
            return
        self.layers[layer] += 1
        if layer.casefold() != self.settings.layer.casefold():
            self.unused["entities on other layers"] += 1
            return
        if kind not in _READ:
            self.refuse(f"expected {CURVES} on the layer {layer}, got this; move it to another layer")
        self.count += 1
        if self.count > MOST_CURVES:
            self.refuse(f"expected at most {MOST_CURVES} curves, got more; draw the outline on a layer of its own")
        curves = list(_READ[kind](self, entity))
        if not curves:
            self.unused["curves without a length"] += 1
            return
        self.runs.append(curves)
        self.names.append((self.line, self.name))

    def _block(self, insert: Any, layer: str, *, depth: int) -> None:
        """What a block has, where it is inserted; on layer 0 it is on that of the reference."""
        name = self.name
        block = insert.block()
        if block is None:
            self.refuse(f"expected a block of the file, got {shown(insert.dxf.name)}, which it has not")
        if depth == DEEPEST:
            self.refuse(f"expected at most {DEEPEST} blocks within one another, got more")
        self.count += insert.mcount * len(block)
        if self.count > MOST_CURVES:
            self.refuse(f"expected at most {MOST_CURVES} curves, those of blocks included, got more")
        self.unused["attributes of blocks"] += len(insert.attribs)
        skipped: list[str] = []
        for single in insert.multi_insert() if insert.mcount > 1 else (insert,):
            for entity in single.virtual_entities(skipped_entity_callback=lambda it, _: skipped.append(it.dxftype())):
                within = _layer(entity)
                self._entity(entity, layer if within == "0" else within, depth=depth + 1)
                self.name = name
        self.unused.update(f"{kind} in a block" for kind in skipped)

    def point(self, x: float, y: float, z: float = 0.0) -> Array:
        """A point of the plane of the drawing in [m]."""
        if not (np.isfinite([x, y, z]).all() and max(abs(x), abs(y)) * self.scale <= FARTHEST * METRES_PER_MM):
            self.refuse(f"expected coordinates of at most {FARTHEST:g} mm, got x {x:g}, y {y:g}; is the unit right?")
        if abs(z) * self.scale > FLAT_MM * METRES_PER_MM:
            self.refuse(f"expected a curve at z = 0, got z = {z * self.scale / METRES_PER_MM:g} mm; draw it flat")
        return self.scale * np.array([x, y])

    def side(self, entity: Any) -> float:
        """1.0 for an entity that is seen from +z, -1.0 for a mirrored one, which is seen from -z."""
        x, y, z = entity.dxf.extrusion
        if max(abs(x), abs(y), abs(abs(z) - 1.0)) > UPRIGHT:
            self.refuse(f"expected a curve in the plane of the drawing, got the normal [{x:g}, {y:g}, {z:g}]")
        return 1.0 if z > 0.0 else -1.0

    def lines(self, entity: Any) -> Iterator[FlatCurve]:
        """A line."""
        yield from self.sides([(*entity.dxf.start, 0.0), (*entity.dxf.end, 0.0)], is_closed=False)

    def sides(self, corners: list[tuple[float, float, float, float]], *, is_closed: bool) -> Iterator[FlatCurve]:
        """Lines and arcs between corners with their bulges; those without a length are left out."""
        points = [self.point(*corner[:3]) for corner in corners]
        bulges = [corner[3] for corner in corners]
        ends = points[1:] + points[:1] if is_closed else points[1:]
        for start, end, bulge in zip(points, ends, bulges, strict=False):
            if not abs(bulge) <= FARTHEST:
                self.refuse(f"expected a bulge that is a number, got {bulge:g}")
            if np.linalg.norm(end - start) > SHORTEST_MM * METRES_PER_MM:
                yield bulged(start, end, bulge)

    def arcs(self, entity: Any) -> Iterator[FlatCurve]:
        """An arc, a circle or an arc of an ellipse."""
        from ezdxf.entities.ellipse import Ellipse

        self.side(entity)
        radius = (
            entity.dxf.major_axis.magnitude * entity.dxf.ratio if entity.dxftype() == "ELLIPSE" else entity.dxf.radius
        )
        if not (np.isfinite(radius) and radius > 0.0):
            self.refuse(f"expected a radius above 0, got {radius:g}")
        ellipse = entity if entity.dxftype() == "ELLIPSE" else Ellipse.from_arc(entity)
        first, second = (self.point(*axis) for axis in (ellipse.dxf.major_axis, ellipse.minor_axis))
        begin, end = ellipse.dxf.start_param, ellipse.dxf.end_param
        if not np.isfinite([begin, end]).all():
            self.refuse("expected angles that are numbers")
        sweep = (end - begin) % (2.0 * np.pi)
        if sweep <= FULL_TURN or entity.dxftype() == "CIRCLE":
            sweep = 2.0 * np.pi
        if sweep * min(np.linalg.norm(first), np.linalg.norm(second)) > SHORTEST_MM * METRES_PER_MM:
            centre = self.point(*ellipse.dxf.center)
            yield FlatArc(centre=centre, first=first, second=second, span=(begin, begin + sweep))

    def polylines(self, entity: Any) -> Iterator[FlatCurve]:
        """Both kinds of polylines, flat ones with arcs; one in space where it is flat."""
        if entity.dxftype() == "LWPOLYLINE":
            sign, z = self.side(entity), entity.dxf.elevation
            corners = [(sign * x, y, z, sign * bulge) for x, y, bulge in entity.get_points("xyb")]
            yield from self.sides(corners, is_closed=entity.closed)
            return
        if entity.dxf.flags & (CURVE_FITTED | IS_MESH):
            self.refuse("expected a polyline of lines and arcs, got a fitted one or a surface; explode it")
        sign = 1.0 if entity.is_3d_polyline else self.side(entity)
        z = 0.0 if entity.is_3d_polyline else entity.dxf.elevation.z
        corners = [
            (sign * it.dxf.location.x, it.dxf.location.y, z + sign * it.dxf.location.z, sign * it.dxf.get("bulge", 0.0))
            for it in entity.vertices
        ]
        yield from self.sides(corners, is_closed=entity.is_closed)

    def splines(self, entity: Any) -> Iterator[FlatCurve]:
        """A spline by its control points."""
        degree, count = entity.dxf.degree, len(entity.control_points)
        knots, weights = np.array(entity.knots, dtype=float), np.array(entity.weights or [1.0] * count, dtype=float)
        if not 1 <= degree < count:
            self.refuse(f"expected more than {degree} control points for a spline, got {count}; convert its fit points")
        if len(knots) != count + degree + 1 or not np.isfinite(knots).all() or np.any(np.diff(knots) < 0.0):
            self.refuse(f"expected {count + degree + 1} knots that do not decrease, got {len(knots)}")
        if len(weights) != count or not np.all((weights > 0.0) & np.isfinite(weights)):
            self.refuse(f"expected {count} weights above 0, got {len(weights)}")
        ends = knots[degree], knots[count]
        inner, repeats = np.unique(knots[degree + 1 : count], return_counts=True)
        if not ends[0] < ends[1] or np.any(repeats[(inner > ends[0]) & (inner < ends[1])] > degree):
            self.refuse("expected a spline in one piece, got knots that repeat too often")
        control = np.stack([self.point(*point) for point in entity.control_points])
        if np.ptp(control, axis=0).max() > SHORTEST_MM * METRES_PER_MM:
            weighted = np.column_stack([control * weights[:, None], weights])
            yield FlatSpline(degree=degree, knots=knots, control=weighted, span=(float(ends[0]), float(ends[1])))


FULL_TURN: Final = 1e-9  # [rad] an arc that turns by less ends where it begins: it is a whole circle
_READ: Final = {
    "LINE": _Reader.lines,
    "ARC": _Reader.arcs,
    "CIRCLE": _Reader.arcs,
    "ELLIPSE": _Reader.arcs,
    "LWPOLYLINE": _Reader.polylines,
    "POLYLINE": _Reader.polylines,
    "SPLINE": _Reader.splines,
}


def _text(path: Path, file: str) -> str:
    """Text of the file: UTF-8, or from older programs one byte for each letter."""
    data = read_regular_file(path, file=file, limit=MOST_BYTES)
    if data.startswith(b"AutoCAD Binary DXF"):
        raise InputError(f"{file}: expected a DXF file as text, got a binary one; save it as text")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def _scan(text: str, file: str) -> tuple[list[_Record], int]:
    """Entities of the model space with the lines at which they begin, and the code of the unit; 0 for none.

    Group codes are checked, so that a damaged file is refused by its line.
    """
    records, unit, section, variable, is_name = list[_Record](), 0, "", "", False
    lines = text.split("\n")
    ends = len(lines) - 1
    for k in range(0, len(lines) - 1, 2):
        code, value = lines[k].strip(), lines[k + 1].strip()
        if not re.fullmatch(r"-?\d{1,4}", code, re.ASCII):
            raise InputError(f"{file}:{k + 1}: expected a group code, a whole number, got {shown(lines[k])}")
        if code == "0":
            if value == "EOF":
                break
            section = "" if value == "ENDSEC" else section
            if section == "ENTITIES" and value not in SUB_ENTITIES:
                records.append(_Record(value, k + 1))
        elif code == "2" and is_name:
            section = value
        elif code == "67" and value == "1" and section == "ENTITIES" and records:
            records.pop()  # it is in a paper space
        elif code == "9":
            variable = value
        elif code == "70" and variable == "$INSUNITS":
            unit, variable = int(value) if value.isascii() and value.isdigit() else -1, ""
        is_name = code == "0" and value == "SECTION"
    else:
        raise InputError(f"{file}:{ends + 1}: expected 0 and EOF at the end of a DXF file, got the end; is it whole?")
    return records, unit


def _document(text: str, file: str) -> Any:
    """The document of a file."""
    from ezdxf.filemanagement import read

    try:
        return read(StringIO(text))
    except _failures() as error:
        words = " ".join(str(error).replace("DXFStructureError:", "").split())
        place = _LINE_OF.search(words)
        line = f":{place.group(1)}" if place else ""
        raise InputError(
            f"{file}{line}: expected a sound DXF file, but ezdxf says: {_LINE_OF.sub('', words).strip()}"
        ) from None


def _failures() -> tuple[type[Exception], ...]:
    """What the library raises on damaged content."""
    from ezdxf.lldxf.const import DXFError

    return DXFError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError


def _layer(entity: Any) -> str:
    """Layer of an entity, of one that the library does not know as well."""
    if entity.dxf.is_supported("layer"):
        return str(entity.dxf.layer)
    return next((str(tag.value) for tags in entity.xtags.subclasses for tag in tags if tag.code == LAYER_CODE), "0")


def _scale(code: int, settings: DrawingSettings) -> float:
    """A unit of the file in [m]."""
    file, stated = settings.source, OF_CODES.get(code)
    words = " or ".join([", ".join([*UNITS][:-1]), [*UNITS][-1]])
    if code and stated is None:
        raise InputError(f"{file}: expected lengths in {words} ($INSUNITS), got the unit {code}; convert the drawing")
    if settings.unit is None and stated is None:
        raise InputError(f"{file}: expected the unit of lengths ($INSUNITS), got none; give outline a unit: {words}")
    if settings.unit is not None and stated not in {None, settings.unit}:
        raise InputError(f"{file}: expected lengths in {settings.unit}, as the cell says, got a drawing in {stated}")
    return UNITS[settings.unit or stated or ""] * METRES_PER_MM
