"""Run-in and run-out: the path goes on along its tangents, on which the tool comes to its feed and to rest."""

from dataclasses import replace

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.extension import ExtendedCurve, ExtendedFrame, Extension
from cellplan.geometry.curves.orientation import Orientation
from cellplan.model.task.task import ProgrammedPath, Task
from cellplan.planning.path.curve import PathCurve


def with_runs(task: Task, path: PathCurve, orientation: Orientation) -> tuple[PathCurve, Orientation]:
    """The path with its runs, and the orientation, whose turning ends on them; both unchanged without any.

    Raises:
        InputError: The tool stops on the path or may, weaves along it, follows walls, or goes through it several times.
    """
    runs = (0.0, 0.0) if task.process is None else task.process.runs
    if not any(runs):
        return path, orientation
    where = task.where("process.run_in_mm" if runs[0] else "process.run_out_mm")
    if isinstance(task.path, ProgrammedPath):
        raise InputError(
            f"{where}: expected none along a path with rapids and stops of its own, on which the tool begins at rest; "
            "leave it out (a raster has overlap_mm, in which the tool comes to its feed)"
        )
    if len(path.stops) > 2:
        raise InputError(
            f"{where}: expected a path without stops between its ends, got {len(path.stops) - 2}; round the corners "
            "(corners: {blend_mm: 5})"
        )
    for key, is_there in (("path.weave", task.weave is not None), ("repeat", task.repeat > 1)):
        if is_there:
            raise InputError(f"{where}: expected none beside {key}; leave one of them out")
    if path.seam is not None:
        raise InputError(f"{where}: expected none beside walls and angles of the path; leave one of them out")
    ends = path.stops[[0, -1]]
    speeds = np.linalg.norm(path.curve.evaluate(ends, (ends[0], ends[1]))[1], axis=1)
    before, behind = (np.array(runs) / speeds).tolist()
    inside = path.curve.knots[(path.curve.knots > ends[0]) & (path.curve.knots < ends[1])]
    extension = Extension(knots=np.concatenate([ends[:1], inside, ends[1:]]), before=before, behind=behind)
    extended = replace(
        path,
        curve=ExtendedCurve(curve=path.curve, extension=extension),
        stops=extension.ends,
        is_closed=False,
        runs_on=False,
    )
    return extended, ExtendedFrame(frame=orientation, curve=path.curve, extension=extension)
