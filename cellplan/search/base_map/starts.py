"""Start postures of a robot at many places of its base: those of a few places, carried on from neighbour to neighbour.

The start of a path is the same for all places; seen from the base it moves a little from one place to the next. So
random configurations are needed at the places of a coarse grid only: everywhere else Newton's method starts from what
was found next to it. Places next to others that have starts are asked until no further one has any.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Relation, Robot
from cellplan.model.robot.robot import RobotModel
from cellplan.model.seeds import generator
from cellplan.planning.start.inverse_kinematics import (
    SAME_POSTURE,
    finite_limits,
    on_nearest_turns,
    random_configurations,
    reached_by_rows,
)
from cellplan.planning.tracking.task_constraints import constraint_rows
from cellplan.scene.kinematics.reach import reach_bound
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.base_map.places import Places

APART: Final = 400.0  # [mm] at most from one place with random configurations to the next, where the grid is finer
SEEDS: Final = 48  # [-] random configurations at each of these places
MOST_ROUNDS: Final = 100  # [-] over the places next to others with starts
Solve = Callable[[Indices, Array], tuple[Array, Indices]]  # starts and their places, from seeds at places


@dataclass(frozen=True, slots=True, kw_only=True)
class StartGoal:
    """What a robot's tool is to reach."""

    robot: Robot
    chain: ScrewChain  # the same at its present base
    relation: Relation  # its task
    X_RT: Array  # tool tip at the start of the path in the frame R that the task is relative to, shape (4, 4)
    X_WR: Array  # that frame in the world, shape (4, 4)
    given: Array  # the present start posture in [rad] or [m], shape (n,)


def starts_at(goal: StartGoal, places: Places, model: RobotModel, X_WB: Array, *, seed: int) -> tuple[Array, Indices]:
    """Start postures at all places, of each branch the one on the turns nearest to the present start.

    Args:
        X_WB: Its present base, shape (4, 4).

    Returns:
        Configurations in [rad] or [m], shape (S, n), and their places, ascending, shape (S,); at each place in order of
        their distance from the present start. They may be out of limits.
    """
    X_WR = X_WB @ inverse(places.X_WB) @ goal.X_WR  # as if the part moved the other way
    seeds = np.vstack([goal.given, random_configurations(model, SEEDS - 1, generator(model.name, seed))])

    def solved(at: Indices, seeds: Array) -> tuple[Array, Indices]:
        configurations, rows = reached_by_rows(goal.chain, goal.relation, goal.X_RT, X_WP=X_WR[at], seeds=seeds)
        return _distinct(_near_turns(model, configurations, goal.given), at[rows])

    stride = _first_stride(places)
    coarse = places.coarse(stride)
    coarse = coarse[_within_reach(goal, places.X_WB[coarse])]
    q, at = solved(np.repeat(coarse, SEEDS), np.tile(seeds, (len(coarse), 1)))
    while stride := stride // 2:
        among = np.isin(np.arange(len(places)), places.coarse(stride))
        q, at = _carried_on(q, at, places.neighbours(stride), among, solved)
    everywhere = np.ones(len(places), dtype=bool)
    for _ in range(MOST_ROUNDS):
        before = len(q)
        q, at = _carried_on(q, at, places.neighbours(1), everywhere, solved)
        if len(q) == before:
            break
    distances = np.abs(q - goal.given).max(axis=1)
    order = np.lexsort((np.round(distances / SAME_POSTURE), at))
    return q[order], at[order]


def _within_reach(goal: StartGoal, X_WB: Array) -> Flags:
    """Which bases, shape (K, 4, 4), are near enough to the start; all where position is not asked."""
    X_WT = goal.X_WR @ goal.X_RT
    if np.linalg.matrix_rank(constraint_rows(goal.relation, goal.X_RT[None])[0][:, :3]) < 3:
        return np.ones(len(X_WB), dtype=bool)
    model = goal.robot.model
    first = X_WB[:, :3, :3] @ model.axes[model.links_to_flange[0]].point_B + X_WB[:, :3, 3]
    return np.linalg.norm(X_WT[:3, 3] - first, axis=1) <= reach_bound(goal.robot)


def _first_stride(places: Places) -> int:
    """Rows and columns between places with random configurations: a power of two."""
    steps = [float(np.diff(values).min()) for values in (places.x, places.y) if len(values) > 1]
    return 2 ** int(np.log2(max(1.0, APART / max(steps, default=APART))))


def _carried_on(q: Array, at: Indices, pairs: Indices, among: Flags, solved: Solve) -> tuple[Array, Indices]:
    """Starts found so far, and those of places that had none, from the ones at their neighbours."""
    has = np.isin(np.arange(len(among)), at)
    attempted = pairs[has[pairs[:, 0]] & ~has[pairs[:, 1]] & among[pairs[:, 1]]]
    if not len(attempted):
        return q, at
    order = np.argsort(at, kind="stable")
    q, at = q[order], at[order]
    first, last = (np.searchsorted(at, attempted[:, 0], side=side) for side in ("left", "right"))
    counts = last - first
    source = np.repeat(first - np.cumsum(counts) + counts, counts) + np.arange(counts.sum())
    more, places = solved(np.repeat(attempted[:, 1], counts), q[source])
    return np.concatenate([q, more]), np.concatenate([at, places])


def _near_turns(model: RobotModel, q: Array, given: Array) -> Array:
    """Configurations with joints on the turns nearest to given ones, where limits allow; else nearest to mid-range."""
    lower, upper = finite_limits(model)
    turning = np.array([joint.is_revolute for joint in model.joints])
    near = q - 2.0 * np.pi * np.where(turning, np.round((q - given) / (2.0 * np.pi)), 0.0)
    return np.where((near >= lower) & (near <= upper), near, on_nearest_turns(model, q))


def _distinct(q: Array, at: Indices) -> tuple[Array, Indices]:
    """One configuration of each branch at each place."""
    order = np.lexsort((*np.round(q / SAME_POSTURE).T, at))
    q, at = q[order], at[order]
    is_new = np.ones(len(q), dtype=bool)
    is_new[1:] = (at[1:] != at[:-1]) | (np.abs(np.diff(q, axis=0)).max(axis=1) > SAME_POSTURE)
    return q[is_new], at[is_new]
