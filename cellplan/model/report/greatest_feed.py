"""The greatest constant feed that the joints would allow at each place of a path, and what binds where it is least."""

from dataclasses import dataclass
from typing import Final

from cellplan.geometry.transforms import Array
from cellplan.model.units import MM

TOOL_SPEED: Final = "tool speed"
BETWEEN_ROWS: Final = "tolerance between rows"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GreatestFeed:
    """Greatest feed of one task along the same joint path, everything faster or slower by one factor.

    Attributes:
        task: Name of the task.
        feed: Feed at which the path was run along, in [m/s].
        travelled: Places on the path in [m] behind the tool, shape (M,).
        feeds: Greatest feed in [m/s] at each of them, inf where nothing limits it, shape (M,).
        binding: Joint or tool, as ``kuka B2``, that limits the least of them.
        kind: Its limit: velocity, acceleration, jerk, tool speed or tolerance between rows.
        at: Place on the path in [m].
        at_s: Time in [s].
        point: The point of the file that is nearest to this place, as text; empty for a path without a file.
        is_in_ramp: Whether the tool speeds up or slows down there.
    """

    task: str
    feed: float
    travelled: Array
    feeds: Array
    binding: str
    kind: str
    at: float
    at_s: float
    point: str = ""
    is_in_ramp: bool = False

    @property
    def greatest(self) -> float:
        """Greatest feed in [m/s] that holds at all places."""
        return float(self.feeds.min())

    @property
    def text(self) -> str:
        """What binds, as ``joint kuka B2, acceleration, at 132 mm (point 45, line 46 of curve.csv)``."""
        joint = "" if self.kind in (TOOL_SPEED, BETWEEN_ROWS) else "joint "
        ramp = " in a ramp" if self.is_in_ramp else ""
        point = f" ({self.point})" if self.point else ""
        return f"{joint}{self.binding}, {self.kind}{ramp}, at {MM * self.at:.4g} mm{point}"


def cure_of(kind: str) -> str:
    """What allows a greater feed than a limit of some kind, behind what binds; empty where nothing is known to."""
    return "; a smaller motion.step_s allows more" if kind == BETWEEN_ROWS else ""
