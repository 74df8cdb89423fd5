"""Program: what is done from home to home, beside the tasks and their order."""

from dataclasses import dataclass

from cellplan.geometry.transforms import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Mark:
    """A point at which robots wait for one another.

    Attributes:
        name: Name, which stands among the tasks in the orders of the robots that take part.
        dwell: Time in [s] for which all robots of the cell stand still there.
    """

    name: str
    dwell: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartPlace:
    """A place at which the part lies without a robot that holds it.

    Attributes:
        X_WP: The part frame in the world, shape (4, 4).
        rests_on: Name of the obstacle that it may touch there; None for a part that touches nothing.
        approach: Distance in [m] of the holder's straight move along its tool axis to the part, or away from it.
        lift: Height in [m] over which the part is moved straight up from the place, or down to it.
    """

    X_WP: Array
    rests_on: str | None = None
    approach: float = 0.05
    lift: float = 0.05


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramSettings:
    """A program from home to home.

    Attributes:
        cycles: How often all of it is done.
        marks: Points at which robots wait for one another.
        attach: Where the part lies until it is gripped; None for a part that is held from the beginning.
        detach: Where the part is put down after the last task; None for a part that is held to the end.
    """

    cycles: int = 1
    marks: tuple[Mark, ...] = ()
    attach: PartPlace | None = None
    detach: PartPlace | None = None
