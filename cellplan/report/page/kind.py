"""A kind of result, as frames and notebooks show it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from cellplan.report.plots.figure import Figure
from cellplan.report.record.common import Record
from cellplan.report.record.rows import Tables


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of result.

    Attributes:
        name: As the schema of its record has it.
        title: Of its card.
        tables: Its tables by name.
        shown: Tables on its card and their columns.
        pictures: Pictures on its card.
    """

    name: str
    title: str
    tables: Callable[[Record], Tables]
    shown: Mapping[str, tuple[str, ...]]
    pictures: Callable[[Record], Mapping[str, Figure | None]]
