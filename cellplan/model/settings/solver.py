"""Solver of a cell: method, gains, secondary goals and joint weights that change along the motion."""

from typing import Annotated, Final, Literal, Self

from pydantic import Field, Tag

from cellplan.model.settings.entry import Entry, Name, Text, by_kind, setting
from cellplan.model.settings.robot import JointPosition
from cellplan.model.settings.units import Mm, Within
from cellplan.model.solver import METHODS, MethodName, MethodTraits

LARGEST_SEED: Final = 2**32 - 1
MOST_ROUNDS: Final = 1_000_000
HALF_FEEDBACK: Final = 0.5  # gain_per_s * step_s by default: a quarter of the stability limit of Euler's steps
Gain = Annotated[float, Field(gt=0.0, le=1e9)]
DAMPING_WORDS: Final = "auto or a number of at least 0"

DampingChoice = Annotated[
    Annotated[Literal["auto"], Tag(f"<{DAMPING_WORDS}>")]
    | Annotated[Annotated[float, Field(ge=0.0, le=1e6)], Tag("<number>")],
    by_kind(DAMPING_WORDS, number=(int, float)),
]


class DampedLeastSquaresEntry(Entry):
    """Where the damping of `damped_least_squares` sets in; how large it becomes is stated by `damping`."""

    measure: Literal["singular_value", "manipulability"] = setting(
        "singular_value", "Measure of the distance from a singularity."
    )
    region: Annotated[float, Field(gt=0.0, le=1e6)] = setting(
        0.02,
        "Value of the measure below which damping sets in; with `damping: auto` and singular values the largest "
        "damping factor as well.",
    )
    shape_gain: bool = setting(False, "Whether the feedback gain falls near a singularity.")


class FilteredInverseEntry(Entry):
    """Settings of `filtered_inverse` and `filtered_inverse_ii`."""

    gain_per_s: Gain = setting(1000.0, "Update gain.")
    start: Literal["zero", "inverse"] = setting(
        "inverse", "Whether the filter starts at zero, as in the paper, or at the pseudo-inverse."
    )


class SearchJointEntry(Entry):
    """One joint of a sequence."""

    robot: Name = Field(description="Robot of the joint.")
    joint: Text = Field(description="The joint.")


class SearchEntry(Entry):
    """Settings of `heuristic_search` and `recursive_search`."""

    tolerance_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] = setting(
        Mm(1e-4), "Largest square root of the cost at which a sample counts as reached."
    )
    orientation_weight_m2: Annotated[float, Field(gt=0.0, le=1e6)] = setting(
        0.01, "Weight of the orientation in the cost."
    )
    rounds: Annotated[int, Field(ge=1, le=MOST_ROUNDS)] = setting(
        2000, "Rounds over all joints after which a sample counts as out of reach."
    )
    brakes: bool = setting(False, "Whether joints slow down near their limits.")
    sequence: tuple[SearchJointEntry, ...] | None = setting(
        None,
        "Joints in the order in which `recursive_search` moves them; all, robot by robot in the order of their names, "
        "when absent. Joints left out stand still.",
        min_length=1,
    )


class QuadraticProgramEntry(Entry):
    """Limits and slack of `quadratic_program`."""

    slack_weight: Annotated[float, Field(gt=0.0, le=1e12)] = setting(
        1e8, "Cost of the task's slack relative to that of weighted joint velocities."
    )
    ramp_s: Annotated[float, Field(gt=0.0, le=1e3)] | None = setting(
        None, "Time in which a joint without an acceleration limit reaches its velocity limit; absent: at once."
    )


class WeightingEntry(Entry):
    """Joint weights that change along the motion."""

    near_limits: Annotated[float, Field(ge=0.0, le=1e6)] = setting(
        0.0, "Gain of the weight that grows as a joint approaches a limit; 0: constant weights."
    )
    load: Annotated[float, Field(ge=0.0, le=1e6)] = setting(
        0.0, "Gain of the weight that grows with the gravity load of a joint; 0: constant weights."
    )


class ManipulabilityGoalEntry(Entry):
    """Away from singularities."""

    gain: Gain = setting(1.0, "Gain in rad^2/s per unit of log manipulability.")


class JointLimitsGoalEntry(Entry):
    """Towards the middle of the joint ranges."""

    gain: Gain = setting(
        100.0, "Gain in rad^2/s: a joint of range r in an arm of n joints returns at the rate gain / (n r^2)."
    )


class ObstacleGoalEntry(Entry):
    """Distance from obstacles and from other robots."""

    gain: Gain = setting(0.1, "Gain in rad^2/s.")
    within_mm: Annotated[Mm, Within(gt=0.0, le=10_000.0)] = setting(
        Mm(200.0), "Distance below which bodies repel each other."
    )


class ConfigurationGoalEntry(Entry):
    """A desired configuration."""

    gain: Gain = setting(1.0, "Gain in 1/s: the rate at which a joint of weight 1 approaches it.")
    at: dict[Name, dict[str, JointPosition]] = setting(
        {}, "Reference positions by robot, one key per joint; robots left out: their start posture."
    )


GoalEntry = ManipulabilityGoalEntry | JointLimitsGoalEntry | ObstacleGoalEntry | ConfigurationGoalEntry


class SecondaryEntry(Entry):
    """Goals in the null space of the tasks."""

    manipulability: ManipulabilityGoalEntry | None = setting(None, "Away from singularities.")
    joint_limits: JointLimitsGoalEntry | None = setting(None, "Towards the middle of the joint ranges.")
    obstacles: ObstacleGoalEntry | None = setting(None, "Away from obstacles and other robots.")
    posture: ConfigurationGoalEntry | None = setting(None, "Towards a desired configuration.")

    @property
    def goals(self) -> dict[str, GoalEntry]:
        """The goals that are given, by name."""
        return {name: goal for name, goal in self if goal is not None}


class SolverEntry(Entry):
    """Resolution method, integrator and their settings."""

    method: MethodName = setting(
        "weighted_pseudo_inverse", 'Resolution method; the guide "Which method when" compares them.'
    )
    integrator: Literal["auto", "accurate", "euler"] = setting(
        "auto",
        "How joint velocities become positions: accurate finds joint polynomials whose tool error between all nodes "
        "is below accuracy_mm, euler steps along the clock and feeds the pose error back. accurate requires "
        "weighted_pseudo_inverse; gain_per_s and damping do not apply to it. auto is accurate with that method, else "
        "euler.",
    )
    accuracy_mm: Annotated[Mm, Within(ge=1e-9, le=1.0)] = setting(
        Mm(1e-4),
        "Largest tool error between the nodes of the accurate mode; for angles the same number in milliradians. euler "
        "does not use it.",
    )
    gain_per_s: Gain | None = setting(
        None,
        "Gain of the pose-error feedback; 0.5 / step_s when absent. gain_per_s * step_s is below 2. Applies to "
        "Euler's steps, also where the accurate mode falls back to them.",
    )
    damping: DampingChoice = setting(
        "auto",
        "Largest damping factor, or with `measure: manipulability` its square; auto: from the smallest singular "
        "value, 0: no damping. Applies to Euler's steps, also where the accurate mode falls back to them.",
    )
    seed: Annotated[int, Field(ge=0, le=LARGEST_SEED)] = setting(0, "Seed of every random search.")
    damped_least_squares: DampedLeastSquaresEntry = setting(DampedLeastSquaresEntry(), "Settings of that method.")
    filtered_inverse: FilteredInverseEntry = setting(FilteredInverseEntry(), "Settings of both filtered inverses.")
    search: SearchEntry = setting(SearchEntry(), "Settings of both searches.")
    quadratic_program: QuadraticProgramEntry = setting(QuadraticProgramEntry(), "Settings of that method.")
    weighting: WeightingEntry = setting(WeightingEntry(), "Joint weights that change along the motion.")
    secondary: SecondaryEntry = setting(SecondaryEntry(), "Goals in the null space of the tasks.")

    def at_step(self, step: float) -> Self:
        """The same with the gain that goes with Euler's steps of a length in [s], where none is given."""
        return self.changed(gain_per_s=HALF_FEEDBACK / step) if self.gain_per_s is None else self

    @property
    def gain(self) -> float:
        """Gain of the pose-error feedback in [1/s]; 0 where none is given and no step was stated."""
        return self.gain_per_s or 0.0

    @property
    def traits(self) -> MethodTraits:
        """What the method is and can do."""
        return METHODS[self.method]

    @property
    def is_accurate(self) -> bool:
        """Whether the motion is resolved accurately: Euler's steps are not prescribed, and the method allows it."""
        return self.integrator != "euler" and self.traits.is_accurate

    @property
    def is_varied(self) -> bool:
        """Whether goals or changing weights have a say in the null space of the tasks."""
        return bool(self.secondary.goals) or self.weighting.near_limits > 0.0 or self.weighting.load > 0.0

    @property
    def nonminimal_keys(self) -> tuple[str, ...]:
        """Keys of these settings by which the motion is another than that of the smallest weighted joint velocities.

        Searches and screenings of many cells know only that one, by the weighted pseudo-inverse with constant weights.
        """
        obstacles = {
            "method": not self.traits.is_accurate,
            "secondary": bool(self.secondary.goals),
            "weighting.near_limits": self.weighting.near_limits != 0.0,
            "weighting.load": self.weighting.load != 0.0,
        }
        return tuple(key for key, stands in obstacles.items() if stands)
