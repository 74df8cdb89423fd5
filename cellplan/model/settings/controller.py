"""How the controller of a robot counts its joints, as a robot file states it, or a file beside a URDF."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, model_validator

from cellplan.model.settings.entry import Angle, Coordinate, Entry, Text, rule

LARGEST_FACTOR: Final = 1_000.0  # [-] a larger coupling is a mistake

Factor = Annotated[float, Field(ge=-LARGEST_FACTOR, le=LARGEST_FACTOR)]


class ControllerZeroEntry(Entry):
    """Joint positions of the controller: sign * model + zero + sum of factor * controller position of another joint."""

    zero_deg: dict[str, Angle] = Field(
        default={},
        description="By revolute joint, what the controller shows while the model reads zero; 0 when absent.",
    )
    zero_mm: dict[str, Coordinate] = Field(
        default={},
        description="By prismatic joint, what the controller shows while the model reads zero; 0 when absent.",
    )
    sign: dict[str, Literal[1, -1]] = Field(
        default={}, description="By joint, -1 where the controller counts the other way round; 1 when absent."
    )
    coupling: dict[str, dict[str, Factor]] = Field(
        default={},
        description="By joint, the factors of the controller positions of earlier joints of its kind that are added.",
    )
    limits_deg: dict[str, tuple[Angle, Angle]] = Field(
        default={},
        description="By revolute joint, the smallest and the largest position that the controller allows of what it "
        "shows: of a coupled joint too, whose range in the model depends on the others.",
    )
    source: Text = Field(default="not stated", description="Where this is known from.")

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        """An empty entry would confirm a counting that was never stated."""
        if not self.model_fields_set:
            raise rule("expected zero_deg, zero_mm, sign or coupling, or the source that says there are none, got none")
        return self
