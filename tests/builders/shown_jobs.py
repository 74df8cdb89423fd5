"""Small export jobs whose programs the hand-over pages show in full."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from builders.export_jobs import cell_of, controlled, job_of, positioner_model
from builders.fanuc_jobs import CONTROLLER, FANUC, counted, seam_job
from builders.rapid_jobs import multimove_cell
from builders.scene_builders import arm_model
from builders.stream_jobs import with_latency
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise, RobotRows
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import HandshakeEntry, KindName

ARMS = {
    "weld": [
        [0, -90, 90, 0, 0, 0],
        [4.125, -88.31, 91.02, 0, 12.5, -3],
        [8, -87, 92, 0, 20, -6],
        [10, -85, 92.5, 0, 22, -7],
    ],
    "hold": [[0, -90, 90, 0, 45, 0], [0, -90, 90, 0, 45, 0], [5, -90, 90, 0, 45, 0], [5, -90, 90, 0, 45, 0]],
}  # [deg] four rows of two arms
TABLE = [[0, 0], [0.5, -1], [1.5, -3], [2, -4]]  # [deg] four rows of a positioner
NUMBERS = {
    "weld": HandshakeEntry(output=10, inputs={"hold": 11}),
    "hold": HandshakeEntry(output=20, inputs={"weld": 21}),
}
NAMES = {
    "weld": HandshakeEntry(output="doThere", inputs={"hold": "diGo"}),
    "hold": HandshakeEntry(output="doThere", inputs={"weld": "diGo"}),
}
STANDARD = {
    "weld": HandshakeEntry(output=1, inputs={"hold": 0}),
    "hold": HandshakeEntry(output=1, inputs={"weld": 0}),
}
STEP = 0.04  # [s] between rows of the synchronised program
SLOW_CYCLE = 0.02  # [s] of the stream, so that its rest takes few rows


def waiting_arms(kind: KindName, signals: Mapping[str, HandshakeEntry]) -> ExportJob:
    """Two arms, four rows, one mark at the third row."""
    tools = {"weld": 1, "hold": None}
    model = _named("kr16")
    robots = [controlled(n, model, handshake=signals[n], tool_number=tools[n]) for n in ARMS]
    rows = {name: _rows(name, q, times=np.arange(4.0), marks=(2,)) for name, q in ARMS.items()}
    return job_of(cell_of(*robots, kind=kind), ProgramRows(name=None, robots=rows), blend=0.1)


def arm_and_positioner() -> ExportJob:
    """An arm and a positioner in step on one controller; no tool is in process."""
    cell = multimove_cell({"weld": _named("arm"), "table": positioner_model()})
    torch = Tool(X_FT=pose((0.0, 0.0, 0.15)), bodies=(), mass=1.5)
    cell = replace(
        cell, robots=tuple(replace(robot, tool=torch) if robot.name == "weld" else robot for robot in cell.robots)
    )
    times = np.arange(4) * STEP
    rows = {"weld": _rows("weld", ARMS["weld"], times=times), "table": _rows("table", TABLE, times=times)}
    return job_of(cell, ProgramRows(name=None, robots=rows), promise=Promise.SYNCHRONISED, blend=0.25)


def _to_the_ground() -> ControllerZero:
    """A counting of axis 3 against the ground."""
    coupling = np.zeros((6, 6))
    coupling[2, 1] = -1.0
    return ControllerZero(zero=np.zeros(6), sign=np.ones(6), coupling=coupling, source="the model's own file")


def waiting_fanucs() -> ExportJob:
    """Two FANUC arms, four rows, one mark at the third row."""
    return replace(counted(waiting_arms(FANUC, NUMBERS), _to_the_ground()), blend=0.5)


def motion_groups() -> ExportJob:
    """A FANUC arm and a positioner, two motion groups of one controller in step; no tool is in process."""
    weld = controlled("weld", _named("arm"), id=CONTROLLER, group=1, tool_number=3)
    table = controlled("table", positioner_model(), id=CONTROLLER, group=2)
    times = np.arange(4) * STEP
    rows = {"weld": _rows("weld", ARMS["weld"], times=times), "table": _rows("table", TABLE, times=times)}
    program = ProgramRows(name=None, robots=rows)
    job = job_of(cell_of(weld, table, kind=FANUC), program, promise=Promise.SYNCHRONISED, blend=0.5)
    return counted(job, _to_the_ground())


def welded_seam() -> ExportJob:
    """A FANUC arm that welds a line, an arc and a line."""
    return seam_job(process={"on": ("Weave Sine[1]", "Weld Start[1,1]"), "off": ("Weld End[1,1]", "Weave End")})


def timed_table(kind: KindName = "other") -> ExportJob:
    """A positioner whose rows have times, in process in the middle."""
    table = controlled("table", positioner_model())
    times = np.arange(4) * 0.5
    speeds = np.deg2rad([[0, 0], [1.5, -3], [1.5, -3], [0, 0]])
    process = np.array([False, True, True, False])
    rows = _rows("table", TABLE, times=times, qd=speeds, process=process)
    return job_of(cell_of(table, kind=kind), ProgramRows(name=None, robots={"table": rows}), promise=Promise.TIMED)


def streamed_table() -> ExportJob:
    """A positioner at the cycle of its controller, at rest for 0.1 s at both ends."""
    table = controlled("table", positioner_model(), cycle_ms=1e3 * SLOW_CYCLE)
    share = np.clip((np.arange(16) - 5) / 5, 0.0, 1.0)
    q = np.outer(share**3 * (10 - 15 * share + 6 * share**2), [0.1, -0.2])
    process = (share > 0.0) & (share < 1.0)
    rows = _rows("table", q, times=np.arange(16) * SLOW_CYCLE, process=process)
    cell = cell_of(table, kind="kuka")
    return job_of(cell, ProgramRows(name=None, robots={"table": rows}), promise=Promise.TIMED)


def streamed_arm() -> ExportJob:
    """An arm at the cycle of its controller, at rest for 0.1 s at both ends."""
    arm = controlled("weld", _named("arm"), cycle_ms=1e3 * SLOW_CYCLE)
    share = np.clip((np.arange(16) - 5) / 5, 0.0, 1.0)
    q = np.array(ARMS["weld"][0], dtype=float) + np.outer(share**2 * (3 - 2 * share), [1, 2, -1, 0, 3, 1])
    rows = _rows("weld", q, times=np.arange(16) * SLOW_CYCLE)
    cell = cell_of(arm, kind="kuka")
    return job_of(cell, ProgramRows(name=None, robots={"weld": rows}), promise=Promise.TIMED)


def servoed_arm() -> ExportJob:
    """An arm that follows four rows at the cycle of its controller."""
    arm: Robot = controlled("weld", _named("arm"), cycle_ms=8.0)
    start = np.array(ARMS["weld"][0], dtype=float)
    q = start + np.outer([0.0, 0.001, 0.003, 0.004], [1, 2, -1, 0, 3, 1])
    rows = _rows("weld", q, times=np.arange(4) * 0.008)
    cell = with_latency(cell_of(arm, kind="ur"), 100.0)
    return job_of(cell, ProgramRows(name=None, robots={"weld": rows}), promise=Promise.TIMED)


def _named(name: str) -> RobotModel:
    """An arm whose joints are called as on a controller."""
    arm = arm_model()
    return replace(arm, name=name, joints=tuple(replace(joint, name=joint.name.upper()) for joint in arm.joints))


def _rows(robot: str, q: object, *, times: Array, **others: object) -> RobotRows:
    """Rows of a robot from degrees."""
    return RobotRows(robot=robot, q=np.deg2rad(np.array(q, dtype=float)), times=times, **others)  # type: ignore[arg-type]
