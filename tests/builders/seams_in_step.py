"""The seam of the elbow arm on a part that a table of its controller turns meanwhile, all axes in step."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from builders.elbow_arm import closed_form, tip
from builders.export_jobs import controlled, positioner_model, signals
from builders.paced_pairs import FANUC_ZERO, WELD
from builders.scene_builders import arm_model, held_part, placed
from builders.seam_jobs import CONTROLLER, KUKA_ZERO, ROBOT, SEAM, TASK, VALVE, X_WP, poses, seam_job
from cellplan.geometry.transforms import Array, inverse, pose
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise, RobotRows, Station
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.programs.seams.shapes import Shape, arc, line

TABLE = "table"
MACHINE = {"machine": 2}  # what the cell states of it on a KUKA controller
HELD = np.array(  # joints of the table in [rad] at all rows; the arc counts with its end
    [[0.0, 0.0], [0.0, 0.0], [0.01, 0.0], [0.03, -0.05], [0.03, -0.08], [0.05, -0.12], [0.05, -0.12], [0.0, 0.0]]
)


def shapes() -> list[tuple[int, int, Shape]]:
    """Lines and arcs of the seam with the rows at which they begin and end."""
    X = poses()
    curve = arc(*X[2:5])
    assert curve is not None
    return [(1, 2, line(*X[:2])), (2, 3, line(*X[1:3])), (3, 5, curve), (5, 6, line(*X[4:]))]


def table(stated: Mapping[str, Any] = MACHINE) -> Robot:
    """A table that tilts and turns, on the controller of the arm, of which the cell states something."""
    control = RobotControlEntry.model_validate({"id": CONTROLLER, **stated}, strict=False)
    return replace(placed(TABLE, positioner_model(), base=pose((0.7, 0.1, 0.0), (0.0, 0.0, 0.3))), control=control)


def part_at(held: Array) -> Array:
    """The part in the world, shape (4, 4), for joints of the table, shape (2,)."""
    robot = table()
    return tip(robot, held) @ inverse(tip(robot, HELD[1])) @ X_WP


def joints_at(robot: Robot, X_PT: Array, held: Array) -> Array:
    """Joints of the arm that bring its tool to a pose on the part."""
    return closed_form(robot, part_at(held) @ X_PT @ inverse(robot.tool.X_FT), 1, 1, 1)


def job_in_step(*, number: int | None = None) -> ExportJob:
    """The job of the arm and the table on a KUKA controller."""
    return held(seam_job("kuka", controller=KUKA_ZERO, process=VALVE, number=number), table(), number=number)


def fanuc_in_step() -> ExportJob:
    """The same on a FANUC controller, whose corner is rounded within 12 mm."""
    stated = {"group": 1, "tool_number": 2}
    job = held(
        seam_job("fanuc", controller=FANUC_ZERO, process=WELD, control=stated), table({"group": 2, "tool_number": 1})
    )
    robots = {name: replace(rows, times=2.0 * np.arange(8.0)) for name, rows in job.programs[0].robots.items()}
    return replace(job, programs=(replace(job.programs[0], robots=robots),))


def held(job: ExportJob, turning: Robot, *, number: int | None = None) -> ExportJob:
    """The job of an arm whose part a table holds."""
    robot, rows = job.frame.robot(ROBOT), job.programs[0].robots[ROBOT]
    q = rows.q.copy()
    q[1:7] = [joints_at(robot, X, held) for X, held in zip(poses(), HELD[1:7], strict=True)]
    X_FP = inverse(tip(turning, HELD[1])) @ X_WP
    cell = replace(
        job.frame.cell,
        robots=(turning, *job.frame.cell.robots),
        part=held_part(job.frame.cell.part.shape, TABLE, inverse(X_FP)),
    )
    frame = replace(
        job.frame,
        cell=cell,
        robots=(TABLE, ROBOT),
        promise=Promise.SYNCHRONISED,
        stations={ROBOT: (Station(tasks=(TASK,), number=number, holder=TABLE, X=X_FP),)},
    )
    robots = {
        TABLE: RobotRows(robot=TABLE, q=HELD, times=rows.times, rounding=rows.rounding),
        ROBOT: replace(rows, q=q),
    }
    return replace(job, frame=frame, programs=(ProgramRows(name=None, robots=robots),))


def job_beside() -> ExportJob:
    """The same beside an arm of another controller, for which it waits at its first and last row and in its seam."""
    job, other = job_in_step(), controlled("beta", arm_model(), id="another")
    wires = signals([ROBOT, other.name])
    robots = tuple(
        replace(one, control=one.control.model_copy(update={"handshake": wires.get(one.name)}))
        for one in (*job.frame.cell.robots, other)
        if one.control is not None
    )
    kinds = {**job.frame.cell.controllers, "another": ControllerEntry(kind="abb")}
    cell = replace(job.frame.cell, robots=robots, controllers=kinds)
    waiting = {name: replace(rows, marks=(0, 5, 7)) for name, rows in job.programs[0].robots.items()}
    frame = replace(job.frame, cell=cell, promise=Promise.PACED)
    return replace(job, frame=frame, programs=(ProgramRows(name=None, robots=waiting),))


def run_in_step(job: ExportJob, *, steps: int = 20, uneven: float = 0.0) -> ProgramRows:
    """All rows of its run: the tool on its shapes, the table evenly along each, but for so much in [rad] in between."""
    robot, rows = job.frame.robot(ROBOT), job.programs[0].robots[ROBOT]
    shares = np.arange(1, steps + 1) / steps
    q, held, times = [rows.q[:1]], [HELD[:1]], [np.zeros(1)]
    between = {first: (last, shape) for first, last, shape in shapes()}
    for first in (0, 1, 2, 3, 5, 6):
        last, shape = between.get(first, (first + 1, None))
        turned = HELD[first] + shares[:, None] * (HELD[last] - HELD[first])
        if shape is None:
            moved = rows.q[first] + shares[:, None] * (rows.q[last] - rows.q[first])
        else:
            turned = turned + uneven * (4.0 * shares * (1.0 - shares))[:, None]
            moved = np.array([joints_at(robot, X, at) for X, at in zip(shape.poses(shares), turned, strict=True)])
        q.append(moved)
        held.append(turned)
        times.append(first + (last - first) * shares)
    clock = np.concatenate(times)
    every = {
        TABLE: RobotRows(robot=TABLE, q=np.concatenate(held), times=clock),
        ROBOT: RobotRows(robot=ROBOT, q=np.concatenate(q), times=clock),
    }
    assert SEAM.first == 1
    return ProgramRows(name=None, robots=every)
