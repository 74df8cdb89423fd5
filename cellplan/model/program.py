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
        rests_on: Name of the obstacle that it rests on, and touches there, or names of several; None without any.
        rest_gap: Largest distance in [m] from each of them.
        is_clamped: Whether a nest, magnet or hook holds it there, so that it need not touch anything.
        approach: Distance in [m] of the holder's straight move along its tool axis to the part, or away from it.
        lift: Height in [m] over which the part is moved straight up from the place, or down to it.
        contact: Distance in [m] from the grip within which holder and part, part and support may touch; None for the
            depth of the grip.
    """

    X_WP: Array
    rests_on: str | tuple[str, ...] | None = None
    rest_gap: float = 0.001
    is_clamped: bool = False
    approach: float = 0.05
    lift: float = 0.05
    contact: float | None = None

    @property
    def supports(self) -> tuple[str, ...]:
        """Names of the obstacles that the part rests on."""
        return (self.rests_on,) if isinstance(self.rests_on, str) else self.rests_on or ()


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
