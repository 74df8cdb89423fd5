"""Solver settings: the resolution method, its parameters, and secondary goals in the null space of the tasks."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import Final, Literal

from cellplan.geometry.transforms import Array
from cellplan.model.settings.solver import (
    DampedLeastSquaresEntry,
    FilteredInverseEntry,
    QuadraticProgramEntry,
    SearchEntry,
    WeightingEntry,
)

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


@dataclass(frozen=True, slots=True, kw_only=True)
class MethodTraits:
    """What a resolution method is and can do.

    Attributes:
        feeds_back: Whether the pose error is fed back with the gain of the solver; searches minimise it directly.
        steps_because: Why the motion can only be stepped along the clock, as a predicate of the method; empty where it
            can also be resolved by collocation (the integrator ``accurate``).
    """

    label: str  # name in reports
    has_null_space: bool = True  # whether goals besides the tasks can be pursued in the null space of the task Jacobian
    feeds_back: bool = True
    takes_euler_steps: bool = False  # whether a joint step is a joint velocity times the time step
    steps_because: str = ""

    @property
    def is_accurate(self) -> bool:
        """Whether the motion can also be resolved by collocation (the integrator ``accurate``)."""
        return not self.steps_because

    @property
    def is_search(self) -> bool:
        """Whether configurations are found by minimising the pose error, without a Jacobian inverse."""
        return not self.feeds_back


BY_FEEDBACK: Final = "follows the path only as far as the feedback of its errors takes it"
AT_SAMPLES: Final = "is defined at the samples alone"
METHODS: Final[Mapping[MethodName, MethodTraits]] = MappingProxyType(
    {
        "weighted_pseudo_inverse": MethodTraits(label="weighted pseudo-inverse", takes_euler_steps=True),
        "damped_least_squares": MethodTraits(
            label="damped least squares", takes_euler_steps=True, steps_because="leaves the path where it damps"
        ),
        "jacobian_transpose": MethodTraits(label="Jacobian transpose", has_null_space=False, steps_because=BY_FEEDBACK),
        "filtered_inverse": MethodTraits(label="filtered inverse I", steps_because=BY_FEEDBACK),
        "filtered_inverse_ii": MethodTraits(label="filtered inverse II", steps_because=BY_FEEDBACK),
        "heuristic_search": MethodTraits(
            label="heuristic search, the best joint first",
            has_null_space=False,
            feeds_back=False,
            steps_because=AT_SAMPLES,
        ),
        "recursive_search": MethodTraits(
            label="recursive search, joint by joint", has_null_space=False, feeds_back=False, steps_because=AT_SAMPLES
        ),
        "quadratic_program": MethodTraits(
            label="quadratic program",
            takes_euler_steps=True,
            steps_because="gives up part of a task at a limit, and limits accelerations from step to step",
        ),
    }
)
NULL_SPACE_METHODS: Final = tuple(sorted(name for name, traits in METHODS.items() if traits.has_null_space))
ACCURATE_METHODS: Final = tuple(sorted(name for name, traits in METHODS.items() if traits.is_accurate))


class Integrator(StrEnum):
    """How joint velocities become joint positions.

    ``ACCURATE`` finds joint positions as polynomials in time that keep the tools on their tasks, within a stated error;
    ``EULER`` steps from sample to sample of the clock and feeds the pose error back.
    """

    ACCURATE = "accurate"
    EULER = "euler"


def beside_smallest(method: MethodName, weighting: WeightingEntry, *, has_goals: bool) -> tuple[str, ...]:
    """Keys of the solver's settings by which the motion is another than that of the smallest weighted joint velocities.

    Searches and screenings of many cells know only that one, by the weighted pseudo-inverse with constant weights.

    Args:
        has_goals: Whether anything is pursued besides the tasks.
    """
    obstacles = {
        "method": not METHODS[method].is_accurate,
        "secondary": has_goals,
        "weighting.near_limits": weighting.near_limits != 0.0,
        "weighting.load": weighting.load != 0.0,
    }
    return tuple(key for key, stands in obstacles.items() if stands)


class GoalKind(StrEnum):
    """What the motion in the null space may improve."""

    MANIPULABILITY = "manipulability"
    JOINT_LIMITS = "joint_limits"
    OBSTACLES = "obstacles"
    POSTURE = "posture"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SecondaryGoal:
    """One goal that is pursued in the null space of the tasks ([Ribeiro2010]_ Eqs. D.43-D.47).

    Attributes:
        kind: What is improved.
        gain: Gain ``k0`` of Eq. D.44.
        within: Distance in [m] below which bodies push each other away (obstacles only).
        configurations: Desired configuration by robot, shape (n,) each (``posture`` only); that of a robot left out is
            its start posture.
    """

    kind: GoalKind
    gain: float
    within: float = 0.2
    configurations: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolverSettings:
    """Settings of the solver.

    Attributes:
        method: The resolution method.
        gain: Error feedback gain in [1/s] of Euler's steps.
        damping: Largest damping factor of Euler's steps, or with manipulability its square; None lets the smallest
            singular value decide (``auto``).
        seed: Seed of every random search.
        damped_least_squares: Settings of that method.
        filtered_inverse: Settings of both filtered inverses.
        search: Settings of both searches.
        quadratic_program: Settings of that method.
        weighting: Joint weights that change along the motion.
        goals: Secondary goals in the null space.
        integrator: How joint velocities become positions; None (``auto``) for the accurate mode wherever the other
            settings allow it, else Euler's steps.
        accuracy: Largest tool error between the nodes of the accurate mode in [m]; angles in as many [rad].
    """

    method: MethodName
    gain: float
    damping: float | None
    seed: int
    damped_least_squares: DampedLeastSquaresEntry = field(default_factory=DampedLeastSquaresEntry)
    filtered_inverse: FilteredInverseEntry = field(default_factory=FilteredInverseEntry)
    search: SearchEntry = field(default_factory=SearchEntry)
    quadratic_program: QuadraticProgramEntry = field(default_factory=QuadraticProgramEntry)
    weighting: WeightingEntry = field(default_factory=WeightingEntry)
    goals: tuple[SecondaryGoal, ...] = ()
    integrator: Integrator | None = Integrator.EULER
    accuracy: float = 1e-7

    @property
    def beside_smallest(self) -> tuple[str, ...]:
        """Keys of these settings by which the motion is not that of the smallest weighted joint velocities."""
        return beside_smallest(self.method, self.weighting, has_goals=bool(self.goals))

    @property
    def is_varied(self) -> bool:
        """Whether goals or changing weights have a say in the null space of the tasks."""
        return bool(self.goals) or self.weighting.near_limits > 0.0 or self.weighting.load > 0.0

    @property
    def is_accurate(self) -> bool:
        """Whether the motion is resolved accurately: Euler's steps are not prescribed, and the method allows it."""
        return self.integrator is not Integrator.EULER and self.traits.is_accurate

    @property
    def traits(self) -> MethodTraits:
        """What the method is and can do."""
        return METHODS[self.method]
