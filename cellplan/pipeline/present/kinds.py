"""Kinds of results that JSON files hold, each as its own file says how it is shown."""

from collections.abc import Mapping
from typing import Final

from cellplan.pipeline.fastest.result import FASTEST
from cellplan.pipeline.sweep_result import STUDY
from cellplan.report.page.kind import Kind
from cellplan.report.record.common import Record
from cellplan.report.record.rows import Tables, format_of, tables_of_record

KINDS: Final[Mapping[str, Kind]] = {kind.name: kind for kind in (FASTEST, STUDY)}


def record_tables(record: Record) -> Tables:
    """The tables of a record by its format; nothing for a format without tables."""
    kind = KINDS.get(format_of(record))
    return tables_of_record(record) if kind is None else kind.tables(record)
