"""Run-in and run-out: the path goes on beyond its ends, where the tool comes to its feed and to rest."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.extension import ExtendedCurve, ExtendedFrame, Extension, Tail
from cellplan.geometry.curves.orientation import Orientation
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.task import ProgrammedPath, Task
from cellplan.planning.path.curve import PathCurve

ACROSS: Final = np.sin(np.deg2rad(20.0))  # [-] of a tool that is lifted off the surface by going back along its axis


def with_runs(task: Task, path: PathCurve, orientation: Orientation) -> tuple[PathCurve, Orientation]:
    """The path with its runs, and the orientation, whose turning ends on them; both unchanged without any.

    Raises:
        InputError: The tool stops on the path or may, weaves along it, follows walls, or goes through it several times.
    """
    if task.process is None or not any(task.process.has_runs):
        return path, orientation
    where = task.where(f"process.{task.process.run_key}")
    if isinstance(task.path, ProgrammedPath) and task.path.is_run is not None:
        return path, orientation  # an outline has its runs among its sides
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
    if task.process.run_tolerance_mm is not None and task.process.run_tolerance_mm < task.tolerance.position_mm:
        raise InputError(
            f"{task.where('process.run_tolerance_mm')}: expected at least {task.tolerance.position_mm:g} mm, the "
            f"tolerance of the task, got {task.process.run_tolerance_mm:g}; leave it out"
        )
    if path.seam is not None:
        raise InputError(f"{where}: expected none beside walls and angles of the path; leave one of them out")
    ends = path.stops[[0, -1]]
    inside = path.curve.knots[(path.curve.knots > ends[0]) & (path.curve.knots < ends[1])]
    knots = np.concatenate([ends[:1], inside, ends[1:]])
    extension = Extension(knots=knots, tails=_tails(task, task.process, path, orientation))
    extended = replace(
        path,
        curve=ExtendedCurve(curve=path.curve, extension=extension),
        stops=extension.ends,
        work=ends,
        is_closed=False,
        runs_on=False,
    )
    return extended, ExtendedFrame(frame=orientation, curve=path.curve, extension=extension)


def _tails(task: Task, process: ProcessEntry, path: PathCurve, orientation: Orientation) -> tuple[Tail, Tail]:
    """The run-in and the run-out of a path; one that is not stated has no length."""
    ends = path.stops[[0, -1]]
    p, dp = path.curve.evaluate(ends, (ends[0], ends[1]))
    R, _ = orientation.frames(ends, (ends[0], ends[1]), p=p, dp=dp)
    side = np.sign(process.arc) * np.cross(dp, R[:, :, 2])  # z points into the part: to the left of the path
    for key, height in (("run_arc_mm", process.arc), ("lift_mm", process.lift_mm)):
        if height and np.any(np.linalg.norm(np.cross(dp, R[:, :, 2]), axis=1) < ACROSS * np.linalg.norm(dp, axis=1)):
            raise InputError(
                f"{task.where(f'process.{key}')}: expected a tool that points across its path at both ends, got one "
                f"within {np.rad2deg(np.arcsin(ACROSS)):.0f} deg of its direction; leave it out"
            )
    side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), np.finfo(float).tiny)
    first, last = (
        Tail(
            p=p[k],
            dp=dp[k],
            side=side[k],
            normal=-R[k, :, 2],
            straight=process.straights[k],
            arc=abs(process.arc),
            lift=process.lift_mm.si,
            sign=(-1.0, 1.0)[k],
        )
        for k in range(2)
    )
    return first, last
