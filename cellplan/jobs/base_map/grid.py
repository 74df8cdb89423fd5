"""Grid of a map: where the base of a robot is tried."""

import math
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.units import MM
from cellplan.scene.kinematics.reach import arm_reach
from cellplan.search.base_map.places import Places

STEP: Final = 50.0  # [mm] from one place to the next
MOST_PLACES: Final = 40_000
TOWARD: Final = "toward"
Span = tuple[float, float]  # from and to in [mm]


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseGrid:
    """Where the base of a robot is tried.

    Attributes:
        x: From and to in [mm]; None for all places from which the robot may reach the part.
        y: Likewise.
        step: From one place to the next in [mm].
        yaw: Angle of the base about the vertical in [deg], as ``yaw_deg`` of the cell file; ``toward`` for its x axis
            turned to the part; None for the present one.
    """

    x: Span | None = None
    y: Span | None = None
    step: float = STEP
    yaw: float | Literal["toward"] | None = None

    def places(self, robot: Robot, part: Array) -> Places:
        """The places of a robot's base; what ``refuse`` names is refused.

        Args:
            part: Where the part is at the start in [m], shape (3,).

        Raises:
            InputError: There are too many, or a number is not usable.
        """
        x, y = self._axes(robot, part)
        if len(x) * len(y) > MOST_PLACES:
            raise InputError(f"--grid: expected at most {MOST_PLACES} places, got {len(x)} x {len(y)}: a larger step")
        yaw = None if self.yaw is None or self.yaw == TOWARD else float(np.radians(self.yaw))
        return Places.of(robot.X_WB, x, y, yaw=yaw, toward=part if self.yaw == TOWARD else None)

    def refuse(self, robot: Robot) -> None:
        """Refuse too many places and unusable numbers wherever the part is; call it early, before any long work."""
        x, y = self._axes(robot, np.zeros(3))
        if (len(x) - 1) * (len(y) - 1) > MOST_PLACES:  # one more or less, as the part is elsewhere
            raise InputError(f"--grid: expected at most {MOST_PLACES} places, got {len(x)} x {len(y)}: a larger step")

    def _axes(self, robot: Robot, part: Array) -> tuple[Array, Array]:
        """Values of x and y in [mm]."""
        if not (math.isfinite(self.step) and self.step > 0.0):
            raise InputError(f"--grid: expected millimetres above 0, got {self.step:g}")
        reach = MM * (arm_reach(robot.model) + float(np.linalg.norm(robot.tool.X_FT[:3, 3])))
        x, y = (
            self._values(option, span, MM * float(middle), reach)
            for option, span, middle in (("--x", self.x, part[0]), ("--y", self.y, part[1]))
        )
        return x, y

    def _values(self, option: str, span: Span | None, middle: float, reach: float) -> Array:
        """Values along one axis in [mm]: multiples of the step where no span is given, else from where it begins."""
        if span is None:
            first = math.ceil((middle - reach) / self.step)
            count = math.floor((middle + reach) / self.step) - first
            return np.asarray(self.step * np.arange(first, first + min(count, MOST_PLACES) + 1), dtype=float)
        if not (all(map(math.isfinite, span)) and span[0] <= span[1]):
            raise InputError(f"{option}: expected FROM:TO in mm with FROM not above TO, got {span[0]:g}:{span[1]:g}")
        steps = math.floor((span[1] - span[0]) / self.step * (1.0 + 1e-9))
        return np.asarray(span[0] + self.step * np.arange(min(steps, MOST_PLACES) + 1), dtype=float)


def read_span(option: str, text: str) -> Span:
    """Read ``FROM:TO`` in [mm], or refuse it."""
    first, _, last = text.partition(":")
    try:
        return float(first), float(last)
    except ValueError:
        raise InputError(f"{option}: expected FROM:TO in mm, such as 500:2000, got '{text}'") from None


def read_yaw(text: str) -> float | Literal["toward"]:
    """Read an angle in [deg] or ``toward``, or refuse it."""
    if text == TOWARD:
        return "toward"
    try:
        yaw = float(text)
    except ValueError:
        yaw = math.nan
    if not math.isfinite(yaw):
        raise InputError(f"--yaw: expected degrees or {TOWARD}, got '{text}'")
    return yaw
