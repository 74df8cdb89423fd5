"""Transfer moves: from one configuration at rest to another, planned by the first of a few ways that succeeds.

All robots of which the configuration changes move; the others stand. What is planned is made smooth, retimed to the
limits of all joints and then certified as it stands in the rows: nothing is retimed after it was certified.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.geometry.transforms import Array
from cellplan.model.progress import Progress, silent
from cellplan.model.rung import Rung
from cellplan.planning.timing.retime import Retimer
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.planning.transfer.blended_lines import joint_path
from cellplan.planning.transfer.in_turn import InTurn, RobotMove
from cellplan.planning.transfer.query import STAGE, TransferQuery
from cellplan.planning.transfer.straight_time import straight_rows
from cellplan.scene.scene import Scene

RESERVES: Final = (
    0.002,
    0.006,
)  # [m] kept beyond the demand while planning: the larger one where the certificate refuses what was found
MOST_RETIMED: Final = 3  # orders that are retimed and certified
STRAIGHT_ROWS: Final = 33  # rows of a straight move that is certified before it is retimed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedTransfer:
    """A transfer move in the rows of the tables, at rest at both ends, certified between its rows too.

    Attributes:
        times: Times of the rows in [s], from 0, shape (N,).
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        rungs: How it was found, by the name of each robot that moves.
    """

    times: Array
    q: Array
    rungs: Mapping[str, Rung]


def plan_transfer(
    scene: Scene, start: Array, goal: Array, *, retimer: Retimer, seed: int, progress: Progress = silent
) -> PlannedTransfer:
    """Plan the move of all robots of which the configuration changes.

    All of them straight in joint space and together, where that is free.

    Args:
        scene: The scene of the phase: its pairs carry the demands that count in it.
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise.
        retimer: The limits of all joints and the step of the rows.
        seed: Seed of what is drawn; the same one gives the same rows.
        progress: Called with the stage and the fraction done.

    Raises:
        TransferNotFoundError: The start or the goal comes too close to something, or no way was found.
    """
    query = TransferQuery.of(scene, start, goal, seed=seed)
    query.require_free_ends()
    if not query.movers:
        return PlannedTransfer(times=np.array([0.0, retimer.step]), q=np.array([start, goal]), rungs={})
    progress(STAGE, 0.0)
    found = _straight(query, retimer)
    for reserve in RESERVES:
        found = found or _in_turn(query, retimer, reserve, progress)
    if found is None:
        raise query.not_found()
    return found


def _straight(query: TransferQuery, retimer: Retimer) -> PlannedTransfer | None:
    """All robots straight in joint space, on one common share of the way; None where that is not free."""
    share = np.linspace(0.0, 1.0, STRAIGHT_ROWS)[:, None]
    if not certify(query.scene, query.start + share * (query.goal - query.start), with_minimum=False).is_kept:
        return None
    q = straight_rows(query.start, query.goal, retimer)
    return in_rows(query, q, retimer, dict.fromkeys(query.movers, Rung.STRAIGHT))


def _in_turn(query: TransferQuery, retimer: Retimer, reserve: float, progress: Progress) -> PlannedTransfer | None:
    """One robot after the other; None where no order is found or certified."""
    search = InTurn(query, reserve=reserve, progress=progress)
    for moves in islice(search.moves(), MOST_RETIMED):
        rows, q = [query.start[None]], query.start
        for move in moves:
            rows.append(_rows_of(move, q, retimer)[1:])
            q = rows[-1][-1]
        rungs = {move.robot: Rung.IN_TURN for move in moves}
        found = in_rows(query, np.concatenate(rows), retimer, rungs)
        if found is not None:
            return found
    return None


def _rows_of(move: RobotMove, q: Array, retimer: Retimer) -> Array:
    """Rows of the move of one robot from a stacked configuration, shape (N, nq); the last one is exact."""
    goal = q.copy()
    goal[move.line.columns] = move.line.q[-1]
    if move.is_straight:
        return straight_rows(q, goal, retimer)
    path = joint_path(q, [move.line])
    rows = path.at(retimer.fastest(path).sigma)
    rows[-1] = goal
    return rows


def in_rows(query: TransferQuery, q: Array, retimer: Retimer, rungs: Mapping[str, Rung]) -> PlannedTransfer | None:
    """Rows, shape (N, nq), as a transfer move; None where they are not certified to keep what is demanded."""
    q[0], q[-1] = query.start, query.goal
    if not certify(query.scene, q, with_minimum=False).is_kept:
        return None
    times = np.round(np.arange(len(q)) * retimer.step, TIME_DECIMALS)
    return PlannedTransfer(times=times, q=q, rungs=rungs)
