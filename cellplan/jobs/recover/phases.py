"""Phases of a recovery: what is done, by whom, and in which rows."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.jobs.recover.state import RunPlaces, StoppedState
from cellplan.model.cell.cell import Cell
from cellplan.scene.scene import Scene

SAME: Final = 1e-9  # [rad] or [m] within which two configurations are one


class RecoveryKind(StrEnum):
    """What robots do in a phase of a recovery."""

    RETRACT = "retract"
    BACK = "back"
    HOLDERS_BACK = "holders_back"
    TRANSFER = "transfer"
    HOLD = "hold"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecoveryPhase:
    """One phase of a recovery, from rest to rest."""

    kind: RecoveryKind  # what is done
    robots: tuple[str, ...]  # names of the robots that move
    words: str  # the same for people
    q: Array  # its rows in [rad] or [m], shape (N, nq); the first one is the last one of the phase before
    place: int | None = None  # place of the phase of the program that is played backwards; None for what is not


def scene_of(phase: RecoveryPhase, places: RunPlaces, state: StoppedState) -> Scene:
    """The scene that a phase is judged in."""
    return places.scene_while_stopped(state.lying) if phase.place is None else places.scene_of_phase(phase.place)


def moving(cell: Cell, q: Array) -> tuple[str, ...]:
    """Names of the robots that move in some rows, shape (N, nq)."""
    moved = np.any(np.abs(q - q[0]) > SAME, axis=0)
    return tuple(robot.name for robot in cell.robots if np.any(moved[cell.columns(robot.name)]))


def joints_of(cell: Cell, robots: Sequence[str]) -> Flags:
    """Which joints belong to some robots, shape (nq,)."""
    is_moved = np.zeros(cell.joint_count, dtype=bool)
    for name in robots:
        is_moved[cell.columns(name)] = True
    return is_moved
