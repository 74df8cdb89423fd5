"""Building blocks of all files: strict entries, numbers with bounds, poses, directions and choices."""

from typing import Annotated, Any, ClassVar, Final, Literal, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    StringConstraints,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError

from cellplan.geometry.transforms import Array, pose
from cellplan.model.settings.units import Deg, Mm, MmPerS, Within, in_si

NAME_PATTERN: Final = "^[A-Za-z0-9_][A-Za-z0-9_-]{0,39}$"
NAME_WORDS: Final = "a name of 1 to 40 letters, digits, '_' or '-' that does not start with '-'"

DIRECTION_WORDS: Final = "+x, -x, +y, -y, +z, -z or a direction [x, y, z]"

FARTHEST_MM: Final = 100_000.0  # nothing in a cell is farther away than 100 m
THINNEST_MM: Final = 0.001  # nothing solid is thinner than a micrometre
FASTEST_MM_S: Final = 10_000.0  # 10 m/s: faster is a wrong unit
LARGEST_FRAME_DEG: Final = 720.0  # two turns: more in the pose of a frame is a wrong unit
LARGEST_TURN_DEG: Final = 3_600.0  # ten turns: more is a wrong unit

Name = Annotated[str, StringConstraints(pattern=NAME_PATTERN)]
Coordinate = Annotated[Mm, Within(ge=-FARTHEST_MM, le=FARTHEST_MM)]
Size = Annotated[Mm, Within(ge=THINNEST_MM, le=FARTHEST_MM)]
Angle = Annotated[Deg, Within(ge=-LARGEST_TURN_DEG, le=LARGEST_TURN_DEG)]
SlidingSpeed = Annotated[MmPerS, Within(gt=0.0, le=FASTEST_MM_S)]

Coordinates = tuple[Coordinate, Coordinate, Coordinate]
PlaneCoordinates = tuple[Coordinate, Coordinate]
FrameAngle = Annotated[Deg, Within(ge=-LARGEST_FRAME_DEG, le=LARGEST_FRAME_DEG)]
Angles = tuple[FrameAngle, FrameAngle, FrameAngle]
ORIGIN: Final = (Mm(0.0), Mm(0.0), Mm(0.0))
NOT_TURNED: Final = (Deg(0.0), Deg(0.0), Deg(0.0))

Default = TypeVar("Default")

SHORTEST_DIRECTION: Final = 1e-6  # [-] a shorter vector has no direction


def setting(default: Default, description: str, **options: Any) -> Default:
    """A key that may be left out: what then holds, and what the key means."""
    return Field(default=default, description=description, **options)


def rule(text: str, key: str = "") -> PydanticCustomError:
    """Finding of a rule between several keys; ``key`` is added to the path of the entry that is checked."""
    return PydanticCustomError("rule", "{text}", {"text": text, "key": key})


def _one_line(text: str) -> str:
    """Text with all white space as single blanks."""
    words = " ".join(text.split())
    if not words:
        raise rule("expected some text, got an empty one")
    return words


def _has_words(text: str) -> str:
    """Refuse signs without a word: a reason is repeated in reports, for people to judge."""
    if not any(character.isalpha() for character in text):
        raise rule(f"expected a reason in words, got '{text}'")
    return text


def _has_direction(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    """Refuse a vector too short to point anywhere."""
    if sum(component * component for component in vector) < SHORTEST_DIRECTION**2:
        raise rule("expected a direction that is not zero, got a vector of no length")
    return vector


Text = Annotated[str, AfterValidator(_one_line)]
Reason = Annotated[Text, AfterValidator(_has_words)]
Component = Annotated[float, Field(ge=-1e6, le=1e6)]
Vector = Annotated[tuple[Component, Component, Component], AfterValidator(_has_direction)]
AxisName = Literal["x", "y", "z"]
SignedAxis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


def require_unique(words: tuple[str, ...], key: str) -> None:
    """Refuse a list that names something twice."""
    for index, word in enumerate(words):
        if word in words[:index]:
            raise rule(f"expected each word once, got '{word}' twice", f"{key}[{index}]")


def by_kind(words: str, **kinds: type | tuple[type, ...]) -> Discriminator:
    """Choice by the kind of value: a text takes the branch tagged ``<words>``, others the branch tagged by kind.

    The words say what is allowed; they are a tag so that findings can say it. Tags of kinds come without brackets.
    """

    def tag(value: object) -> str | None:
        """Tag of the branch that a value belongs to."""
        if isinstance(value, str):
            return f"<{words}>"
        value_type = dict if isinstance(value, BaseModel) else type(value)
        for name, kind in kinds.items():
            if issubclass(value_type, kind) and (value_type is bool) == (kind is bool):
                return f"<{name}>"
        return None

    return Discriminator(tag, custom_error_type="choice", custom_error_message=words)


Direction = Annotated[
    Annotated[SignedAxis, Tag(f"<{DIRECTION_WORDS}>")] | Annotated[Vector, Tag("<list>")],
    by_kind(DIRECTION_WORDS, list=tuple),
]


class Entry(BaseModel):
    """A mapping of a file: unknown keys, converted types and numbers that are not finite are refused."""

    model_config: ClassVar[ConfigDict] = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @classmethod
    def __pydantic_init_subclass__(cls, **settings: Any) -> None:
        """Let ``help`` list the keys with what they mean."""
        keys = [f"    {key}: {field.description or ''}" for key, field in cls.model_fields.items()]
        cls.__doc__ = "\n".join([cls.__doc__ or "", "", "Attributes:", *keys])

    def changed(self, **values: Any) -> Self:
        """The entry with other values, which are validated like those of a file."""
        return type(self).model_validate({**dict(self), **values})


class OneOf(Entry):
    """Base of entries that give exactly one of some keys, which are None where they are not given."""

    alternatives: ClassVar[tuple[str, ...]] = ()
    model_config: ClassVar[ConfigDict] = ConfigDict(
        json_schema_extra=lambda schema, entry: schema.update(oneOf=[{"required": [key]} for key in entry.alternatives])
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        """Exactly one of the keys."""
        given = [key for key in self.alternatives if getattr(self, key) is not None]
        if len(given) != 1:
            keys = ", ".join(self.alternatives)
            raise rule(f"expected exactly one of the keys {keys}, got {' and '.join(given) or 'none'}")
        return self


class PoseEntry(Entry):
    """A pose: where a frame stands and how it is turned."""

    xyz_mm: Coordinates = setting(ORIGIN, "Position.")
    rpy_deg: Angles = setting(
        NOT_TURNED, "Roll, pitch and yaw about fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF."
    )

    @property
    def matrix(self) -> Array:
        """The pose in [m] and [rad], shape (4, 4)."""
        return pose(in_si(self.xyz_mm), in_si(self.rpy_deg))
