"""Colours that plots and pages share: one per robot, dark enough to read on white."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # whoever only paints needs no cells
    from cellplan.model.cell import Cell

INK = "#1d2733"
GREY = "#5f6b79"
LIMIT = "#c22f2f"
FORBIDDEN = "#f9e1df"
ROBOTS = ("#2b5fa6", "#c4660c", "#2a7d53", "#7b4aa6", "#0f7f8c", "#a8324f", "#6b6a13", "#4a5568")
AXES = ("#c4472b", "#2a7d53", "#2b5fa6")
CLASSES = ("#0f7f8c", "#7b4aa6", "#6b6a13", "#4a5568")


def robot_colours(cell: "Cell") -> dict[str, str]:
    """Colour of each robot, by its place in the cell."""
    return {robot.name: ROBOTS[index % len(ROBOTS)] for index, robot in enumerate(cell.robots)}
