"""Start postures of one layout: all branches of inverse kinematics of its operators."""

from collections.abc import Collection
from itertools import product

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.planning.start.inverse_kinematics import SAME_POSTURE, joint_margin_shares, on_nearest_turns
from cellplan.search.starts.effort import EFFORT
from cellplan.search.starts.problem import StartProblem
from cellplan.search.starts.reaching import BaseBounds, PlacedDraws, followed, reached


def branches(problem: StartProblem, robot: int, x: Array, start: Array, rng: np.random.Generator) -> Array:
    """Configurations from which an operator follows its path with the part at rest, shape (M, n).

    They are ordered by what they leave of the joint limits on the whole path, the most first.

    Args:
        x: Values of the variables, shape (n,).
        start: Start posture of the cell; that of this robot is tried too, shape (nq,).
    """
    cell, arm = problem.cell, problem.arms[robot]
    layouts = problem.variables.layouts(x[None], start[None])
    model, columns = cell.robots[robot].model, cell.columns(cell.robots[robot].name)
    q = np.vstack([start[columns], rng.uniform(arm.lower, arm.upper, (EFFORT.postures - 1, len(arm.lower)))])
    goal = problem.goal(robot, problem.part_pose(layouts))
    if goal is None:
        return start[None, columns]
    fixed = BaseBounds(is_free=np.zeros(4, dtype=bool), lower=np.zeros(3), upper=np.zeros(3))
    X_WB, X_FT = (np.tile(part[0, robot], (len(q), 1, 1)) for part in (layouts.X_WB, layouts.X_FT))
    placed, has_arrived = reached(arm, goal, fixed, PlacedDraws(q=q, X_WB=X_WB, X_FT=X_FT))
    near = placed.q[has_arrived]
    q = np.where(np.all(on_nearest_turns(model, near) == near, axis=1)[:, None], near, on_nearest_turns(model, near))
    q = _distinct(q)
    path, has_followed = followed(arm, goal, PlacedDraws(q=q, X_WB=X_WB[: len(q)], X_FT=X_FT[: len(q)]))
    margin = joint_margin_shares(model, path[has_followed]).min(axis=(1, 2), initial=np.inf)
    order = np.argsort(-margin, kind="stable")
    return q[has_followed][order[margin[order] >= 0.0]][: EFFORT.branches]


def branch_starts(
    problem: StartProblem, x: Array, start: Array, rng: np.random.Generator, robots: Collection[str] | None = None
) -> tuple[Array, Array, str]:
    """Combinations of branches of the operators of one layout.

    Args:
        x: Values of the variables, shape (n,).
        start: Start posture, shape (nq,).
        robots: Names of the operators whose branch may change; None for all.

    Returns:
        Variables, shape (C, n), start postures, shape (C, nq), and the robot that follows its path from no branch, in
        words; empty where all do.
    """
    nothing = np.zeros((0, len(x))), np.zeros((0, len(start)))
    start = problem.variables.layouts(x[None], start[None]).start[0]
    choices = []
    operators = [
        operator for operator in problem.operators if robots is None or problem.cell.robots[operator].name in robots
    ]
    for robot in operators:
        configurations = branches(problem, robot, x, start, rng)
        if not len(configurations):
            name = problem.cell.robots[robot].name
            return *nothing, f"'{name}' follows its path from no configuration with the part at rest"
        choices.append(configurations)
    while np.prod([len(choice) for choice in choices]) > EFFORT.branch_combinations:
        longest = max(range(len(choices)), key=lambda place: len(choices[place]))
        choices[longest] = choices[longest][:-1]
    rows = []
    for picks in product(*choices):
        row = start.copy()
        for robot, q in zip(operators, picks, strict=True):
            row[problem.cell.columns(problem.cell.robots[robot].name)] = q
        rows.append(row)
    starts = np.array(rows)
    return problem.with_starts(np.tile(x, (len(starts), 1)), starts), starts, ""


def _distinct(q: Array) -> Array:
    """One configuration of each branch, in the order of their joints."""
    if not len(q):
        return q
    q = q[np.lexsort(np.round(q / SAME_POSTURE).T[::-1])]
    is_new = np.append(True, np.abs(np.diff(q, axis=0)).max(axis=1) > SAME_POSTURE)
    return q[is_new]
