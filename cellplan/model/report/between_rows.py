"""Errors between the rows of the tables: what a tool does while every joint moves linearly from one row to the next."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class BetweenError:
    """One error of a tool between the rows, in [m] or [rad]."""

    # largest one found between two neighbouring rows: in the middle of every step, and at ten subdivisions of the worst
    # steps and of those for which the bound is too wide
    largest: float
    at_s: float  # its instant in [s]
    # no error between the rows is larger; None where the bound is wider than what is allowed, and the verdict rests on
    # ten subdivisions of every such step
    bound: float | None
    # a step in [s] that meets the tolerance for all tools, by the way errors grow with the step; None where the error
    # is small enough, or too large at the rows already
    longest_step: float | None = None
    easing: float = 1.0  # share of it that counts against the tolerance: less on the runs of a process

    @property
    def proof(self) -> str:
        """What the verdict rests on."""
        return "ten subdivisions" if self.bound is None else "bound"


@dataclass(frozen=True, slots=True, kw_only=True)
class BetweenRows:
    """Errors of one tool between the rows."""

    position: BetweenError
    orientation: BetweenError
