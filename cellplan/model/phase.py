"""Phases of a program: stretches of its nominal time in each of which every robot has one role."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Final, Self

ALL_TASKS: Final = "all tasks"  # no task has this name: names have no spaces
NOT_IN_PROGRAM: Final = "not part of the program"


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
    """A stretch of the nominal time of a program; a new phase begins whenever a role changes.

    Attributes:
        name: Name of its only task, ``ALL_TASKS`` when it is the only one, ``work-2`` or ``transfer-2`` in a program
            from home to home, or what lies between two.
        roles: Role of every robot, by its name: those at work first, in the order of the tasks.
        begin: Nominal time in [s] at which it begins; 0, as ``end``, while the plan is not on a clock.
        end: Nominal time in [s] at which it ends.
        in_program: Whether the program has rows for it; otherwise its motion is left to the operator of the cell.
    """

    name: str
    roles: Mapping[str, Role]
    begin: float = 0.0
    end: float = 0.0
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
