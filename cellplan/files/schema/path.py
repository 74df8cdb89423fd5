"""Paths of tools, and given paths of a positioner's joints, as written in a cell file."""

from typing import Annotated, Any, ClassVar, Final, Literal, Self

from pydantic import Field, Tag, model_validator

from cellplan.files.schema.closed_shapes import CircleEntry, PlaneWord, RectangleEntry, RhombusEntry
from cellplan.files.schema.programmed import MOST_JOINED_MM, CamChoice, GcodeChoice, OutlineChoice
from cellplan.files.schema.raster import RasterEntry
from cellplan.model.settings.entry import (
    FARTHEST_MM,
    Angle,
    Coordinate,
    Coordinates,
    Direction,
    Entry,
    OneOf,
    Text,
    by_kind,
    rule,
    setting,
)
from cellplan.model.settings.units import Deg, Mm, Within

COEFFICIENT_LIMIT: Final = 400  # more are a table of the motion, not a spline

JointValue = Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)]
Row = tuple[float, ...] | dict[str, Any]
SHORTEST_SIDE_MM: Final = 1e-3  # sides shorter than a micrometre have no direction
CSV_WORDS: Final = "a file name or {file: path.csv, smooth: true, closed: false}"
OF_FILES: Final = ("csv", "apt", "gcode")
MOST_EDGES: Final = 50  # in one path
LEAST_TUBE: Final = 1e-3  # [mm], [deg] of a tube: tables of points are no finer
WIDEST_SMOOTHED_DEG: Final = 45.0  # farther from its direction a tool does other work


class PolylineEntry(Entry):
    """Points joined by straight sides in the order they are listed: two coordinates each in a plane, or three."""

    points_mm: tuple[tuple[Coordinate, ...], ...] = Field(
        min_length=2, description="Points, all [u, v] on the plane's axes or all [x, y, z] in the part frame."
    )
    plane: PlaneWord | None = setting(None, "Plane of the part frame; required with [u, v], not with [x, y, z].")
    closed: bool = setting(False, "Whether the last point is joined to the first.")

    @model_validator(mode="after")
    def _is_drawable(self) -> Self:
        """Points of one dimension, a plane where one is needed, no side without length."""
        sizes = [len(point) for point in self.points_mm]
        for index, size in enumerate(sizes):
            if size not in {2, 3} or size != sizes[0]:
                allowed = sizes[0] if sizes[0] in {2, 3} else "2 or 3"
                raise rule(f"expected a list of {allowed} numbers, got {size}", f"points_mm[{index}]")
        if sizes[0] == 2 and self.plane is None:
            raise rule("missing, expected the plane of the points: xy, yz or xz", "plane")
        if sizes[0] == 3 and self.plane is not None:
            raise rule("unexpected key, points [x, y, z] need no plane", "plane")
        if self.closed and len(sizes) < 3:
            raise rule(f"expected at least 3 points for a closed path, got {len(sizes)}", "points_mm")
        self._require_sides()
        return self

    def _require_sides(self) -> None:
        """Refuse equal neighbours, and on a closed path a last point on the first."""
        points = self.points_mm
        pairs = list(zip(points, points[1:], range(1, len(points)), strict=False))
        if self.closed:
            pairs.append((points[0], points[-1], len(points) - 1))
        for a, b, index in pairs:
            if sum((u - v) ** 2 for u, v in zip(a, b, strict=True)) < SHORTEST_SIDE_MM**2:
                other = "first" if self.closed and a is points[0] and index == len(points) - 1 else "point before"
                raise rule(f"expected another point than the {other}, got the same", f"points_mm[{index}]")


class CsvEntry(Entry):
    """Tool targets from a CSV file."""

    file: Text = Field(
        description="File with the header x_mm,y_mm,z_mm and optionally i,j,k or qw,qx,qy,qz, and t_s for a trajectory "
        "that brings its own clock."
    )
    smooth: bool = setting(True, "Whether the points are joined by a smooth curve instead of straight sides.")
    closed: bool = setting(
        False, "Whether the last point is joined to the first; a closed trajectory ends with its first row again."
    )
    join_mm: Annotated[Mm, Within(ge=0.0, le=MOST_JOINED_MM)] = setting(
        Mm(0.0),
        "Points nearer to the point before than this are left out, and at the end of a closed path those nearer to "
        "the first; not for a trajectory.",
    )


CsvChoice = Annotated[
    Annotated[Text, Tag(f"<{CSV_WORDS}>")] | Annotated[CsvEntry, Tag("<mapping>")], by_kind(CSV_WORDS, mapping=dict)
]


class SmoothEntry(Entry):
    """How far points and tool axes of a file may be moved to make the path smooth."""

    position_mm: Annotated[Mm, Within(ge=LEAST_TUBE, le=FARTHEST_MM)] | None = setting(
        None,
        "Largest distance of the smoothed tool tip from the given one, less than the position tolerance of the task, "
        "which it shares with the tracking error; absent: points stay.",
    )
    direction_deg: Annotated[Deg, Within(ge=LEAST_TUBE, le=WIDEST_SMOOTHED_DEG)] | None = setting(
        None, "Likewise the largest angle between the tool's axis and the given one; absent: axes stay."
    )
    into_mm: Annotated[Mm, Within(ge=0.0, le=FARTHEST_MM)] = setting(
        Mm(0.0), "Largest distance of the smoothed tool tip from the given one along the given axis, into the part."
    )

    @model_validator(mode="after")
    def _moves_anything(self) -> Self:
        """A distance or an angle; the depth is part of the distance."""
        if self.position_mm is None and self.direction_deg is None:
            raise rule("missing, expected position_mm, direction_deg or both", "position_mm")
        if self.into_mm > (self.position_mm or 0.0):
            raise rule(f"expected at most position_mm = {self.position_mm or 0.0:g}, got {self.into_mm:g}", "into_mm")
        return self


class PathShapeEntry(OneOf):
    """Exactly one path, and its projection onto the part."""

    alternatives: ClassVar[tuple[str, ...]] = (
        "circle",
        "rectangle",
        "rhombus",
        "polyline",
        "edge",
        "edges",
        "outline",
        "face",
        *OF_FILES,
    )

    circle: CircleEntry | None = setting(None, "Circle.")
    rectangle: RectangleEntry | None = setting(None, "Rectangle.")
    rhombus: RhombusEntry | None = setting(None, "Rhombus.")
    polyline: PolylineEntry | None = setting(None, "Points joined by straight sides.")
    edge: Text | None = setting(
        None, "Edge or seam of the STEP file of the part (`part.step`) by name; `cellplan seams` lists them."
    )
    edges: tuple[Text, ...] | None = setting(
        None,
        "Edges or seams that meet end to end, as one path in this order. Where they meet at an angle it has a corner.",
        min_length=2,
        max_length=MOST_EDGES,
    )
    start_at_mm: Coordinates | None = setting(
        None, "Point in the part frame; edges that are closed begin where they are nearest to it."
    )
    outline: OutlineChoice | None = setting(
        None,
        "Contours of a layer of a DXF drawing (extra `dxf`), on a plane face of the part (`on`) or projected onto the "
        "part (`project`), with rapids between them; the tool points against the normal.",
    )
    layer: Text | None = setting(None, "Layer of the drawing; required with outline.")
    on: Text | None = setting(
        None,
        "Plane face of the STEP file of the part (`part.step`) that the outline lies on, by name; `cellplan seams` "
        "lists them. The origin of the drawing is the foot of that of the part frame, its x axis +x of the part frame "
        "along the face (+y on a face across x), and it is seen from outside; see outline.at.",
    )
    face: Text | None = setting(
        None,
        "Face of the STEP file of the part (`part.step`) by name, covered by a raster, the tool against its normal; "
        "`cellplan seams` lists them.",
    )
    raster: RasterEntry | None = setting(None, "Lines of a raster; required with face.")
    csv: CsvChoice | None = setting(None, "Tool targets from a file.")
    apt: CamChoice | None = setting(None, "Tool targets, feeds and rapids from a file of APT or CLDATA.")
    gcode: GcodeChoice | None = setting(
        None, "Tool targets, feeds and rapids from G-code of moves of the tool tip, with tool vectors I, J, K."
    )
    project: Direction | None = setting(
        None,
        "Side of the part, as a direction in the part frame, from which the path is projected onto the part; absent: "
        "not projected. An outline is drawn in the plane across it through the origin, as under `on`.",
    )
    smooth: SmoothEntry | None = setting(
        None,
        "Tube round the points and axes of a file, an outline or a raster within which they are made as smooth as "
        "possible.",
    )
    offset_mm: Coordinate | None = setting(
        None, "Shift of a planar path that is not projected along the plane's normal axis; 0 when absent."
    )

    @model_validator(mode="after")
    def _has_place(self) -> Self:
        """An offset goes with a planar path that is not projected."""
        if self.offset_mm is not None and not self.is_planar:
            raise rule("unexpected key, only a path in a plane has an offset", "offset_mm")
        if self.offset_mm is not None and self.project is not None:
            raise rule("unexpected key, a projected path lies on the surface", "offset_mm")
        if self.has_feeds and self.project is not None:
            raise rule("unexpected key, a path of CAM is used as it stands in the file", "project")
        if self.is_edge and self.project is not None:
            raise rule("unexpected key, edges lie on the part already", "project")
        if self.smooth is not None and self.file_key is None and not self.is_programmed:
            text = "unexpected key, only a path of many points (csv, apt, gcode, outline, face) is smoothed"
            raise rule(text + ("; list them in a table" if self.polyline is not None else ""), "smooth")
        if self.smooth is not None and self.project is not None and self.outline is None:
            text = "unexpected key, a projected path takes points and normals from the part; list them in a table (csv)"
            raise rule(text, "smooth")
        if (self.face is None) != (self.raster is None):
            text = "missing, expected how the face is rastered: {step_mm: 20}"
            raise rule(text if self.raster is None else "unexpected key, it covers a face", "raster")
        if self.face is not None and self.project is not None:
            raise rule("unexpected key, a face lies on the part already", "project")
        if not self.is_edge and self.start_at_mm is not None:
            raise rule("unexpected key, only edges that are closed begin anywhere", "start_at_mm")
        return self

    @model_validator(mode="after")
    def _has_ground(self) -> Self:
        """An outline has a layer, and lies on a face or is projected."""
        for key in ("layer", "on") if self.outline is None else ():
            if getattr(self, key) is not None:
                raise rule("unexpected key, it goes with an outline", key)
        if self.outline is None:
            return self
        if self.layer is None:
            raise rule("missing, expected the layer of the drawing", "layer")
        if (self.on is None) == (self.project is None):
            text = "missing, expected a plane face of the STEP file of the part, or project: +z (or another side)"
            raise rule(text if self.on is None else "expected either on or project, got both", "on")
        return self

    @property
    def is_planar(self) -> bool:
        """Whether the path is drawn in a plane of the part frame."""
        return self.polyline.plane is not None if self.polyline is not None else not (self.file_key or self.is_on_part)

    @property
    def file_key(self) -> str | None:
        """Key of the file that the path is read from; None for a path without a file."""
        return next((key for key in OF_FILES if getattr(self, key) is not None), None)

    @property
    def has_feeds(self) -> bool:
        """Whether the file of the path states feeds."""
        return self.apt is not None or self.gcode is not None

    @property
    def is_programmed(self) -> bool:
        """Whether it has rapids and stops of its own."""
        return self.has_feeds or self.outline is not None or self.raster is not None

    @property
    def is_on_part(self) -> bool:
        """Whether it lies on the part, which holds the tool upright or has walls: edges, outlines and rasters."""
        return self.is_edge or self.outline is not None or self.raster is not None

    @property
    def is_edge(self) -> bool:
        """Whether it runs along edges of the STEP file of the part."""
        return self.edge is not None or self.edges is not None


class JointPathEntry(Entry):
    """The joints of a positioner as a B-spline over the common clock, at rest at both ends."""

    degree: Literal[3, 5] = setting(
        5, "Degree of the polynomials between two knots; the knots are evenly spaced over the clock."
    )
    coefficients_deg: tuple[tuple[Angle, ...], ...] | None = setting(
        None,
        "Coefficients, one configuration each with one angle per joint, for robots with revolute joints only. The "
        "first is the start posture, the last the end; both count three times, so that the joints begin and end at "
        "rest and without acceleration. The path passes near the others.",
        min_length=2,
        max_length=COEFFICIENT_LIMIT,
    )
    coefficients: tuple[dict[str, JointValue], ...] | None = setting(
        None,
        "The same with one key per joint with its unit (a1_deg, rail_mm); excludes coefficients_deg.",
        min_length=2,
        max_length=COEFFICIENT_LIMIT,
    )

    @model_validator(mode="after")
    def _is_given_once(self) -> Self:
        """Coefficients in one of both spellings."""
        if (self.coefficients_deg is None) == (self.coefficients is None):
            got = "neither" if self.coefficients is None else "both"
            raise rule(f"expected either coefficients_deg or coefficients, got {got}")
        return self

    @property
    def key(self) -> str:
        """The key under which the coefficients are given."""
        return "coefficients_deg" if self.coefficients is None else "coefficients"

    @property
    def rows(self) -> tuple[Row, ...]:
        """The coefficients as they are written."""
        return self.coefficients if self.coefficients is not None else self.coefficients_deg or ()
