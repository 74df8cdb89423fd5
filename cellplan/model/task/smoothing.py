"""Smoothing: how far a path may be from the points and axes of its file, and how much smoother that makes it."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cellplan.model.task.task import SampledPath


@dataclass(frozen=True, slots=True, kw_only=True)
class Roughness:
    """Root mean squares of second derivatives over the length of a path, in [1/m] of points, in [rad/m^2] of axes."""

    given: float  # of what the file lists
    smoothed: float  # of what is followed
    bound: float  # nothing in the tube has less; for axes, no vectors of the caps of the unit ball


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Smoothing:
    """What a smoothed path was made of, and within which tube."""

    listed: "SampledPath"  # the path by its file
    position: float  # largest distance of a point in [m]; 0 where points stay
    direction: float  # largest angle of an axis in [rad]; 0 where axes stay
    into: float  # largest distance in [m] along the given axis
    of_points: Roughness | None  # None where points stay
    of_axes: Roughness | None  # None where axes stay
