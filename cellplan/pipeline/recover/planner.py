"""Planner of recoveries: straight off the part and home; else back along the program, then off and home."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from cellplan.certify.growth import certify_growth, rows_too_near
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.transforms import Array
from cellplan.model.progress import Progress
from cellplan.pipeline.plan.retiming import transfer_retimer
from cellplan.pipeline.recover.phases import SAME, RecoveryKind, RecoveryPhase, joints_of, moving
from cellplan.pipeline.recover.state import RunPlaces, StoppedState
from cellplan.pipeline.recover.ways_back import BackwardProgram, holders_back
from cellplan.planning.recovery.retract import find_retract
from cellplan.planning.recovery.rows_path import RowsPath, retract_rows
from cellplan.planning.transfer.plan import plan_transfer


class RecoveryPlanner:
    """Ways from one stopped state to the homes.

    Attributes:
        refused: Why ways were not taken, in the order in which they were tried.
    """

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
        self.refused: list[str] = []

    def phases(self) -> tuple[RecoveryPhase, ...]:
        """The first way that is found: straight off and home; else back along the program, then off and home.

        Raises:
            TransferNotFoundError: No way was found, with what was tried.
        """
        for back in BackwardProgram(self._places, self._state, self._fixed, self.refused).options():
            q = back[-1].q[-1] if back else self._state.q
            try:
                phases = (*back, *self._off_and_home(q))
            except TransferNotFoundError as error:
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
        """Retract, then transfer moves.

        Raises:
            TransferNotFoundError: One of them was not found.
        """
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
        transfer = plan_transfer(self._scene, start, end, retimer=self._retimer, seed=seed, progress=self._progress)
        how = {rung.words for rung in transfer.rungs.values()}
        words = f"{', '.join(robots)} to the end of the recovery ({', '.join(sorted(how))})"
        return [RecoveryPhase(kind=RecoveryKind.TRANSFER, robots=robots, words=words, q=transfer.q)]

    def _with_holders(self, q: Array, goal: Array) -> list[RecoveryPhase]:
        """The holders of the part together back along the program, before or after the others go home.

        Raises:
            TransferNotFoundError: Neither is free.
        """
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
