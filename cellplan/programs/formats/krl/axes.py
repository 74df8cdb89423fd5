"""Axes of a KUKA controller: those of an arm, then external ones: its rail, and positioners that move with it."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportFrame, Moves, Promise
from cellplan.programs.elements.frames import require_rest
from cellplan.programs.elements.joints import Axes, unit_of
from cellplan.programs.elements.pages import require_six_axes
from cellplan.programs.formats.krl.poses import status_and_turn
from cellplan.programs.formats.krl.text import EXTERNAL, require_numbers


def played_robots(frame: ExportFrame) -> ExportFrame:
    """The frame with the robots that have programs of their own: no positioners that move with an arm."""
    return replace(frame, robots=tuple(name for name in frame.robots if name == unit_of(frame.cell, name)[0]))


def order_of_axes(frame: ExportFrame, robot: str) -> list[int]:
    """Places of the joints of a robot in the order of a point: its arm, then its external axes."""
    axes = Axes.of(frame.robot(robot))
    return [*axes.arm, *axes.external]


def external_axes(frame: ExportFrame, robot: str) -> int:
    """Number of external axes in the points of a robot's program: those before its arm, then those of other robots."""
    others = unit_of(frame.cell, robot)[1:]
    return len(Axes.of(frame.robot(robot)).external) + sum(len(order_of_axes(frame, name)) for name in others)


def demands(frame: ExportFrame, _rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell."""
    for robot in played_robots(frame).robots:
        yield partial(require_numbers, frame, robot)
        yield partial(require_six_axes, frame.robot(robot), external=EXTERNAL, what="KRL")
        yield partial(_require_places, frame, robot)
        for station in frame.stations.get(robot, ()):
            if station.holder not in unit_of(frame.cell, robot):
                yield partial(require_rest, robot, station)
        is_in_step = frame.promise is Promise.SYNCHRONISED and frame.moves is not Moves.JOINTS
        if frame.promise is Promise.PACED or is_in_step:
            placed = frame.robot(robot)
            yield partial(status_and_turn, placed, np.zeros((1, len(placed.model.joints))))
            for grasp in frame.cell.part.held_by[:1] if frame.moves is Moves.LINEAR else ():
                if grasp.robot in unit_of(frame.cell, robot)[1:]:
                    yield partial(machine_of, frame, grasp.robot)


def machine_of(frame: ExportFrame, positioner: str) -> int:
    """Number of a positioner among the machines of its controller; ``InputError`` where the cell states none."""
    control = frame.robot(positioner).control
    if control is None or control.machine is None:
        raise InputError(
            f"robots.{positioner}.controller.machine: expected its number in MACHINE_DEF of the controller, from 2, as "
            "it moves the frame of the part, got none"
        )
    return control.machine


def _require_places(frame: ExportFrame, arm: str) -> None:
    """Refuse more external axes than a point holds, and an arm without the positioners that its points move."""
    for name in unit_of(frame.cell, arm):
        if name not in frame.robots:
            raise InputError(f"--robot: expected '{name}' too, whose axes stand in the points of '{arm}', got none")
    count = external_axes(frame, arm)
    if count > EXTERNAL:
        raise InputError(
            f"robots.{arm}: expected at most {EXTERNAL} external axes with it on its controller, got {count}"
        )
