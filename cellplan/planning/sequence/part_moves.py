"""Straight moves by which a holder grips a part that lies in the cell, lifts it, lowers it and lets it go.

Each of them is a task of the holder in the world, its tool upright to itself: the part lies where the cell says.
"""

from dataclasses import replace
from enum import StrEnum
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.program import PartPlaceEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.task.task import Frame, SampledPath, Task, TimeLaw, TimeLawKind
from cellplan.model.task.time_law import peak_rate

PEAK_SPEED: Final = 0.1  # [m/s] of the tool near a part that is gripped or put down: slow
QUINTIC: Final = TimeLaw(kind=TimeLawKind.QUINTIC)
ALL_AXES: Final = (0, 1, 2, 3, 4, 5)


class PartMove(StrEnum):
    """What a straight move of a holder does, and the phase it makes."""

    GRIP = "grip"
    LIFT = "lift"
    LOWER = "lower"
    RELEASE = "release"

    @property
    def task(self) -> str:
        """Name of its task; no task of a cell file has such a name."""
        return f"part@{self.value}"


def part_lying(cell: Cell, place: PartPlaceEntry) -> Cell:
    """The cell while its part lies in it, held by no robot."""
    return replace(cell, tasks=(), part=replace(cell.part, held_by=(), X_WP=place.X_WP))


def with_move(cell: Cell, move: PartMove, place: PartPlaceEntry, holder: str) -> Cell:
    """The cell with a straight move of the holder as its only task.

    Gripping and letting go are straight along the axis of the holder's tool; lifting and lowering are vertical.
    """
    grasp = next(grasp for grasp in cell.part.held_by if grasp.robot == holder)
    at = place.X_WP @ grasp.X_PT
    up = np.array([0.0, 0.0, 1.0])
    away = {PartMove.GRIP: -at[:3, 2], PartMove.RELEASE: -at[:3, 2]}.get(move, up)
    length = (place.approach_mm if move in (PartMove.GRIP, PartMove.RELEASE) else place.lift_mm).si
    ends = np.stack([at[:3, 3] + length * away, at[:3, 3]])
    if move in (PartMove.LIFT, PartMove.RELEASE):
        ends = ends[::-1]
    is_lying = move in (PartMove.GRIP, PartMove.RELEASE)
    lying_cell = part_lying(cell, place) if is_lying else cell
    return replace(lying_cell, tasks=(_task(move, holder, ends, at[:3, :3]),))


def _task(move: PartMove, robot: str, ends: Array, R: Array) -> Task:
    """The task of a straight move from one point to another, shape (2, 3), with one orientation of the tool."""
    length = float(np.linalg.norm(ends[1] - ends[0]))
    path = SampledPath(
        source=move.value, points=ends, axes=None, rotations=np.stack([R, R]), is_smooth=False, is_closed=False
    )
    return Task(
        name=move.task,
        robot=robot,
        path=path,
        tool_x=np.array([1.0, 0.0, 0.0]),
        axes=ALL_AXES,
        tolerance=ToleranceEntry(),
        duration=float(np.ceil(100.0 * peak_rate(QUINTIC) * length / PEAK_SPEED) / 100.0),
        time_law=QUINTIC,
        relative_to=Frame.WORLD,
    )
