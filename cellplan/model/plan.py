"""Plan: phases of a program and roles of the robots, over its nominal time."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.phase import Phase

Interval = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """The phases of a program, and the tasks of its tools.

    Attributes:
        phases: All phases in their order, those without rows in the program among them; neighbours share their ends.
        stops: Nominal times in [s] at which the time law brings the tool of a task to rest, by task.
        dwells: Stretches of nominal time in [s] that take no less time in any program, as (from, to): the delays of
            processes, and dwells.
        process: Stretches of nominal time in [s] in which the tool of a task is on its path, by task; with the delays
            of a process.
    """

    phases: tuple[Phase, ...] = ()
    stops: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    dwells: tuple[Interval, ...] = ()
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
            if phase.task == task:
                return phase
        raise KeyError(task)

    def gaps(self, sigma: Array) -> dict[int, str]:
        """Name of what is not part of the program, by the first row after it.

        Args:
            sigma: Nominal times of the rows in [s], shape (N,), increasing.
        """
        return {int(np.searchsorted(sigma, phase.end)): phase.name for phase in self.phases if not phase.in_program}


def rows_of(phase: Phase, sigma: Array) -> slice:
    """Rows of a program that belong to a phase, both ends included.

    Args:
        phase: The phase, on the clock.
        sigma: Nominal times of the rows in [s], shape (N,), increasing.
    """
    first = int(np.searchsorted(sigma, phase.begin))
    return slice(first, int(np.searchsorted(sigma, phase.end, side="right")))
