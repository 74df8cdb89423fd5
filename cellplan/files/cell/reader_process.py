"""The process that reads robots and meshes, begun while this one still imports what it reads a cell by."""

import re
from contextlib import suppress
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.files import read_regular_file
from cellplan.guard import begin_child

SIZE_LIMIT: Final = 1_000_000  # [bytes] of a cell file; in a larger one nothing is looked for
READERS: Final = {
    rb"\.(?:urdf|xacro)\b": "cellplan.files.robots.urdf.load",
    rb"\.(?:stl|obj|ply|dae)\b": "cellplan.geometry.mesh.load",
}  # modules by what a cell file has that names such files


def begin_reading(cell: Path | None) -> None:
    """Begin the process if a cell file seems to name a robot or a mesh; what it really names is read later."""
    text = b""
    with suppress(InputError):
        text = b"" if cell is None else read_regular_file(cell, file=str(cell), limit=SIZE_LIMIT)
    modules = [module for pattern, module in READERS.items() if re.search(pattern, text, re.IGNORECASE)]
    if modules:
        begin_child(*modules)
