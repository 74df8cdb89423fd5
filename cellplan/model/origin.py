"""Origin: file and lines that a cell was read from."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Origin:
    """Source of a cell: its file and the line of each key, so that a later finding can still name the line.

    Attributes:
        file: File name as the user gave it.
        lines: Line number, from 1, of each key path (``robots.kuka.start_deg``).
        document: The file as plain values in the file's units, every default filled in: what a written copy is made of.
    """

    file: str = "<cell>"
    lines: Mapping[str, int] = field(default_factory=dict)
    document: Mapping[str, object] = field(default_factory=dict)

    def at(self, key: str) -> str:
        """``file:line: key`` for a key path; the nearest enclosing key gives the line when the key is a default."""
        enclosing = key
        while enclosing not in self.lines and "." in enclosing:
            enclosing = enclosing.rpartition(".")[0]
        line = self.lines.get(enclosing)
        return f"{self.file}:{line}: {key}" if line else f"{self.file}: {key}"
