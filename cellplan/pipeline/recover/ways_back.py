"""Ways back: the program played backwards from a stopped state, which its certificate says is free."""

from collections.abc import Collection, Iterator

import numpy as np

from cellplan.certify.certify import certify
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.arrays import Array, Flags
from cellplan.pipeline.plan.retiming import transfer_retimer
from cellplan.pipeline.recover.phases import SAME, RecoveryKind, RecoveryPhase, joints_of, moving
from cellplan.pipeline.recover.state import RunPlaces, StoppedState
from cellplan.planning.recovery.rows_path import RowsPath, timed_rows
from cellplan.scene.scene import Scene


class BackwardProgram:
    """The program backwards.

    Attributes:
        refused: Receives why it is not played backwards, or not farther.
    """

    def __init__(self, places: RunPlaces, state: StoppedState, fixed: Collection[str], refused: list[str]) -> None:
        """Prepare; nothing is planned yet.

        Args:
            refused: See above.
        """
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
    """Robots that hold the part together, back along the program as they came while all others stand.

    Raises:
        TransferNotFoundError: Something is in their way.
    """
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
