"""A kind of result, as frames and notebooks show it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from cellplan.report.plots.figure import Figure
from cellplan.report.record.common import Record
from cellplan.report.record.rows import Tables


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of result."""

    name: str  # as the schema of its record has it
    title: str  # of its card
    tables: Callable[[Record], Tables]  # its tables by name
    shown: Mapping[str, tuple[str, ...]]  # tables on its card and their columns
    pictures: Callable[[Record], Mapping[str, Figure | None]]  # pictures on its card
