"""Settings of the methods that resolve the motion of tools into that of joints, and of the weights of joints."""

from typing import Annotated, Final, Literal

from pydantic import Field

from cellplan.model.settings.entry import Entry, Name, Text
from cellplan.model.settings.units import Mm, Within

LARGEST_SEED: Final = 2**32 - 1
MOST_ROUNDS: Final = 1_000_000
Gain = Annotated[float, Field(gt=0.0, le=1e9)]


class DampedLeastSquaresEntry(Entry):
    """Where the damping of `damped_least_squares` sets in; how large it becomes is stated by `damping`."""

    measure: Literal["singular_value", "manipulability"] = Field(
        default="singular_value", description="Measure of the distance from a singularity."
    )
    region: Annotated[float, Field(gt=0.0, le=1e6)] = Field(
        default=0.02,
        description="Value of the measure below which damping sets in; with `damping: auto` and singular values the "
        "largest damping factor as well.",
    )
    shape_gain: bool = Field(default=False, description="Whether the feedback gain falls near a singularity.")


class FilteredInverseEntry(Entry):
    """Settings of `filtered_inverse` and `filtered_inverse_ii`."""

    gain_per_s: Gain = Field(default=1000.0, description="Update gain.")
    start: Literal["zero", "inverse"] = Field(
        default="inverse", description="Whether the filter starts at zero, as in the paper, or at the pseudo-inverse."
    )


class SearchJointEntry(Entry):
    """One joint of a sequence."""

    robot: Name = Field(description="Robot of the joint.")
    joint: Text = Field(description="The joint.")


class SearchEntry(Entry):
    """Settings of `heuristic_search` and `recursive_search`."""

    tolerance_mm: Annotated[Mm, Within(gt=0.0, le=1000.0)] = Field(
        default=Mm(1e-4), description="Largest square root of the cost at which a sample counts as reached."
    )
    orientation_weight_m2: Annotated[float, Field(gt=0.0, le=1e6)] = Field(
        default=0.01, description="Weight of the orientation in the cost."
    )
    rounds: Annotated[int, Field(ge=1, le=MOST_ROUNDS)] = Field(
        default=2000, description="Rounds over all joints after which a sample counts as out of reach."
    )
    brakes: bool = Field(default=False, description="Whether joints slow down near their limits.")
    sequence: tuple[SearchJointEntry, ...] | None = Field(
        default=None,
        min_length=1,
        description="Joints in the order in which `recursive_search` moves them; all, robot by robot in the order of "
        "their names, when absent. Joints left out stand still.",
    )


class QuadraticProgramEntry(Entry):
    """Limits and slack of `quadratic_program`."""

    slack_weight: Annotated[float, Field(gt=0.0, le=1e12)] = Field(
        default=1e8, description="Cost of the task's slack relative to that of weighted joint velocities."
    )
    ramp_s: Annotated[float, Field(gt=0.0, le=1e3)] | None = Field(
        default=None,
        description="Time in which a joint without an acceleration limit reaches its velocity limit; absent: at once.",
    )


class WeightingEntry(Entry):
    """Joint weights that change along the motion."""

    near_limits: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        default=0.0, description="Gain of the weight that grows as a joint approaches a limit; 0: constant weights."
    )
    load: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        default=0.0, description="Gain of the weight that grows with the gravity load of a joint; 0: constant weights."
    )
