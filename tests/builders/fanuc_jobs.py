"""Export jobs for FANUC controllers: arms whose third axis is counted with the second, and motion groups in step."""

from dataclasses import replace

import numpy as np

from builders.export_jobs import (
    NAMES,
    cell_of,
    controlled,
    drawn_limits,
    job_of,
    positioner_model,
    rail_model,
    random_program,
    two_arms,
    zero_of,
)
from builders.scene_builders import arm_model
from cellplan.model.report.exported import ExportJob, Promise
from cellplan.model.robot.controller import ControllerZero

FANUC = "fanuc"
CONTROLLER = "r30"


def counted(job: ExportJob, zero: ControllerZero | None = None) -> ExportJob:
    """A job whose arms have a controller that counts otherwise than the model."""
    robots = [
        replace(robot, model=replace(robot.model, controller=zero or zero_of(len(robot.model.joints))))
        if len(robot.model.joints) >= 6
        else robot
        for robot in job.frame.cell.robots
    ]
    return replace(job, frame=replace(job.frame, cell=replace(job.frame.cell, robots=tuple(robots))))


def waiting_job(**changes: object) -> ExportJob:
    """Two arms on controllers of their own that wait for one another."""
    return counted(two_arms(FANUC, **changes))  # type: ignore[arg-type]


def group_job(
    *, rows: int = 20, seed: int = 0, groups: tuple[int, int, int] = (1, 3, 2), **changes: object
) -> ExportJob:
    """An arm, an arm on a rail and a positioner, each a motion group of one controller, in step."""
    rng = np.random.default_rng(seed)
    models = (arm_model(), rail_model(), positioner_model())
    robots = [
        controlled(name, drawn_limits(model, rng), id=CONTROLLER, group=group)
        for name, model, group in zip(NAMES, models, groups, strict=False)
    ]
    cell = cell_of(*robots, kind=FANUC)
    job = job_of(cell, random_program(cell, rows=rows, seed=seed), **{"promise": Promise.SYNCHRONISED, **changes})  # type: ignore[arg-type]
    return counted(job)
