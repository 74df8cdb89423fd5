"""Plan: phases of a program and roles of the robots, over its nominal time."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.transforms import Array

ALL_TASKS: Final = "all tasks"  # no task has this name: names have no spaces
NOT_IN_PROGRAM: Final = "not part of the program"
Interval = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Carry:
    """Hold the part and move with it, resolved together with the tasks."""

    def __str__(self) -> str:
        """The role in one word."""
        return "carry"


@dataclass(frozen=True, slots=True)
class Work:
    """Move the tool along the path of a task."""

    task: str

    def __str__(self) -> str:
        """The role and the name of its task."""
        return f"work: {self.task}"


@dataclass(frozen=True, slots=True)
class Transfer:
    """Move from where the previous phase ends to where another one begins."""

    to: str

    def __str__(self) -> str:
        """The role and the name of the phase at whose start it ends."""
        return f"transfer: {self.to}"


@dataclass(frozen=True, slots=True)
class Hold:
    """Stand still: at the home of an idle robot, or as a holder at its start."""

    at_home: bool = False

    def __str__(self) -> str:
        """The role, and where an idle robot stands."""
        return "hold at home" if self.at_home else "hold"


Role = Carry | Work | Transfer | Hold


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """A stretch of the nominal time of a program; a new phase begins whenever a role changes."""

    # name of its only task, ``ALL_TASKS`` when it is the only one, ``work-2`` or ``transfer-2`` in a program from home
    # to home, or what lies between two
    name: str
    roles: Mapping[str, Role]  # role of every robot, by its name: those at work first, in the order of the tasks
    begin: float = 0.0  # nominal time in [s] at which it begins; 0, as ``end``, while the plan is not on a clock
    end: float = 0.0  # nominal time in [s] at which it ends
    # whether the program has rows for it; otherwise its motion is left to the operator of the cell
    in_program: bool = True

    def __post_init__(self) -> None:
        """Check that the phase does not end before it begins."""
        if not self.begin <= self.end:
            raise ValueError(f"phase '{self.name}': ends at {self.end} s before it begins at {self.begin} s")

    @property
    def label(self) -> str | None:
        """Name by which reports and folders tell it from the others; None for the only phase of a program."""
        return None if self.name == ALL_TASKS else self.name

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks that are worked on."""
        return tuple(role.task for role in self.roles.values() if isinstance(role, Work))

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the robots that may move; all others stand still."""
        return tuple(name for name, role in self.roles.items() if not isinstance(role, Hold))

    @property
    def idle(self) -> tuple[str, ...]:
        """Names of the robots that have nothing to do and stand at their homes."""
        return tuple(name for name, role in self.roles.items() if role == Hold(at_home=True))

    def among(self, robots: Collection[str]) -> Self:
        """The phase with the roles of some robots only."""
        return replace(self, roles={name: role for name, role in self.roles.items() if name in robots})


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The phases of a program, and the tasks of its tools."""

    # all phases in their order, those without rows in the program among them; neighbours share their ends
    phases: tuple[Phase, ...] = ()
    # nominal times in [s] at which the time law brings the tool of a task to rest, by task
    stops: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    # stretches of nominal time in [s] that take no less time in any program, as (from, to): the delays of processes,
    # and dwells
    dwells: tuple[Interval, ...] = ()
    # stretches of nominal time in [s] in which the tool of a task is on its path, by task; with the delays of a process
    process: Mapping[str, tuple[Interval, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that phases follow one another without a gap on the nominal time."""
        for one, other in zip(self.phases, self.phases[1:], strict=False):
            if one.end != other.begin:
                raise ValueError(f"plan: '{one.name}' ends at {one.end} s, '{other.name}' begins at {other.begin} s")

    @property
    def program(self) -> tuple[Phase, ...]:
        """The phases that have rows in the program."""
        return tuple(phase for phase in self.phases if phase.in_program)

    @property
    def end(self) -> float:
        """Nominal time in [s] at which the last phase ends."""
        return self.phases[-1].end

    def phase(self, task: str | None) -> Phase:
        """The phase of a single task, or of all tasks together for None.

        Raises:
            KeyError: There is no such phase.
        """
        for phase in self.program:
            if phase.label == task:
                return phase
        raise KeyError(task)

    def gaps(self, sigma: Array) -> dict[int, str]:
        """Name of what is not part of the program, by the first row after it.

        ``sigma`` are the nominal times of the rows in [s], increasing, shape (N,).
        """
        return {int(np.searchsorted(sigma, phase.end)): phase.name for phase in self.phases if not phase.in_program}


def rows_of(phase: Phase, sigma: Array) -> slice:
    """Rows of a program that belong to a phase of the clock, both ends included.

    ``sigma`` are the nominal times of the rows in [s], increasing, shape (N,).
    """
    first = int(np.searchsorted(sigma, phase.begin))
    return slice(first, int(np.searchsorted(sigma, phase.end, side="right")))
