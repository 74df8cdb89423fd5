"""What a report tells of errors between the rows of the tables, in printed units."""

import math

from cellplan.model.between_rows import BetweenError, BetweenRows
from cellplan.model.cell import Cell
from cellplan.model.report import Report
from cellplan.report.record.run import Record, number, tasks_record


def full_tasks_record(report: Report, cell: Cell) -> Record:
    """Tool errors by task, at the rows of the tables and between them."""
    record = tasks_record(report, cell)
    for accuracy in report.accuracy:
        if accuracy.between is not None:
            position, orientation = cell.task(accuracy.task).tolerance.between
            task = record[accuracy.task]
            task |= between_record(accuracy.between)
            task["tolerance"] |= {
                "between_rows_mm": number(1e3 * position),
                "between_rows_deg": number(math.degrees(orientation)),
            }
    return record


def between_record(between: BetweenRows) -> Record:
    """Largest errors between the rows, their instants, and what the verdict rests on."""
    return {
        **_error_record("position", between.position, 1e3, "mm"),
        **_error_record("orientation", between.orientation, math.degrees(1.0), "deg"),
    }


def _error_record(kind: str, error: BetweenError, scale: float, unit: str) -> Record:
    return {
        f"max_{kind}_error_between_rows_{unit}": number(scale * error.largest),
        f"max_{kind}_error_between_rows_at_s": number(error.at_s),
        f"{kind}_error_between_rows_bound_{unit}": None if error.bound is None else number(scale * error.bound),
        f"{kind}_error_between_rows_by": error.proof,
    }
