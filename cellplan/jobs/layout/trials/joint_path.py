"""Joint paths and null-space motion that may change: the same job without, and what means nothing beside a path."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.trials.searched import short_key, written_vary
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.model.cell.layout import PathRange, VariableKind
from cellplan.model.motion.motion import Schedule
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.spline_path.nodes import PathNodes
from cellplan.search.spline_path.null_space import NullSpaceNodes, NullSpaceProblem
from cellplan.search.spline_path.problem import PathProblem
from cellplan.search.spline_path.spline_problem import SplineProblem
from cellplan.search.spline_path.variables import SAMPLES, PathVariables, first_path, with_count
from cellplan.search.variables.variables import Variables
from cellplan.search.variables.written import written_start


@dataclass(frozen=True, kw_only=True, eq=False)
class PathSearch:
    """Joint paths of one search."""

    settings: PathRange  # the splines that may change
    layout_variables: Variables  # what varies beside the path
    unled: Variables  # what varies without the path, the start posture of the positioner with it
    schedule: Schedule  # the tasks on the common clock
    start: Array  # start posture of the given layout in [rad] or [m], shape (nq,)

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of the robots that have splines."""
        return (self.settings.robot,)

    @property
    def is_given(self) -> bool:
        """Whether the cell itself gives a path."""
        return self.stated(self.layout_variables.base) is not None

    @cached_property
    def given(self) -> JointSpline:
        """The path of the cell, else that of its motion by the pseudo-inverse, else the positioner at its start."""
        given = self.stated(self.layout_variables.base)
        if given is not None:
            return given
        fitted = self.fitted(self.unled.given, self.start)
        if fitted is not None:
            return fitted[0]
        still = self.start[self.layout_variables.base.columns(self.settings.robot)]
        return JointSpline(coefficients=np.tile(still, (self.settings.coefficients, 1)), degree=self.settings.degree)

    def stated(self, cell: Cell) -> JointSpline | None:
        """The path that a cell states, with as many coefficients as are asked for; None where it states none."""
        path = cell.robot(self.settings.robot).path
        return None if path is None else with_count(path, self.settings.coefficients, self.settings.degree)

    def fitted(self, x: Array, start: Array) -> tuple[JointSpline, Array] | None:
        """The path nearest to a motion by the pseudo-inverse, and the start posture; None where a tool is lost.

        Args:
            x: Variables of the layout without the path, shape (n,).
            start: Start posture near the right one in [rad] or [m], shape (nq,).
        """
        base, layouts, settings = self.unled.base, self.unled.layouts(x[None], start[None]), self.settings
        return first_path(base, self.schedule, layouts, count=settings.coefficients, degree=settings.degree)

    def variables(self, path: JointSpline, others: Array) -> Array:
        """Variables of the path problem: coefficients, then what varies besides, shape (n,)."""
        return np.concatenate([path.coefficients.ravel(), others])

    def layout_values(self, x: Array) -> Array:
        """What varies beside the path, as in a layout without one."""
        place = {name: column for column, name in enumerate(self.unled.names)}
        return np.array([x[place[name]] for name in self.layout_variables.names])

    def departures(self, x: Array) -> Array:
        """How far each joint leaves the given path at most in [rad] or [m], shape (n,), at variables of the problem."""
        coefficients = x[: self.given.coefficients.size].reshape(self.given.coefficients.shape)
        shares = np.linspace(0.0, 1.0, SAMPLES)
        departure = replace(self.given, coefficients=coefficients).at(shares) - self.given.at(shares)
        return np.asarray(np.abs(departure).max(axis=0))

    def problem(self, nodes: int, *, bodies: CellDistances, acceleration: Array) -> SplineProblem:
        """The path problem at about so many nodes.

        Args:
            acceleration: Largest accelerations that the joints are judged by in [rad/s^2] or [m/s^2], shape (nq,).
        """
        base, settings = self.layout_variables.base, self.settings
        count, degree = settings.coefficients, settings.degree
        return PathProblem(
            nodes=PathNodes.of(base, self.schedule, count=count, degree=degree, nodes=nodes),
            path=PathVariables.of(base, settings.robot, self.given),
            layout=self.layout_variables,
            bodies=bodies,
            acceleration=acceleration,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class NullSpaceSearch(PathSearch):
    """Motion of all robots at work in the null space of the tasks: a motion by the pseudo-inverse has none."""

    @property
    def robots(self) -> tuple[str, ...]:
        """See ``PathSearch``."""
        base = self.layout_variables.base
        working = {*base.positioners, *(task.robot for task in base.tasks)}
        return tuple(robot.name for robot in base.robots if robot.name in working and robot.model.joints)

    @cached_property
    def given(self) -> JointSpline:
        """That of the cell, else none."""
        return self.stated(self.layout_variables.base) or self._joined(self.unled.base)

    def stated(self, cell: Cell) -> JointSpline | None:
        """See ``PathSearch``."""
        is_stated = any(cell.robot(name).null_space is not None for name in self.robots)
        return self._joined(cell) if is_stated else None

    def fitted(self, x: Array, start: Array) -> tuple[JointSpline, Array] | None:  # noqa: ARG002
        """See ``PathSearch``."""
        return self._joined(self.unled.base), start

    def problem(self, nodes: int, *, bodies: CellDistances, acceleration: Array) -> SplineProblem:
        """See ``PathSearch``."""
        base, shape = self.layout_variables.base, (self.settings.coefficients, self.settings.degree)
        return NullSpaceProblem(
            nodes=NullSpaceNodes.of(base, self.schedule, self.robots, shape=shape, nodes=nodes),
            path=PathVariables.of_null_space(base, self.robots, self.given),
            layout=self.layout_variables,
            bodies=bodies,
            acceleration=acceleration,
        )

    def _joined(self, cell: Cell) -> JointSpline:
        """The splines of all robots together, from zero on; zero where a cell states none."""
        count, degree = self.settings.coefficients, self.settings.degree
        parts = []
        for robot in (cell.robot(name) for name in self.robots):
            part = np.zeros((count, len(robot.model.joints)))
            if robot.null_space is not None:
                part = with_count(robot.null_space, count, degree).coefficients
            parts.append(part - part[0])
        return JointSpline(coefficients=np.concatenate(parts, axis=1), degree=degree)


def without_path(cell: Cell) -> Cell | None:
    """The cell without the splines, whose motions by the pseudo-inverse they begin with; None where none may change.

    The start posture of the positioner may vary there where a path decides it.
    """
    if cell.layout is None or not (cell.layout.paths or cell.layout.null_space):
        return None
    vary = {short_key(key): value for key, value in written_vary(cell).items()}
    values: dict[str, object] = {
        f"robots.{robot.name}.null_space": None for robot in cell.robots if robot.null_space is not None
    }
    vary.pop("null_space", None)
    for name in [path.robot for path in cell.layout.paths]:
        robot = cell.robot(name)
        del vary[f"{name}.path"]
        if not {f"{name}.start", f"{name}.start_deg"} & vary.keys():
            is_turning = all(joint.is_revolute for joint in robot.model.joints)
            vary[f"{name}.start_deg" if is_turning else f"{name}.start"] = True
        if robot.path is not None:
            values |= {f"robots.{name}.path": None, **written_start(cell, robot, robot.path.start)}
    return cell.with_values({**values, "layout.vary": vary})


def resolving(cell: Cell) -> frozenset[str]:
    """Addresses of what decides how redundancy is resolved, and so nothing beside a given joint path."""
    if cell.layout is None:
        return frozenset()
    names = {path.robot for path in cell.layout.paths}
    return frozenset(
        variable.address
        for variable in cell.layout.ranges
        if variable.kind is VariableKind.WEIGHT or (variable.kind is VariableKind.START and variable.name in names)
    )
