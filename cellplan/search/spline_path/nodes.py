"""Nodes of a motion along a spline: on its knots and on either side, so that no peak hides between two of them."""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import JointSpline, basis
from cellplan.model.motion.motion import Schedule
from cellplan.model.task.clocked_path import distinct
from cellplan.search.kernel.job import Job

LOWEST: Final = 4  # degree of the polynomials between two breaks
HIGHEST: Final = 24
SHORT: Final = 0.02  # share of the mean distance of breaks: nearer ones of the spline alone are left to their neighbour


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathNodes:
    """The job of a cell whose positioner goes along a spline, at Chebyshev points between breaks.

    Breaks are the times at which desired twists jump and the knots of the spline; where two stretches meet, each has a
    node of its own, which sees the desired motion from inside.
    """

    job: Job  # the job; the joints of the positioner are given, not resolved
    columns: slice  # place of the positioner's joints in the stacked joint vector
    operators: Indices  # columns of the joints of each relation's robot, shape (T, 6)
    count: int  # number of coefficients
    degree: int  # degree of the spline
    shares: Array  # share of each coefficient in a joint, its speed [1/s], acceleration [1/s^2], (3, N, count)
    rates: Array  # time derivatives in [1/s] of the polynomial through the nodes of a stretch, shape (N, N)

    @classmethod
    def of(cls, cell: Cell, schedule: Schedule, *, count: int, degree: int, nodes: int) -> "PathNodes":
        """Place nodes for a spline of so many coefficients.

        Args:
            degree: Degree of the spline, 3 or 5.

        Raises:
            InputError: An operator's motion does not follow from its task and the positioner alone.
        """
        holder = _positioner(cell)
        still = JointSpline(coefficients=np.zeros((count, len(cell.robots[holder].model.joints))), degree=degree)
        robots = [replace(robot, path=still if index == holder else None) for index, robot in enumerate(cell.robots)]
        cell = replace(cell, robots=tuple(robots))
        end = float(schedule.times[-1])
        times, begins, ends, rates = _panels(_breaks(schedule.jumps, still.knots * end), nodes)
        moving = [robot.name for robot in cell.robots]
        job = Job.at_nodes(cell, schedule, moving=moving, nodes=(times, begins, ends))
        return cls(
            job=job,
            columns=cell.columns(cell.robots[holder].name),
            operators=_operators(job),
            count=count,
            degree=degree,
            shares=np.array([basis(times / end, count, degree, k) / end**k for k in range(3)]),
            rates=rates,
        )


def _positioner(cell: Cell) -> int:
    """Place of the robot that carries the part, which must have no task of its own."""
    if cell.carrier is None:
        raise InputError(f"{cell.origin.at('part.held_by')}: expected a robot that holds the part and may have a path")
    name = cell.robots[cell.carrier].name
    for task in cell.tasks:
        if task.robot == name:
            raise InputError(f"{task.where('robot')}: expected no task of '{name}', whose path is to be found")
    return cell.carrier


def _operators(job: Job) -> Indices:
    """Columns of the joints of each relation's robot."""
    operators = []
    for relation, is_constrained, operator in zip(
        job.relations, job.constraints.constrained, job.constraints.operators, strict=True
    ):
        robot = job.cell.robots[operator]
        columns = job.cell.columns(robot.name)
        if not is_constrained.all() or columns.stop - columns.start != 6:
            where = job.cell.origin.at(f"robots.{robot.name}")
            raise InputError(
                f"{where}: expected a robot of six joints whose task '{relation.name}' states all six components, for "
                "a search of joint paths; its motion would not follow from that of the positioner alone"
            )
        operators.append(np.arange(columns.start, columns.stop))
    return np.array(operators, dtype=np.intp).reshape(-1, 6)


def _breaks(jumps: Array, knots: Array) -> Array:
    """Times in [s] at which stretches meet; a knot of the spline next to a jump is left out."""
    near = SHORT * float(jumps[-1] - jumps[0]) / (len(jumps) + len(knots))
    inner = knots[np.abs(knots[:, None] - jumps).min(axis=1, initial=np.inf) > near]
    return distinct(np.concatenate([jumps, inner]))


def _panels(breaks: Array, count: int) -> tuple[Array, Array, Array, Array]:
    """Times, begins and ends of the stretches of all nodes, and derivatives at the nodes from values at them."""
    parts, blocks = [], []
    for begin, end in pairwise(breaks.tolist()):
        share = count * (end - begin) / float(breaks[-1] - breaks[0])
        points = chebyshev(int(np.clip(round(share) - 1, LOWEST, HIGHEST)))
        times = begin + (end - begin) * points.nodes
        times[-1] = end
        parts.append(np.stack([times, np.full_like(times, begin), np.full_like(times, end)]))
        blocks.append(points.derivative / (end - begin))
    times, begins, ends = np.concatenate(parts, axis=1)
    rates = np.zeros((len(times), len(times)))
    first = 0
    for block in blocks:
        last = first + len(block)
        rates[first:last, first:last] = block
        first = last
    return times, begins, ends, rates
