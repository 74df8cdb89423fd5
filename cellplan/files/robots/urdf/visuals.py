"""What a URDF draws of its links, for pictures: nothing is judged by it."""

from dataclasses import dataclass
from pathlib import Path

from cellplan.files.robots.urdf.bodies import MeshShelf
from cellplan.files.robots.urdf.document.document import read_document
from cellplan.files.robots.urdf.document.packages import Packages
from cellplan.files.robots.urdf.drawings import shape_solids
from cellplan.files.robots.urdf.load import UrdfOptions
from cellplan.geometry.shapes import Solid
from cellplan.geometry.transforms import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Visual:
    """One visual element: its shape, and the pose of the shape in the frame of its link, shape (4, 4)."""

    link: str
    shape: Solid
    X_LS: Array


def read_visuals(path: Path, options: UrdfOptions) -> tuple[Visual, ...]:
    """Visual elements of all links that have collision elements too; the bodies of all others are drawn already.

    A link of which one cannot be read is left out: it is drawn by its bodies.
    """
    shelf = MeshShelf(Packages(folder=path.parent, package_dirs=options.package_dirs, within=options.within))
    visuals: list[Visual] = []
    for link in read_document(path, options.xacro).links.values():
        if link.element.all("collision"):
            solids = shape_solids(link, shelf)
            visuals += [Visual(link=link.name, shape=shape, X_LS=X_LS) for shape, X_LS in solids]
    return tuple(visuals)
