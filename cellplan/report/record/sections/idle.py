"""Idle robots in a record, and moves that the program does not contain."""

from collections.abc import Iterable, Mapping
from typing import TypedDict

from cellplan.model.cell.cell import Cell
from cellplan.model.cell.idle import not_in_program
from cellplan.model.report.report import Report


class IdleRecord(TypedDict):
    """Idle robots and missing moves."""

    idle: list[str]
    not_in_program: list[str]


def idle_record(cell: Cell, report: Report) -> IdleRecord:
    """Idle robots of one run, and moves that its program does not contain."""
    return {"idle": list(report.idle), "not_in_program": missing_moves(cell, {None: report.tasks})}


def missing_moves(cell: Cell, runs: Mapping[str | None, Iterable[str]]) -> list[str]:
    """Lines on moves that the programs of several runs do not contain, each with the name of its run.

    Args:
        runs: Names of its tasks, by the name of the run.
    """
    lines = {run: not_in_program(cell, tuple(tasks)) for run, tasks in runs.items()}
    return [f"{run}: {line}" if run else line for run, line in lines.items() if line]
