"""The line to type for a cell that fails; nothing of it is worked out here."""

import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from cellplan.io.yaml.writer import flow_text
from cellplan.model.cell import Cell
from cellplan.pipeline.synchronous import is_searchable

OPTIONS: Final = {"motion.duration_s": "--duration", "checks.clearance_mm": "--clearance"}  # by address


def repair_line(cell: Path, changes: Mapping[str, object], allow_dirs: Sequence[Path] = ()) -> str:
    """The line to type for a cell that fails.

    Args:
        cell: The cell file, as the user named it.
        changes: Values that were set in it, by address.
        allow_dirs: Further folders that the files it names may lie in.
    """
    words = ["cellplan", "layout", str(cell), "--repair"]
    for address, value in changes.items():
        text = "null" if value is None else flow_text(value)
        words += [OPTIONS[address], text] if address in OPTIONS else ["--set", f"{address}={text}"]
    for folder in allow_dirs:
        words += ["--allow-dir", str(folder)]
    return f"next: {shlex.join(words)}"


def repair_lines(cell: Path, solved: Cell, allow_dirs: Sequence[Path] = ()) -> list[str]:
    """The same for a job that can be searched; nothing for others."""
    return [repair_line(cell, solved.origin.changes, allow_dirs)] if is_searchable(solved) else []
