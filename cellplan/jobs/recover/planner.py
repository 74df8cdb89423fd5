"""Planner of recoveries: straight off the part and home; else back along the program, then off and home."""

from collections.abc import Collection, Iterator, Sequence
from functools import partial

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.growth import certify_growth, rows_too_near
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.arrays import Array, Flags
from cellplan.jobs.recover.phases import SAME, RecoveryKind, RecoveryPhase, joints_of, moving
from cellplan.jobs.recover.state import RunPlaces, StoppedState
from cellplan.model.progress import Progress
from cellplan.planning.recovery.retract import find_retract
from cellplan.planning.recovery.rows_path import RowsPath, retract_rows, timed_rows
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.planning.transfer.plan import plan_transfer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.scene.scene import Scene


class RecoveryPlanner:
    """Ways from one stopped state to the homes."""

    def __init__(self, places: RunPlaces, state: StoppedState, progress: Progress) -> None:
        """Prepare; nothing is planned yet."""
        self._places, self._state, self._progress = places, state, progress
        self._cell = places.cell
        self._scene = places.scene_while_stopped(state.lying)
        self._retimer = transfer_retimer(self._scene)
        held = self._scene.cell.positioners
        self._group = held if len(held) > 1 else ()
        self._fixed = {*state.standing, *(held if set(held) & set(state.standing) and self._group else ())}
        self._off_start: Array | None = None
        self.refused: list[str] = []  # why ways were not taken, in the order of trying
        self.blocked: BlockedTransferError | None = None  # the first transfer move that was not found

    def phases(self) -> tuple[RecoveryPhase, ...]:
        """The first way that is found: straight off and home; else back along the program, then off and home."""
        for back in BackwardProgram(self._places, self._state, self._fixed, self.refused).options():
            q = back[-1].q[-1] if back else self._state.q
            try:
                phases = (*back, *self._off_and_home(q))
            except TransferNotFoundError as error:
                self.blocked = self.blocked or (error if isinstance(error, BlockedTransferError) else None)
                where = f"from {back[-1].words.split(' to ')[-1]}: " if back else ""
                self.refused.append(f"{where}{error}")
                if not self._is_at_start(q):
                    continue
                return back or (self._standing(q, "all robots are where the program begins, and leave it nowhere"),)
            return phases or (self._standing(q, "all robots are home"),)
        raise TransferNotFoundError("; then ".join(dict.fromkeys(self.refused)))

    def _standing(self, q: Array, words: str) -> RecoveryPhase:
        rows = q[None].repeat(2, axis=0)
        return RecoveryPhase(kind=RecoveryKind.HOLD, robots=(), words=words, q=rows, place=self._state.place)

    def _is_at_start(self, q: Array) -> bool:
        """Whether all robots are at their homes, those without one where their program begins."""
        return not self._fixed and not np.any(np.abs(self._first(q)[0] - q) > SAME)

    def _off_and_home(self, q: Array) -> list[RecoveryPhase]:
        """Retract, then transfer moves, or the error of the one that is not found."""
        made = self._retracts(q)
        last = made[-1].q[-1] if made else q
        goal = self._goal(last)
        if not self._group or not np.any(np.abs(goal - last)[joints_of(self._cell, self._group)] > SAME):
            goal[joints_of(self._cell, self._group)] = last[joints_of(self._cell, self._group)]
            return [*made, *self._transfers(last, goal)]
        return [*made, *self._with_holders(last, goal)]

    def _retracts(self, q: Array) -> list[RecoveryPhase]:
        """Robots straight off what they are too near to."""
        cell = self._scene.cell
        able = [robot.name for robot in cell.robots if robot.name not in {*self._fixed, *self._group}]
        self._progress("planning the retract", 0.0)
        made = []
        for leg in find_retract(self._scene, q, may_move=able):
            path = RowsPath(np.linspace(0.0, leg.length, len(leg.q)), leg.q)
            rows = retract_rows(path, self._retimer)
            if not certify_growth(self._scene, rows).is_proved:
                raise TransferNotFoundError(f"the retract of {leg.words} is not proved in the rows of its tables")
            robots = tuple(line.robot for line in leg.lines)
            made.append(RecoveryPhase(kind=RecoveryKind.RETRACT, robots=robots, words=leg.words, q=rows))
        return made

    def _goal(self, q: Array) -> Array:
        """Homes of all robots: stated ones, else off the start of the program, else where a robot has retracted to."""
        goal, homeless = self._first(q)
        cell = self._scene.cell
        if self._off_start is None:
            self._off_start = self._clear_of_start(goal, homeless, q)
        for name in homeless:
            goal[cell.columns(name)] = self._off_start[cell.columns(name)]
        return goal

    def _first(self, q: Array) -> tuple[Array, list[str]]:
        """Homes of all robots, or where the program begins; and the robots without a home."""
        first = self._places.motion.q[self._places.rows(0 if self._places.stages else self._state.place).start]
        cell, goal = self._scene.cell, first.copy()
        homeless = []
        for robot in cell.robots:
            columns = cell.columns(robot.name)
            if robot.name in self._fixed:
                goal[columns] = q[columns]
            elif robot.home is not None and robot.name not in self._group:
                goal[columns] = robot.home
            elif robot.name not in self._group:
                homeless.append(robot.name)
        return goal, homeless

    def _clear_of_start(self, goal: Array, homeless: Sequence[str], q: Array) -> Array:
        """Where robots without a home end: at the start of the program, off the part if they would touch it there."""
        operators = [name for name in homeless if name not in self._scene.cell.positioners]
        stays = any(name in self._fixed for name in self._cell.positioners)
        if stays or not rows_too_near(self._scene, goal):
            return q if stays else goal
        try:
            legs = find_retract(self._scene, goal, may_move=operators)
        except TransferNotFoundError:
            return q
        return legs[-1].q[-1] if legs else goal

    def _transfers(self, start: Array, goal: Array) -> list[RecoveryPhase]:
        """Transfer moves; none where all robots are where they are to be."""
        robots = moving(self._cell, np.stack([start, goal]))
        if not robots:
            return []
        end = start.copy()
        for name in robots:
            columns = self._cell.columns(name)
            end[columns] = goal[columns]
        seed = self._cell.solver.seed
        query = TransferQuery.of(self._scene, start, end, seed=seed)
        transfer = plan_transfer(query, retimer=self._retimer, progress=self._progress)
        how = {rung.words for rung in transfer.rungs.values()}
        words = f"{', '.join(robots)} to the end of the recovery ({', '.join(sorted(how))})"
        return [RecoveryPhase(kind=RecoveryKind.TRANSFER, robots=robots, words=words, q=transfer.q)]

    def _with_holders(self, q: Array, goal: Array) -> list[RecoveryPhase]:
        """The holders of the part together back along the program, before or after the others go home."""
        columns, faults = joints_of(self._cell, self._group), []
        holders = partial(holders_back, self._places, self._state, self._scene)
        for holders_first in (True, False):
            middle = q.copy()
            chosen = columns if holders_first else ~columns
            middle[chosen] = goal[chosen]
            try:
                if holders_first:
                    return [holders(q), *self._transfers(middle, goal)]
                return [*self._transfers(q, middle), holders(middle)]
            except TransferNotFoundError as error:
                faults.append(str(error))
        raise TransferNotFoundError("; ".join(faults))


class BackwardProgram:
    """The program backwards.

    Attributes:
        refused: Receives why it is not played backwards, or not farther.
    """

    def __init__(self, places: RunPlaces, state: StoppedState, fixed: Collection[str], refused: list[str]) -> None:
        """Prepare; nothing is planned yet."""
        self._places, self._state, self._fixed, self.refused = places, state, set(fixed), refused

    def options(self) -> Iterator[tuple[RecoveryPhase, ...]]:
        """What is done before robots leave the part: nothing, or the program backwards, less or more of it."""
        yield ()
        if not self._state.is_on_program:
            self.refused.append("the way back along the program is not open, as robots stand at different times of it")
            return
        made: list[RecoveryPhase] = []
        tried = 0
        for place in self._backwards():
            phase = self._back(place)
            if isinstance(phase, str):
                self.refused.append(phase)
                break
            if phase is None:
                continue
            made.append(phase)
            if not tried:
                yield tuple(made)
            tried += 1
        if tried > 1:
            yield tuple(made)

    def _backwards(self) -> Iterator[int]:
        """Places of the phases back from the stopped state, while the part stays where it is and nothing is between."""
        place = self._state.place
        gaps, stages = self._places.motion.gaps, self._places.stages
        while True:
            yield place
            if place == 0 or not stages or self._places.rows(place).start in gaps or place % len(stages) == 0:
                return
            place -= 1
            if self._places.lying_at(place) is not self._state.lying:
                return

    def _back(self, place: int) -> RecoveryPhase | str | None:
        """A phase of the program from its end, or the stopped state, back to its beginning; a refusal in words."""
        path = self._path_back(place)
        if path is None:
            return None
        robots = moving(self._places.cell, path.q)
        fixed = sorted(set(robots) & self._fixed)
        name = self._places.phases[place].name
        if fixed:
            return f"the way back along '{name}' moves '{fixed[0]}', which is to stand still"
        scene = self._places.scene_of_phase(place)
        q = timed_rows(path, transfer_retimer(scene))
        if not certify(scene, q, with_minimum=False).is_met:
            return f"the way back along '{name}' is not certified"
        begin = float(self._places.motion.times[self._places.rows(place).start])
        words = f"back along the program to the beginning of '{name}' at {begin:g} s"
        return RecoveryPhase(kind=RecoveryKind.BACK, robots=robots, words=words, q=q, place=place)

    def _path_back(self, place: int) -> RowsPath | None:
        """The program from the stopped state, or the end of a phase, to its beginning; None where that is no way."""
        motion, rows = self._places.motion, self._places.rows(place)
        last = self._state.at if place == self._state.place else float(motion.times[rows.stop - 1])
        inner = [row for row in range(rows.start, rows.stop) if motion.times[row] < last - SAME]
        if not inner:
            return None
        end = self._state.q if place == self._state.place else motion.q[rows.stop - 1]
        q = np.concatenate([end[None], motion.q[inner][::-1]])
        return RowsPath(np.concatenate([[0.0], last - motion.times[inner][::-1]]), q)


def holders_back(places: RunPlaces, state: StoppedState, scene: Scene, q: Array) -> RecoveryPhase:
    """Robots that hold the part together, back along the program as they came while all others stand."""
    group = scene.cell.positioners
    named = ", ".join(group)
    path = _path_of_group(places, state.times[group[0]], q, joints_of(places.cell, group))
    if path is None or set(state.standing) & set(group):
        raise TransferNotFoundError(f"{named} hold the part together and cannot be moved one by one")
    rows = timed_rows(path, transfer_retimer(scene))
    if not certify(scene, rows, with_minimum=False).is_met:
        raise TransferNotFoundError(f"{named} cannot go back together while the others stand: a body is in the way")
    words = f"{named} together back along the program"
    return RecoveryPhase(kind=RecoveryKind.HOLDERS_BACK, robots=group, words=words, q=rows)


def _path_of_group(places: RunPlaces, last: float, q: Array, columns: Flags) -> RowsPath | None:
    """The way of the holders back to where their phase begins; None where that is not where the program begins.

    Args:
        last: Time of the program in [s] at which they stand.
        q: Where all robots stand in [rad] or [m], shape (nq,).
        columns: Which joints are those of the holders, shape (nq,).
    """
    motion, rows = places.motion, places.rows(places.at(last))
    inner = [row for row in range(rows.start, rows.stop) if motion.times[row] < last - SAME]
    if not inner or np.any(np.abs(motion.q[rows.start] - motion.q[0])[columns] > SAME):
        return None
    path = np.tile(q, (len(inner) + 1, 1))
    path[1:, columns] = motion.q[inner][::-1][:, columns]
    return RowsPath(np.concatenate([[0.0], last - motion.times[inner][::-1]]), path)
