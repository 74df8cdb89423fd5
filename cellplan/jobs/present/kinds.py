"""Kinds of results that JSON files hold, each as its own file says how it is shown."""

from collections.abc import Mapping
from typing import Final

from cellplan.jobs.assign.result import ASSIGNMENT
from cellplan.jobs.base_map.result import MAP
from cellplan.jobs.compare.result import COMPARISON
from cellplan.jobs.fastest.result import FASTEST
from cellplan.jobs.layout.result import LAYOUT
from cellplan.jobs.rehearsal.result import REHEARSAL
from cellplan.jobs.repair.result import ADVICE
from cellplan.jobs.sweep.result import STUDY
from cellplan.report.page.kind import ResultKind
from cellplan.report.record.common import Record
from cellplan.report.record.rows import Tables, curve_columns, format_of, run_tables

TASK_COLUMNS: Final = (
    "task",
    "robot",
    "max_position_error_mm",
    "tolerance.position_mm",
    "max_orientation_error_deg",
    "tolerance.orientation_deg",
    "path_length_mm",
    "start_s",
    "end_s",
)
RUN: Final = ResultKind(
    name="report",
    title="Run",
    file="report.json",
    tables=lambda record: run_tables([record]),
    shown={"tasks": TASK_COLUMNS},
)
SERIES: Final = ResultKind(
    name="series",
    title="series",
    file="series.json",
    tables=lambda record: {"curves": lambda: curve_columns(record)},
    shown={},
)
# where two files are, the first is shown
OF_JOBS: Final = (MAP, FASTEST, ASSIGNMENT, ADVICE, REHEARSAL, COMPARISON, LAYOUT, STUDY)
KINDS: Final[Mapping[str, ResultKind]] = {kind.name: kind for kind in (*OF_JOBS, RUN, SERIES)}


def record_tables(record: Record) -> Tables:
    """The tables of a record by its format; nothing for a format without tables."""
    kind = KINDS.get(format_of(record))
    return {} if kind is None else kind.tables(record)


def record_of(result: object) -> Record | None:
    """The record of a result whose tables and card are those of its JSON file; None for others."""
    for kind in OF_JOBS:
        if kind.made_of is not None and kind.record is not None and isinstance(result, kind.made_of):
            return kind.record(result)
    record = getattr(result, "record", None)  # of a layout search, or a repair
    return record if isinstance(record, Mapping) else None
