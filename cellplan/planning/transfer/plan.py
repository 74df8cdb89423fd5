"""Transfer moves: from one configuration at rest to another, planned by the first of four ways that succeeds.

All robots of which the configuration changes move; the others stand. What is planned is made smooth, retimed to the
limits of all joints and then certified as it stands in the rows: nothing is retimed after it was certified.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice, pairwise
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.geometry.transforms import Array
from cellplan.model.progress import Progress, silent
from cellplan.planning.timing.retime import Retimer
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.planning.transfer.best_try import Try
from cellplan.planning.transfer.blended_lines import BlendedLine, joint_path
from cellplan.planning.transfer.in_legs import legs_of
from cellplan.planning.transfer.in_time import InTime
from cellplan.planning.transfer.in_turn import InTurn, RobotMove
from cellplan.planning.transfer.query import STAGE, TransferQuery
from cellplan.planning.transfer.reasons import Tried, blocked_error, require_free_ends
from cellplan.planning.transfer.straight_moves import StraightMoves
from cellplan.planning.transfer.straight_time import straight_line, straight_rows

RESERVES: Final = (0.002, 0.006)  # [m] beyond the demand while planning; the larger where the certificate refuses
RESERVES_IN_TIME: Final = (0.004, 0.012)  # [m] likewise where several robots move
MOST_RETIMED: Final = 3  # orders of the robots that are retimed and certified


class Rung(StrEnum):
    """The ways in which transfer moves are planned, in the order in which they are tried."""

    STRAIGHT = "straight"  # all robots that move, straight in joint space, together
    IN_LEGS = "in_legs"  # straight in joint space in several legs, each of some robots together
    IN_TURN = "in_turn"  # one robot after the other, all others standing
    IN_TIME = "in_time"  # in joint space and time, against the motion of the robots planned before

    @property
    def words(self) -> str:
        """How it reads in a report."""
        return {
            Rung.STRAIGHT: "straight",
            Rung.IN_LEGS: "straight in legs",
            Rung.IN_TURN: "one after the other",
            Rung.IN_TIME: "beside the others",
        }[self]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedTransfer:
    """A transfer move in the rows of the tables, at rest at both ends, certified between its rows too."""

    times: Array  # times of the rows in [s], from 0, shape (N,)
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    rungs: Mapping[str, Rung]  # how it was found, by the name of each robot that moves


def plan_transfer(query: TransferQuery, *, retimer: Retimer, progress: Progress = silent) -> PlannedTransfer:
    """Plan the move of all robots of which the configuration changes, by the first of these ways that is free.

    1. All of them straight in joint space and together, in the time of the closed form.
    2. All of them straight in up to three legs: those go together that are not in each other's way, and a robot that is
       in the way of the others may back off towards its home and go on afterwards.
    3. One robot after the other, each by two trees in its joint space while all others stand: those that have moved at
       their goals, the others at their starts. The moves follow each other in time; none overlap. Straight moves that
       follow each other and are free together are made together.
    4. All of them in the same span of time, each planned in joint space and time against the motion of those planned
       before it.

    Ways found by trees are shortened and their corners rounded off, so that accelerations are continuous. In the end
    the rows are certified with all pairs of the scene.

    Args:
        retimer: The limits of all joints and the step of the rows.

    Raises:
        TransferNotFoundError: The start or the goal comes too close to something, or no way was found.
    """
    scene, start, goal = query.scene, query.start, query.goal
    progress(STAGE, 0.0)
    require_free_ends(query)
    if not query.movers:
        return PlannedTransfer(times=np.array([0.0, retimer.step]), q=np.array([start, goal]), rungs={})
    straight = straight_line(start, goal)
    if certify(scene, straight, with_minimum=False).is_met:
        rows = straight_rows(start, goal, retimer)
        transfer = _in_rows(query, rows, retimer, dict.fromkeys(query.movers, Rung.STRAIGHT))
        if transfer is not None:
            return transfer
    in_turn, in_time = Tried(), Tried() if len(query.movers) > 1 else None
    transfer = _in_legs(query, retimer, in_turn)
    search = InTurn(query, in_turn, reserve=RESERVES[0], progress=progress)
    if transfer is None:
        transfer = _in_turn(search, retimer, progress)
    if transfer is None and in_time is not None:
        transfer = _in_time(query, retimer, in_time, progress)
    if transfer is None:
        tries = [Try(words="all at once, straight" if in_time else "straight", q=straight), *search.tries()]
        raise blocked_error(query, tries, in_turn, in_time)
    return transfer


def _in_legs(query: TransferQuery, retimer: Retimer, tried: Tried) -> PlannedTransfer | None:
    """Straight in several legs; None where no such move is free."""
    ends = legs_of(query, retimer, tried, StraightMoves(query.scene))
    rungs = dict.fromkeys(query.movers, Rung.IN_LEGS)
    return _in_rows(query, _through_legs(ends, retimer), retimer, rungs) if ends else None


def _in_turn(search: InTurn, retimer: Retimer, progress: Progress) -> PlannedTransfer | None:
    """One robot after the other; None where no order is found, or none is certified."""
    query, tried = search.query, search.tried
    for reserve in RESERVES:
        before = tried.uncertified
        again = InTurn(query, tried, reserve=reserve, progress=progress) if reserve > RESERVES[0] else search
        for moves in islice(again.moves(), MOST_RETIMED):
            rungs = {move.robot: Rung.IN_TURN for move in moves}
            transfer = _in_rows(query, _rows_in_turn(query, moves, retimer), retimer, rungs)
            if transfer is not None:
                return transfer
            tried.uncertified += 1
        if tried.uncertified == before:
            break  # nothing was found; with more reserve neither
    return None


def _rows_in_turn(query: TransferQuery, moves: Sequence[RobotMove], retimer: Retimer) -> Array:
    """Rows of moves that follow each other, shape (N, nq); straight neighbours that are free together are one leg."""
    ends, rows = [query.start], [query.start[None]]
    for move in moves:
        goal = ends[-1].copy()
        goal[move.line.columns] = move.line.q[-1]
        if not move.is_straight:
            rows += [_through_legs(ends, retimer)[1:], _along(move.line, ends[-1], goal, retimer)[1:]]
            ends = [goal]
        elif len(ends) > 1 and certify(query.scene, straight_line(ends[-2], goal), with_minimum=False).is_met:
            ends[-1] = goal
        else:
            ends.append(goal)
    return np.concatenate([*rows, _through_legs(ends, retimer)[1:]])


def _through_legs(ends: Sequence[Array], retimer: Retimer) -> Array:
    """Rows of straight legs between stacked configurations, shape (N, nq); at rest at each of them."""
    return np.concatenate([ends[0][None], *(straight_rows(*leg, retimer)[1:] for leg in pairwise(ends))])


def _along(line: BlendedLine, start: Array, goal: Array, retimer: Retimer) -> Array:
    """Rows of one robot along its way, shape (N, nq); the last one is exact."""
    path = joint_path(start, [line])
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
