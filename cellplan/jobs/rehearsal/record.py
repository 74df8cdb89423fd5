"""``rehearsal.json``: true errors on real cells in printed units, round by round and over all trials."""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import PurePath
from typing import Any

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.cell_errors import Draw
from cellplan.model.report.rehearsal import (
    Correction,
    IsoFigures,
    PathFigures,
    PoseFigures,
    Rehearsal,
    RunRehearsal,
    Trial,
)
from cellplan.model.report.report import CAUTION, TaskAccuracy
from cellplan.report.record.common import AXES, Provenance, Record, check_record, entry_record, number
from cellplan.report.record.phases import missing_moves
from cellplan.report.record.sections.tasks import BETWEEN_ROWS

SCHEMA = "cellplan.rehearsal/1"
ABC = ("a", "b", "c")
Pick = Callable[[Trial], tuple[TaskAccuracy, ...] | None]


EXECUTIONS: Mapping[str, Pick] = {
    "before": lambda trial: trial.before,
    "after": lambda trial: None if trial.correction is None else trial.correction.accuracy,
    "in_pass": lambda trial: trial.in_pass,
}  # true errors of the program as solved, corrected from pass to pass, and corrected within the pass


def rehearsal_record(rehearsal: Rehearsal, *, provenance: Provenance) -> Record:
    """Everything that is known about one rehearsal."""
    cell, errors = rehearsal.cell, rehearsal.errors
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if rehearsal.passed else "failed",
        "mode": str(cell.motion.mode),
        "cycle_time_s": number(sum(float(run.times[-1]) for run in rehearsal.runs)),
        "trials": len(rehearsal.runs[0].trials),
        "feedback": rehearsal.has_feedback,
        "in_pass": rehearsal.has_in_pass,
        "tables_released": rehearsal.is_released,
        "measurement": entry_record(errors.measurement),
        "simulated": _simulated_record(rehearsal),
        "tasks": {name: record for run in rehearsal.runs for name, record in _tasks_record(cell, run).items()},
        "runs": [_run_record(cell, run) for run in rehearsal.runs],
        "checks": [check_record(check) for check in rehearsal.checks],
        "not_in_program": missing_moves(cell, {run.name: run.before for run in rehearsal.runs}),
        "inputs": {**cell.inputs, **({PurePath(errors.file).name: errors.digest} if errors.digest else {})},
        "digests": dict(provenance.digests),
        "versions": dict(provenance.versions),
        "seed": errors.seed,
        "caution": CAUTION,
    }


def _simulated_record(rehearsal: Rehearsal) -> Record:
    """Largest joint errors and torques of simulated arms over all runs and trials, by robot and joint."""
    cell, simulation = rehearsal.cell, rehearsal.errors.simulation
    made = [trial.joints for run in rehearsal.runs for trial in run.trials if trial.joints is not None]
    if simulation is None or not made:
        return {}
    errors = np.max([np.abs(it.executed - it.commanded).max(axis=0) for it in made], axis=0)
    torques = np.max([np.abs(it.torque).max(axis=0) for it in made], axis=0)
    record: dict[str, Any] = {}
    for name in simulation.robots:
        joints, columns = cell.robot(name).model.joints, cell.columns(name)
        record[name] = {
            joint.name: {
                f"max_error_{joint.display_unit.name}": number(error, joint.display_unit.scale),
                f"max_torque_{'nm' if joint.is_revolute else 'n'}": number(torque),
            }
            for joint, error, torque in zip(joints, errors[columns], torques[columns], strict=True)
        }
    return record


def _tasks_record(cell: Cell, run: RunRehearsal) -> Record:
    """True errors of each task of a run over all trials, for each way of executing it."""
    record: dict[str, Any] = {}
    for place, accuracy in enumerate(run.trials[0].before):
        task = cell.task(accuracy.task)
        record[task.name] = {
            "robot": task.robot,
            "run": run.name,
            "tolerance": entry_record(task.tolerance, without=BETWEEN_ROWS),
            "axes": [AXES[index] for index in task.axes],
            "judged_from_s": number(float(run.times[run.judged_from[task.name]])),
            **{name: _execution_record(run, place, pick) for name, pick in EXECUTIONS.items()},
            "iso_9283": {
                "before": _iso_record(run.before[task.name]),
                "after": None if run.after is None else _iso_record(run.after[task.name]),
            },
        }
    return record


def _execution_record(run: RunRehearsal, place: int, pick: Pick) -> Record | None:
    """Largest, mean and root-mean-square errors over all samples and trials; None where there was no such execution."""
    picked = [(index, record[place]) for index, trial in enumerate(run.trials) if (record := pick(trial)) is not None]
    if not picked:
        return None
    numbers = [index for index, _ in picked]
    first = run.judged_from[picked[0][1].task]
    times = run.times[first:]
    position = np.stack([errors.position_error[first:] for _, errors in picked])
    orientation = np.stack([errors.orientation_error[first:] for _, errors in picked])
    return {
        "trials": len(picked),
        **_error_record("position_error", "mm", 1e3 * position, times=times, numbers=numbers, axes=AXES[:3]),
        **_error_record(
            "orientation_error", "deg", np.rad2deg(orientation), times=times, numbers=numbers, axes=AXES[3:]
        ),
    }


def _error_record(
    name: str, unit: str, errors: Array, *, times: Array, numbers: Sequence[int], axes: Sequence[str]
) -> Record:
    """Figures of one kind of error, shape (T, N, 3)."""
    length = np.linalg.norm(errors, axis=2)
    trial, sample = np.unravel_index(int(np.argmax(length)), length.shape)
    by_axis = np.abs(errors).max(axis=(0, 1))
    return {
        f"max_{name}_{unit}": number(length[trial, sample]),
        f"max_{name}_at_s": number(times[sample]),
        f"max_{name}_trial": numbers[int(trial)] + 1,
        f"mean_{name}_{unit}": number(length.mean()),
        f"rms_{name}_{unit}": number(math.sqrt(np.mean(length**2))),
        f"max_{name}_by_axis_{unit}": {axis: number(value) for axis, value in zip(axes, by_axis, strict=True)},
    }


def _iso_record(figures: IsoFigures) -> Record:
    """Figures of ISO 9283 by their names there."""
    return {**_path_record(figures.path), "poses": [_pose_record(pose) for pose in figures.poses]}


def _path_record(path: PathFigures) -> Record:
    return {
        "AT_p_mm": number(path.AT_p, 1e3),
        "AT_p_at_s": number(path.AT_p_at_s),
        **_angles_record("AT", path.AT_abc),
        "RT_p_mm": number(path.RT_p, 1e3),
        "RT_p_at_s": number(path.RT_p_at_s),
        **_angles_record("RT", path.RT_abc),
    }


def _pose_record(pose: PoseFigures) -> Record:
    return {
        "at_s": number(pose.at_s),
        "AP_p_mm": number(pose.AP_p, 1e3),
        **_angles_record("AP", pose.AP_abc),
        "RP_l_mm": number(pose.RP_l, 1e3),
        **_angles_record("RP", pose.RP_abc),
    }


def _angles_record(name: str, angles: tuple[float, float, float] | None) -> Record:
    return {
        f"{name}_{letter}_deg": None if angles is None else number(math.degrees(angles[index]))
        for index, letter in enumerate(ABC)
    }


def _run_record(cell: Cell, run: RunRehearsal) -> Record:
    """What was drawn and what correcting came to, trial by trial."""
    return {
        "name": run.name,
        "trials": [
            {
                "trial": index + 1,
                "correction": None if trial.correction is None else _correction_record(trial.correction),
                "drawn": _draw_record(cell, trial.draw),
            }
            for index, trial in enumerate(run.trials)
        ],
        "corrected_program": None
        if run.corrected is None
        else {
            "passed": run.corrected.report.passed,
            "checks": len(run.corrected.report.checks),
            "failed": [check.message for check in run.corrected.report.checks if not check.passed],
        },
    }


def _correction_record(correction: Correction) -> Record:
    """The convergence table: every round, and by which factor the error changed from the one before."""
    shares = [made.measured_share for made in correction.rounds]
    factors = [None, *(now / last if last > 0.0 else None for last, now in pairwise(shares))]
    return {
        "outcome": str(correction.outcome),
        "kept_round": correction.best,
        "rounds": [
            {
                "round": made.number,
                "max_position_error_mm": {task: number(value, 1e3) for task, value in made.position.items()},
                "max_orientation_error_deg": {
                    task: number(math.degrees(value)) for task, value in made.orientation.items()
                },
                "share_of_tolerance": number(made.share),
                "measured_share_of_tolerance": number(made.measured_share),
                "factor": number(factor),
            }
            for made, factor in zip(correction.rounds, factors, strict=True)
        ],
    }


def _draw_record(cell: Cell, draw: Draw) -> Record:
    """The errors of one trial as they were drawn: joints by name, poses as rows of a matrix with lengths in mm."""
    robots: dict[str, Any] = {}
    for robot in cell.robots:
        sample = draw.robots[robot.name]
        joints = list(zip(robot.model.joints, sample.joint_offsets, strict=True))
        robots[robot.name] = {
            "joint_offsets": {
                f"{joint.name}_{joint.display_unit.name}": number(joint.display_unit.scale * value)
                for joint, value in joints
            },
            "link_lengths_mm": {
                name: number(1e3 * value)
                for name, value in zip(robot.model.joint_names, sample.link_lengths, strict=True)
            },
            "base": _pose_rows(sample.X_base),
            "tool": _pose_rows(sample.X_tool),
        }
    return {"robots": robots, "grasp": {name: _pose_rows(X) for name, X in draw.X_grasps.items()}}


def _pose_rows(X: Array) -> Record:
    """A small pose: position in mm and the three rows of its rotation."""
    return {
        "xyz_mm": [number(1e3 * value) for value in X[:3, 3]],
        "rotation": [[number(value) for value in row] for row in X[:3, :3]],
    }
