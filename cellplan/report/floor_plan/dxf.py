"""The floor plan as a DXF drawing: true scale in millimetres, one layer for each kind of line."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from io import StringIO
from itertools import groupby
from typing import TYPE_CHECKING, Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.report.floor_plan.pendants import pendant_lines
from cellplan.report.floor_plan.plan import Dimension, FloorPlan, Layer, PlanWall, length_text
from cellplan.report.floor_plan.reactions import reaction_lines

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.blocklayout import BlockLayout
    from ezdxf.layouts.layout import Modelspace

VERSION: Final = "R2010"
MARK: Final = "999\ncellplan floor plan\n"  # a comment at the beginning of each drawing
NAMES: Final = "names"  # layer of texts
LINE_TYPES: Final = {Layer.REACH: "DASHED", Layer.SWEPT: "CONTINUOUS"}
WHOLE: Final = "DOT"  # line type of the swept area of the whole cell
COLOURS: Final = {
    Layer.SURROUNDINGS: 8,
    Layer.REACH: 9,
    Layer.SWEPT: 4,
    Layer.ROBOTS: 5,
    Layer.PART: 2,
    Layer.PATHS: 1,
    Layer.DIMENSIONS: 7,
}  # numbers of the colours of layers; what belongs to a robot has its own
TEXT_SHARE: Final = 0.012  # [-] height of texts by the size of the plan
TICK: Final = 0.5  # [-] half length of a tick by the height of texts
DIMENSION_TYPE: Final = 32  # a linear dimension with a block of its own

NO_DXF: Final = "--format dxf: expected the package ezdxf, got none: pip install 'cellplan[dxf]', or use --format svg"


def floor_plan_dxf(plan: FloorPlan) -> str:
    """A floor plan as the text of a DXF file; equal plans give equal text.

    Raises:
        InputError: The package ``ezdxf`` is not installed.
    """
    document = _document()
    space = document.modelspace()
    low, high = plan.bounds
    height = TEXT_SHARE * float((high - low).max())
    document.header["$LTSCALE"] = _number(height)  # dashes are as long as texts are high
    _draw_areas(space, plan)
    _draw_bodies(space, plan, height)
    _draw_bases(space, plan, height)
    for number, dimension in enumerate(plan.dimensions):
        _draw_dimension(document, dimension, corner=low - 3.0 * height, height=height, number=number)
    _draw_frames(space, plan, at=low - 12.0 * height, height=height)
    words = f"Floor plan of {plan.cell}: {plan.state}; lengths in mm"
    _text(space, NAMES, words, at=np.array([low[0], high[1] + 2.0 * height]), height=height)
    stream = StringIO()
    with _fixed_meta_data():
        document.write(stream)
    return MARK + stream.getvalue()


def require_dxf() -> None:
    """Refuse what needs ezdxf where that is not installed."""
    if find_spec("ezdxf") is None:
        raise InputError(NO_DXF)


def _document() -> "Drawing":
    """An empty drawing in millimetres with all layers."""
    try:
        from ezdxf.filemanagement import new
        from ezdxf.units import MM
    except ImportError as error:
        raise InputError(NO_DXF) from error
    with _fixed_meta_data():
        document = new(VERSION, setup=["linetypes"])
    document.units = MM
    document.header["$MEASUREMENT"] = 1  # metric line types
    for layer in Layer:
        kind = LINE_TYPES.get(layer, "CONTINUOUS")
        document.layers.add(str(layer), color=COLOURS[layer], linetype=kind)
    document.layers.add(NAMES, color=7)
    return document


@contextmanager
def _fixed_meta_data() -> Iterator[None]:
    """Dates and identifiers are the same in every drawing."""
    from ezdxf._options import options

    before = options.write_fixed_meta_data_for_testing
    options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        options.write_fixed_meta_data_for_testing = before


def _draw_areas(space: "Modelspace", plan: FloorPlan) -> None:
    """Walls, reach and swept areas."""
    for wall in plan.walls:
        first, second = _ends(wall, *plan.bounds)
        space.add_line(first, second, dxfattribs={"layer": str(Layer.SURROUNDINGS)})
    for robot in plan.robots:
        colour = {"true_color": int(robot.colour[1:], 16)}
        of_reach = {"layer": str(Layer.REACH), **colour}
        if robot.reach is None:
            _closed(space, robot.reach_outline, of_reach)
        else:
            space.add_circle(_point(robot.centre), _number(robot.reach), dxfattribs=of_reach)
        for line in robot.swept:
            _closed(space, line, {"layer": str(Layer.SWEPT), **colour})
    for line in plan.whole:
        _closed(space, line, {"layer": str(Layer.SWEPT), "linetype": WHOLE})


def _draw_bodies(space: "Modelspace", plan: FloorPlan, height: float) -> None:
    """Outlines of all bodies, and the paths."""
    colours = {robot.name: {"true_color": int(robot.colour[1:], 16)} for robot in plan.robots}
    for outline in plan.outlines:
        of_robot = colours[outline.robot] if outline.robot is not None and outline.layer is Layer.ROBOTS else {}
        _closed(space, outline.corners, {"layer": str(outline.layer), **of_robot})
        if outline.layer is Layer.SURROUNDINGS:
            _text(space, NAMES, outline.name, at=outline.corners.mean(axis=0), height=0.7 * height)
    for path in plan.paths:
        space.add_lwpolyline(_points(path.points), dxfattribs={"layer": str(Layer.PATHS), **colours[path.robot]})


def _draw_bases(space: "Modelspace", plan: FloorPlan, height: float) -> None:
    """A point at each base, the direction of its x axis, its name and its coordinates."""
    for robot in plan.robots:
        attributes = {"layer": str(Layer.ROBOTS), "true_color": int(robot.colour[1:], 16)}
        space.add_point([_number(coordinate) for coordinate in robot.base], dxfattribs=attributes)
        yaw = np.radians(robot.yaw_deg)
        toward = robot.base[:2] + 3.0 * height * np.array([np.cos(yaw), np.sin(yaw)])
        space.add_line(_point(robot.base[:2]), _point(toward), dxfattribs=attributes)
        x, y, z = (_number(coordinate) for coordinate in robot.base)
        lines = (robot.name, f"x {x:g} y {y:g} z {z:g} yaw {robot.yaw_deg:g} deg")
        for number, words in enumerate(lines):
            at = robot.base[:2] + height * np.array([0.6, -1.6 - 1.3 * number])
            _text(space, NAMES, words, at=at, height=(0.7 if number else 1.0) * height)


def _draw_frames(space: "Modelspace", plan: FloorPlan, *, at: Array, height: float) -> None:
    """Axes and names of fixed frames of the part, and below the plan base reactions and all frames to type."""
    for place, frames in plan.fixed_frames.items():
        for X_W in frames.values():
            for share, toward in zip((3.0, 1.8), X_W[:2, :2].T, strict=True):
                end = _point(np.array(place) + share * height * toward)
                space.add_line(place, end, dxfattribs={"layer": str(Layer.PART)})
        _text(space, NAMES, ", ".join(frames), at=np.array(place) - [0.0, 1.6 * height], height=0.7 * height)
    for number, words in enumerate([*reaction_lines(plan), *pendant_lines(plan.pendants)]):
        _text(space, NAMES, words, at=at - [0.0, 1.3 * height * number], height=0.7 * height)


def _draw_dimension(document: "Drawing", dimension: Dimension, *, corner: Array, height: float, number: int) -> None:
    """A DIMENSION below or left of the plan, with the lines and the text that show it as its block.

    Args:
        corner: Left lower corner of the first row of dimensions, shape (2,).
    """
    along, across = np.eye(2)[[dimension.axis, 1 - dimension.axis]]
    at = float(corner @ across) - 3.0 * height * dimension.row
    first, second = (place * along + at * across for place in (dimension.first, dimension.second))
    middle = 0.5 * (first + second) + 0.9 * height * across * (1.0 if dimension.axis == 0 else -1.0)
    block = document.blocks.new(f"*D{number + 1}")
    _fill_block(block, dimension, ends=(first, second), middle=middle, height=height)
    document.modelspace().new_entity(
        "DIMENSION",
        {
            "layer": str(Layer.DIMENSIONS),
            "geometry": block.name,
            "dimtype": DIMENSION_TYPE,
            "dimstyle": "Standard",
            "defpoint": _point(second),
            "defpoint2": _point(first),
            "defpoint3": _point(second),
            "text_midpoint": _point(middle),
            "angle": 0.0 if dimension.axis == 0 else 90.0,
            "text": length_text(dimension.length),
            "actual_measurement": _number(dimension.length),
        },
    )


def _fill_block(
    block: "BlockLayout", dimension: Dimension, *, ends: tuple[Array, Array], middle: Array, height: float
) -> None:
    """Line, ticks and text of a dimension."""
    attributes = {"layer": str(Layer.DIMENSIONS)}
    along, across = np.eye(2)[[dimension.axis, 1 - dimension.axis]]
    block.add_line(_point(ends[0]), _point(ends[1]), dxfattribs=attributes)
    for end in ends:
        block.add_line(_point(end - TICK * height * across), _point(end + 2.0 * height * across), dxfattribs=attributes)
        slant = TICK * height * (along + across)
        block.add_line(_point(end - slant), _point(end + slant), dxfattribs=attributes)
    turn = 0.0 if dimension.axis == 0 else 90.0
    text = block.add_text(length_text(dimension.length), height=_number(height), rotation=turn, dxfattribs=attributes)
    text.dxf.halign, text.dxf.valign = 4, 0  # its middle is where it is put
    text.dxf.insert = text.dxf.align_point = _point(middle)


def _ends(wall: PlanWall, low: Array, high: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ends of a wall beside a plan with some bounds."""
    along, middle = np.array([-wall.normal[1], wall.normal[0]]), 0.5 * (low + high)
    nearest = wall.point + along * float((middle - wall.point) @ along)
    half = 0.5 * float(np.linalg.norm(high - low)) * along
    return _point(nearest - half), _point(nearest + half)


def _closed(space: "Modelspace", line: Array, attributes: dict[str, object]) -> None:
    space.add_lwpolyline(_points(line), close=True, dxfattribs=attributes)


def _text(space: "Modelspace", layer: str, words: str, *, at: Array, height: float) -> None:
    """A line of text that begins at a point."""
    space.add_text(words, height=_number(height), dxfattribs={"layer": layer, "insert": _point(at)})


def _points(line: Array) -> list[tuple[float, float]]:
    """Points of a line, those that are one once."""
    return [place for place, _ in groupby(map(_point, line))]


def _point(point: Array) -> tuple[float, float]:
    """A point as plain numbers."""
    return _number(point[0]), _number(point[1])


def _number(value: float) -> float:
    """A length in [mm] to a thousandth."""
    return round(float(value), 3) + 0.0
