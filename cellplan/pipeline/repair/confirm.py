"""Confirmation: a layout of the search is solved and verified in full, and corrected where it falls short."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.arrays import Array
from cellplan.model.cell import Cell
from cellplan.model.check_kinds import DISTANCES, JOINT_LIMITS, PASSED_BY_TIME
from cellplan.model.report import Check
from cellplan.model.units import MM
from cellplan.pipeline.layout.prepared import NOT_FOLLOWED, PreparedSearch
from cellplan.pipeline.repair.neat import changed_values, neat
from cellplan.pipeline.repair.solved import SolvedCell, demanded_margin
from cellplan.pipeline.solve import solve
from cellplan.search.programs.improve import Improved, improve
from cellplan.search.programs.measures import reserves
from cellplan.search.programs.objective import Demands, Effort, Reserve
from cellplan.search.programs.problem import Problem

SOLVES: Final = 4  # [-] times that a layout is corrected and solved before it is given up
NODES: Final = 129  # [-] of a correction
KEYS: Final = 33  # [-] configurations at which it asks for distances
ITERATIONS: Final = 20
SHARE_LEFT: Final = 0.5  # [-] share of the room beyond a demanded distance that every node is to have
REFINEMENTS: Final = 4  # [-] local optimisations until no distance between the configurations is too small
MORE_ANGLE: Final = float(np.radians(0.05))  # [rad] asked for beyond what is missed
MORE_LENGTH: Final = 0.0005  # [m] likewise
MORE_TIME: Final = 0.002  # [-] likewise


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Confirmed:
    """What came of a change when it was solved in full."""

    values: Mapping[str, object]  # what changes, by address of the cell file
    cost: float  # size of the change
    solved: SolvedCell | None  # the last solution; None where there is none
    reason: str  # why it is no remedy; empty where it passed
    solves: int  # how often it was solved


def confirmed(ready: PreparedSearch, x: Array, start: Array) -> Confirmed:
    """A layout of the search, corrected until it passes every check with the demanded margins.

    Args:
        ready: What may change.
        x: Values of the variables, shape (n,).
        start: Start posture in [rad] or [m], shape (nq,).
    """
    problem, demands = ready.problem(NODES), ready.demands()
    effort = Effort(iterations=ITERATIONS, keys=KEYS, trust=0.2)
    done = Confirmed(values={}, cost=0.0, solved=None, reason=NOT_FOLLOWED, solves=0)
    for solves in range(1, SOLVES + 1):
        improved, effort = _refined(problem, (x, start), demands, effort)
        if improved is None or not (improved.is_conforming or solves == 1):
            break
        x, start = neat(ready, improved.x, improved.start)
        values, cost = changed_values(ready, x, start), float(np.abs(x - problem.given) @ problem.cost)
        solved, reason = solved_cell(ready.cell, values)
        done = Confirmed(values=values, cost=cost, solved=solved, reason=reason, solves=solves)
        tighter = _tightened(solved, demands, effort) if solved is not None and reason else None
        if tighter is None:
            break
        demands, effort = tighter
    return done


def _refined(
    problem: Problem, begin: tuple[Array, Array], demands: Demands, effort: Effort
) -> tuple[Improved | None, Effort]:
    """A local optimum with a little more than the demanded distances at every node, and the effort that this takes."""
    x, start = begin
    improved: Improved | None = None
    for _ in range(REFINEMENTS):
        improved = improve(problem, x, start, demands, effort)
        if improved is None:
            break
        near = problem.distances(improved.point, np.arange(len(problem.times), dtype=np.intp), effort.reserve.distance)
        shortfalls = near.demands + SHARE_LEFT * reserves(near, effort.reserve) - near.values
        worst = {int(near.pairs[row]): int(near.nodes[row]) for row in np.argsort(shortfalls) if shortfalls[row] > 0.0}
        if not worst:
            break
        also_at = {*effort.also_at, *(float(problem.times[node]) for node in worst.values())}
        effort, x, start = replace(effort, also_at=tuple(sorted(also_at))), improved.x, improved.start
    return improved, effort


def solved_cell(cell: Cell, values: Mapping[str, object]) -> tuple[SolvedCell | None, str]:
    """A changed cell solved in full, and why it is no remedy; empty where it passes with the demanded margins."""
    try:
        changed = cell.with_values(values) if values else cell
        solved = SolvedCell(solution=solve(changed, is_reported=False), margin=demanded_margin(cell))
    except (InputError, NoSolutionError) as error:
        return None, str(error).splitlines()[0]
    failed = solved.failed
    return solved, failed[0].message if failed else ""


def _tightened(solved: SolvedCell, demands: Demands, effort: Effort) -> tuple[Demands, Effort] | None:
    """Demands that ask for what the verified motion lacks; None where it lacks something else."""
    failed = solved.failed
    names = {check.name for check in failed}
    if not names <= JOINT_LIMITS | PASSED_BY_TIME | DISTANCES:
        return None
    shortfalls = solved.violations
    margin = demands.margin + np.where(shortfalls > 0.0, shortfalls + MORE_ANGLE, 0.0)
    near = [check for check in failed if check.name in DISTANCES]
    reserve = replace(
        effort.reserve, distance=effort.reserve.distance + _missing(near), time=effort.reserve.time + _late(failed)
    )
    at = (check.at_s for check in near if check.at_s is not None)
    also_at = tuple(sorted({*effort.also_at, *at}))
    return replace(demands, margin=margin), replace(effort, reserve=_most(reserve), also_at=also_at)


def _missing(near: Sequence[Check]) -> float:
    """Distance in [m] to ask for beyond what is asked for already."""
    lengths = [check.limit - check.value for check in near if check.unit == "mm" and check.name == "clearance"]
    return max(0.0, max(lengths, default=0.0)) / MM + MORE_LENGTH if near else 0.0


def _late(failed: Sequence[Check]) -> float:
    """Share of the time to ask for beyond what is asked for already."""
    shares = [check.kind.more_time(check.value, check.limit) - 1.0 for check in failed if check.name in PASSED_BY_TIME]
    return max(shares) + MORE_TIME if shares else 0.0


def _most(reserve: Reserve) -> Reserve:
    """The room, within reason: what asks for more is not corrected any further."""
    return replace(reserve, distance=min(reserve.distance, 0.05), time=min(reserve.time, 0.5))
