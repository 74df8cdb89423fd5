"""Errors of the real cell: joint zeros, link lengths, bases, tools, grasps, and the noise of the measuring system."""

from typing import Annotated, ClassVar, Final, Literal

from pydantic import ConfigDict, Field, Tag, model_validator

from cellplan.io.schema.common import Entry, Name, by_kind, one_of_keys, require_one
from cellplan.io.schema.solver import LARGEST_SEED

LARGEST_SHIFT_MM: Final = 1_000.0  # an error of a metre is a slip of the unit
LARGEST_TURN_ERROR_DEG: Final = 45.0  # likewise an eighth of a turn
TRIAL_LIMIT: Final = 10_000
AMOUNT_WORDS: Final = "a number, {normal: NUMBER} or {uniform: NUMBER}"
SPREADS: Final = ("normal", "uniform")

Shift = Annotated[float, Field(ge=-LARGEST_SHIFT_MM, le=LARGEST_SHIFT_MM)]
Turn = Annotated[float, Field(ge=-LARGEST_TURN_ERROR_DEG, le=LARGEST_TURN_ERROR_DEG)]
ShiftWidth = Annotated[float, Field(ge=0.0, le=LARGEST_SHIFT_MM)]
TurnWidth = Annotated[float, Field(ge=0.0, le=LARGEST_TURN_ERROR_DEG)]


class ShiftSpreadEntry(Entry):
    """A length that differs from trial to trial, zero on average."""

    model_config: ClassVar[ConfigDict] = ConfigDict(json_schema_extra=one_of_keys(*SPREADS))

    normal: ShiftWidth | None = Field(default=None, description="Standard deviation of a normal distribution.")
    uniform: ShiftWidth | None = Field(default=None, description="Half width of a uniform distribution.")

    @model_validator(mode="after")
    def _is_one_spread(self) -> "ShiftSpreadEntry":
        """Exactly one distribution."""
        require_one(self, SPREADS)
        return self


class TurnSpreadEntry(Entry):
    """An angle that differs from trial to trial, zero on average."""

    model_config: ClassVar[ConfigDict] = ConfigDict(json_schema_extra=one_of_keys(*SPREADS))

    normal: TurnWidth | None = Field(default=None, description="Standard deviation of a normal distribution.")
    uniform: TurnWidth | None = Field(default=None, description="Half width of a uniform distribution.")

    @model_validator(mode="after")
    def _is_one_spread(self) -> "TurnSpreadEntry":
        """Exactly one distribution."""
        require_one(self, SPREADS)
        return self


ShiftAmount = Annotated[
    Annotated[Shift, Tag("<number>")] | Annotated[ShiftSpreadEntry, Tag("<mapping>")],
    by_kind(AMOUNT_WORDS, number=(int, float), mapping=dict),
]
TurnAmount = Annotated[
    Annotated[Turn, Tag("<number>")] | Annotated[TurnSpreadEntry, Tag("<mapping>")],
    by_kind(AMOUNT_WORDS, number=(int, float), mapping=dict),
]


class PoseErrorEntry(Entry):
    """Pose of a real frame seen from the one that the cell names."""

    xyz_mm: tuple[ShiftAmount, ShiftAmount, ShiftAmount] = Field(default=(0.0, 0.0, 0.0), description="Position.")
    rpy_deg: tuple[TurnAmount, TurnAmount, TurnAmount] = Field(
        default=(0.0, 0.0, 0.0), description="Roll, pitch and yaw about fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll)."
    )


class RobotErrorsEntry(Entry):
    """How one robot differs from its data sheet and its place."""

    joint_offsets_deg: dict[str, TurnAmount] = Field(
        default={}, description="Real less told angle of revolute joints, by joint name."
    )
    joint_offsets_mm: dict[str, ShiftAmount] = Field(
        default={}, description="Real less told position of prismatic joints, by joint name."
    )
    link_lengths_mm: dict[str, ShiftAmount] = Field(
        default={},
        description="By how much the link before a joint is longer: the joint's axis point, and everything after it, "
        "moves away from the axis point of the joint before (from the base frame's origin for the first joint).",
    )
    base: PoseErrorEntry = Field(default=PoseErrorEntry(), description="The real base seen from the written one.")
    tool: PoseErrorEntry = Field(
        default=PoseErrorEntry(), description="The real tool tip seen from the written one, z out of the tool."
    )


class MeasurementEntry(Entry):
    """The measuring system that looks at the tools on the part."""

    position_noise_mm: ShiftWidth = Field(
        default=0.0, description="Standard deviation of each measured coordinate of a tool tip."
    )
    orientation_noise_deg: TurnWidth = Field(
        default=0.0, description="Standard deviation of each measured small turn about the part's axes."
    )


class ErrorsDocument(Entry):
    """A whole errors file."""

    cellplan_errors: Literal[1] = Field(description="Version of the format.")
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = Field(default=0, description="Seed of all draws.")
    trials: Annotated[int, Field(ge=1, le=TRIAL_LIMIT)] = Field(
        default=1, description="Number of real cells that are drawn, where an amount is a distribution."
    )
    robots: dict[Name, RobotErrorsEntry] = Field(
        default={}, description="Errors of the cell's robots by name; a robot that is not named is exact."
    )
    grasp: dict[Name, PoseErrorEntry] = Field(
        default={},
        description="The real part seen from where it should sit, by the name of the robot that holds it.",
    )
    measurement: MeasurementEntry = Field(default=MeasurementEntry(), description="Noise of the measuring system.")
