"""A paced job made by hand: the elbow arm enters a seam by its joints, and follows two lines, an arc and a retract."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from builders.elbow_arm import closed_form, wide
from builders.scene_builders import make_cell, stick, work
from cellplan.geometry.transforms import Array, inverse, pose, rotation_exp
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import (
    ExportFrame,
    ExportJob,
    Moves,
    ProgramRows,
    Promise,
    RobotRows,
    Seam,
    Station,
)
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.settings.controllers import ControllerEntry, KindName, RobotControlEntry
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.task import SpacePolylinePath
from cellplan.programs.seams.shapes import arc, line

ROBOT, TASK, CONTROLLER = "alpha", "seam", "box"
X_WP = pose((0.6, -0.1, 0.5), (0.0, 0.1, 0.4))  # the part in the world, which is the base of the arm
PLACES = ((0.0, 0.0, 0.1), (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.15, 0.02, 0.0), (0.2, 0.0, 0.0), (0.2, 0.0, 0.1))
KUKA_ZERO = ControllerZero(  # stretched forward
    zero=np.deg2rad([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]), sign=np.ones(6), coupling=np.zeros((6, 6)), source="its file"
)
VALVE = {"on": ["$OUT[6]=TRUE", "$OUT[7]=TRUE"], "off": ["$OUT[7]=FALSE", "$OUT[6]=FALSE"]}  # of a KUKA arm
UR_VALVE = {"on": "set_digital_out(3,True)", "off": "set_digital_out(3,False)"}
STAUBLI_VALVE = {"on": ["doGas=true", "doArc=true"], "off": ["doArc=false", "doGas=false"]}
ARC_AND_WEAVE = {"on": ["ARCON ASF#(1)", "WVON WEV#(1)"], "off": ["WVOF", "ARCOF AEF#(1)"]}  # of a Yaskawa arm
SEAM = Seam(task=TASK, first=1, last=6)  # approach; start, corner, through the arc, end; retract


def poses() -> Array:
    """Poses of the tool on the part at the rows of the seam, the tool pointing down and turning, shape (6, 4, 4)."""
    down = pose((0.0, 0.0, 0.0), (0.0, 0.5 * np.pi, 0.0))[:3, :3]
    X = np.repeat(np.eye(4)[None], len(PLACES), axis=0)
    X[:, :3, 3] = PLACES
    X[:, :3, :3] = rotation_exp(np.array([[0.0, 0.0, 0.04 * row] for row in range(len(PLACES))])) @ down
    return X


def joints_at(robot: Robot, X_PT: Array, *, branch: tuple[int, int, int] = (1, 1, 1)) -> Array:
    """Joints of the elbow arm that bring its tool to a pose on the part, shape (6,)."""
    return closed_form(robot, X_WP @ X_PT @ inverse(robot.tool.X_FT), *branch)


def seam_job(
    kind: KindName,
    *,
    process: Mapping[str, Any] | None = None,
    controller: Any = None,
    control: Mapping[str, Any] | None = None,
    number: int | None = None,
) -> ExportJob:
    """The job of one arm: home, the entry, five moves of the tool and home again, the process on over three of them.

    ``process`` are the statements of its controller, ``control`` what the robot states of it, ``controller`` how it
    counts, ``number`` that of the frame of the part.
    """
    robot = wide(ROBOT)
    robot = replace(
        robot,
        model=replace(robot.model, controller=controller),
        tool=replace(stick(), X_FT=pose((0.0, 0.02, 0.1), (0.1, 0.0, 0.2))),
        control=RobotControlEntry(**{"id": CONTROLLER, **(control or {})}),
    )
    stated = (
        {} if process is None else {"process": {k: tuple(v) if isinstance(v, list) else v for k, v in process.items()}}
    )
    entry = ControllerEntry.model_validate({"kind": kind, **stated})
    task = replace(
        work(ROBOT),
        name=TASK,
        path=SpacePolylinePath(points=PLACES[1:5], is_closed=False),
        feed=0.008,
        process=ProcessEntry(feed_mm_s=8.0, on_delay_s=0.3, off_delay_s=0.2),
    )
    cell = replace(make_cell(robot, tasks=(task,)), controllers={CONTROLLER: entry})
    X_PT = poses()
    home = np.array([0.2, -0.3, 0.4, 0.1, 0.9, -0.2])
    rows = RobotRows(
        robot=ROBOT,
        q=np.array([home, *(joints_at(robot, X) for X in X_PT), home]),
        times=np.arange(8.0),
        process=np.array([False, False, True, True, True, False, False, False]),
        rounding=np.array([0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0]),
        X_PT=np.concatenate([np.full((2, 4, 4), np.nan), X_PT[1:], np.full((1, 4, 4), np.nan)]),
        feeds=np.array([np.nan, np.nan, 0.05, 0.008, 0.008, 0.008, 0.05, np.nan]),
        middles=np.array([False] * 4 + [True] + [False] * 3),
        seams=(SEAM,),
    )
    station = Station(tasks=(TASK,), number=number, X=X_WP, X_W=X_WP)
    frame = ExportFrame(
        cell=cell,
        robots=(ROBOT,),
        programs=(None,),
        promise=Promise.PACED,
        moves=Moves.LINEAR,
        stations={ROBOT: (station,)},
    )
    return ExportJob(frame=frame, programs=(ProgramRows(name=None, robots={ROBOT: rows}),))


def inform_job(**stated: object) -> ExportJob:
    """The job of a Yaskawa arm; the corner between its lines may be rounded over half of them."""
    job = seam_job("yaskawa", process=ARC_AND_WEAVE, control={"tool_number": 1, "frames": (2,)} | stated, number=2)
    rows = job.programs[0].robots[ROBOT]
    assert rows.rounding is not None
    rounded = replace(rows, rounding=np.where(rows.rounding > 0.0, 0.5, 0.0))
    return replace(job, programs=(replace(job.programs[0], robots={ROBOT: rounded}),))


def run_of(job: ExportJob, *, steps: int = 40) -> ProgramRows:
    """All rows of the run of a job: its tool on the lines and the arc, so many to a move."""
    rows, X_PT = job.programs[0].robots[ROBOT], poses()
    robot = job.frame.robot(ROBOT)
    shapes = [line(X_PT[0], X_PT[1]), line(X_PT[1], X_PT[2]), arc(*X_PT[2:5]), None, line(X_PT[4], X_PT[5])]
    q, times = [rows.q[0]], [0.0]
    for step in range(len(rows) - 1):
        shares = np.arange(1, steps + 1) / steps
        shape = shapes[step - 1] if 0 < step < 6 else None
        if step == 4:
            continue  # the arc of the step before leads on over it
        span = 2.0 if step == 3 else 1.0
        if shape is None:
            q += list(rows.q[step] + shares[:, None] * (rows.q[step + 1] - rows.q[step]))
        else:
            q += [joints_at(robot, X) for X in shape.poses(shares)]
        times += (float(step) + span * shares).tolist()
    return ProgramRows(name=None, robots={ROBOT: RobotRows(robot=ROBOT, q=np.array(q), times=np.array(times))})
