"""Aligned columns: what is measured, its figure, and where it stands; two spaces or more between columns."""

from collections.abc import Iterable, Sequence

Row = tuple[str, str, str]  # what, its figure, where and when


def aligned(rows: Iterable[Sequence[str]], indent: str = "  ") -> list[str]:
    """Indented lines of rows with as many columns each, as wide as their widest texts; empty columns are left out."""
    table = [tuple(row) for row in rows]
    if not table:
        return []
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        indent + "  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True) if width).rstrip()
        for row in table
    ]
