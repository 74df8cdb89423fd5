"""Base reactions on a floor plan: rows of a table, and lines of text."""

from collections.abc import Iterator
from typing import Final

from cellplan.model.robot.base_reaction import BaseReaction
from cellplan.report.floor_plan.plan import FloorPlan

HEADINGS: Final = ("vertical N", "horizontal N", "tilting Nm", "turning Nm")
SHORT: Final = ("Fv N", "Fh N", "Mk Nm", "Mr Nm")  # as makers abbreviate them on drawings of foundations


def reaction_title(plan: FloorPlan) -> str:
    """What the base reactions are of."""
    return f"Base reactions {'at rest at the start' if plan.square is None else 'in the motion'}"


def reaction_numbers(reaction: BaseReaction) -> tuple[str, ...]:
    """The largest values, as they stand below the headings."""
    peaks = (reaction.vertical, reaction.horizontal, reaction.tilting, reaction.turning)
    return tuple(f"{peak.size:.0f}" for peak in peaks)


def unstated_reactions(plan: FloorPlan) -> str:
    """The robots whose base reactions are not known; empty without any."""
    unknown = [robot.name for robot in plan.robots if robot.reaction is None]
    return f"not stated: masses of {', '.join(unknown)}" if unknown else ""


def reaction_lines(plan: FloorPlan) -> Iterator[str]:
    """All base reactions as text: a line for each robot, and one for those without masses."""
    yield f"{reaction_title(plan)}, moments about the origin of the base"
    for robot in plan.robots:
        if robot.reaction is not None:
            cells = zip(HEADINGS, reaction_numbers(robot.reaction), strict=True)
            values = (" ".join([*heading.split()[:1], value, *heading.split()[1:]]) for heading, value in cells)
            yield f"  {robot.name}: {', '.join(values)}"
    if unknown := unstated_reactions(plan):
        yield f"  {unknown}"
