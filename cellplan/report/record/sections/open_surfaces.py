"""Open surfaces: meshes that are not closed, and how their inside is judged."""

from collections.abc import Iterator
from typing import Annotated, TypedDict

from cellplan.geometry.mesh.load import open_edges
from cellplan.geometry.shapes import Mesh, Shape
from cellplan.model.cell.cell import Cell, Robot


class OpenSurfaceRecord(TypedDict):
    """A body whose mesh is not closed."""

    body: Annotated[str, "the body"]
    key: Annotated[str, "key of the cell that names it"]
    mesh: Annotated[str, "file of the mesh"]
    open_edges: Annotated[int, "number of open edges"]
    has_inside: Annotated[
        bool, "whether points with a winding number above one half count as inside (links), or none do (`open: true`)"
    ]


def open_surfaces_record(cell: Cell) -> list[OpenSurfaceRecord]:
    """Each body whose mesh is not closed, with the key that names it, and whether it has an inside nevertheless."""
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


def _bodies(cell: Cell) -> Iterator[tuple[str, str, Shape]]:
    """Name of each body, its key in the cell, and its shape."""
    for robot in cell.robots:
        key = f"robots.{robot.name}"
        for link in robot.model.bodies:
            yield f"{robot.name}/{link.name}", f"{key}.model", link.shape
        yield from _tool_bodies(robot, f"{key}.tool")
    for thing in cell.obstacles:
        yield thing.name, f"environment.{thing.name}", thing.shape


def _tool_bodies(robot: Robot, key: str) -> Iterator[tuple[str, str, Shape]]:
    """Solids of a tool with their names in reports."""
    for number, body in enumerate(robot.tool.bodies, start=1):
        yield f"{robot.name}/tool" if number == 1 else f"{robot.name}/tool_{number}", key, body.shape
