"""Open meshes of tools and surroundings are refused unless the cell says that they are surfaces; links are listed."""

from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh

from cellplan.model.cell.cell import Cell
from cellplan.report.record.sections.rests_on import open_surfaces_record
from cellplan.report.text.notes import open_surface_notes

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
FLOOR = "  floor: {plane: {z_mm: 0}}"
OPEN = (
    "a.stl: expected a closed surface, got 3 open edges, 0 edges of more than two triangles and 0 edges whose "
    "triangles face opposite directions, the longest open one from (-250, -200, -150) to (-250, 200, 150) mm: repair "
    "the mesh, or set open: true, with which no point counts as inside it"
)


@pytest.fixture(autouse=True)
def torn(tmp_path: Path) -> None:
    """A box without one of its triangles, and a whole one, beside the cell."""
    box = trimesh.creation.box((500, 400, 300))
    box.export(tmp_path / "whole.stl")
    trimesh.Trimesh(box.vertices, box.faces[1:], process=False).export(tmp_path / "a.stl")


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        (FLOOR, "  room: {{mesh: a.stl, unit: mm{}}}", "c:23: environment.room.mesh"),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {{geometry: {{mesh: a.stl, unit: mm{}}}}}",
            "c:10: robots.worker.tool.geometry.mesh",
        ),
        (
            "tool: {xyz_mm: [0, 0, 100]}",
            "tool: {{bodies: [{{mesh: a.stl, unit: mm{}}}]}}",
            "c:10: robots.worker.tool.bodies[0].mesh",
        ),
    ],
    ids=["surroundings", "tool", "tool body"],
)
def test_an_open_mesh_is_refused_unless_it_is_a_surface(
    load: Load, refuse: Refuse, old: str, new: str, key: str
) -> None:
    assert refuse((old, new.format(""))) == [f"{key}: {OPEN}"]
    assert refuse((old, new.format(", open: false"))) == [f"{key}: {OPEN}"]

    cell = load((old, new.format(", open: true")))

    (result,) = open_surfaces_record(cell)
    (line,) = open_surface_notes([result])
    assert (result["open_edges"], result["has_inside"]) == (3, False)
    assert line[1].endswith("has 3 open edges: contact is detected, containment is not")


def test_a_closed_mesh_that_may_be_open_is_a_solid_all_the_same(load: Load) -> None:
    cell = load((FLOOR, "  room: {mesh: whole.stl, unit: mm, open: true}"))

    assert cell.obstacles[0].shape.is_closed
    assert open_surfaces_record(cell) == []


def test_open_links_are_listed_robot_by_robot() -> None:
    links = [
        {"body": f"arm/link_{k}", "key": "robots.arm.model", "mesh": "a.stl", "open_edges": 3, "has_inside": True}
        for k in range(5)
    ]

    assert list(open_surface_notes(links)) == [
        (
            "robots.arm.model",
            "5 meshes of links are open (arm/link_0, arm/link_1, arm/link_2, …): points with a winding number "
            "above one half count as inside",
        )
    ]
