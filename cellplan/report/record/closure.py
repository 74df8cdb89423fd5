"""What a report tells of closures: how far the tools of further holders stray from their grasps, in printed units."""

import math
from collections.abc import Iterable

import numpy as np

from cellplan.model.cell import Cell
from cellplan.model.report import ClosureAccuracy, Report
from cellplan.report.record.between_rows import between_record
from cellplan.report.record.run import AXES, Record, number


def closures_record(report: Report, cell: Cell) -> Record:
    """Closure errors by robot, of every holder but the first."""
    return {closure.robot: _closure_record(closure, report, cell) for closure in report.closures}


def worst_closures_record(runs: Iterable[Report], cell: Cell) -> Record:
    """Closure errors by robot: the largest distance and the largest angle of all runs, each with its instant."""
    worst: Record = {}
    for report in runs:
        for robot, record in closures_record(report, cell).items():
            known = worst[robot] = worst.get(robot) or record
            for name, instant in (
                ("max_position_error_mm", "at_s"),
                ("max_orientation_error_deg", "max_orientation_error_at_s"),
                ("max_position_error_between_rows_mm", "max_position_error_between_rows_at_s"),
                ("max_orientation_error_between_rows_deg", "max_orientation_error_between_rows_at_s"),
            ):
                if name in record and record[name] > known[name]:
                    known |= {name: record[name], instant: record[instant]}
    return {
        robot: {key: value for key, value in record.items() if "mean" not in key} for robot, record in worst.items()
    }


def _closure_record(closure: ClosureAccuracy, report: Report, cell: Cell) -> Record:
    """Largest and mean distance and angle of one tool, with what is allowed and what is kept."""
    position = np.linalg.norm(closure.position_error, axis=1)
    orientation = np.linalg.norm(closure.orientation_error, axis=1)
    worst, most_turned = int(np.argmax(position)), int(np.argmax(orientation))
    return {
        "max_position_error_mm": number(1e3 * position[worst]),
        "max_orientation_error_deg": number(math.degrees(orientation[most_turned])),
        "at_s": number(report.times[worst]),
        "max_orientation_error_at_s": number(report.times[most_turned]),
        "mean_position_error_mm": number(1e3 * position.mean()),
        "mean_orientation_error_deg": number(math.degrees(orientation.mean())),
        "allowed": {
            "position_mm": number(1e3 * cell.checks.closure_position),
            "orientation_deg": number(math.degrees(cell.checks.closure_orientation)),
        },
        "axes": [AXES[index] for index in closure.axes],
        **({} if closure.between is None else between_record(closure.between)),
    }
