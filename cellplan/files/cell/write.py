"""The cell that was solved as a cell file: every default written out, start postures and homes filled in."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from cellplan.files.cell.build.accelerations import written_rule
from cellplan.files.schema.cell import MotionEntry
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.schema.task import TaskEntry
from cellplan.files.yaml.writer import yaml_text
from cellplan.geometry.transforms import Array, pose, rpy_from_rotation
from cellplan.model.cell.cell import Cell, Part, Robot
from cellplan.model.cell.sequence import sequence_of
from cellplan.model.robot.robot import RobotModel, configuration_in_si, start_keys
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.settings.units import Deg, Mm, file_number, in_si
from cellplan.model.solver import Integrator
from cellplan.model.task.task import ProgrammedPath, SampledPath, Task, TimedPath
from cellplan.model.units import MM

CONFIGURATIONS: Final = frozenset({"start", "start_deg", "home", "home_deg", "holder", "holder_deg"})


def render_cell(cell: Cell, starts: Mapping[str, Array] | None = None) -> str:
    """The cell as a cell file that loads to the same cell again.

    Files are named as in the original, so the text loads only from a folder from which these names lead to them. Mode,
    method, durations and the choice of tasks are those of the cell, which the command line may have changed.

    Args:
        starts: Start postures that were found, by robot, in [rad] or [m]; those written in the cell stay.

    Raises:
        ValueError: The cell was not read from a file.
    """
    return yaml_text(written_document(cell, starts))


def written_document(cell: Cell, starts: Mapping[str, Array] | None = None) -> dict[str, Any]:
    """The cell as plain values in the units of a cell file, every default filled in; see ``render_cell``."""
    if not cell.origin.document:
        raise ValueError("a cell that was not read from a file has no words to write")
    document: dict[str, Any] = dict(cell.origin.document)
    given_starts = starts or {}
    robots, tasks = document["robots"], document["tasks"]
    document["robots"] = {
        robot.name: _robot(robots[robot.name], robot, given_starts.get(robot.name)) for robot in cell.robots
    }
    document["part"] = _part(document["part"], cell.part)
    document["tasks"] = {task.name: _task(tasks[task.name], task) for task in cell.tasks}
    if cell.program.is_home_to_home:
        written = document["tasks"]
        document["tasks"] = {task.name: _in_sequence(written[task.name], task, cell) for task in cell.tasks}
    if len(cell.tasks) != len(tasks) or str(cell.motion.mode) != document["motion"]["mode"]:
        document.pop("layout", None)  # it may name other tasks, or choose between other modes
    document["motion"] = _motion(document["motion"], cell)
    document["solver"] = _solver(cell.solver)
    document["checks"] = {**document["checks"], "clearance_mm": cell.checks.clearance_mm}
    return document


def as_written(model: RobotModel, q: Array) -> Array:
    """The configuration that is read back after ``q``, shape (n,), in [rad] or [m], was written.

    It is at most a unit in the last place away from ``q``.

    Not every number of radians is the image of a number of degrees. A solver that starts from this configuration can be
    repeated from the written cell to the last bit.
    """
    return configuration_in_si(model, in_file_units(model, q))


def _robot(entry: Mapping[str, Any], robot: Robot, start: Array | None) -> dict[str, Any]:
    """A robot with its weights, start posture and home written out."""
    written = {key: value for key, value in entry.items() if key not in {*CONFIGURATIONS, "order"}}
    written["base"] = _pose(entry["base"], robot.X_WB)
    written |= _configuration("start", robot.model, robot.start if robot.start is not None else start)
    written |= _configuration("home", robot.model, robot.home)
    if robot.order:
        written["order"] = list(robot.order)
    written["weights"] = [float(weight) for weight in robot.weights]
    written["acceleration"] = written_rule(robot)
    written["controller_cycle_ms"] = file_number(robot.controller_cycle, is_revolute=False)
    return {key: written[key] for key in RobotEntry.model_fields if key in written}


def _configuration(key: str, model: RobotModel, q: Array | None) -> dict[str, Any]:
    """A start posture or a home under the key that suits the robot's joints."""
    as_list = all(joint.is_revolute for joint in model.joints)
    if q is None:
        return {f"{key}_deg" if as_list else key: "auto"}
    values = in_file_units(model, q)
    return {f"{key}_deg": values} if as_list else {key: dict(zip(start_keys(model), values, strict=True))}


def _part(entry: Mapping[str, Any], part: Part) -> dict[str, Any]:
    """The part with its place written out."""
    written = dict(entry)
    written["held_by"] = [
        {**old, "at": _pose(old["at"], grasp.X_PT)} for grasp, old in zip(part.held_by, entry["held_by"], strict=True)
    ]
    if part.X_WP is not None:
        written["at"] = _pose(entry["at"], part.X_WP)
    return written


def _task(entry: Mapping[str, Any], task: Task) -> dict[str, Any]:
    """A task with its present start; one without a time of its own still fills the clock."""
    written = {**entry, "start_s": task.start}
    if task.duration is not None:
        written["duration_s"] = task.duration
    if task.process is not None and not task.process.scales:
        process = {**entry["process"], "ramp_s": task.process.ramp}
        written["process"] = {key: process[key] for key in ProcessEntry.model_fields if key in process}
    if isinstance(task.path, SampledPath | TimedPath) and not isinstance(task.path, ProgrammedPath):
        settings = {"file": task.path.source, "smooth": task.path.is_smooth, "closed": task.path.is_closed}
        if isinstance(task.path, SampledPath) and task.path.join:
            settings["join_mm"] = MM * task.path.join
        written["path"] = {**entry["path"], "csv": settings}
    return written


def _in_sequence(entry: Mapping[str, Any], task: Task, cell: Cell) -> dict[str, Any]:
    """A task of a program with what comes before it, its start posture and the configuration of the first holder."""
    written = {key: value for key, value in entry.items() if key not in {*CONFIGURATIONS, "after"}}
    if task.after:
        written["after"] = list(task.after)
    robot, names = cell.robot(task.robot), [other.name for other in cell.tasks]
    first = next((name for name in sequence_of(cell, task.robot) if name in names), task.name)
    if first != task.name or task.start_posture is not None:
        written |= _configuration("start", robot.model, task.start_posture)
    if task.holder_posture is not None and cell.carrier is not None:
        written |= _configuration("holder", cell.robots[cell.carrier].model, task.holder_posture)
    return {key: written[key] for key in TaskEntry.model_fields if key in written}


def _solver(solver: SolverEntry) -> dict[str, Any]:
    """The solver with its integrator as it was used."""
    integrator = Integrator.ACCURATE if solver.is_accurate else Integrator.EULER
    return solver.model_dump(exclude_none=True) | {"integrator": str(integrator)}


def _motion(entry: Mapping[str, Any], cell: Cell) -> dict[str, Any]:
    """The motion with the mode and clock of the cell; a clock that ends with the last task has no length."""
    written = {**entry, "mode": str(cell.motion.mode), "step_s": cell.motion.finer or cell.motion.step}
    written["duration_s"] = cell.motion.duration
    written["timing"] = str(cell.motion.timing) if cell.motion.cycle is None else {"cycle_s": cell.motion.cycle}
    return {key: written[key] for key in MotionEntry.model_fields if written.get(key) is not None}


def _pose(entry: Mapping[str, Any], X: Array) -> dict[str, Any]:
    """A pose with the numbers of the file; with new numbers if it was changed since."""
    if np.array_equal(pose(in_si(map(Mm, entry["xyz_mm"])), in_si(map(Deg, entry["rpy_deg"]))), X):
        return dict(entry)
    xyz_mm = [file_number(float(value), is_revolute=False) for value in X[:3, 3]]
    rpy_deg = [file_number(float(value), is_revolute=True) for value in rpy_from_rotation(X[:3, :3])]
    return {"xyz_mm": xyz_mm, "rpy_deg": rpy_deg}


def in_file_units(model: RobotModel, q: Array) -> list[float]:
    """A configuration in degrees and millimetres."""
    return [
        file_number(float(value), is_revolute=joint.is_revolute) for joint, value in zip(model.joints, q, strict=True)
    ]
