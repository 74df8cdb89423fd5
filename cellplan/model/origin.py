"""Origin: the document that a cell was read from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from cellplan.model.cell.cell import Cell


class CellSource(Protocol):
    """The document that a cell was read from; a reader of files provides it, so that the model needs none."""

    @property
    def written(self) -> Mapping[str, Any]:
        """The values of the document as they stand in it, no default filled in."""

    def with_values(self, cell: "Cell", values: Mapping[str, object]) -> "Cell":
        """The cell of the document with other values; see ``Cell.with_values``."""


@dataclass(frozen=True, slots=True)
class Origin:
    """The document of a cell: source lines for located errors, and what is needed to write or to change it."""

    file: str = "<cell>"  # file name as the user gave it
    # line number, from 1, of each key path (``robots.kuka.start_deg``) that the file gives
    lines: Mapping[str, int] = field(default_factory=dict)
    # the file as plain values in the file's units, every default filled in: what a written copy is made of
    document: Mapping[str, object] = field(default_factory=dict)
    # values set by ``Cell.with_values``, by address, in the order in which they were set
    changes: Mapping[str, object] = field(default_factory=dict)
    # what to print for each changed key path: ``motion.duration_s = 2.5``
    changed: Mapping[str, str] = field(default_factory=dict)
    # reads the document again with other values; None for a cell that was built in Python
    source: CellSource | None = None

    def at(self, key: str) -> str:
        """``file:line: key`` for a key path; the nearest enclosing key gives the line when the key is a default."""
        enclosing = key
        while enclosing not in self.lines and enclosing not in self.changed and "." in enclosing:
            enclosing = enclosing.rpartition(".")[0]
        inside = (f"{key}.", f"{key}[")
        changes = [text for path, text in self.changed.items() if path == enclosing or path.startswith(inside)]
        line = self.lines.get(enclosing)
        where = f"{self.file}:{line}" if line else self.file
        return f"{where} with {', '.join(changes)}: {key}" if changes else f"{where}: {key}"
