"""Colours that plots and pages share: one per robot, dark enough to read on white."""

import colorsys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:  # rendering needs no cells
    from cellplan.model.cell.cell import Cell

INK = "#1d2733"
GREY = "#5f6b79"
LIMIT = "#c22f2f"
FORBIDDEN = "#f9e1df"
ROBOTS = ("#2b5fa6", "#c4660c", "#2a7d53", "#7b4aa6", "#0f7f8c", "#a8324f", "#6b6a13", "#4a5568")
AXES = ("#c4472b", "#2a7d53", "#2b5fa6")
CLASSES = ("#0f7f8c", "#7b4aa6", "#6b6a13", "#4a5568")
GRID = "#e3e7ec"
FRAME = "#aeb7c2"
PAPER = "#ffffff"
ON_DARK: Final = {  # what takes the place of each colour where the page is dark
    PAPER: "#12171e",
    INK: "#e6eaf0",
    GREY: "#a3adb9",
    LIMIT: "#ff7d75",
    FORBIDDEN: "#452427",
    GRID: "#2a323c",
    FRAME: "#55606d",
    ROBOTS[0]: "#7cb0f5",
    ROBOTS[1]: "#f0a050",
    ROBOTS[2]: "#63c793",
    ROBOTS[3]: "#c39bec",
    ROBOTS[4]: "#4fc5d2",
    ROBOTS[5]: "#f08a9f",
    ROBOTS[6]: "#c9c75a",
    ROBOTS[7]: "#a9b6c8",
    AXES[0]: "#ff8d70",
}


HUE_STEP: Final = 0.6180339887498949  # [-] of the colour circle from one further robot to the next: none comes back
LIGHTNESS: Final = (0.26, 0.38)  # [-] lightness of further robots in turn
SATURATION: Final = 0.6  # [-] their saturation


def robot_colours(cell: "Cell") -> dict[str, str]:
    """Colour of each robot, by its place in the cell."""
    return {robot.name: _colour(index) for index, robot in enumerate(cell.robots)}


def _colour(index: int) -> str:
    """A chosen colour for the first robots, then others round the colour circle."""
    if index < len(ROBOTS):
        return ROBOTS[index]
    shares = colorsys.hls_to_rgb(index * HUE_STEP % 1.0, LIGHTNESS[index % 2], SATURATION)
    return "#" + "".join(f"{round(255 * share):02x}" for share in shares)


def dark_rules() -> str:
    """Style rules that replace the colours of figures where the reader prefers a dark page."""
    rules = "".join(
        f'.figure [fill="{light}"]{{fill:{dark}}}.figure [stroke="{light}"]{{stroke:{dark}}}'
        for light, dark in ON_DARK.items()
    )
    return f"@media screen and (prefers-color-scheme:dark){{{rules}}}"
