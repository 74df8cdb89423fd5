"""Errors of the real cell: joint zeros, link lengths, bases, tools, grasps; its measuring system and its drives."""

from typing import Annotated, ClassVar, Final, Literal

from pydantic import Field, Tag

from cellplan.model.settings.entry import NOT_TURNED, ORIGIN, Entry, Name, OneOf, PoseEntry, by_kind, setting
from cellplan.model.settings.simulation import SampleTime, SimulationEntry
from cellplan.model.settings.solver import LARGEST_SEED
from cellplan.model.settings.units import Deg, Mm, Quantity, Within

LARGEST_SHIFT_MM: Final = 1_000.0  # an error of a metre is a wrong unit
LARGEST_TURN_ERROR_DEG: Final = 45.0  # likewise an eighth of a turn
TRIAL_LIMIT: Final = 10_000
MOST_PIXELS: Final = 1e6
AMOUNT_WORDS: Final = "a number, {normal: NUMBER} or {uniform: NUMBER}"

Focal = Annotated[float, Field(gt=0.0, le=MOST_PIXELS)]
Pixels = Annotated[float, Field(ge=-MOST_PIXELS, le=MOST_PIXELS)]
Shift = Annotated[Mm, Within(ge=-LARGEST_SHIFT_MM, le=LARGEST_SHIFT_MM)]
Turn = Annotated[Deg, Within(ge=-LARGEST_TURN_ERROR_DEG, le=LARGEST_TURN_ERROR_DEG)]
ShiftWidth = Annotated[Mm, Within(ge=0.0, le=LARGEST_SHIFT_MM)]
TurnWidth = Annotated[Deg, Within(ge=0.0, le=LARGEST_TURN_ERROR_DEG)]


class Spread(OneOf):
    """An amount that varies from trial to trial, with mean zero."""

    alternatives: ClassVar[tuple[str, ...]] = ("normal", "uniform")

    normal: Quantity | None
    uniform: Quantity | None


class ShiftSpreadEntry(Spread):
    """A length that varies from trial to trial, with mean zero."""

    normal: ShiftWidth | None = setting(None, "Standard deviation of a normal distribution.")
    uniform: ShiftWidth | None = setting(None, "Half width of a uniform distribution.")


class TurnSpreadEntry(Spread):
    """An angle that varies from trial to trial, with mean zero."""

    normal: TurnWidth | None = setting(None, "Standard deviation of a normal distribution.")
    uniform: TurnWidth | None = setting(None, "Half width of a uniform distribution.")


ShiftAmount = Annotated[
    Annotated[Shift, Tag("<number>")] | Annotated[ShiftSpreadEntry, Tag("<mapping>")],
    by_kind(AMOUNT_WORDS, number=(int, float), mapping=dict),
]
TurnAmount = Annotated[
    Annotated[Turn, Tag("<number>")] | Annotated[TurnSpreadEntry, Tag("<mapping>")],
    by_kind(AMOUNT_WORDS, number=(int, float), mapping=dict),
]
Amount = Quantity | Spread


class PoseErrorEntry(Entry):
    """Pose of an actual frame in the nominal one."""

    xyz_mm: tuple[ShiftAmount, ShiftAmount, ShiftAmount] = setting(ORIGIN, "Position.")
    rpy_deg: tuple[TurnAmount, TurnAmount, TurnAmount] = setting(
        NOT_TURNED, "Roll, pitch and yaw about fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll)."
    )


class RobotErrorsEntry(Entry):
    """Deviations of one robot from its data sheet and its pose."""

    joint_offsets_deg: dict[str, TurnAmount] = setting(
        {}, "Actual minus commanded angle of revolute joints, by joint name."
    )
    joint_offsets_mm: dict[str, ShiftAmount] = setting(
        {}, "Actual minus commanded position of prismatic joints, by joint name."
    )
    link_lengths_mm: dict[str, ShiftAmount] = setting(
        {},
        "Excess length of the link before a joint: the joint's axis point, and everything after it, moves away from "
        "the axis point of the joint before (from the base frame's origin for the first joint).",
    )
    base: PoseErrorEntry = setting(PoseErrorEntry(), "Pose of the actual base in the nominal base frame.")
    tool: PoseErrorEntry = setting(
        PoseErrorEntry(), "Pose of the actual tool tip in the nominal tool frame, z out of the tool."
    )

    @property
    def joint_offsets(self) -> dict[str, Amount]:
        """Actual minus commanded joint position, by joint name."""
        return {**self.joint_offsets_deg, **self.joint_offsets_mm}


class CameraModelEntry(Entry):
    """A camera without distortion: a point at (x, y, z) in its frame is seen at ``centre + focal (x, y) / z``."""

    focal_px: tuple[Focal, Focal] = Field(description="Focal length in columns and in rows.")
    centre_px: tuple[Pixels, Pixels] = setting((0.0, 0.0), "Column and row of the optical axis.")
    at: PoseEntry = Field(description="Pose in the world: z along the view, x along the rows, y down the columns.")


class CameraEntry(CameraModelEntry):
    """A camera beside the cell that sees the tips of the tools and their desired places."""

    believed: CameraModelEntry | None = setting(
        None, "What corrections take it for; when absent, what it is. Only differences of pixels are used."
    )
    noise_px: Annotated[float, Field(ge=0.0, le=MOST_PIXELS)] = setting(
        0.0, "Standard deviation of column and row of a tip."
    )


class MeasurementEntry(Entry):
    """The measuring system that measures the tools relative to the part."""

    camera: CameraEntry | None = setting(
        None, "Measures positions across its view only, in place of a system that measures poses."
    )
    period_ms: SampleTime | None = setting(
        None, "Time between two measurements within a pass; when absent, that of the samples."
    )
    share: Annotated[float, Field(gt=0.0, le=1.0)] = setting(
        1.0, "Part of a measured error that is corrected at once within a pass."
    )
    position_noise_mm: ShiftWidth = setting(Mm(0.0), "Standard deviation of each measured coordinate of a tool tip.")
    orientation_noise_deg: TurnWidth = setting(
        Deg(0.0), "Standard deviation of each measured small turn about the part's axes."
    )


class ErrorsDocument(Entry):
    """A whole errors file."""

    cellplan_errors: Literal[1] = Field(description="Version of the format.")
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = setting(0, "Seed of all samples.")
    trials: Annotated[int, Field(ge=1, le=TRIAL_LIMIT)] = setting(
        1, "Number of sampled cells, where an amount is a distribution."
    )
    robots: dict[Name, RobotErrorsEntry] = setting(
        {}, "Errors of the cell's robots by name; a robot that is not named is exact."
    )
    grasp: dict[Name, PoseErrorEntry] = setting(
        {}, "Pose of the actual part in the nominal part frame, by the name of the robot that holds it."
    )
    measurement: MeasurementEntry = setting(MeasurementEntry(), "The measuring system.")
    simulation: SimulationEntry | None = setting(
        None, "Arms with masses and joint controllers; when absent, joints reach exactly what they are commanded."
    )
