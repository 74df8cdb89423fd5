"""Link bodies of a URDF: mesh files looked up and read, every collision element turned into one body."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Final
from urllib.parse import unquote

from cellplan.errors import InputError
from cellplan.files.input.findings import listed, shown
from cellplan.files.robots.urdf.document.document import UrdfLink, UrdfMesh, UrdfSolid
from cellplan.files.robots.urdf.document.packages import Packages, is_file
from cellplan.files.robots.urdf.document.xml import Element, Remarks
from cellplan.files.robots.urdf.tree import UrdfTree, ZeroConfiguration, links_in_order
from cellplan.geometry.mesh.load import FORMATS, is_flat, read_mesh, unknown_format
from cellplan.geometry.shapes import Mesh, Solid
from cellplan.model.robot.robot import Body, free_name

PACKAGE: Final = "package://"


@dataclass(slots=True)
class MeshShelf:
    """Finds and reads the mesh files of one URDF, each once."""

    packages: Packages  # folders that names of meshes are looked up in
    files: list[Path] = field(default_factory=list)  # mesh files read so far, in the order of first use
    remarks: Remarks = field(default_factory=Remarks)  # names of meshes that only some programs understand
    _read: dict[tuple[Path, tuple[float, float, float]], Mesh] = field(default_factory=dict)

    def mesh(self, desired: UrdfMesh, element: Element) -> Mesh:
        """The mesh in [m] that an element names; ``InputError`` where there is none, or it is flat."""
        name = PurePosixPath(desired.uri)
        if name.suffix and name.suffix.lower() not in FORMATS:
            raise unknown_format(name.name)
        path, remark = find_mesh(desired.uri, self.packages)
        if remark is not None:
            self.remarks.add(remark, f"mesh {shown(desired.uri)}: {remark}", element)
        key = (path, desired.scale)
        if key not in self._read:
            mesh = read_mesh(path, scale=desired.scale)
            if is_flat(mesh):
                raise InputError(f"{path.name}: expected a body with a volume, got a flat one")
            self._read[key] = replace(mesh, is_leaky=not mesh.is_closed)
            if path not in self.files:
                self.files.append(path)
        return self._read[key]


def link_bodies(tree: UrdfTree, configuration: ZeroConfiguration, shelf: MeshShelf) -> tuple[Body, ...]:
    """One body for each collision element, named after its link; further ones of a link are numbered from 2.

    An ``InputError`` has the line of an element whose mesh is missing or unsound.
    """
    links = links_in_order(tree)
    taken = {link.name for link in links}
    bodies: list[Body] = []
    for link in links:
        for place, solid in enumerate(link.solids):
            name = link.name if place == 0 else free_name(link.name, taken)
            taken.add(name)
            X_BS = configuration.X_BL[link.name] @ solid.X_LS
            carrier = configuration.carrier[link.name]
            shape = _solid(link, solid, shelf)
            bodies.append(Body(name=name, link=carrier, shape=shape, X_BS=X_BS, link_name=link.name))
    return tuple(bodies)


def find_mesh(uri: str, packages: Packages) -> tuple[Path, str | None]:
    """File that a mesh name means, and a remark where other programs may read the name otherwise.

    ``package://NAME/rest`` is looked up as `Packages` says; ``package:///NAME/rest`` likewise, and where no package is
    named, ``rest`` below the same folders. Other names are relative to the URDF. Absolute paths and ``file://`` count
    below the URDF's folder, a package folder or a folder of ``within``; a name that only begins with a slash is looked
    up below the first two. Nothing outside the folders ``within`` of the packages is accessed.

    An ``InputError`` names every place that was tried.
    """
    within = packages.within
    if uri.startswith(PACKAGE):
        tried = _package_places(uri.removeprefix(PACKAGE), packages)
    else:
        tried = _plain_places(uri, packages)
    inside = [place for place in tried if within is None or within.holds(place)]
    if tried and not inside:
        raise InputError(
            "expected a mesh below the folder of the cell file, got one elsewhere; allow it with --allow-dir"
        )
    place = next((place for place in inside if is_file(place)), None)
    if place is None:
        cure = "" if len(tried) == 1 else ": name the folder that holds it in `package_dirs`"
        raise InputError(f"no such mesh file, tried {listed(map(str, inside))}{cure}")
    return place, tried[place]


def _package_places(name: str, packages: Packages) -> dict[Path, str | None]:
    """Places where a file of a package may lie, and what is unusual about its name at each."""
    package, _, rest = name.lstrip("/").partition("/")
    plain = rest.lstrip("/")
    if not package or package in (".", "..") or (not plain and not name.startswith("/")):
        raise InputError("expected package://NAME/path")
    if not plain:
        return dict.fromkeys((root / package for root in packages.roots), "names no package, looked up without one")
    places, remark = packages.places(package, plain)
    is_usual = not name.startswith("/") and rest == plain
    return dict.fromkeys(places, remark or (None if is_usual else "has too many slashes, read as package://NAME/path"))


def _plain_places(uri: str, packages: Packages) -> dict[Path, str | None]:
    """Places of a file named by a path or by ``file://``, and what is unusual about its name at each."""
    folder, package_dirs, within = packages.folder, packages.package_dirs, packages.within
    scheme, mark, rest = uri.partition("://")
    if mark and scheme != "file":
        raise InputError(f"expected a path, package:// or file://, got {scheme}://")
    path = Path(re.sub("^/+", "/", unquote(rest) if mark else uri))
    if not path.is_absolute():
        return {folder / path: None}
    allowed = [folder, *package_dirs, *(() if within is None else (within.folder, *within.allowed))]
    if any(path.resolve().is_relative_to(root.resolve()) for root in allowed):
        return {path: "is an absolute path, which other machines will not have"}
    below = [root / path.relative_to(path.anchor) for root in (*package_dirs, folder)]
    if not any(is_file(place) for place in below if within is None or within.holds(place)):
        raise InputError("expected an absolute path below the URDF's folder or one of `package_dirs`")
    return dict.fromkeys(below, "begins with a slash, looked up below the folders of the URDF and of packages")


def _solid(link: UrdfLink, solid: UrdfSolid, shelf: MeshShelf) -> Solid:
    """Shape of one element; findings about its mesh get the line of the element."""
    if not isinstance(solid.shape, UrdfMesh):
        return solid.shape
    try:
        return shelf.mesh(solid.shape, solid.element)
    except InputError as error:
        place = solid.element.tag if solid.element.tag == "collision" else "visual, used as it has no collision element"
        raise solid.element.error(f"link '{link.name}' ({place}): mesh '{solid.shape.uri}': {error}") from None
