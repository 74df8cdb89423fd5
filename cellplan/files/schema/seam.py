"""Paths as welders describe them: walls beside a seam, and how the tool is held to them."""

from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import ConfigDict, Field, Tag, model_validator

from cellplan.files.schema.path import PathShapeEntry
from cellplan.model.settings.entry import DIRECTION_WORDS, Entry, Name, Vector, by_kind, rule, setting
from cellplan.model.settings.units import Deg, Mm, Within

WALL_WORDS: Final = f"surface, left, right, {DIRECTION_WORDS}"
MOST_WALLS: Final = 2  # beside one seam
STEEPEST_DEG: Final = 90.0  # of a work angle: beyond it the tool is in the wall
FLATTEST_DEG: Final = 80.0  # of a travel angle: beyond it the tool slides along the seam
MOST_DWELL: Final = 0.8  # [-] of the period of a weave
FARTHEST_PART_MM: Final = 100_000.0  # no path is longer
FARTHEST_MM: Final = 500.0  # no tool works from farther away
SURFACE: Final = "surface"
SIDES: Final = ("left", "right")

WallChoice = Annotated[
    Annotated[Literal["surface", "left", "right", "+x", "-x", "+y", "-y", "+z", "-z"], Tag(f"<{WALL_WORDS}>")]
    | Annotated[Vector, Tag("<list>")],
    by_kind(WALL_WORDS, list=tuple),
]
WorkAngle = Annotated[Deg, Within(ge=-STEEPEST_DEG, le=STEEPEST_DEG)]
Shift = Annotated[Mm, Within(ge=-FARTHEST_MM, le=FARTHEST_MM)]
TravelAngle = Annotated[Deg, Within(ge=0.0, le=FLATTEST_DEG)]


Length = Annotated[Mm, Within(gt=0.0, le=FARTHEST_PART_MM)]
Dwell = Annotated[float, Field(ge=0.0, le=10.0)]
WeaveSide = Annotated[Mm, Within(gt=0.0, le=FARTHEST_MM)]
OF_OUTLINES: Final = ("work_deg", "push_deg", "drag_deg", "standoff_mm", "reverse")  # keys of a seam that they have
OF_RASTERS: Final = ("standoff_mm",)
OF_SMOOTHED: Final = ("from_mm", "to_mm", "reverse", "overlap_mm", "back_mm", "weave")  # where they are of its curve
OF_FEED: Final = ("frequency_hz", "dwell_left_s", "dwell_right_s")  # keys whose lengths follow from the feed


class WeaveEntry(Entry):
    """How the tool tip swings about its path while it travels along it; the feed is that of travel."""

    side_mm: WeaveSide = Field(description="Distance of each edge from the path, across travel and tool.")
    form: Literal["sine", "zigzag", "triangle", "circle"] = setting(
        "sine",
        "Line of the weave: a sine; straight from edge to edge; straight from the root over both edges; round a centre "
        "that travels along the path. The left edge comes first, as seen along the tool.",
    )
    wavelength_mm: Length | None = setting(
        None, "Length of the path for one whole period, dwells included; excludes frequency_hz."
    )
    frequency_hz: Annotated[float, Field(gt=0.0, le=50.0)] | None = setting(
        None, "Periods in a second at the feed of the process, dwells included."
    )
    dwell_left_s: Dwell = setting(0.0, "Time for which the tool travels along the left edge in each period.")
    dwell_right_s: Dwell = setting(0.0, "Likewise along the right edge.")
    dwell: Literal["moving", "standing"] = setting(
        "moving",
        "What the tool does meanwhile: it travels on along the edge, or stands, and travels as much faster between the "
        "edges as its mean travel needs for the feed.",
    )
    out_mm: Length | None = setting(
        None, "Distance of the edges of a triangle from the path, out of the part; required with triangle only."
    )

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        """One period, and what its form has."""
        if (self.wavelength_mm is None) == (self.frequency_hz is None):
            got = "neither" if self.wavelength_mm is None else "both"
            raise rule(f"expected either wavelength_mm or frequency_hz, got {got}")
        if (self.out_mm is not None) != (self.form == "triangle"):
            raise rule(
                "missing, expected the distance of the edges from the path, out of the part"
                if self.out_mm is None
                else f"unexpected key, a weave of the form {self.form} stays at one distance",
                "out_mm",
            )
        if self.form == "circle" and (self.dwell_left_s or self.dwell_right_s):
            raise rule("expected no dwells, a circle has no edges", "form")
        if self.dwell == "standing" and not (self.dwell_left_s or self.dwell_right_s):
            raise rule("expected dwell_left_s or dwell_right_s beside it, got neither", "dwell")
        return self

    def require_strokes(self, feed_mm_s: float) -> None:
        """Refuse dwells that leave too little of each period for the way from edge to edge, at a feed in [mm/s]."""
        period = (self.wavelength_mm or feed_mm_s / (self.frequency_hz or 1.0)) / feed_mm_s
        dwells = self.dwell_left_s + self.dwell_right_s
        if dwells > MOST_DWELL * period:
            text = f"expected dwells of at most {MOST_DWELL:g} of the period of {period:.4g} s, got {dwells:.4g} s"
            raise rule(text, f"path.weave.{'dwell_left_s' if self.dwell_left_s else 'dwell_right_s'}")


class PathEntry(PathShapeEntry):
    """Exactly one path, its projection onto the part, and how the tool is held to the walls beside it."""

    model_config: ClassVar[ConfigDict] = ConfigDict(serialize_by_alias=True)

    walls: dict[Name, WallChoice] | None = setting(
        None,
        "One or two walls beside the path by name, each with its outward normal in the part frame: a direction, or "
        "surface for that of the part under a projected path, or left or right for one that stands upright on the "
        "other wall, on that side of travel. When absent a projected path has the one wall surface.",
        min_length=1,
        max_length=MOST_WALLS,
    )
    from_: Name | None = Field(
        default=None,
        alias="from",
        description="Wall that the work angle is measured from; required where there are two.",
    )
    work_deg: WorkAngle | None = setting(
        None,
        "Work angle: between the tool and the perpendicular to the wall under from, across the seam, towards the open "
        "side, away from the other wall: 45 for a fillet, 0 for a butt joint. Beside one wall, or two that face alike, "
        "it is positive to the left of travel, seen against the normal. 0 when absent and another angle is given; "
        "halfway between both walls along edges.",
    )
    push_deg: TravelAngle | None = setting(
        None,
        "Travel angle of a tool that points along travel: between the tool and the perpendicular to the seam. Excludes "
        "drag_deg; 0 when both are absent.",
    )
    drag_deg: TravelAngle | None = setting(None, "Travel angle of a tool that points against travel.")
    standoff_mm: Annotated[Mm, Within(ge=0.0, le=FARTHEST_MM)] | None = setting(
        None, "Distance of the tool tip from the path, against the tool's own axis; 0 when absent."
    )
    rod_from_walls_mm: Annotated[Mm, Within(ge=0.0, le=FARTHEST_MM)] | None = setting(
        None,
        "Least distance of the rod of the tool from the walls, as planes through the path, 0 when absent; of a tool "
        "without a rod that of all its solids, which are not judged when absent.",
    )
    side_mm: Shift | None = setting(
        None,
        "Distance of a pass from the path, across the weld face between the walls: positive towards the wall toward, "
        "or to the left of travel beside one wall.",
    )
    out_mm: Shift | None = setting(None, "Distance of a pass from the path, out of the part between the walls.")
    toward: Name | None = setting(None, "Wall that side_mm is positive towards; when absent the other one than from.")
    from_mm: Length | None = setting(None, "Length of the path, as it is drawn, at which it is begun; 0 when absent.")
    to_mm: Length | None = setting(None, "Length of the path at which it ends; its whole length when absent.")
    reverse: bool | None = setting(
        None, "Whether it is run along from its end to its begin. Walls stay where they are as it is drawn; push stays."
    )
    overlap_mm: Length | None = setting(None, "Length by which a closed path goes on past its start.")
    back_mm: Length | None = setting(None, "Length by which the tool goes back at the end, held as it came.")

    weave: WeaveEntry | None = setting(
        None,
        "How the tool tip swings about the path. Where the controller of its robot has process statements with "
        "weave_mm, the controller weaves: the rows stay on the path, and side_mm must be weave_mm.",
    )

    @model_validator(mode="after")
    def _suits_part(self) -> Self:
        """How a tool is held along an outline or a raster follows from the normal of the part alone."""
        allowed = OF_OUTLINES if self.outline is not None else OF_RASTERS
        for key in self.seam_keys if self.outline is not None or self.raster is not None else ():
            if key not in allowed:
                what = (
                    f"an outline has {', '.join(allowed)}" if self.outline is not None else "a raster has standoff_mm"
                )
                raise rule(f"unexpected key, {what}; it is run as it is drawn", key)
        return self

    @model_validator(mode="after")
    def _has_its_walls(self) -> Self:
        """Angles have walls, walls have angles, and one of the walls is what the work angle is measured from."""
        if self.push_deg is not None and self.drag_deg is not None:
            raise rule("expected either push_deg or drag_deg, got both", "drag_deg")
        for key in self.seam_keys if self.smooth is not None and not self.is_programmed else ():
            if key not in OF_SMOOTHED:
                text = "unexpected key beside smooth, which smooths tool axes that are stated, not those held to walls"
                raise rule(text, key)
        if self.is_edge:
            self._require_no_walls()
            return self
        if not self.is_seam:
            return self
        names = self.wall_names
        if not names:
            raise rule(
                "missing, expected the walls beside the path, such as {floor: +z, web: -y}, or project: +z (or another "
                "side)",
                "walls",
            )
        if self.from_ is None and len(names) > 1:
            raise rule(f"missing, expected the wall that work_deg is measured from: {' or '.join(names)}", "from")
        for key, name in (("from", self.from_), ("toward", self.toward)):
            if name is not None and name not in names:
                raise rule(f"expected one of the walls {' and '.join(names)}, got '{name}'", key)
        walls = self.walls or {}
        for name, wall in walls.items():
            if wall == SURFACE and self.project is None:
                raise rule("expected a direction on a path without project, got surface", f"walls.{name}")
            if wall in SIDES and all(other in SIDES for other in walls.values()):
                raise rule(f"expected a wall beside it that is no side of travel, got {wall}", f"walls.{name}")
        return self

    @model_validator(mode="after")
    def _has_a_stretch(self) -> Self:
        """The begin before the end; past the start only goes what goes to the end."""
        if self.to_mm is not None and self.to_mm <= (self.from_mm or 0.0):
            raise rule(f"expected more than from_mm = {self.from_mm or 0.0:g}, got {self.to_mm:g}", "to_mm")
        if self.overlap_mm is not None and (self.from_mm is not None or self.to_mm is not None):
            raise rule("unexpected key beside from_mm and to_mm: a part of a path has two ends", "overlap_mm")
        return self

    def _require_no_walls(self) -> None:
        """Edges have the walls of their file; a work angle is measured from one of them."""
        if self.walls is not None:
            raise rule("unexpected key, edges have the walls of the STEP file", "walls")
        if self.work_deg is not None and self.from_ is None:
            text = (
                "missing, expected the wall that work_deg is measured from, by its name in the list of cellplan seams"
            )
            raise rule(text, "from")
        if self.from_ is not None and self.work_deg is None:
            raise rule("missing, expected the angle from the wall under from; leave both out for halfway", "work_deg")

    @property
    def seam_keys(self) -> tuple[str, ...]:
        """Names of the keys that say more than the shape and the place of the path."""
        more = {
            name: field for name, field in type(self).model_fields.items() if name not in PathShapeEntry.model_fields
        }
        return tuple(field.alias or name for name, field in more.items() if getattr(self, name) != field.default)

    @property
    def is_seam(self) -> bool:
        """Whether the tool is held to walls."""
        of_walls = self.walls, self.from_, self.toward
        distances = self.standoff_mm, self.side_mm, self.out_mm, self.rod_from_walls_mm
        return self.raster is None and any(
            it is not None for it in (*of_walls, *distances, self.work_deg, self.push_deg, self.drag_deg)
        )

    @property
    def wall_names(self) -> tuple[str, ...]:
        """Names of the walls beside it."""
        return tuple(self.walls or ()) or ((SURFACE,) if self.project or self.on else ())
