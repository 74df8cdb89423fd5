"""Base reactions: what the pedestal and the floor under a robot must hold."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple


class PeakLoad(NamedTuple):
    """A largest value and its time."""

    size: float  # in [N] or [N m]
    at_s: float  # its time in [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseReaction:
    """Largest forces and moments of one robot on what it stands on, moments about the origin of its base."""

    robot: str  # name of the robot
    weight: float  # of the robot and what it carries in [N]
    vertical: PeakLoad  # force along the vertical of the world
    horizontal: PeakLoad  # force across it
    tilting: PeakLoad  # moment about a horizontal axis
    turning: PeakLoad  # moment about the vertical
    tilting_at_rest: PeakLoad  # moment about a horizontal axis by weights alone, in any configuration of the motion


def largest_reactions(reactions: Iterable[BaseReaction | None]) -> dict[str, BaseReaction]:
    """The largest values over several phases, times as they have them, by robot; None is what is not known."""
    largest: dict[str, BaseReaction] = {}
    for it in filter(None, reactions):
        other = largest.setdefault(it.robot, it)
        largest[it.robot] = BaseReaction(
            robot=it.robot,
            weight=max(other.weight, it.weight),
            vertical=max(other.vertical, it.vertical),
            horizontal=max(other.horizontal, it.horizontal),
            tilting=max(other.tilting, it.tilting),
            turning=max(other.turning, it.turning),
            tilting_at_rest=max(other.tilting_at_rest, it.tilting_at_rest),
        )
    return largest
