"""Tools on smoothed paths against the points and axes that their files list."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.measures.tool_errors import error_lengths, errors_on_part, relative_to_task_frame
from cellplan.model.cell.cell import RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check
from cellplan.model.report.smoothing import ListedErrors
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import SampledPath, Task
from cellplan.model.units import DEG, MM
from cellplan.scene.kinematics.screw_chain import Chains

SAME_LENGTH: Final = 1e-9  # [m] rounding of lengths


def listed_errors(schedule: Schedule, chains: Chains, q: RobotRows, X_WP: Array) -> dict[str, ListedErrors]:
    """Errors of all tasks whose path was smoothed, in the rows on their paths, by task.

    A row is held against the curve of the file at the same parameter: no other place of that curve, such as one of a
    neighbouring line of a raster, makes its error smaller than it is.

    Args:
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    errors: dict[str, ListedErrors] = {}
    for path, scheduled in zip(schedule.paths, schedule.tasks, strict=False):
        task, listed = path.task, path.toolpath.listed
        on_path = (schedule.times >= task.judged_from) & _on_file(schedule, path, scheduled.travelled)
        if listed is None or not np.any(on_path):
            continue
        X_PT = relative_to_task_frame(task, chains[task.robot].tool_poses(q[task.robot]), X_WP)[on_path]
        times = schedule.times[on_path]
        nominal = times if schedule.clock is None else schedule.clock.at(times)
        desired = replace(path, toolpath=listed).poses(nominal)
        lengths = error_lengths(X_PT, desired, task)
        into = -np.sum(errors_on_part(X_PT, desired, task)[:, :3] * desired[:, :3, 2], axis=1)
        far, turned, deep = int(np.argmax(lengths[:, 0])), int(np.argmax(lengths[:, 1])), int(np.argmax(into))
        errors[task.name] = ListedErrors(
            position=float(lengths[far, 0]),
            position_at_s=float(times[far]),
            orientation=float(lengths[turned, 1]),
            orientation_at_s=float(times[turned]),
            into=float(into[deep]),
            into_at_s=float(times[deep]),
        )
    return errors


def check_listed(task: Task, errors: ListedErrors | None) -> Iterator[Check]:
    """Whether smoothing and tracking error together are within the tolerance, and along the axis within its bound."""
    smoothing = task.path.smoothing if isinstance(task.path, SampledPath) else None
    if smoothing is None or errors is None:
        return
    tracking, turning = task.tolerance.position_mm, task.tolerance.orientation_deg
    position = MM * errors.position, errors.position_at_s
    yield _check("listed_position_error", task.name, position, limit=MM * smoothing.position + tracking, unit="mm")
    orientation = DEG * errors.orientation, errors.orientation_at_s
    limit = DEG * smoothing.direction + turning
    yield _check("listed_orientation_error", task.name, orientation, limit=limit, unit="deg")
    if smoothing.position:
        depth = MM * errors.into, errors.into_at_s
        yield _check("listed_depth", task.name, depth, limit=MM * smoothing.into + tracking, unit="mm")


def _on_file(schedule: Schedule, path: ClockedPath, travelled: Array) -> Flags:
    """Which rows are on a path, but for its runs, of which its file says nothing, shape (N,)."""
    nominal = schedule.times if schedule.clock is None else schedule.clock.sigma
    run_in, run_out = path.toolpath.runs
    end = path.task.repeat * path.toolpath.length - run_out
    on_path = (nominal >= path.start) & (nominal <= path.end)
    return on_path & (travelled >= run_in - SAME_LENGTH) & (travelled <= end + SAME_LENGTH)


def _check(name: str, task: str, worst: tuple[float, float], *, limit: float, unit: str) -> Check:
    """A check of the worst value, with its time, against its limit."""
    value, at_s = worst
    what = name.removeprefix("listed_").replace("_", " ")
    message = f"{what} of task '{task}' against its file: {value:.3g} {unit} at {at_s:.3f} s, allowed {limit:g} {unit}"
    cure = "" if value <= limit else "; a narrower path.smooth reduces it"
    return Check(name, task, value <= limit, message + cure, value=value, limit=limit, unit=unit, at_s=at_s)
