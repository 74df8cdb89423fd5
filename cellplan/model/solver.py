"""Solver settings: how joint motion is found, and what it is to do besides following the tasks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final, Literal

from cellplan.geometry.transforms import Array

MethodName = Literal[  # each is the name of a file and a function in planning/methods/
    "weighted_pseudo_inverse",
    "damped_least_squares",
    "jacobian_transpose",
    "filtered_inverse",
    "filtered_inverse_ii",
    "heuristic_search",
    "recursive_search",
    "quadratic_program",
]

NULL_SPACE_METHODS: Final[frozenset[str]] = frozenset(
    {
        "weighted_pseudo_inverse",
        "damped_least_squares",
        "filtered_inverse",
        "filtered_inverse_ii",
        "quadratic_program",
    }
)  # methods that leave room for goals besides the tasks


ACCURATE_METHODS: Final[frozenset[str]] = frozenset({"weighted_pseudo_inverse"})  # methods with an accurate mode


class Integrator(StrEnum):
    """How joint speeds become joint positions.

    ``ACCURATE`` finds joint positions as polynomials in time that keep the tools on their tasks, within a stated error;
    ``EULER`` goes on from instant to instant of the clock and feeds the pose error back.
    """

    ACCURATE = "accurate"
    EULER = "euler"


def against_accurate(method: str, *, has_goals: bool, near_limits: float, load: float) -> tuple[str, ...]:
    """Keys of the solver's settings, as in the cell file, that rule the accurate mode out.

    Args:
        method: The resolution method.
        has_goals: Whether anything is pursued besides the tasks.
        near_limits: See ``WeightingSettings``.
        load: See ``WeightingSettings``.
    """
    obstacles = {
        "method": method not in ACCURATE_METHODS,
        "secondary": has_goals,
        "weighting.near_limits": near_limits != 0.0,
        "weighting.load": load != 0.0,
    }
    return tuple(key for key, stands in obstacles.items() if stands)


class SingularityMeasure(StrEnum):
    """What tells how near a singularity is."""

    SINGULAR_VALUE = "singular_value"
    MANIPULABILITY = "manipulability"


@dataclass(frozen=True, slots=True, kw_only=True)
class DampedLeastSquaresSettings:
    """When damping sets in; its largest factor is ``SolverSettings.damping``.

    Attributes:
        measure: Smallest singular value ([Nicolato2007]_ Eq. 2.12) or manipulability ([Vargas2012]_ Eqs. 9-10).
        region: Value of the measure below which damping sets in (``epsilon``, ``w0``).
        shapes_gain: Whether the feedback gain falls near a singularity ([Nicolato2007]_ Eq. 2.14).
    """

    measure: SingularityMeasure = SingularityMeasure.SINGULAR_VALUE
    region: float = 0.02
    shapes_gain: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class FilteredInverseSettings:
    """How fast the filtered inverse follows the Jacobian.

    Attributes:
        gain: Update gain ``Gamma`` in [1/s] ([Vargas2012]_ Eq. 34).
        starts_at_zero: Whether it starts at zero, as in the paper, rather than at the pseudo-inverse.
    """

    gain: float = 1000.0
    starts_at_zero: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """How the heuristic and the recursive search look for the next configuration ([Nicolato2007]_ ch. 3).

    Attributes:
        tolerance: Largest root of the cost at which an instant counts as reached, in [m].
        orientation_weight: Weight ``gamma`` of the orientation in the cost in [m^2].
        rounds: Rounds over all joints before an instant counts as out of reach.
        brakes: Whether joints slow down near their limits (Eqs. 3.29, 3.30).
        sequence: Joints as (robot, joint) in the order in which the recursive search moves them; None for the order
            of the stacked joint vector.
    """

    tolerance: float = 1e-7
    orientation_weight: float = 0.01
    rounds: int = 2000
    brakes: bool = False
    sequence: tuple[tuple[str, str], ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class QuadraticProgramSettings:
    """Limits and slack of the quadratic program.

    Attributes:
        slack_weight: Weight of the task's slack against the weighted joint speeds.
        ramp: Time in [s] in which a joint without a known acceleration limit reaches its top speed; None: at once.
    """

    slack_weight: float = 1e8
    ramp: float | None = None


class GoalKind(StrEnum):
    """What the motion in the null space may improve."""

    MANIPULABILITY = "manipulability"
    JOINT_LIMITS = "joint_limits"
    OBSTACLES = "obstacles"
    POSTURE = "posture"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SecondaryGoal:
    """One goal that is pursued as far as the tasks leave room ([Ribeiro2010]_ Eqs. D.43-D.47).

    Attributes:
        kind: What is improved.
        gain: How strongly: ``k0`` of Eq. D.44.
        within: Distance in [m] below which bodies push each other away (obstacles only).
        postures: Reference configuration by robot, shape (n,) each (configuration only); robots left out: their start
            posture.
    """

    kind: GoalKind
    gain: float
    within: float = 0.2
    configurations: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightingSettings:
    """How joint weights change along the motion; 0 leaves them as they are.

    Attributes:
        near_limits: How strongly a joint is held back on its way to a limit.
        load: How strongly a joint is held back by the weight it has to lift.
    """

    near_limits: float = 0.0
    load: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolverSettings:
    """How joint motion is found.

    Attributes:
        method: The resolution method.
        gain: Error feedback gain in [1/s] of Euler's steps.
        damping: Largest damping factor of Euler's steps; None lets the smallest singular value decide (``auto``).
        seed: Seed of every random search.
        damped_least_squares: Settings of that method.
        filtered_inverse: Settings of both filtered inverses.
        search: Settings of both searches.
        quadratic_program: Settings of that method.
        weighting: How joint weights change along the motion.
        goals: Secondary goals in the null space.
        integrator: How joint speeds become positions; ``is_accurate`` says whether the other settings allow it.
        accuracy: Largest tool error between the nodes of the accurate mode in [m]; angles in as many [rad].
    """

    method: MethodName
    gain: float
    damping: float | None
    seed: int
    damped_least_squares: DampedLeastSquaresSettings = DampedLeastSquaresSettings()
    filtered_inverse: FilteredInverseSettings = FilteredInverseSettings()
    search: SearchSettings = SearchSettings()
    quadratic_program: QuadraticProgramSettings = QuadraticProgramSettings()
    weighting: WeightingSettings = WeightingSettings()
    goals: tuple[SecondaryGoal, ...] = ()
    integrator: Integrator = Integrator.EULER
    accuracy: float = 1e-7

    @property
    def against_accurate(self) -> tuple[str, ...]:
        """Keys of these settings that rule the accurate mode out."""
        return against_accurate(
            self.method, has_goals=bool(self.goals), near_limits=self.weighting.near_limits, load=self.weighting.load
        )

    @property
    def is_accurate(self) -> bool:
        """Whether the motion is resolved accurately: it is asked for, and nothing rules it out."""
        return self.integrator is Integrator.ACCURATE and not self.against_accurate
