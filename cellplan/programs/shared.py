"""Shared: what all exports of one run have in common, worked out once however many formats are written."""

import hashlib
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, Final, TypeVar

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.progress import Progress, silent
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.promises.orders import KnownOrders, Orders, certified_orders, scenes_of_motions
from cellplan.programs.rows.played import ExecutedProgram
from cellplan.scene.scene import Scene

Result = TypeVar("Result")
SAME_DECIMALS: Final = 9  # of a time in [s], or a position in [rad] or [m]: a nanometre decides about no depth


class Shared:
    """What exports of one run have in common, whatever their format.

    Nothing of it outlives the object, so that a proof rests on what was worked out in the same call.
    """

    def __init__(self, run: VerifiedRun) -> None:
        """Begin with nothing."""
        self.run = run
        self.known_orders: KnownOrders = {}
        self._results: dict[object, Any] = {}

    @cached_property
    def scene(self) -> Scene:
        """The cell made computable."""
        return Scene.from_cell(self.run.cell)

    @cached_property
    def scenes(self) -> Sequence[Scene]:
        """The scene of each motion of the run."""
        return scenes_of_motions(self.run)

    def orders(self, progress: Progress = silent) -> tuple[Orders, ...]:
        """Marks of every program, between which every order of the robots is certified."""
        return self.once("orders", lambda: certified_orders(self.run, progress=progress))

    def once(self, key: object, make: Callable[[], Result]) -> Result:
        """The result kept for a key, which states all that it depends on besides the run, or else made now."""
        if key not in self._results:
            self._results[key] = make()
        return self._results[key]


def played_digest(played: ExecutedProgram) -> str:
    """SHA-256 of all that a played program is, besides its run: equal digests are played alike to the last bit."""
    state = hashlib.sha256()
    about = (played.place, str(played.interpolation), played.exported, played.lead.hex())
    state.update(repr(about).encode())
    for name, rows in played.rows.items():
        state.update(repr((name, rows.marks)).encode())
        for values in (rows.q, rows.times, rows.qd, rows.process, *(() if rows.tube is None else (rows.tube,))):
            state.update(b"none" if values is None else repr((values.dtype.str, values.shape)).encode())
            state.update(b"" if values is None else np.ascontiguousarray(values).tobytes())
    for name, shares in played.shares.items():
        state.update(repr((name, shares.shape)).encode() + np.ascontiguousarray(shares).tobytes())
    return state.hexdigest()


def motion_digest(*arrays: Array, is_exact: bool = False) -> bytes:
    """SHA-256 of times in [s] and positions in [rad] or [m], shape (M, ...).

    Those that differ by rounding share it, unless it is to be exact.
    """
    state = hashlib.sha256(repr([values.shape for values in arrays]).encode())
    for values in arrays:
        state.update((values if is_exact else np.round(values, SAME_DECIMALS) + 0.0).tobytes())  # no negative zeros
    return state.digest()
