"""The first path of a search: the positioner's own where the cell gives one, else that of the pseudo-inverse."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.model.motion.motion import Schedule
from cellplan.search.kernel.job import Job, Layouts, enough_nodes
from cellplan.search.kernel.run import run

NODES: Final = 193  # of the motion that is fitted
SAMPLES: Final = 401  # of a given path that gets another number of coefficients


def first_path(
    cell: Cell, schedule: Schedule, layout: Layouts, *, count: int, degree: int
) -> tuple[JointSpline, Array] | None:
    """The path nearest to the weighted pseudo-inverse motion, and the start posture (nq,); None if a tool is lost."""
    carrier = next(robot for robot in cell.robots if robot.name == cell.positioners[0])
    start = layout.start[0]
    if carrier.path is not None:
        return with_count(carrier.path, count, degree), start
    free = replace(cell, robots=tuple(replace(robot, path=None) for robot in cell.robots))
    job = Job.of(free, schedule, moving=[robot.name for robot in cell.robots], nodes=enough_nodes(schedule, NODES))
    motion = run(job, layout)
    if not motion.is_followed[0]:
        return None
    once = np.append(np.diff(job.times) > 0.0, True)
    times, q = job.times[once], motion.q[0, once][:, cell.columns(carrier.name)]
    return JointSpline.fitted(times / times[-1], q, count=count, degree=degree), motion.q[0, 0]


def with_count(path: JointSpline, count: int, degree: int) -> JointSpline:
    """A path with so many coefficients; the very path where it has them already."""
    if (len(path.coefficients), path.degree) == (count, degree):
        return path
    shares = np.linspace(0.0, 1.0, SAMPLES)
    return JointSpline.fitted(shares, path.at(shares), count=count, degree=degree)
