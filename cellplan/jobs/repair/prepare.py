"""A failing cell made ready for its repair: what one attempt may change, and where the search for it begins."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.joint_path import without_path
from cellplan.jobs.layout.trials.phases import ProgramPhases
from cellplan.jobs.layout.trials.prepared import PreparedSearch
from cellplan.jobs.layout.trials.searched import searched_cell
from cellplan.jobs.repair.attempts import Attempt
from cellplan.model.cell.cell import Cell
from cellplan.model.units import DEG, MM
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.run import run
from cellplan.search.programs.layout_problem import LayoutProblem

DRAWS: Final = 48  # [-] layouts nearby that are tried side by side where there is no motion
SPREADS: Final = (0.5, 1.0, 2.0, 4.0)  # [-] usual steps by which they differ, more and more

Begin = tuple[Array, Array]  # variables, shape (n,), and start posture, shape (nq,)


@lru_cache(maxsize=1)
def ready_cell(request: LayoutRequest) -> PreparedSearch:
    """The cell of a request with all that it lets a layout search change but joint paths; made once in each process.

    Where a joint path may change, so may the start posture of its robot, which decides the motion without one.

    Raises:
        NoSolutionError: A phase of a program has no start, or a tool loses its path.
    """
    cell = searched_cell(request)
    for robot in cell.robots:
        if robot.path is not None:
            where = cell.origin.at(f"robots.{robot.name}.path")
            raise InputError(
                f"{where}: expected no joint path for --repair, which begins with the motion without one: leave it "
                "out, or search on from it with cellplan layout"
            )
    try:
        return PreparedSearch.of(request, without_path(cell) or cell)
    except NoSolutionError as error:  # of a program, whose phases are planned first
        raise type(error)(
            f"{error}; --repair of a program begins with tasks that can be followed one by one: cellplan map --robot "
            "NAME shows from where"
        ) from error


def start_posture(ready: PreparedSearch) -> tuple[Array, str]:
    """The start posture of the given layout, shape (nq,), and why there is none; then one in mid-range."""
    try:
        return ready.given_start, ""
    except NoSolutionError as error:
        starts = []
        for robot in ready.variables.base.robots:
            lower, upper = finite_limits(robot.model)
            starts.append(0.5 * (lower + upper) if robot.start is None else robot.start)
        return np.concatenate(starts), str(error).splitlines()[0]


def with_attempt(ready: PreparedSearch, attempt: Attempt) -> PreparedSearch:
    """The cell ready for a search of what one attempt may change."""
    if attempt.addresses:
        variables = ready.variables.among(frozenset(attempt.addresses))
        bodies, phases = CellDistances.of(ready.scene, variables), ready.phases
        if phases is not None:
            phases = ProgramPhases.of_work(phases.work, variables, bodies)
        return replace(ready, variables=variables, bodies=bodies, phases=phases)
    return PreparedSearch.of(ready.request, _varied(ready.cell, attempt.vary))


def begins(ready: PreparedSearch, start: Array, *, seed: int, count: int) -> Iterator[Begin]:
    """Where searches begin: the given layout, and small perturbations of it; of those with a motion only.

    Args:
        start: The start posture of the given layout, shape (nq,).
    """
    problem = ready.coarse
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        x = problem.given
        if number:
            step = problem.scale * rng.standard_normal(len(problem.names))
            x = np.clip(x + step, problem.lower, problem.upper)
        if problem.evaluate(x, start) is not None:
            yield x, start
            continue
        near = _near(ready, start, rng)
        if near is not None:
            yield near


def _near(ready: PreparedSearch, start: Array, rng: np.random.Generator) -> Begin | None:
    """The layout of least change among draws in which all tools follow their paths; None without one."""
    variables, problem = ready.variables, ready.coarse
    if not isinstance(problem, LayoutProblem):
        return None
    for spread in SPREADS:
        steps = spread * variables.scale * rng.standard_normal((DRAWS, len(variables.names)))
        x = np.clip(variables.given + steps, variables.lower, variables.upper)
        starts = np.tile(start, (DRAWS, 1))
        followed = np.flatnonzero(run(problem.job, variables.layouts(x, starts)).is_followed)
        if len(followed):
            cost = np.abs(x[followed] - variables.given) @ variables.cost
            return x[followed[int(cost.argmin())]], start
    return None


def _varied(cell: Cell, vary: Any) -> Cell:
    """The cell with other variables in place of its own, and the margins that it demands."""
    settings = cell.layout
    margins = {}
    if settings is not None:
        margins = {"margin_deg": DEG * settings.margin, "margin_mm": MM * settings.margin_sliding}
    return cell.with_values({"layout": {"vary": dict(vary), **margins}})
