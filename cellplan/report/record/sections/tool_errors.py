"""Tool errors of tasks and grasps in printed units: at the rows of the tables and between them."""

from typing import Annotated, TypedDict

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.between_rows import BetweenRows
from cellplan.model.report.report import ClosureAccuracy, Report
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import AXES, Number, number


class BetweenRowsRecord(TypedDict, total=False):
    """Tool errors between the rows of the tables, all joints moving at constant velocity from row to row."""

    max_position_error_between_rows_mm: Annotated[Number, "largest distance found"]
    max_position_error_between_rows_at_s: Annotated[Number, "its time"]
    position_error_between_rows_bound_mm: Annotated[
        Number, "upper bound of that distance; null if the bound is above the tolerance"
    ]
    position_error_between_rows_by: Annotated[
        str, "what the verdict rests on: `bound`, or `ten subdivisions` of every step for which the bound is too wide"
    ]
    max_orientation_error_between_rows_deg: Annotated[Number, "largest angle found"]
    max_orientation_error_between_rows_at_s: Annotated[Number, "its time"]
    orientation_error_between_rows_bound_deg: Annotated[
        Number, "upper bound of that angle; null if the bound is above the tolerance"
    ]
    orientation_error_between_rows_by: Annotated[str, "likewise"]


class AllowedRecord(TypedDict):
    """Admissible errors of a grasp."""

    position_mm: Annotated[Number, "distance"]
    orientation_deg: Annotated[Number, "angle"]


class ClosureRecord(BetweenRowsRecord):
    """Deviation of the tool of a co-holder from its grasp."""

    max_position_error_mm: Annotated[Number, "largest distance"]
    max_orientation_error_deg: Annotated[Number, "largest angle"]
    at_s: Annotated[Number, "time of the largest distance"]
    max_orientation_error_at_s: Annotated[Number, "time of the largest angle"]
    allowed: Annotated[AllowedRecord, "admissible errors"]
    axes: Annotated[list[str], "constrained components of the grasp"]


class RunClosureRecord(ClosureRecord):
    """Deviation of the tool of a co-holder from its grasp in one run."""

    mean_position_error_mm: Annotated[Number, "mean distance over all samples"]
    mean_orientation_error_deg: Annotated[Number, "mean angle over all samples"]


def between_record(between: BetweenRows | None) -> BetweenRowsRecord:
    """Largest errors between the rows, their times, and the evidence; empty if they were not evaluated."""
    if between is None:
        return {}
    position, orientation = between.position, between.orientation
    return {
        "max_position_error_between_rows_mm": number(MM * position.largest),
        "max_position_error_between_rows_at_s": number(position.at_s),
        "position_error_between_rows_bound_mm": number(position.bound, MM),
        "position_error_between_rows_by": position.proof,
        "max_orientation_error_between_rows_deg": number(DEG * orientation.largest),
        "max_orientation_error_between_rows_at_s": number(orientation.at_s),
        "orientation_error_between_rows_bound_deg": number(orientation.bound, DEG),
        "orientation_error_between_rows_by": orientation.proof,
    }


def largest(error: Array) -> tuple[float, int]:
    """Largest length of the vectors, shape (N, 3), and its row."""
    length = np.linalg.norm(error, axis=1)
    worst = int(np.argmax(length))
    return float(length[worst]), worst


def mean_length(error: Array) -> float:
    """Mean length of the vectors, shape (N, 3)."""
    return float(np.linalg.norm(error, axis=1).mean())


def by_axis(error: Array, axes: tuple[str, ...]) -> dict[str, Number]:
    """Largest amount of each component, error of shape (N, 3)."""
    return {axis: number(value) for axis, value in zip(axes, np.abs(error).max(axis=0), strict=True)}


def closures_record(report: Report, cell: Cell) -> dict[str, RunClosureRecord]:
    """Closure errors by robot, of every co-holder."""
    return {closure.robot: _closure_record(closure, report, cell) for closure in report.closures}


def _closure_record(closure: ClosureAccuracy, report: Report, cell: Cell) -> RunClosureRecord:
    position, at_position = largest(closure.position_error)
    orientation, at_orientation = largest(closure.orientation_error)
    return {
        "max_position_error_mm": number(MM * position),
        "max_orientation_error_deg": number(DEG * orientation),
        "at_s": number(report.times[at_position]),
        "max_orientation_error_at_s": number(report.times[at_orientation]),
        "mean_position_error_mm": number(MM * mean_length(closure.position_error)),
        "mean_orientation_error_deg": number(DEG * mean_length(closure.orientation_error)),
        "allowed": {"position_mm": number(cell.checks.closure_mm), "orientation_deg": number(cell.checks.closure_deg)},
        "axes": [AXES[index] for index in closure.axes],
        **between_record(closure.between),
    }


def without_means(record: RunClosureRecord) -> ClosureRecord:
    """The record without what is a mean over one run."""
    rest = record.copy()
    del rest["mean_position_error_mm"], rest["mean_orientation_error_deg"]
    return rest
