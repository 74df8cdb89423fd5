"""Smoothed paths in a record: the tube, the roughness with its bound, and the errors against the file."""

from typing import Annotated, TypedDict

from cellplan.model.report.smoothing import ListedErrors
from cellplan.model.task.smoothing import Roughness
from cellplan.model.task.task import SampledPath, Task
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Number, number


class RoughnessRecord(TypedDict):
    """Root mean square of the second derivative over the length of the path, in 1/m or rad/m2."""

    given: Annotated[Number, "of the points or axes of the file"]
    smoothed: Annotated[Number, "of the smoothed ones"]
    bound: Annotated[Number, "nothing within the tube has less"]


class SmoothingRecord(TypedDict):
    """A smoothed path and the errors of its tool against the points and axes of the file, tracking errors included."""

    position_mm: Annotated[Number, "radius of the tube round the points; 0 where they stay"]
    direction_deg: Annotated[Number, "half angle of the cone about the axes; 0 where they stay"]
    into_mm: Annotated[Number, "how far the tube goes along the axes, into the part"]
    points: Annotated[RoughnessRecord | None, "roughness of the points; null where they stay"]
    axes: Annotated[RoughnessRecord | None, "roughness of the axes; null where they stay"]
    max_position_error_mm: Annotated[Number, "largest distance from the curve of the file in the rows"]
    max_position_error_at_s: Annotated[Number, "its time"]
    max_orientation_error_deg: Annotated[Number, "largest angle from the orientation of the file in the rows"]
    max_orientation_error_at_s: Annotated[Number, "its time"]
    max_depth_mm: Annotated[Number, "largest distance along the axes of the file, into the part"]
    max_depth_at_s: Annotated[Number, "its time"]


class SmoothedRecord(TypedDict, total=False):
    """Only of a task whose path is smoothed."""

    smoothing: Annotated[SmoothingRecord, "how the path was smoothed, and errors against its file"]


def smoothed_record(errors: ListedErrors | None, task: Task) -> SmoothedRecord:
    """How the path of a task was smoothed; nothing where it was not."""
    smoothing = task.path.smoothing if isinstance(task.path, SampledPath) else None
    if errors is None or smoothing is None:
        return {}
    record: SmoothingRecord = {
        "position_mm": number(smoothing.position, MM),
        "direction_deg": number(smoothing.direction, DEG),
        "into_mm": number(smoothing.into, MM),
        "points": _roughness_record(smoothing.of_points),
        "axes": _roughness_record(smoothing.of_axes),
        "max_position_error_mm": number(errors.position, MM),
        "max_position_error_at_s": number(errors.position_at_s),
        "max_orientation_error_deg": number(errors.orientation, DEG),
        "max_orientation_error_at_s": number(errors.orientation_at_s),
        "max_depth_mm": number(errors.into, MM),
        "max_depth_at_s": number(errors.into_at_s),
    }
    return {"smoothing": record}


def _roughness_record(roughness: Roughness | None) -> RoughnessRecord | None:
    """A roughness with its bound."""
    if roughness is None:
        return None
    return {
        "given": number(roughness.given),
        "smoothed": number(roughness.smoothed),
        "bound": number(roughness.bound),
    }
