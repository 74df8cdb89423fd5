"""Transfer moves: from one configuration at rest to another, planned by the first of three ways that succeeds.

All robots of which the configuration changes move; the others stand. What is planned is made smooth, retimed to the
limits of all joints and then certified as it stands in the rows: nothing is retimed after it was certified.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.geometry.transforms import Array
from cellplan.model.progress import Progress, silent
from cellplan.planning.timing.retime import Retimer
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.planning.transfer.best_try import Try
from cellplan.planning.transfer.blended_lines import joint_path
from cellplan.planning.transfer.in_time import InTime
from cellplan.planning.transfer.in_turn import InTurn, RobotMove
from cellplan.planning.transfer.query import STAGE, TransferQuery
from cellplan.planning.transfer.reasons import Tried, blocked_error, require_free_ends
from cellplan.planning.transfer.straight_time import straight_rows
from cellplan.scene.scene import Scene

RESERVES: Final = (0.002, 0.006)  # [m] beyond the demand while planning; the larger where the certificate refuses
RESERVES_IN_TIME: Final = (0.004, 0.012)  # [m] likewise where several robots move
MOST_RETIMED: Final = 3  # orders of the robots that are retimed and certified
STRAIGHT_ROWS: Final = 33  # rows of a straight move that is certified before it is retimed


class Rung(StrEnum):
    """The ways in which transfer moves are planned, in the order in which they are tried."""

    STRAIGHT = "straight"  # all robots that move, straight in joint space, together
    IN_TURN = "in_turn"  # one robot after the other, all others standing
    IN_TIME = "in_time"  # in joint space and time, against the motion of the robots planned before

    @property
    def words(self) -> str:
        """How it reads in a report."""
        return {Rung.STRAIGHT: "straight", Rung.IN_TURN: "one after the other", Rung.IN_TIME: "beside the others"}[self]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedTransfer:
    """A transfer move in the rows of the tables, at rest at both ends, certified between its rows too."""

    times: Array  # times of the rows in [s], from 0, shape (N,)
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    rungs: Mapping[str, Rung]  # how it was found, by the name of each robot that moves


def plan_transfer(
    scene: Scene, start: Array, goal: Array, *, retimer: Retimer, seed: int, progress: Progress = silent
) -> PlannedTransfer:
    """Plan the move of all robots of which the configuration changes, by the first of these ways that is free.

    1. All of them straight in joint space and together, in the time of the closed form.
    2. One robot after the other, each by two trees in its joint space while all others stand: those that have moved at
       their goals, the others at their starts. The moves follow each other in time; none overlap.
    3. All of them in the same span of time, each planned in joint space and time against the motion of those planned
       before it.

    Ways found by trees are shortened and their corners rounded off, so that accelerations are continuous. In the end
    the rows are certified with all pairs of the scene.

    Args:
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise.
        retimer: The limits of all joints and the step of the rows.
        seed: Seed of what is drawn; the same one gives the same rows.

    Raises:
        TransferNotFoundError: The start or the goal comes too close to something, or no way was found.
    """
    query = TransferQuery.of(scene, start, goal, seed=seed)
    progress(STAGE, 0.0)
    require_free_ends(query)
    if not query.movers:
        return PlannedTransfer(times=np.array([0.0, retimer.step]), q=np.array([start, goal]), rungs={})
    share = np.linspace(0.0, 1.0, STRAIGHT_ROWS)[:, None]
    straight = start + share * (goal - start)
    if certify(scene, straight, with_minimum=False).is_met:
        rows = straight_rows(start, goal, retimer)
        transfer = _in_rows(query, rows, retimer, dict.fromkeys(query.movers, Rung.STRAIGHT))
        if transfer is not None:
            return transfer
    in_turn, in_time = Tried(), Tried() if len(query.movers) > 1 else None
    search = InTurn(query, in_turn, reserve=RESERVES[0], progress=progress)
    transfer = _in_turn(search, retimer, progress)
    if transfer is None and in_time is not None:
        transfer = _in_time(query, retimer, in_time, progress)
    if transfer is None:
        tries = [Try(words="all at once, straight" if in_time else "straight", q=straight), *search.tries()]
        raise blocked_error(query, tries, in_turn, in_time)
    return transfer


def _in_turn(search: InTurn, retimer: Retimer, progress: Progress) -> PlannedTransfer | None:
    """One robot after the other; None where no order is found, or none is certified."""
    query, tried = search.query, search.tried
    for reserve in RESERVES:
        before = tried.uncertified
        again = InTurn(query, tried, reserve=reserve, progress=progress) if reserve > RESERVES[0] else search
        for moves in islice(again.moves(), MOST_RETIMED):
            rows = [query.start[None]]
            for move in moves:
                rows.append(_rows_of(move, rows[-1][-1], retimer)[1:])
            rungs = {move.robot: Rung.IN_TURN for move in moves}
            transfer = _in_rows(query, np.concatenate(rows), retimer, rungs)
            if transfer is not None:
                return transfer
            tried.uncertified += 1
        if tried.uncertified == before:
            break  # nothing was found; with more reserve neither
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


def _in_time(query: TransferQuery, retimer: Retimer, tried: Tried, progress: Progress) -> PlannedTransfer | None:
    """All robots in the same span of time; None where no order is found, or none is certified."""
    for reserve in RESERVES_IN_TIME:
        before = tried.uncertified
        for lines in islice(InTime(query, tried, reserve=reserve, progress=progress).lines(), MOST_RETIMED):
            path = joint_path(query.start, lines)
            rows = path.at(retimer.fastest(path).sigma)
            transfer = _in_rows(query, rows, retimer, dict.fromkeys(query.movers, Rung.IN_TIME))
            if transfer is not None:
                return transfer
            tried.uncertified += 1
        if tried.uncertified == before:
            break
    return None


def _in_rows(query: TransferQuery, q: Array, retimer: Retimer, rungs: Mapping[str, Rung]) -> PlannedTransfer | None:
    """Rows, shape (N, nq), as a transfer move; None where they are not certified to keep what is demanded."""
    q[0], q[-1] = query.start, query.goal
    if not certify(query.scene, q, with_minimum=False).is_met:
        return None
    times = np.round(np.arange(len(q)) * retimer.step, TIME_DECIMALS)
    return PlannedTransfer(times=times, q=q, rungs=rungs)
