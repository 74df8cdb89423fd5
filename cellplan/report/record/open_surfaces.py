"""Open surfaces: meshes that are not closed, and how it is judged what lies inside them."""

from collections.abc import Iterable, Iterator
from typing import Any, Final

from cellplan.geometry.mesh.load import open_edges
from cellplan.geometry.shapes import Mesh, Shape
from cellplan.model.cell import Cell, Robot

Record = dict[str, Any]

NAMED: Final = 3  # [-] links of a robot that a line names; the rest is counted


def open_surfaces_record(cell: Cell) -> list[Record]:
    """Each body whose mesh is not closed, with the key that names it, and whether it has an inside all the same."""
    return [
        {
            "body": body,
            "key": key,
            "mesh": shape.source,
            "open_edges": open_edges(shape),
            "has_inside": shape.is_leaky,
        }
        for body, key, shape in _bodies(cell)
        if isinstance(shape, Mesh) and not shape.is_closed
    ]


def open_surface_lines(found: Iterable[Record]) -> Iterator[tuple[str, str]]:
    """A line for each open surface, those of one robot's links in one, and the key that it is about."""
    links: dict[str, list[Record]] = {}
    for each in found:
        if each["has_inside"]:
            links.setdefault(each["key"], []).append(each)
        else:
            edges = f"{each['open_edges']} open edge{'s' if each['open_edges'] != 1 else ''}"
            yield (
                each["key"],
                f"the mesh of {each['body']} has {edges}: touching it counts, being inside it does not",
            )
    for key, meshes in links.items():
        names = ", ".join(each["body"] for each in meshes[:NAMED]) + (", …" if len(meshes) > NAMED else "")
        count = f"{len(meshes)} meshes of links are" if len(meshes) > 1 else "the mesh of a link is"
        yield key, f"{count} open ({names}): what they wind round by more than one half counts as inside"


def _bodies(cell: Cell) -> Iterator[tuple[str, str, Shape]]:
    """Name of each body, the key of the cell that it comes from, and its shape."""
    for robot in cell.robots:
        key = f"robots.{robot.name}"
        for link in robot.model.bodies:
            yield f"{robot.name}/{link.name}", f"{key}.model", link.shape
        yield from _tool_bodies(robot, f"{key}.tool")
    for thing in cell.obstacles:
        yield thing.name, f"environment.{thing.name}", thing.shape


def _tool_bodies(robot: Robot, key: str) -> Iterator[tuple[str, str, Shape]]:
    """Solids of a tool, called as in reports."""
    for number, body in enumerate(robot.tool.bodies, start=1):
        yield f"{robot.name}/tool" if number == 1 else f"{robot.name}/tool_{number}", key, body.shape
