"""The branches of an earlier run, read from its folder for a cell that may have other bases, tools and paths."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from cellplan.errors import InputError
from cellplan.files.input.findings import listed
from cellplan.files.run.clock_table import parse_clock
from cellplan.files.run.joint_tables import parse_table
from cellplan.files.run.manifest import NEAR
from cellplan.files.run.stored import CELL, CLOCK, StoredRun, read_stored_run
from cellplan.files.yaml.reader import parse_yaml
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.branches import Branches
from cellplan.model.robot.robot import configuration_in_si
from cellplan.planning.sequence.part_moves import PartMove


def read_branches(folder: Path, cell: Cell) -> Branches:
    """The branches of a run.

    Raises:
        InputError: It is no run, was changed, or has other robots, other joints or none of the tasks.
    """
    stored = read_stored_run(folder)
    _require_fit(stored, cell)
    written = parse_yaml(stored.content("", CELL), file=stored.file("", CELL)).root
    robots, tasks = written["robots"], written["tasks"]
    begun = {
        task.name: _configuration(tasks[task.name], "start", cell.robot(task.robot))
        for task in cell.tasks
        if task.name in tasks and tasks[task.name]["robot"] == task.robot
    }
    starts = {robot.name: _configuration(robots[robot.name], "start", robot) for robot in cell.robots}
    homes = {robot.name: _configuration(robots[robot.name], "home", robot) for robot in cell.robots}
    if not cell.program.is_home_to_home:
        begun = {name: starts[cell.task(name).robot] for name in begun}
    known = {name: q for name, q in begun.items() if q is not None}
    return Branches(
        run=folder.resolve().name,
        digest=stored.digest,
        starts={name: q for name, q in starts.items() if q is not None},
        homes={name: q for name, q in homes.items() if q is not None},
        tasks=known | _straight_moves(stored, cell),
    )


def with_run_named(cell: Cell, near: Branches | None) -> Cell:
    """The cell with the run whose branches it keeps among its inputs."""
    if near is None:
        return cell
    inputs = {**cell.inputs, f"{NEAR}{near.run}": near.digest}
    return replace(cell, inputs=dict(sorted(inputs.items())))  # as in the manifest


def _require_fit(stored: StoredRun, cell: Cell) -> None:
    """Refuse a run of other robots, joints or tasks."""
    where, joints = f"as in the run '{stored.folder}' of --near", stored.record["joints"]
    names = [robot.name for robot in cell.robots]
    if sorted(names) != sorted(joints):
        raise InputError(
            f"{cell.origin.at('robots')}: expected the robots {listed(sorted(joints))} {where}, got "
            f"{listed(sorted(names))}: name a run of these robots"
        )
    for robot in cell.robots:
        if tuple(joints[robot.name]) != robot.model.joint_names:
            raise InputError(
                f"{cell.origin.at(f'robots.{robot.name}.model')}: expected the joints {listed(joints[robot.name])} "
                f"{where}, got {listed(robot.model.joint_names)}: name a run of this robot"
            )
    done = {name: task_record["robot"] for name, task_record in stored.record["tasks"].items()}
    if not any(done.get(task.name) == task.robot for task in cell.tasks):
        raise InputError(
            f"{cell.origin.at('tasks')}: expected a task of the same name and robot {where}, got none: there are "
            f"{listed(f'{name} of {robot}' for name, robot in done.items())}"
        )


def _configuration(entry: Mapping[str, Any], key: str, robot: Robot) -> Array | None:
    """A configuration of a resolved cell in [rad] or [m], shape (n,); None where it has none."""
    given = entry.get(f"{key}_deg", entry.get(key))
    return None if given is None or given == "auto" else configuration_in_si(robot.model, given)


def _straight_moves(stored: StoredRun, cell: Cell) -> dict[str, Array]:
    """Where the holder begins its straight moves, by their tasks; the resolved cell does not have these."""
    moves = [move for move in PartMove if move.value in stored.records and cell.positioners]
    if not moves:
        return {}
    holder = cell.robot(cell.positioners[0])
    if stored.clock:
        phases = parse_clock(stored.clock, stored.file("", f"tables/{CLOCK}.csv")).table.phases
        q = parse_table(stored.tables[holder.name], stored.file("", f"tables/{holder.name}.csv")).q
        return {move.task: q[phases.index(move.value)] for move in moves}
    begun = {}  # a failed run has no tables
    for move in moves:
        curves = stored.series(move.value)["joints"][holder.name]
        first = [curves[joint.name][f"position_{joint.display_unit.name}"][0] for joint in holder.model.joints]
        begun[move.task] = configuration_in_si(holder.model, first)
    return begun
