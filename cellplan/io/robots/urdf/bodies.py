"""Link bodies of a URDF: mesh files looked up and read, every collision element turned into one body."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final
from urllib.parse import unquote

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import is_flat, read_mesh
from cellplan.geometry.shapes import Mesh, Solid
from cellplan.io.input.allowed_folders import AllowedFolders
from cellplan.io.input.findings import listed
from cellplan.io.robots.urdf.document import UrdfLink, UrdfMesh, UrdfSolid
from cellplan.io.robots.urdf.tree import UrdfTree, ZeroConfiguration, links_in_order
from cellplan.model.robot import Body

PACKAGE: Final = "package://"
LEVELS_UP: Final = 8  # folders above the URDF's that are searched for its package


@dataclass(slots=True)
class MeshShelf:
    """Finds and reads the mesh files of one URDF, each once.

    Attributes:
        folder: Folder of the URDF.
        package_dirs: Folders that hold packages (or are one).
        within: Folders that a mesh must lie in to be read; None for all.
        files: Mesh files read so far, in the order of first use.
    """

    folder: Path
    package_dirs: tuple[Path, ...]
    within: AllowedFolders | None = None
    files: list[Path] = field(default_factory=list)
    _read: dict[tuple[Path, tuple[float, float, float]], Mesh] = field(default_factory=dict)

    def mesh(self, desired: UrdfMesh) -> Mesh:
        """The mesh in [m].

        Raises:
            InputError: It is not found, cannot be read, or is flat.
        """
        path = find_mesh(desired.uri, self.folder, package_dirs=self.package_dirs, within=self.within)
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

    Raises:
        InputError: With the line of the element, when its mesh is missing or unsound.
    """
    links = links_in_order(tree)
    taken = {link.name for link in links}
    bodies: list[Body] = []
    for link in links:
        for place, solid in enumerate(link.solids):
            name = link.name if place == 0 else _free_name(link.name, taken)
            taken.add(name)
            X_BS = configuration.X_BL[link.name] @ solid.X_LS
            carrier = configuration.carrier[link.name]
            shape = _solid(link, solid, shelf)
            bodies.append(Body(name=name, link=carrier, shape=shape, X_BS=X_BS, link_name=link.name))
    return tuple(bodies)


def find_mesh(uri: str, folder: Path, *, package_dirs: tuple[Path, ...], within: AllowedFolders | None = None) -> Path:
    """File that a mesh name means: ``package://NAME/…``, or relative to the URDF.

    ``package://NAME/rest`` is looked up as ``DIR/NAME/rest``, then in a DIR that is itself called NAME, then in the
    folder of the URDF and those above it, in the same two ways. Absolute paths and ``file://`` count only below the
    URDF's folder or a package folder. Nothing outside the folders ``within`` is accessed.

    Raises:
        InputError: There is no such file; the message names every place that was tried.
    """
    if uri.startswith(PACKAGE):
        package, _, rest = uri.removeprefix(PACKAGE).partition("/")
        tried = _package_places(package, rest, folder, package_dirs=package_dirs)
        cure = ": name the folder that holds the package in `package_dirs`"
    else:
        tried = [_plain_place(uri, folder, package_dirs=package_dirs)]
        cure = ""
    inside = [place for place in tried if within is None or within.holds(place)]
    if tried and not inside:
        raise InputError(
            "expected a mesh below the folder of the cell file, got one elsewhere; allow it with --allow-dir"
        )
    found = next((place for place in inside if _is_file(place)), None)
    if found is None:
        raise InputError(f"no such mesh file, tried {listed(str(place) for place in inside)}{cure}")
    return found


def _is_file(place: Path) -> bool:
    """Whether there is a file; false for names that the system cannot resolve."""
    try:
        return place.is_file()
    except (OSError, ValueError):
        return False


def _package_places(package: str, rest: str, folder: Path, *, package_dirs: tuple[Path, ...]) -> list[Path]:
    """Places where a file of a package may lie."""
    if not package or package in (".", "..") or not rest:
        raise InputError("expected package://NAME/path")
    above = [folder, *folder.parents] if folder.is_absolute() else [folder, *folder.resolve().parents]
    roots = [*package_dirs, *above[: LEVELS_UP + 1]]
    places = [
        place for root in roots for place in (root / package / rest, root / rest) if _fits(root, place, package, rest)
    ]
    return list(dict.fromkeys(places))


def _fits(root: Path, place: Path, package: str, rest: str) -> bool:
    """A file straight below a folder belongs to the package only if the folder has its name."""
    return place != root / rest or root.resolve().name == package


def _plain_place(uri: str, folder: Path, *, package_dirs: tuple[Path, ...]) -> Path:
    """Place of a file named by a path or by ``file://``."""
    scheme, mark, rest = uri.partition("://")
    if mark and scheme != "file":
        raise InputError(f"expected a path, package:// or file://, got {scheme}://")
    path = Path(unquote(rest) if mark else uri)
    if not path.is_absolute():
        return folder / path
    allowed = [folder, *package_dirs]
    if not any(path.resolve().is_relative_to(root.resolve()) for root in allowed):
        raise InputError("expected an absolute path below the URDF's folder or one of `package_dirs`")
    return path


def _solid(link: UrdfLink, solid: UrdfSolid, shelf: MeshShelf) -> Solid:
    """Shape of one element; findings about its mesh get the line of the element."""
    if not isinstance(solid.shape, UrdfMesh):
        return solid.shape
    try:
        return shelf.mesh(solid.shape)
    except InputError as error:
        place = solid.element.tag if solid.element.tag == "collision" else "visual, used as it has no collision element"
        raise solid.element.error(f"link '{link.name}' ({place}): mesh '{solid.shape.uri}': {error}") from None


def _free_name(link: str, taken: set[str]) -> str:
    """``link_2`` or the next number that no link or body has."""
    number = 2
    while f"{link}_{number}" in taken:
        number += 1
    return f"{link}_{number}"
