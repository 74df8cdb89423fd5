"""What a URDF draws of its links, and links whose bodies are far smaller than that."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.robots.urdf.bodies import MeshShelf, find_mesh
from cellplan.files.robots.urdf.document.document import UrdfLink, UrdfMesh, read_solid
from cellplan.files.robots.urdf.tree import UrdfTree, ZeroConfiguration, links_in_order
from cellplan.geometry.shapes import Solid, support
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.robot.robot import Body

FAR_SMALLER: Final = 0.5  # [-] of an edge of the box round a drawing
VISIBLE: Final = 0.01  # [m] by which an edge is shorter at least
LARGEST_DRAWING: Final = 20_000_000  # [bytes] of a mesh file that is read for nothing but its size


def shape_solids(link: UrdfLink, shelf: MeshShelf, *, largest: float = np.inf) -> list[tuple[Solid, Array]]:
    """Shapes that a link draws, with their poses in its frame, shape (4, 4); none where one cannot be read.

    Mesh files of more bytes than ``largest`` are not read.
    """
    solids: list[tuple[Solid, Array]] = []
    try:
        for element in link.element.all("visual"):
            solid = read_solid(element, f"link '{link.name}'")
            if not isinstance(solid.shape, UrdfMesh):
                solids.append((solid.shape, solid.X_LS))
                continue
            path, _ = find_mesh(solid.shape.uri, shelf.packages)
            if path.stat().st_size > largest:
                return []
            solids.append((shelf.mesh(solid.shape, element), solid.X_LS))
    except InputError:
        return []
    return solids


def edges_of_box(solids: Sequence[tuple[Solid, Array]]) -> Array:
    """Edges of the box round at least one shape, posed in L, along the axes of the frame L, in [m], shape (3,)."""
    sides = np.vstack([np.eye(3), -np.eye(3)])
    reach = [support(shape, sides @ X_LS[:3, :3]) + sides @ X_LS[:3, 3] for shape, X_LS in solids]
    farthest = np.max(reach, axis=0)
    return farthest[:3] + farthest[3:]


def small_bodies(
    tree: UrdfTree, configuration: ZeroConfiguration, bodies: Sequence[Body], *, flange: str, shelf: MeshShelf
) -> Iterator[str]:
    """Remarks on links whose collision bodies are far smaller than what is drawn of them.

    What is read from the shelf here is no input of the robot.
    """
    apart = MeshShelf(shelf.packages)
    for link in links_in_order(tree):
        X_LB = inverse(configuration.X_BL[link.name])
        solids = [(body.shape, X_LB @ body.X_BS) for body in bodies if body.link_name == link.name]
        parts = shape_solids(link, apart, largest=LARGEST_DRAWING) if link.element.all("collision") and solids else []
        if not parts:
            continue
        edges, size = edges_of_box(solids), edges_of_box(parts)
        if np.any((edges < FAR_SMALLER * size) & (size - edges > VISIBLE)):
            ours, theirs = (" x ".join(f"{1e3 * edge:.3g}" for edge in box) for box in (edges, size))
            carries = configuration.carrier[link.name] == configuration.carrier[flange]
            rest = "its flange" if carries else "the rest of it"
            place = f"{tree.document.file}: link '{link.name}'"
            yield f"{place}: its bodies measure {ours} mm, its drawing {theirs} mm: nothing protects {rest}"
