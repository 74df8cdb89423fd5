"""Remarks about a robot file: what was not read, one line for each kind, with a count when there are many."""

from collections import Counter

from cellplan.files.robots.urdf.document.xml import Element


class Remarks:
    """Gathers remarks; of each kind the first one is kept and the others are counted."""

    def __init__(self) -> None:
        """Start with none."""
        self._first: dict[str, str] = {}
        self._count: Counter[str] = Counter()

    def add(self, kind: str, text: str, element: Element | None = None) -> None:
        """Note something; ``kind`` says which remarks are the same but for their place."""
        place = f"{element.file}:{element.line}: " if element is not None else ""
        self._first.setdefault(kind, place + text)
        self._count[kind] += 1

    @property
    def lines(self) -> tuple[str, ...]:
        """One line for each kind, in the order of their first occurrence."""
        return tuple(
            text + (f" (and {self._count[kind] - 1} more)" if self._count[kind] > 1 else "")
            for kind, text in self._first.items()
        )
