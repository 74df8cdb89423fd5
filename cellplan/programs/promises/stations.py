"""Stations: the part as controllers have to know it, in every pose in which tools work on it.

A part that stands still while a tool works has a fixed frame in each of its poses; one that a robot of the same
controller holds has a frame that goes with the flange of this robot, whether it moves or not; where the programs of a
robot by itself can state fixed frames only, it has such a frame as long as the part is at rest.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse, rotation_vector
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import Station
from cellplan.model.report.verified_run import ReadRun, VerifiedRun
from cellplan.model.task.task import Frame, Task
from cellplan.programs.elements.frames import controller_base, on_flange
from cellplan.programs.elements.joints import on_one_controller, unit_of
from cellplan.programs.promises.run_programs import run_programs
from cellplan.runs.plan.demanded import DemandedProgram
from cellplan.scene.kinematics.screw_chain import ScrewChain

FIXED: Final = frozenset({"fanuc", "kuka", "staubli", "ur", "yaskawa"})  # kinds whose programs state fixed frames only
SAME_TOL: Final = 1e-6  # [m] and [rad] within which poses of a part are one


def stations(run: VerifiedRun | ReadRun) -> dict[str, tuple[Station, ...]]:
    """The stations of every robot that works, by its name, in the order of their first use.

    ``InputError`` where a cell states numbers of frames, and fewer than a robot has stations.
    """
    cells = DemandedProgram.of(run.cell).cells
    by_robot: dict[str, list[Station]] = {}
    for program in run_programs(run):
        first = {name: int(np.argmax(inside)) for name, inside in program.process.items() if np.any(inside)}
        for name in sorted(first, key=first.__getitem__):
            rows = np.flatnonzero(program.process[name])
            cell = cells[program.phase_at(int(rows[len(rows) // 2])).place]
            task = cell.task(name)
            _join(by_robot.setdefault(task.robot, []), _station(cell, task, program.q[rows]))
    return {robot.name: _numbered(robot, by_robot[robot.name]) for robot in run.cell.robots if robot.name in by_robot}


def _station(cell: Cell, task: Task, q: Array) -> Station:
    """The station of a task, with the stacked joints in [rad] or [m] while its tool works, shape (N, nq)."""
    part, robot = cell.part, cell.robot(task.robot)
    is_held = task.relative_to is Frame.PART and bool(part.held_by)
    if not is_held:
        X_W = part.X_CP if task.relative_to is Frame.PART else np.eye(4)
        return Station(tasks=(task.name,), X=inverse(controller_base(robot)) @ X_W, X_W=X_W)
    holder = cell.robot(part.held_by[0].robot)
    X_WP = ScrewChain(holder).tool_poses(q[:, cell.columns(holder.name)]) @ part.X_CP
    farthest = np.argmax(np.abs(X_WP - X_WP[0]).max(axis=(1, 2)))
    is_at_rest = _is_same(X_WP[0], X_WP[farthest])
    controller = None if robot.control is None else cell.controllers.get(robot.control.id)
    has_fixed = controller is not None and controller.kind in FIXED
    is_fixed = is_at_rest and has_fixed and holder.name not in unit_of(cell, robot.name)
    if on_one_controller(holder, robot) and not is_fixed:
        return Station(tasks=(task.name,), holder=holder.name, X=on_flange(holder, holder.tool.X_FT @ part.X_CP))
    if not is_at_rest:
        return Station(tasks=(task.name,))
    return Station(tasks=(task.name,), X=inverse(controller_base(robot)) @ X_WP[0], X_W=X_WP[0])


def _join(known: list[Station], other: Station) -> None:
    """Add a station, or its task to the one that it repeats."""
    for place, one in enumerate(known):
        if one.holder == other.holder and _is_same(one.X, other.X):
            known[place] = replace(one, tasks=tuple(dict.fromkeys(one.tasks + other.tasks)))
            return
    known.append(other)


def _is_same(X: Array | None, other: Array | None) -> bool:
    """Whether two poses are one; those of a part that moves are none."""
    if X is None or other is None:
        return X is other
    turn = rotation_vector(X[:3, :3].T @ other[:3, :3])
    return bool(max(np.abs(X - other)[:3, 3].max(), np.abs(turn).max()) <= SAME_TOL)


def _numbered(robot: Robot, known: Sequence[Station]) -> tuple[Station, ...]:
    """Stations of a robot with the numbers of their frames, in their order; a moving part takes none."""
    control, count = robot.control, sum(station.X is not None for station in known)
    numbers = () if control is None else control.frames
    if not numbers and control is not None and control.base_number and count == 1:
        numbers = (control.base_number,)
    if numbers and len(numbers) < count:
        poses = "; ".join(", ".join(station.tasks) for station in known if station.X is not None)
        raise InputError(
            f"robots.{robot.name}.controller.frames: expected {count} numbers, one for each pose of the part in which "
            f"it works ({poses}), got {len(numbers)}"
        )
    left = iter(numbers)
    return tuple(station if station.X is None else replace(station, number=next(left, None)) for station in known)
