"""The floor plan on a sheet of paper, as SVG text: to scale when it is printed without scaling."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import groupby
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.report.floor_plan.pendants import pendant_lines
from cellplan.report.floor_plan.plan import Dimension, FloorPlan, Layer, PlanRobot, PlanWall, length_text
from cellplan.report.floor_plan.reactions import SHORT, reaction_numbers, reaction_title, unstated_reactions
from cellplan.report.record.common import shortened

SVG_START: Final = '<svg class="plan-sheet"'
WIDTH_MM, HEIGHT_MM = 297, 210  # A4 across
UNIT: Final = 10.0  # units of the sheet per [mm] of paper
MARGIN, COLUMN, GAP = 90, 700, 40  # units: border, width of the table, distance between it and the plan
HEADING: Final = 150  # units above the plan
BAND, ROW = 70, 75  # units from the plan to the first row of dimensions, and from row to row
ROWS: Final = 2
TYPED, TYPED_LETTERS = 36, 190  # units between lines of frames to type, and letters in them
AXES: Final = (60.0, 36.0)  # units: x and y axes of frames of the part
SCALES: Final = (1, 2, 5, 10, 15, 20, 25, 30, 40, 50, 60, 75, 100, 125, 150, 200, 250, 300, 400, 500)
BARS: Final = (100.0, 200.0, 500.0, 1000.0, 2000.0, 5000.0, 10_000.0, 20_000.0)  # [mm] lengths of a scale bar
LONGEST_BAR: Final = 480  # units
TEXT: Final = 34  # units between lines of the table
REACTION_COLUMNS, REACTION_LETTERS = (330, 450, 575, 700), 48  # units: right ends of columns; letters in a line
NAME_IN_LINE, NAME_ABOVE, NAME_IN_PLAN = 7, 32, 16  # letters of names beside and above their numbers, and in the plan
FONT: Final = 'system-ui,"Segoe UI","Helvetica Neue",Arial,sans-serif'
LIGHT: Final = f"""
svg.plan-sheet {{ font-family: {FONT}; color-scheme: light dark; max-width: 100%; height: auto; }}
.plan-sheet path, .plan-sheet circle {{ stroke-width: 2.5; stroke-linejoin: round; fill: none; }}
.plan-sheet .sheet {{ fill: #fff; }}
.plan-sheet text {{ font-size: 27px; fill: #1d2733; }}
.plan-sheet .title {{ font-size: 48px; font-weight: 700; }}
.plan-sheet .soft {{ font-size: 29px; fill: #55616f; }}
.plan-sheet .head {{ font-weight: 600; fill: #55616f; }}
.plan-sheet .right {{ text-anchor: end; }}
.plan-sheet .name {{ font-weight: 700; font-size: 31px; }}
.plan-sheet .name, .plan-sheet .thing, .plan-sheet .length {{ text-anchor: middle; paint-order: stroke; stroke: #fff; }}
.plan-sheet .name, .plan-sheet .thing, .plan-sheet .length {{ stroke-width: 8px; stroke-linejoin: round; }}
.plan-sheet .thing {{ font-size: 22px; fill: #55616f; }}
.plan-sheet .robots {{ stroke: #55616f; fill: #55616f; fill-opacity: .10; }}
.plan-sheet .base {{ fill-opacity: .42; stroke-width: 4; }}
.plan-sheet .reach {{ stroke: #55616f; stroke-width: 2.5; stroke-dasharray: 16 10; }}
.plan-sheet .swept {{ stroke: #55616f; fill: #55616f; fill-opacity: .13; fill-rule: evenodd; }}
.plan-sheet .swept {{ stroke-width: 2; stroke-opacity: .6; }}
.plan-sheet .whole {{ stroke: #1d2733; stroke-width: 3.5; stroke-dasharray: 3 8; stroke-linecap: round; }}
.plan-sheet .part {{ stroke: #6d5712; stroke-width: 4; fill: #b9a26a; fill-opacity: .55; }}
.plan-sheet .surroundings {{ stroke: #77828e; stroke-width: 3.5; fill: #c3cad2; fill-opacity: .55; }}
.plan-sheet .wall {{ stroke: #77828e; stroke-width: 7; }}
.plan-sheet .path {{ stroke-width: 5; stroke: #55616f; }}
.plan-sheet .dimension, .plan-sheet .cross {{ stroke: #1d2733; }}
.plan-sheet .cross, .plan-sheet .bar, .plan-sheet .axes {{ stroke: #1d2733; stroke-width: 4; }}
.plan-sheet .rule {{ stroke: #b9c1cb; }}
"""
MONOSPACED: Final = ".plan-sheet text.typed { font: 24px ui-monospace, monospace; white-space: pre; }\n"
DARK: Final = """
.plan-sheet .sheet { fill: #161b22; }
.plan-sheet text { fill: #e3e8ee; }
.plan-sheet .soft, .plan-sheet .head, .plan-sheet .thing { fill: #9aa5b1; }
.plan-sheet .name, .plan-sheet .thing, .plan-sheet .length { stroke: #161b22; }
.plan-sheet .whole, .plan-sheet .dimension, .plan-sheet .cross, .plan-sheet .bar, .plan-sheet .axes { stroke: #e3e8ee; }
.plan-sheet .part { stroke: #d6c288; }
.plan-sheet .rule { stroke: #4a5563; }
"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sheet:
    """How a plan lies on the paper."""

    scale: float  # how many [mm] of the cell one [mm] of paper stands for
    middle: Array  # point of the cell in [mm] in the middle of the plan, shape (2,)
    low: Array  # left upper corner of the plan in units, shape (2,)
    high: Array  # right lower corner, shape (2,)

    def place(self, points: Array) -> Array:
        """Points of the cell in [mm], shape (..., 2), in units of the sheet: x to the right and y down."""
        return 0.5 * (self.low + self.high) + UNIT / self.scale * (points - self.middle) * (1.0, -1.0)


def laid_out(plan: FloorPlan) -> Sheet:
    """The largest usual scale at which a plan fits."""
    band = BAND + ROWS * ROW
    low = np.array([MARGIN + band, MARGIN + HEADING])
    high = np.array([UNIT * WIDTH_MM - MARGIN - COLUMN - GAP, UNIT * HEIGHT_MM - MARGIN - band])
    least, most = plan.bounds
    needed = float((UNIT * (most - least) / (high - low)).max())
    scale = next((candidate for candidate in SCALES if candidate >= needed), 100 * int(np.ceil(needed / 100.0)))
    return Sheet(scale=float(scale), middle=0.5 * (least + most), low=low, high=high)


def floor_plan_svg(plan: FloorPlan) -> str:
    """A floor plan as the text of an SVG element that stands alone or in a page; equal plans give equal text."""
    sheet = laid_out(plan)
    numbers = {robot.name: index for index, robot in enumerate(plan.robots)}
    height = _height(plan)
    robots = ", ".join(f"{robot.name} at x {robot.base[0]:.1f} mm, y {robot.base[1]:.1f} mm" for robot in plan.robots)
    body = [
        f'{SVG_START} xmlns="http://www.w3.org/2000/svg" width="{WIDTH_MM}mm" height="{height}mm" '
        f'viewBox="0 0 {UNIT * WIDTH_MM:.0f} {UNIT * height:.0f}" role="img" '
        'aria-labelledby="floor-plan-title floor-plan-desc">',
        f'<title id="floor-plan-title">Floor plan of {escape(plan.cell)}, scale 1:{sheet.scale:g}</title>',
        f'<desc id="floor-plan-desc">{escape(plan.state)}. {escape(robots)}.</desc>',
        f"<style>{style([robot.colour for robot in plan.robots])}{MONOSPACED if plan.pendants else ''}</style>",
        f'<rect class="sheet" width="{UNIT * WIDTH_MM:.0f}" height="{UNIT * height:.0f}"/>',
        *_heading(plan, sheet),
        *_areas(plan, sheet, numbers),
        *_bodies(plan, sheet, numbers),
        *_bases(plan, sheet, numbers),
        *(line for dimension in plan.dimensions for line in _dimension(dimension, sheet)),
        *_table(plan, sheet, numbers),
        *_frames(plan, sheet),
        *_pendants(plan),
        "</svg>\n",
    ]
    return "\n".join(body)


def _heading(plan: FloorPlan, sheet: Sheet) -> Iterator[str]:
    """Title and state above the plan."""
    yield _text("title", MARGIN, MARGIN + 40, f"Floor plan of {plan.cell}")
    paper = "A3" if plan.pendants else "A4"
    yield _text("soft", MARGIN, MARGIN + 88, f"{plan.state}; scale 1:{sheet.scale:g} on {paper}, lengths in mm")


def _areas(plan: FloorPlan, sheet: Sheet, numbers: dict[str, int]) -> Iterator[str]:
    """What lies below: reach, swept areas and walls."""
    for wall in plan.walls:
        yield f'<path class="wall" d="{_wall(wall, sheet)}"><title>{escape(wall.name)}</title></path>'
    for robot in plan.robots:
        yield _reach(robot, sheet, f"reach r{numbers[robot.name]}")
    for robot in plan.robots:
        if robot.swept:
            path = _closed(sheet.place(line) for line in robot.swept)
            name = escape(robot.name)
            yield f'<path class="swept r{numbers[robot.name]}" d="{path}"><title>{name}: swept area</title></path>'
    if plan.whole:
        yield f'<path class="whole" d="{_closed(sheet.place(line) for line in plan.whole)}"/>'


def _bodies(plan: FloorPlan, sheet: Sheet, numbers: dict[str, int]) -> Iterator[str]:
    """Outlines of the surroundings, of robots at the start and of the part, and the paths."""
    for layer in (Layer.SURROUNDINGS, Layer.ROBOTS, Layer.PART):
        for outline in (one for one in plan.outlines if one.layer is layer):
            kind = "" if outline.robot is None or layer is Layer.PART else f" r{numbers[outline.robot]}"
            base = " base" if outline.is_base else ""
            path = _closed([sheet.place(outline.corners)])
            yield f'<path class="{layer}{kind}{base}" d="{path}"><title>{escape(outline.name)}</title></path>'
            if layer is Layer.SURROUNDINGS:
                x, y = sheet.place(outline.corners.mean(axis=0))
                yield _text("thing", x, y + 9, outline.name)
    for line in plan.paths:
        points = _points(sheet.place(line.points))
        kind = f"path r{numbers[line.robot]}"
        yield f'<path class="{kind}" d="M{points}"><title>{escape(line.task)}</title></path>'


def _bases(plan: FloorPlan, sheet: Sheet, numbers: dict[str, int]) -> Iterator[str]:
    """Places and names of the bases, and the direction of their x axes."""
    for robot in plan.robots:
        x, y = sheet.place(robot.base[:2])
        turn = np.radians(robot.yaw_deg)
        u, v = x + 75 * np.cos(turn), y - 75 * np.sin(turn)
        cross = f"M{x - 22:.1f} {y:.1f}H{x + 22:.1f}M{x:.1f} {y - 22:.1f}V{y + 22:.1f}M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}"
        yield f'<path class="cross" d="{cross}"/>'
        yield _text(f"name n{numbers[robot.name]}", x, y + 60, shortened(robot.name, NAME_IN_PLAN))


def _pendants(plan: FloorPlan) -> Iterator[str]:
    """Frames to type into the pendants, below the plan."""
    if plan.pendants:
        yield _text("title", MARGIN, UNIT * HEIGHT_MM + MARGIN, "Frames to type into the pendants")
    for number, words in enumerate(pendant_lines(plan.pendants), start=2):
        yield _text("typed", MARGIN, UNIT * HEIGHT_MM + MARGIN + TYPED * number, words[:TYPED_LETTERS])


def _height(plan: FloorPlan) -> int:
    """Height of the sheet in [mm]: A3 upright with frames to type, or what a longer list needs."""
    lines = len(list(pendant_lines(plan.pendants)))
    least = HEIGHT_MM + int(np.ceil((TYPED * (lines + 2) + 2 * MARGIN) / UNIT))
    return max(2 * HEIGHT_MM, least) if lines else HEIGHT_MM


def _frames(plan: FloorPlan, sheet: Sheet) -> Iterator[str]:
    """Fixed frames of the part: their x and y axes, and the names of those at one place above it."""
    for place, frames in plan.fixed_frames.items():
        x, y = sheet.place(np.array(place))
        for axes in (frame[:2, :2] * AXES for frame in frames.values()):
            (a, b), (c, d) = (axes * [[1.0], [-1.0]] + [[x], [y]]).T.tolist()
            yield f'<path class="cross" d="M{a:.1f} {b:.1f}L{x:.1f} {y:.1f}L{c:.1f} {d:.1f}"/>'
        yield _text("thing", x, y - 72, ", ".join(frames))


def _dimension(dimension: Dimension, sheet: Sheet) -> Iterator[str]:
    """A dimension below the plan, or to its left."""
    bounds = np.array([[dimension.first, dimension.first], [dimension.second, dimension.second]])
    (a, d), (b, c) = sheet.place(bounds)
    if dimension.axis == 0:
        at = sheet.high[1] + BAND + ROW * dimension.row
        lines = f"M{a:.1f} {at - 45:.1f}V{at + 12:.1f}M{b:.1f} {at - 45:.1f}V{at + 12:.1f}M{a:.1f} {at:.1f}H{b:.1f}"
        ticks = "".join(f"M{x - 9:.1f} {at + 9:.1f}L{x + 9:.1f} {at - 9:.1f}" for x in (a, b))
        yield f'<path class="dimension" d="{lines}{ticks}"/>'
        yield _text("length", 0.5 * (a + b), at - 10, length_text(dimension.length))
        return
    at = sheet.low[0] - BAND - ROW * dimension.row
    lines = f"M{at + 45:.1f} {d:.1f}H{at - 12:.1f}M{at + 45:.1f} {c:.1f}H{at - 12:.1f}M{at:.1f} {d:.1f}V{c:.1f}"
    ticks = "".join(f"M{at - 9:.1f} {y + 9:.1f}L{at + 9:.1f} {y - 9:.1f}" for y in (d, c))
    yield f'<path class="dimension" d="{lines}{ticks}"/>'
    x, y = at - 10, 0.5 * (c + d)
    yield (
        f'<text class="length" x="{x:.1f}" y="{y:.1f}" transform="rotate(-90 {x:.1f} {y:.1f})">'
        f"{length_text(dimension.length)}</text>"
    )


def _reach(robot: PlanRobot, sheet: Sheet, kind: str) -> str:
    """The reach of a robot: a circle, or the outline of what it reaches."""
    name = escape(robot.name)
    if robot.reach is None:
        course = _closed([sheet.place(robot.reach_outline)])
        return f'<path class="{kind}" d="{course}"><title>{name}: reach</title></path>'
    (x, y), radius = sheet.place(robot.centre), UNIT * robot.reach / sheet.scale
    title = f"<title>{name}: reach {robot.reach:.0f} mm</title>"
    return f'<circle class="{kind}" cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}">{title}</circle>'


def _table(plan: FloorPlan, sheet: Sheet, numbers: dict[str, int]) -> Iterator[str]:
    """Directions, scale bar, coordinates of the bases and what the lines mean."""
    left, top = UNIT * WIDTH_MM - MARGIN - COLUMN, MARGIN + HEADING
    yield from _directions(left + 40, top + 130)
    bar = max((length for length in BARS if UNIT * length / sheet.scale <= LONGEST_BAR), default=BARS[0])
    length, x, y = UNIT * bar / sheet.scale, left + 250.0, top + 105
    yield f'<path class="bar" d="M{x:.1f} {y - 14}V{y}H{x + length:.1f}V{y - 14}"/>'
    yield _text("key", x, y + 40, f"{bar:g} mm")
    y = top + 230
    columns = (("robot", 0), ("x", 258), ("y", 390), ("z", 493), ("yaw", 604), ("reach", COLUMN))
    for word, offset in columns:
        yield _text("head" if not offset else "head right", left + offset, y, word)
    yield f'<path class="rule" d="M{left} {y + 12}h{COLUMN}"/>'
    y += 6
    shown = _fitting(plan.robots, y)
    for robot in shown:
        y += TEXT
        yield f'<rect class="swatch n{numbers[robot.name]}" x="{left}" y="{y - 17}" width="16" height="16"/>'
        yield _text("key", left + 28, y, shortened(robot.name, NAME_ABOVE))
        y += TEXT * (_lines(robot) - 1)
        cells = (
            *(length_text(float(coordinate)) for coordinate in robot.base),
            f"{robot.yaw_deg:.1f}°".replace(".0°", "°"),
        )
        reach = "–" if robot.reach is None else f"{robot.reach:.0f}"
        for text, (_, offset) in zip((*cells, reach), columns[1:], strict=True):
            yield _text("key right", left + offset, y, text)
    if len(plan.robots) > len(shown):
        y += TEXT
        yield _text("key", left + 28, y, f"and {len(plan.robots) - len(shown)} more robots")
    y += 90
    for kind, words in _legend(plan):
        yield f'<path class="{kind} n0k" d="M{left} {y - 6}h44v-16h-44z"/>'
        yield _text("key", left + 64, y - 4, words)
        y += TEXT
    yield from _reactions(plan, numbers, left, y + 60)


def _reactions(plan: FloorPlan, numbers: dict[str, int], left: float, top: float) -> Iterator[str]:
    """Base reactions of the robots that have some, as many as there is space for, and who has none."""
    known = [(robot, robot.reaction) for robot in plan.robots if robot.reaction is not None]
    yield _text("head", left, top, reaction_title(plan))
    for heading, right in zip(SHORT, REACTION_COLUMNS, strict=True):
        yield from [_text("head right", left + right, top + TEXT, heading)] if known else []
    y, bottom = top + TEXT * bool(known), UNIT * HEIGHT_MM - MARGIN - 2 * TEXT
    count = max(0, min(len(known), int((bottom - y) / TEXT)))
    for robot, reaction in known[:count]:
        y += TEXT
        yield f'<rect class="swatch n{numbers[robot.name]}" x="{left}" y="{y - 17}" width="16" height="16"/>'
        yield _text("key", left + 28, y, shortened(robot.name, NAME_ABOVE // 2))
        for text, right in zip(reaction_numbers(reaction), REACTION_COLUMNS, strict=True):
            yield _text("key right", left + right, y, text)
    more = f"and {len(known) - count} more in the report" if len(known) > count else ""
    for words in filter(None, (more, unstated_reactions(plan))):
        y += TEXT
        yield _text("key", left, y, shortened(words, REACTION_LETTERS))


def _lines(robot: PlanRobot) -> int:
    """Lines of the table that a robot takes: a long name has one for itself."""
    return 2 if len(robot.name) > NAME_IN_LINE else 1


def _fitting(robots: Sequence[PlanRobot], top: float) -> Sequence[PlanRobot]:
    """The robots that the table has room for."""
    count = int((UNIT * HEIGHT_MM - MARGIN - top - 530) / TEXT) - 1
    taken = np.cumsum([_lines(robot) for robot in robots])
    return robots[: int(np.searchsorted(taken, count, side="right"))]


def _directions(x: float, y: float) -> Iterator[str]:
    """Axes of the world."""
    yield f'<path class="axes" d="M{x} {y}h90m-14 -9l14 9l-14 9M{x} {y}v-90m-9 14l9 -14l9 14"/>'
    yield _text("key", x + 104, y + 9, "x")
    yield _text("key", x - 8, y - 104, "y")


def _legend(plan: FloorPlan) -> list[tuple[str, str]]:
    """What the lines mean, by their kinds."""
    entries = [
        ("robots base", "base, stands still"),
        ("robots", "links and tools at the start"),
        ("part", "part at the start"),
    ]
    if any(outline.layer is Layer.SURROUNDINGS for outline in plan.outlines) or plan.walls:
        entries.append(("surroundings", "surroundings"))
    entries.append(("reach", "reach of the flange"))
    if plan.square is not None:
        entries += [
            ("swept", f"swept area, in squares of {plan.square:g} mm"),
            ("whole", "swept area of the whole cell"),
        ]
    return [*entries, ("path", "paths of the tasks")]


def _wall(wall: PlanWall, sheet: Sheet) -> str:
    """Path of the part of a wall that crosses the plan."""
    along = np.array([-wall.normal[1], wall.normal[0]])
    reach = float(np.linalg.norm(sheet.high - sheet.low)) * sheet.scale / UNIT
    nearest = wall.point + along * float((sheet.middle - wall.point) @ along)
    ends = np.array([nearest - along * reach, nearest + along * reach])
    low, high = sheet.low - 0.5 * BAND, sheet.high + 0.5 * BAND
    first, second = sheet.place(ends)
    step = second - first
    step = np.where(np.abs(step) < 1e-9, 1e-9, step)
    shares = np.sort(np.stack([(low - first) / step, (high - first) / step]), axis=0)
    enters, leaves = max(0.0, float(shares[0].max())), min(1.0, float(shares[1].min()))
    if enters >= leaves:
        return ""
    return f"M{_points(np.array([first + enters * step, first + leaves * step]))}"


def _closed(lines: Iterable[Array]) -> str:
    """Path of closed lines in units."""
    return "".join(f"M{_points(line)}z" for line in lines)


def _points(line: Array) -> str:
    """Points in units, those that are one once."""
    return "L".join(point for point, _ in groupby(f"{x:.1f} {y:.1f}" for x, y in line.tolist()))


def _text(kind: str, x: float, y: float, words: str) -> str:
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}">{escape(words)}</text>'


def style(colours: Sequence[str]) -> str:
    """All rules, with the colours of the robots in their order."""
    light, dark = [], []
    for number, colour in enumerate(colours):
        light.append(_of_robot(number, colour))
        dark.append(_of_robot(number, _lighter(colour)))
    return f"{LIGHT}{''.join(light)}@media screen and (prefers-color-scheme: dark) {{{DARK}{''.join(dark)}}}\n"


def _of_robot(number: int, colour: str) -> str:
    stroked = ", ".join(f".plan-sheet .{kind}.r{number}" for kind in ("robots", "swept", "reach", "path"))
    filled = ", ".join(f".plan-sheet .{kind}.r{number}" for kind in ("robots", "swept"))
    return f"{stroked} {{ stroke: {colour}; }}\n{filled}, .plan-sheet .n{number} {{ fill: {colour}; }}\n"


def _lighter(colour: str) -> str:
    """A colour that can be read in dark surroundings."""
    channels = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(channel + 0.45 * (255 - channel)):02x}" for channel in channels)
