"""What the URDF of a robot in a cell draws of its links."""

from pathlib import PurePosixPath

from cellplan.cache import as_here
from cellplan.errors import InputError
from cellplan.files.cell.load import CellFile
from cellplan.files.cell.referenced_files import URDF_SUFFIXES, argument_text
from cellplan.files.cell.user_folders import user_folders
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.urdf.load import UrdfOptions
from cellplan.files.robots.urdf.visuals import Visual, read_visuals
from cellplan.guard import Guard, in_child
from cellplan.model.cell.cell import Cell


def robot_visuals(cell: Cell, robot: str) -> tuple[Visual, ...]:
    """Visual elements of a robot; none of a robot without a URDF, or whose URDF cannot be read any more."""
    source = cell.origin.source
    if not isinstance(source, CellFile):
        return ()
    entry = source.written["robots"][robot]
    written = str(entry["model"])
    if PurePosixPath(written).suffix.lower() not in URDF_SUFFIXES:
        return ()
    folders = AllowedFolders(folder=source.folder, allowed=(*source.allow_dirs, *user_folders(source.folder)))
    try:
        options = UrdfOptions(
            package_dirs=tuple(folders.directory(folder) for folder in entry.get("package_dirs", ())),
            within=folders,
            xacro_args={key: argument_text(value) for key, value in entry.get("xacro_args", {}).items()},
        )
        guard = Guard(file=written, worker="the URDF reader")
        return in_child(as_here(read_visuals), folders.file(written), options, guard=guard)
    except InputError:
        return ()
