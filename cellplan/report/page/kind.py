"""A kind of result, as frames and notebooks show it."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from cellplan.report.plots.figure import Figure
from cellplan.report.record.common import Record
from cellplan.report.record.rows import Tables


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultKind:
    """A kind of result."""

    name: str  # as the schema of its record has it
    title: str  # of its card
    file: str = "study.json"  # the file with its record, in its folder
    made_of: type | None = None  # the type of results of which records are made; None where they hold their records
    record: Callable[[Any], Record] | None = None  # makes the record of such a result
    tables: Callable[[Record], Tables]  # its tables by name
    shown: Mapping[str, tuple[str, ...]]  # tables on its card and their columns
    pictures: Callable[[Record], Mapping[str, Figure | None]] = lambda _: {}  # pictures on its card
    good: Collection[str] = ("passed",)  # statuses of a good result
