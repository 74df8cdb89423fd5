"""What a layout search may change, as written in a cell file."""

from typing import Annotated, ClassVar, Final, Literal, Self

from pydantic import Field, Tag, WithJsonSchema, model_validator

from cellplan.model.settings.entry import Coordinate, Entry, Name, OneOf, PoseEntry, Size, Text, by_kind, rule, setting
from cellplan.model.settings.units import Deg, Mm, Within

ITEM_LIMIT: Final = 1000
FARTHEST: Final = 1e6  # in the unit of the key
RANGE_WORDS: Final = "a range [low, high] or a number"
ITEM_WORDS: Final = "a name, a number or a range [low, high]"
VARY_WORDS: Final = "true, a mapping of ranges, or a list"
NAMED: Final = {"type": "string"}
NUMBER: Final = {"type": "number"}
PAIR: Final = {"type": "array", "prefixItems": [NUMBER, NUMBER], "minItems": 2, "maxItems": 2}
BY_KEY: Final = {"type": "object", "additionalProperties": {"anyOf": [PAIR, {"type": "integer"}]}}

Number = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST)]
Range = tuple[Number, Number]
RangeChoice = Annotated[
    Annotated[int, Tag("<number>")] | Annotated[Range, Tag("<list>")], by_kind(RANGE_WORDS, number=int, list=tuple)
]
ItemChoice = Annotated[
    Annotated[Name, Tag(f"<{ITEM_WORDS}>")] | Annotated[Number, Tag("<number>")] | Annotated[Range, Tag("<list>")],
    by_kind(ITEM_WORDS, number=(int, float), list=tuple),
]
VaryChoice = Annotated[
    Annotated[Literal[True], Tag(f"<{VARY_WORDS}>")]
    | Annotated[dict[str, RangeChoice], Tag("<mapping>")]
    | Annotated[tuple[ItemChoice, ...], Tag("<list>")],
    by_kind(VARY_WORDS, **{VARY_WORDS: bool}, mapping=dict, list=tuple),
    WithJsonSchema({"anyOf": [{"const": True}, BY_KEY, {"type": "array", "items": {"anyOf": [NAMED, NUMBER, PAIR]}}]}),
]


class MirroredEntry(Entry):
    """Two bases of which the second is the mirror image of the first."""

    bases: tuple[Text, Text] = Field(description="Two addresses ROBOT.base.")
    plane: Literal["xz", "yz"] = Field(description="Plane of the mirror, upright in the world.")
    at_mm: Coordinate = setting(Mm(0.0), "Where the plane stands: its y (xz) or its x (yz).")

    @model_validator(mode="after")
    def _are_two(self) -> Self:
        """Two different bases."""
        if self.bases[0] == self.bases[1]:
            raise rule(f"expected two different bases, got '{self.bases[0]}' twice", "bases[1]")
        return self


class KeepOutBoxEntry(Entry):
    """A box seen from above."""

    size_mm: tuple[Size, ...] = Field(
        min_length=2,
        max_length=3,
        description="Edge lengths along x and y; one along z may follow, and does not count.",
    )


class KeepOutCylinderEntry(Entry):
    """A round area."""

    radius_mm: Size = Field(description="Radius.")


class KeepOutEntry(OneOf):
    """A floor area without robots, at any height: exactly one of box and cylinder."""

    alternatives: ClassVar[tuple[str, ...]] = ("box", "cylinder")

    box: KeepOutBoxEntry | None = setting(None, "Rectangle, centred on its pose.")
    cylinder: KeepOutCylinderEntry | None = setting(None, "Circle, centred on its pose.")
    at: PoseEntry = setting(PoseEntry(), "Pose in the world: x, y and yaw count.")

    @model_validator(mode="after")
    def _stands_upright(self) -> Self:
        """An area of the floor has its heading only."""
        for index, word in enumerate(("roll", "pitch")):
            if self.at.rpy_deg[index]:
                raise rule(f"expected 0, as an area of the floor has no {word}", f"at.rpy_deg[{index}]")
        return self


class FloorEntry(Entry):
    """Where the bases of all robots that may move must stay."""

    x_mm: tuple[Coordinate, Coordinate] | None = setting(None, "Lowest and highest x.")
    y_mm: tuple[Coordinate, Coordinate] | None = setting(None, "Lowest and highest y.")

    @model_validator(mode="after")
    def _is_ordered(self) -> Self:
        """Low before high."""
        for key in ("x_mm", "y_mm"):
            bounds = getattr(self, key)
            if bounds is not None and not bounds[0] < bounds[1]:
                raise rule(f"expected a number above {bounds[0]:g}, got {bounds[1]:g}", f"{key}[1]")
        return self


class MisplacementEntry(Entry):
    """By how much every base may be off its place."""

    position_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] = Field(description="Along each axis of the world.")
    orientation_deg: Annotated[Deg, Within(gt=0.0, le=45.0)] = Field(
        description="About the vertical through the origin of the base."
    )


class LayoutEntry(Entry):
    """What a layout search may change; addresses are those of the file, `robots.` may be left out."""

    vary: dict[str, VaryChoice] | None = setting(
        None,
        "Variables by address. ROBOT.base: {x_mm: [low, high], y_mm, z_mm, roll_deg, pitch_deg, yaw_deg}; "
        "ROBOT.start_deg: true or one range per joint (ROBOT.start by key where joints slide); ROBOT.tool: "
        "{length_mm, tilt_deg, roll_deg} of a tool with rod; ROBOT.weights: true or [low, high]; ROBOT.path: true or "
        "{coefficients: 14, degree: 5}; null_space: likewise, motion of all robots in the null space of the tasks; "
        "ROBOT.branch: true; tasks.TASK.spin_deg: true or [low, high]; "
        "tasks.TASK.robot: [ROBOT, …]; part.held_by[0].at, part.at: ranges as of a base; motion.mode: [MODE, …]. When "
        "absent: the bases of all operators (x and y within 1 m, and from beyond 2.5 m on to 0.5 m from the first "
        "holder or the part at rest; z between 0 and 600 mm unless they stand on a floor; any yaw), that of the first "
        "holder likewise where program has attach or detach, and its start posture.",
        max_length=ITEM_LIMIT,
    )
    fixed: tuple[Text, ...] = setting((), "Addresses that stay as they are, whatever vary says.", max_length=ITEM_LIMIT)
    equal: tuple[tuple[Text, ...], ...] = setting(
        (), "Lists of addresses of variables that have one value.", max_length=ITEM_LIMIT
    )
    mirrored: tuple[MirroredEntry, ...] = setting(
        (), "Pairs of bases that are placed symmetrically.", max_length=ITEM_LIMIT
    )
    keep_out: dict[Name, KeepOutEntry] = setting(
        {}, "Areas in which no base and no pedestal of a varied base stands.", max_length=ITEM_LIMIT
    )
    floor: FloorEntry | None = setting(None, "Where the origins of all varied bases must stay.")
    margin_deg: Annotated[Deg, Within(ge=0.0, le=180.0)] = setting(
        Deg(0.0), "Distance from its limits that every turning joint is to keep."
    )
    margin_mm: Annotated[Mm, Within(ge=0.0, le=10_000.0)] = setting(
        Mm(0.0), "Distance from its limits that every sliding joint is to keep."
    )
    singular_share: Annotated[float, Field(ge=0.0, le=1.0)] | None = setting(
        None,
        "Least singular value of the Jacobian of every arm at its tool tip, in m and rad, that is to be kept, as a "
        "share of the median over all its configurations; 0 for none. When absent: 0.1 as far as the job allows it, "
        "where the shortest cycle is sought.",
    )
    misplacement: MisplacementEntry | None = setting(
        None,
        "All demands are to be kept, and the cycle to be reached, with every base off by so much and the motion "
        "planned anew.",
    )
    cost: dict[str, Annotated[float, Field(ge=0.0, le=1e6)]] = setting(
        {},
        "Cost by address of a change by 100 mm or 10 deg, or of a weight by a factor of 10; else 1.",
        max_length=ITEM_LIMIT,
    )
