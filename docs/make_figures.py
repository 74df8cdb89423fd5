"""Draw the figures of the concept pages: ``python docs/make_figures.py`` writes them to ``docs/images``."""

from pathlib import Path

import matplotlib as mpl
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse, FancyArrowPatch, FancyBboxPatch, Polygon, Rectangle

IMAGES = Path(__file__).resolve().parent / "images"
INK, GREY, PALE = "#222222", "#8a8a8a", "#f2f2f2"
PART, OPERATOR, ZERO = "#2f6fab", "#c8642b", "#ffffff"
Point = tuple[float, float]

mpl.use("svg")
mpl.rcParams.update(
    {
        "svg.hashsalt": "cellplan",  # the same drawing gives the same bytes
        "svg.fonttype": "path",
        "font.family": "DejaVu Sans",
        "mathtext.fontset": "dejavusans",
        "font.size": 11,
    }
)


def canvas(width: float, height: float) -> Axes:
    """An empty sheet on which one unit is one inch."""
    figure = plt.figure(figsize=(width, height))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal")
    axes.axis("off")
    axes.add_patch(Rectangle((0, 0), width, height, facecolor="white", edgecolor="none", zorder=-10))
    return axes


def save(axes: Axes, name: str) -> None:
    """Write one figure without a date in it."""
    axes.figure.savefig(IMAGES / name, metadata={"Date": None, "Creator": "docs/make_figures.py"})
    plt.close("all")


def arrow(axes: Axes, start: Point, end: Point, *, colour: str = INK, bend: float = 0.0, style: str = "-") -> None:
    """An arrow from one point to another."""
    axes.add_patch(
        FancyArrowPatch(
            start,
            end,
            arrowstyle="-|>",
            mutation_scale=13,
            color=colour,
            linewidth=1.6,
            linestyle=style,
            connectionstyle=f"arc3,rad={bend}",
            shrinkA=0,
            shrinkB=0,
        )
    )


def frame(axes: Axes, origin: Point, directions: tuple[Point, Point], *, name: str, at: Point) -> None:
    """The x and z axes of a frame with its letter beside them."""
    for (dx, dy), axis in zip(directions, "xz", strict=True):
        arrow(axes, origin, (origin[0] + dx, origin[1] + dy))
        axes.text(origin[0] + 1.22 * dx, origin[1] + 1.22 * dy, axis, ha="center", va="center", fontsize=9)
    axes.text(origin[0] + at[0], origin[1] + at[1], name, ha="center", va="center", fontweight="bold", fontsize=12)


def arm(axes: Axes, points: list[Point], *, colour: str) -> None:
    """A robot as base, links and joints."""
    x, y = zip(*points, strict=True)
    axes.add_patch(Rectangle((x[0] - 0.26, y[0] - 0.16), 0.52, 0.16, facecolor=colour, edgecolor=INK, linewidth=0.8))
    axes.plot(x, y, color=colour, linewidth=9, solid_capstyle="round", solid_joinstyle="round", alpha=0.55, zorder=1)
    axes.plot(x[:-1], y[:-1], "o", color="white", markeredgecolor=INK, markersize=7, zorder=2)


def draw_frames() -> None:
    """World, part and tool, and the three motions between them."""
    axes = canvas(8.2, 4.4)
    axes.plot([0.2, 8.0], [0.5, 0.5], color=GREY, linewidth=1)
    arm(axes, [(1.5, 0.66), (1.35, 1.9), (2.35, 2.75), (3.0, 2.45)], colour=PART)
    axes.add_patch(Polygon([(3.0, 1.85), (4.6, 1.85), (4.6, 3.05), (3.0, 3.05)], facecolor="#dbe7f2", edgecolor=PART))
    axes.add_patch(Ellipse((4.6, 2.45), 0.35, 1.2, facecolor="#c9dbec", edgecolor=PART))
    arm(axes, [(6.9, 0.66), (7.05, 2.1), (6.25, 3.15), (5.3, 2.75)], colour=OPERATOR)
    axes.plot([5.3, 4.78], [2.75, 2.62], color=INK, linewidth=3, zorder=1)
    frame(axes, (0.55, 0.5), ((0.5, 0.0), (0.0, 0.5)), name="W", at=(-0.18, 0.2))
    frame(axes, (3.8, 2.3), ((0.5, 0.0), (0.0, 0.5)), name="P", at=(-0.2, -0.1))
    frame(axes, (4.78, 2.62), ((0.12, -0.44), (-0.44, -0.12)), name=r"T$_i$", at=(0.22, 0.27))
    arrow(axes, (0.65, 0.66), (3.72, 2.2), colour=PART, bend=0.2, style="--")
    axes.text(2.45, 1.55, r"$X_{WP}(q_p)$", color=PART, ha="center")
    arrow(axes, (0.65, 0.56), (4.82, 2.5), colour=OPERATOR, bend=0.3, style="--")
    axes.text(4.85, 1.2, r"$X_{WT_i}(q_i)$", color=OPERATOR, ha="center")
    arrow(axes, (3.8, 2.3), (4.72, 2.6), colour=INK, bend=-0.35)
    axes.text(3.98, 2.84, r"$p_i$", ha="center")
    axes.text(1.35, 3.2, r"positioner, $q_p$", color=PART, ha="center")
    axes.text(7.0, 3.6, r"operator $i$, $q_i$", color=OPERATOR, ha="center")
    save(axes, "frames.svg")


def draw_arrow_matrix() -> None:
    """Which block of the cooperation Jacobian is filled, for one positioner and three operators."""
    axes = canvas(7.6, 3.7)
    left, top, width, height = 1.75, 2.85, 1.3, 0.8
    heads = [r"$\dot q_p$", r"$\dot q_1$", r"$\dot q_2$", r"$\dot q_3$"]
    for column, head in enumerate(heads):
        axes.text(left + (column + 0.5) * width, top + 0.22, head, ha="center", color=PART if column == 0 else OPERATOR)
    for row in range(3):
        y = top - (row + 1) * height
        axes.text(left - 0.2, y + height / 2, rf"$_P V_{{PT_{row + 1}}}\;=$", ha="right", va="center")
        for column in range(4):
            text, colour = "0", ZERO
            if column == 0:
                text, colour = rf"$-\Phi(p_{row + 1})\,J_{{WP}}$", "#dbe7f2"
            elif column == row + 1:
                text, colour = rf"$J_{{WT_{row + 1}}}$", "#f6dfd0"
            box = Rectangle((left + column * width, y), width, height, facecolor=colour, edgecolor=INK, linewidth=0.9)
            axes.add_patch(box)
            shade = GREY if text == "0" else INK
            x = left + (column + 0.5) * width
            axes.text(x, y + height / 2, text, ha="center", va="center", color=shade)
    axes.text(
        left + width / 2, 0.17, "the part moves\nunder the tools", ha="center", va="center", fontsize=9, color=PART
    )
    axes.text(left + 2.5 * width, 0.17, "each operator moves its own tool", ha="center", va="center", fontsize=9)
    save(axes, "arrow.svg")


def block(axes: Axes, centre: Point, text: str, *, width: float = 1.15) -> None:
    """A box of a block diagram."""
    corner = (centre[0] - width / 2, centre[1] - 0.3)
    axes.add_patch(
        FancyBboxPatch(corner, width, 0.6, boxstyle="round,pad=0,rounding_size=0.06", facecolor=PALE, edgecolor=INK)
    )
    axes.text(*centre, text, ha="center", va="center")


def junction(axes: Axes, centre: Point) -> None:
    """A circle in which signals are added."""
    axes.add_patch(Ellipse(centre, 0.32, 0.32, facecolor="white", edgecolor=INK, linewidth=1.2))
    axes.text(*centre, "+", ha="center", va="center")


def draw_loop() -> None:
    """One step of the integration."""
    axes = canvas(8.6, 3.0)
    y, below = 1.75, 0.6
    block(axes, (1.0, y), "schedule", width=1.2)
    block(axes, (2.7, y), r"pose error", width=1.1)
    block(axes, (4.05, y), r"$K$", width=0.6)
    junction(axes, (4.95, y))
    block(axes, (6.05, y), r"$J^{\#}(q)$", width=0.9)
    block(axes, (7.55, y), r"$q + \dot q\,dt$", width=1.15)
    block(axes, (4.6, below), "where the tools are on the part", width=3.0)
    arrow(axes, (1.6, y), (2.15, y))
    axes.text(1.86, y + 0.14, r"$X_{PT}$", ha="center", fontsize=9)
    arrow(axes, (3.25, y), (3.75, y))
    axes.text(3.5, y + 0.12, r"$e$", ha="center")
    arrow(axes, (4.35, y), (4.79, y))
    arrow(axes, (5.11, y), (5.6, y))
    arrow(axes, (6.5, y), (6.97, y))
    axes.text(6.73, y + 0.14, r"$\dot q$", ha="center")
    axes.plot([1.0, 1.0, 4.95], [y + 0.3, 2.65, 2.65], color=INK, linewidth=1.6)
    arrow(axes, (4.95, 2.65), (4.95, y + 0.16))
    axes.text(3.0, 2.73, r"desired relative twist  $_P V_{PT}$", ha="center", fontsize=10)
    axes.plot([7.55, 7.55], [y - 0.3, below], color=INK, linewidth=1.6)
    arrow(axes, (7.55, below), (6.1, below))
    axes.text(7.75, 1.0, r"$q$", ha="left")
    axes.plot([3.1, 2.7], [below, below], color=INK, linewidth=1.6)
    arrow(axes, (2.7, below), (2.7, y - 0.3))
    save(axes, "loop.svg")


def link(axes: Axes, centre: Point, text: str, *, colour: str = INK) -> None:
    """A vertex of a coupling graph."""
    width = 0.3 if len(text) < 3 else 0.62
    axes.add_patch(Ellipse(centre, width, 0.3, facecolor="white", edgecolor=colour, linewidth=1.4, zorder=3))
    axes.text(*centre, text, ha="center", va="center", fontsize=8, zorder=4)


def chain(axes: Axes, links: list[Point], names: list[str], *, colour: str, offset: Point, style: str = "-") -> None:
    """Edges of a coupling graph from link to link, with their names to one side."""
    for (x0, y0), (x1, y1), name in zip(links[:-1], links[1:], names, strict=True):
        dx, dy = x1 - x0, y1 - y0
        scale = 0.2 / (dx * dx + dy * dy) ** 0.5
        start, end = (x0 + scale * dx, y0 + scale * dy), (x1 - scale * dx, y1 - scale * dy)
        arrow(axes, start, end, colour=colour, style=style)
        middle = ((x0 + x1) / 2 + offset[0], (y0 + y1) / 2 + offset[1])
        axes.text(*middle, name, ha="center", va="center", fontsize=9, color=colour)


def draw_coupling_graph() -> None:
    """Coupling graph of a positioner and two operators in the plane, with its two circuits."""
    axes = canvas(8.2, 4.5)
    middle = 4.1
    held = [(middle, 0.45), (middle, 1.4), (middle, 2.35), (middle, 3.55)]
    chain(axes, held, ["A", "B", "C"], colour=PART, offset=(0.2, 0.0))
    for side, (number, letters) in zip((-1, 1), (("1", "DEF"), ("2", "GHI")), strict=True):
        arm_links = [(middle + side * x, y) for x, y in ((0.0, 0.45), (1.5, 0.55), (2.6, 1.05), (3.1, 2.35))]
        virtual = [(middle + side * x, y) for x, y in ((0.0, 3.55), (1.1, 3.95), (2.2, 3.8), (3.1, 2.35))]
        chain(axes, arm_links, list(letters), colour=OPERATOR, offset=(side * 0.12, -0.2))
        names = [rf"$p_x$, {number}", rf"$p_y$, {number}", rf"$r_z$, {number}"]
        chain(axes, virtual, names, colour=GREY, offset=(side * 0.14, 0.22), style="--")
        for point, text in zip(arm_links[1:], ("1", "2", f"tool {number}"), strict=True):
            link(axes, point, text, colour=OPERATOR)
        for point in virtual[1:-1]:
            link(axes, point, "", colour=GREY)
        top, low = (middle + side * 1.05, 2.95), (middle + side * 1.05, 1.45)
        arrow(axes, top, (middle + side * 1.95, 2.2), bend=side * -0.35)
        arrow(axes, (middle + side * 1.95, 2.1), low, bend=side * -0.35)
        axes.text(middle + side * 1.25, 2.2, f"circuit {number}", ha="center", va="center", fontsize=10)
    for point, text in zip(held, ("world", "1", "2", "part"), strict=True):
        link(axes, point, text, colour=PART)
    save(axes, "circuits.svg")


if __name__ == "__main__":
    IMAGES.mkdir(exist_ok=True)
    draw_frames()
    draw_arrow_matrix()
    draw_loop()
    draw_coupling_graph()
