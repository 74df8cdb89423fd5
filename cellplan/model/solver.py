"""Resolution methods and what each of them can do, and how joint velocities become positions."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import Final, Literal

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
    """What a resolution method is and can do."""

    label: str  # name in reports
    has_null_space: bool = True  # whether goals besides the tasks can be pursued in the null space of the task Jacobian
    # whether the pose error is fed back with the gain of the solver; searches minimise it directly
    feeds_back: bool = True
    lets_axes_lean: bool = False  # whether a tool's axis that may lean moves within its cone; others keep the axis
    takes_euler_steps: bool = False  # whether a joint step is a joint velocity times the time step
    # why the motion can only be stepped along the clock, as a predicate of the method; empty where it can also be
    # resolved by collocation (the integrator ``accurate``)
    steps_because: str = ""

    @property
    def is_accurate(self) -> bool:
        """Whether the motion can also be resolved by collocation (the integrator ``accurate``)."""
        return not self.steps_because


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
            lets_axes_lean=True,
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
