"""Solver of a cell: method, gains, secondary goals and joint weights that change along the motion."""

from typing import Annotated, Final, Literal

from pydantic import Field, Tag

from cellplan.io.schema.robot import JointPosition
from cellplan.model.settings.entry import Entry, Name, by_kind
from cellplan.model.settings.solver import (
    LARGEST_SEED,
    DampedLeastSquaresEntry,
    FilteredInverseEntry,
    Gain,
    QuadraticProgramEntry,
    SearchEntry,
    WeightingEntry,
)
from cellplan.model.settings.units import Mm, Within
from cellplan.model.solver import MethodName

DAMPING_WORDS: Final = "auto or a number of at least 0"

DampingChoice = Annotated[
    Annotated[Literal["auto"], Tag(f"<{DAMPING_WORDS}>")]
    | Annotated[Annotated[float, Field(ge=0.0, le=1e6)], Tag("<number>")],
    by_kind(DAMPING_WORDS, number=(int, float)),
]


class ManipulabilityGoalEntry(Entry):
    """Away from singularities."""

    gain: Gain = Field(default=1.0, description="Gain in rad^2/s per unit of log manipulability.")


class JointLimitsGoalEntry(Entry):
    """Towards the middle of the joint ranges."""

    gain: Gain = Field(
        default=100.0,
        description="Gain in rad^2/s: a joint of range r in an arm of n joints returns at the rate gain / (n r^2).",
    )


class ObstacleGoalEntry(Entry):
    """Distance from obstacles and from other robots."""

    gain: Gain = Field(default=0.1, description="Gain in rad^2/s.")
    within_mm: Annotated[Mm, Within(gt=0.0, le=10_000.0)] = Field(
        default=Mm(200.0), description="Distance below which bodies repel each other."
    )


class ConfigurationGoalEntry(Entry):
    """A desired configuration."""

    gain: Gain = Field(default=1.0, description="Gain in 1/s: the rate at which a joint of weight 1 approaches it.")
    at: dict[Name, dict[str, JointPosition]] = Field(
        default={}, description="Reference positions by robot, one key per joint; robots left out: their start posture."
    )


class SecondaryEntry(Entry):
    """Goals in the null space of the tasks."""

    manipulability: ManipulabilityGoalEntry | None = Field(default=None, description="Away from singularities.")
    joint_limits: JointLimitsGoalEntry | None = Field(
        default=None, description="Towards the middle of the joint ranges."
    )
    obstacles: ObstacleGoalEntry | None = Field(default=None, description="Away from obstacles and other robots.")
    posture: ConfigurationGoalEntry | None = Field(default=None, description="Towards a desired configuration.")


class SolverEntry(Entry):
    """Resolution method, integrator and their settings."""

    method: MethodName = Field(
        default="weighted_pseudo_inverse", description='Resolution method; the guide "Which method when" compares them.'
    )
    integrator: Literal["auto", "accurate", "euler"] = Field(
        default="auto",
        description="How joint velocities become positions: accurate finds joint polynomials whose tool error between "
        "all nodes is below accuracy_mm, euler steps along the clock and feeds the pose error back. accurate requires "
        "weighted_pseudo_inverse; gain_per_s and damping do not apply to it. auto is accurate with that method, else "
        "euler.",
    )
    accuracy_mm: Annotated[Mm, Within(ge=1e-9, le=1.0)] = Field(
        default=Mm(1e-4),
        description="Largest tool error between the nodes of the accurate mode; for angles the same number in "
        "milliradians. euler does not use it.",
    )
    gain_per_s: Gain | None = Field(
        default=None,
        description="Gain of the pose-error feedback; 0.5 / step_s when absent. gain_per_s * step_s is below 2. "
        "Applies to Euler's steps, also where the accurate mode falls back to them.",
    )
    damping: DampingChoice = Field(
        default="auto",
        description="Largest damping factor, or with `measure: manipulability` its square; auto: from the smallest "
        "singular value, 0: no damping. Applies to Euler's steps, also where the accurate mode falls back to them.",
    )
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = Field(default=0, description="Seed of every random search.")
    damped_least_squares: DampedLeastSquaresEntry = Field(
        default=DampedLeastSquaresEntry(), description="Settings of that method."
    )
    filtered_inverse: FilteredInverseEntry = Field(
        default=FilteredInverseEntry(), description="Settings of both filtered inverses."
    )
    search: SearchEntry = Field(default=SearchEntry(), description="Settings of both searches.")
    quadratic_program: QuadraticProgramEntry = Field(
        default=QuadraticProgramEntry(), description="Settings of that method."
    )
    weighting: WeightingEntry = Field(
        default=WeightingEntry(), description="Joint weights that change along the motion."
    )
    secondary: SecondaryEntry = Field(default=SecondaryEntry(), description="Goals in the null space of the tasks.")
