"""What lies inside a mesh without touching it: solids and leaky links enclose, surfaces do not."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Mesh, Sphere
from cellplan.geometry.transforms import pose
from cellplan.scene.collision.bodies import checked_poses, prepare
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.containment import is_inside

BOX = tessellate(Box((1.0, 1.0, 1.0)))
TORN = make_mesh(BOX.vertices, BOX.faces[1:], source="link.stl")
INSIDE_OUT = make_mesh(BOX.vertices, BOX.faces[1:, ::-1], source="link.stl")


def holds(mesh: Mesh, *, x: float = 0.0) -> bool:
    engine = Engine([prepare("ball", Sphere(0.05)), prepare("mesh", mesh)])
    poses = checked_poses([pose((x, 0.0, 0.0))[None], np.eye(4)[None]])
    return is_inside(engine, (0, 1), poses, sample=0)


@pytest.mark.parametrize("mesh", [TORN, INSIDE_OUT], ids=["outward", "inward"])
def test_a_leaky_link_encloses_whichever_way_it_faces(mesh: Mesh) -> None:
    assert not mesh.is_closed
    assert holds(replace(mesh, is_leaky=True))
    assert not holds(replace(mesh, is_leaky=True), x=0.8)


def test_a_surface_encloses_nothing_and_a_solid_does() -> None:
    assert not holds(TORN)
    assert holds(BOX)
