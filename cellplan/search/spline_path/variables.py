"""Coefficients of a positioner's path as variables of a search, and the path that a search begins with."""

from dataclasses import dataclass, replace
from typing import Any, Final

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
    """The coefficients, one configuration after the other, each of the joints of some robots."""

    robots: tuple[str, ...]  # names of the robots: the positioner alone of a path
    key: str  # their key in the cell file, ``path`` or ``null_space``
    given: JointSpline  # the spline that is searched from
    names: tuple[str, ...]  # addresses in the cell file, n of them
    lower: Array  # lowest values in [rad] or [m], shape (n,)
    upper: Array  # highest values, shape (n,)
    scale: Array  # A usual step of each, shape (n,)
    cost: Array  # cost of a change by one unit of each, shape (n,): 1 for a change of the whole spline by a usual step

    @classmethod
    def of(cls, cell: Cell, robot: str, given: JointSpline) -> "PathVariables":
        """Those of the path of a positioner, searched from a given one."""
        model = cell.robot(robot).model
        with np.errstate(invalid="ignore"):
            beyond = np.where(np.isfinite(model.upper - model.lower), BEYOND * (model.upper - model.lower), FARTHEST)
        lower, upper = np.maximum(model.lower, -FARTHEST) - beyond, np.minimum(model.upper, FARTHEST) + beyond
        lower = np.minimum(lower, given.coefficients.min(axis=0))
        upper = np.maximum(upper, given.coefficients.max(axis=0))
        rows = len(given.coefficients)
        return cls(**_common(cell, (robot,), "path", given), lower=np.tile(lower, rows), upper=np.tile(upper, rows))

    @classmethod
    def of_null_space(cls, cell: Cell, robots: tuple[str, ...], given: JointSpline) -> "PathVariables":
        """Those of motion in the null space."""
        most = np.full(given.coefficients.size, FARTHEST)
        return cls(**_common(cell, robots, "null_space", given), lower=-most, upper=most)

    def spline(self, x: Array) -> JointSpline:
        """The spline at values of the variables, shape (n,)."""
        return JointSpline(coefficients=x.reshape(self.given.coefficients.shape), degree=self.given.degree)

    def written(self, cell: Cell, x: Array) -> dict[str, object]:
        """The splines as the cell file writes them, by address."""
        coefficients, written = x.reshape(self.given.coefficients.shape), dict[str, object]()
        for robot in self.robots:
            joints = cell.robot(robot).model.joints
            rows, coefficients = coefficients[:, : len(joints)], coefficients[:, len(joints) :]
            units = [joint_unit(is_revolute=joint.is_revolute) for joint in joints]
            scaled = rows * np.array([unit.scale for unit in units])
            values = [[round(float(value), DECIMALS) + 0.0 for value in row] for row in scaled]
            entry: dict[str, object] = {"degree": self.given.degree, "coefficients_deg": values}
            if not all(joint.is_revolute for joint in joints):
                keys = [f"{joint.name}_{unit.name}" for joint, unit in zip(joints, units, strict=True)]
                del entry["coefficients_deg"]
                entry["coefficients"] = [dict(zip(keys, row, strict=True)) for row in values]
            written[f"robots.{robot}.{self.key}"] = entry
        return written


def _common(cell: Cell, robots: tuple[str, ...], key: str, given: JointSpline) -> dict[str, Any]:
    """Fields of variables but for their bounds."""
    rows, places, scale = len(given.coefficients), list[str](), list[float]()
    for robot in robots:
        joints = cell.robot(robot).model.joints
        is_turning = all(joint.is_revolute for joint in joints)
        path = f"robots.{robot}.{key}.{'coefficients_deg' if is_turning else 'coefficients'}"
        for index, joint in enumerate(joints):
            unit = joint_unit(is_revolute=joint.is_revolute).name
            places.append(f"{path}[{{}}]" + (f"[{index}]" if is_turning else f".{joint.name}_{unit}"))
            scale.append(USUAL_ANGLE if joint.is_revolute else USUAL_LENGTH)
    return {
        "robots": robots,
        "key": key,
        "given": given,
        "names": tuple(place.format(row) for row in range(rows) for place in places),
        "scale": np.tile(scale, rows),
        "cost": np.tile(1.0 / (np.array(scale) * rows), rows),
    }


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
