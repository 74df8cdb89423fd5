"""Coefficients of a positioner's path as variables of a search, and the path that a search begins with."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.model.motion.motion import Schedule
from cellplan.model.units import joint_unit
from cellplan.search.kernel.job import Job, Layouts, enough_nodes
from cellplan.search.kernel.run import run

NODES: Final = 193  # of the motion that is fitted
SAMPLES: Final = 401  # of a given path that gets another number of coefficients
DECIMALS: Final = 6  # of a degree or a millimetre, as coefficients are written
USUAL_ANGLE: Final = float(np.radians(10.0))  # [rad] of a step, and of a change that costs 1
USUAL_LENGTH: Final = 0.1  # [m] likewise
BEYOND: Final = 0.5  # share of the range by which a coefficient may lie outside it: the path goes past it
FARTHEST: Final = float(np.radians(1080.0))  # [rad] or [m] of a coefficient of a joint without limits


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathVariables:
    """The coefficients, one configuration after the other."""

    robot: str  # name of the positioner
    given: JointSpline  # the path that is searched from
    names: tuple[str, ...]  # addresses in the cell file, n of them
    lower: Array  # lowest values in [rad] or [m], shape (n,)
    upper: Array  # highest values, shape (n,)
    scale: Array  # A usual step of each, shape (n,)
    cost: Array  # cost of a change by one unit of each, shape (n,): 1 for a change of the whole path by a usual step

    @classmethod
    def of(cls, cell: Cell, robot: str, given: JointSpline) -> "PathVariables":
        """Those of a robot's path, searched from a given one."""
        model, rows = cell.robot(robot).model, len(given.coefficients)
        turning = np.array([joint.is_revolute for joint in model.joints])
        scale = np.where(turning, USUAL_ANGLE, USUAL_LENGTH)
        with np.errstate(invalid="ignore"):
            beyond = np.where(np.isfinite(model.upper - model.lower), BEYOND * (model.upper - model.lower), FARTHEST)
        lower, upper = np.maximum(model.lower, -FARTHEST) - beyond, np.minimum(model.upper, FARTHEST) + beyond
        lower = np.minimum(lower, given.coefficients.min(axis=0))
        upper = np.maximum(upper, given.coefficients.max(axis=0))
        key = "coefficients_deg" if turning.all() else "coefficients"
        joints = [
            f"[{index}]" if turning.all() else f".{joint.name}_{joint_unit(is_revolute=joint.is_revolute).name}"
            for index, joint in enumerate(model.joints)
        ]
        return cls(
            robot=robot,
            given=given,
            names=tuple(f"robots.{robot}.path.{key}[{row}]{joint}" for row in range(rows) for joint in joints),
            lower=np.tile(lower, rows),
            upper=np.tile(upper, rows),
            scale=np.tile(scale, rows),
            cost=np.tile(1.0 / (scale * rows), rows),
        )

    def spline(self, x: Array) -> JointSpline:
        """The path at values of the variables, shape (n,)."""
        return JointSpline(coefficients=x.reshape(self.given.coefficients.shape), degree=self.given.degree)

    def written(self, cell: Cell, x: Array) -> dict[str, object]:
        """The path as the cell file writes it."""
        units = [joint_unit(is_revolute=joint.is_revolute) for joint in cell.robot(self.robot).model.joints]
        rows = x.reshape(self.given.coefficients.shape) * np.array([unit.scale for unit in units])
        values = [[round(float(value), DECIMALS) + 0.0 for value in row] for row in rows]
        if all(joint.is_revolute for joint in cell.robot(self.robot).model.joints):
            return {"degree": self.given.degree, "coefficients_deg": values}
        keys = [
            f"{joint.name}_{unit.name}" for joint, unit in zip(cell.robot(self.robot).model.joints, units, strict=True)
        ]
        return {"degree": self.given.degree, "coefficients": [dict(zip(keys, row, strict=True)) for row in values]}


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
