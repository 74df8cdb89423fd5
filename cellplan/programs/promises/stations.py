"""Stations: the part as controllers have to know it, in every pose in which tools work on it.

A part that stands still while a tool works has a fixed frame in each of its poses; one that a robot of the same
controller holds has a frame that goes with the flange of this robot, whether it moves or not; where the programs of a
robot by itself can state fixed frames only, it has such a frame as long as the part is at rest.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, inverse, rotation_vector
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import Station
from cellplan.model.report.verified_run import AnyRun, ReadRun, UnsolvedRun, VerifiedRun
from cellplan.model.task.task import Frame, Task
from cellplan.programs.elements.frames import controller_base, on_flange
from cellplan.programs.elements.joints import on_one_controller, unit_of
from cellplan.programs.promises.run_programs import holders_rest, run_programs
from cellplan.runs.plan.demanded import DemandedProgram
from cellplan.scene.kinematics.screw_chain import ScrewChain

FIXED: Final = frozenset({"fanuc", "kuka", "staubli", "ur", "yaskawa"})  # kinds whose programs state fixed frames only
SAME_TOL: Final = 1e-6  # [m] and [rad] within which poses of a part are one


def stations(run: AnyRun) -> dict[str, tuple[Station, ...]]:
    """The stations of every robot that works, by its name, in the order of their first use.

    Those of a cell that was not solved are known where the part rests while tools work, in poses that the cell states;
    there are none else.
    """
    by_robot: dict[str, list[Station]] = {}
    for cell, task, q in _resting(run.cell) if isinstance(run, UnsolvedRun) else _worked(run):
        _join(by_robot.setdefault(task.robot, []), _station(cell, task, q))
    return {robot.name: _numbered(robot, by_robot[robot.name]) for robot in run.cell.robots if robot.name in by_robot}


def _worked(run: VerifiedRun | ReadRun) -> Iterator[tuple[Cell, Task, Array]]:
    """Each task with the cell in its phase and the stacked joints in [rad] or [m] while its tool works, (N, nq)."""
    cells = DemandedProgram.of(run.cell).cells
    for program in run_programs(run):
        first = {name: int(np.argmax(inside)) for name, inside in program.process.items() if np.any(inside)}
        for name in sorted(first, key=first.__getitem__):
            rows = np.flatnonzero(program.process[name])
            cell = cells[program.phase_at(int(rows[len(rows) // 2])).place]
            yield cell, cell.task(name), program.q[rows]


def _resting(cell: Cell) -> Iterator[tuple[Cell, Task, Array]]:
    """Likewise where the robot that holds the part rests, at the joints that the cell states for it, shape (1, nq)."""
    demanded = DemandedProgram.of(cell)
    phases, cells = demanded.plan.program, demanded.cells
    names = [task.name for task in cell.tasks]  # moves of the part by itself are none of them
    work = [(o, name) for phase, o in zip(phases, cells, strict=False) for name in phase.tasks if name in names]
    starts = [other.robot(holder).start for other, _ in work for holder in cell.positioners]
    if not holders_rest(cell, phases) or any(start is None for start in starts):
        return
    for other, name in work:
        q = np.zeros((1, cell.joint_count))
        for holder in cell.positioners:
            q[:, cell.columns(holder)] = other.robot(holder).start
        yield other, other.task(name), q


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
    left = iter(numbers)
    return tuple(station if station.X is None else replace(station, number=next(left, None)) for station in known)
