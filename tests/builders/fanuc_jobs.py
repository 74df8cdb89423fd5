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
from builders.scene_builders import arm_model, work
from cellplan.geometry.transforms import pose
from cellplan.model.report.exported import ExportJob, Moves, ProgramRows, Promise, RobotRows, Seam, Station
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.settings.process_statements import ProcessStatementsEntry
from cellplan.model.settings.task import ProcessEntry

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


def seam_job(*, process: dict[str, object] | None = None, passes: int = 1, **changes: object) -> ExportJob:
    """An arm that enters a seam by joints, begins its process, moves on a line, an arc and a line, and ends it.

    Rows 0 and 1 and the last one are joints; the process takes 0.3 s to begin and 0.2 s to end.
    """
    coupling = np.zeros((6, 6))
    coupling[2, 1] = -1.0
    zero = ControllerZero(zero=np.zeros(6), sign=np.ones(6), coupling=coupling, source="test")
    arm = controlled(NAMES[0], arm_model(), id=CONTROLLER, tool_number=2, frames=(4,))
    task = replace(work(NAMES[0]), feed=0.008, process=ProcessEntry(feed_mm_s=8, on_delay_s=0.3, off_delay_s=0.2))
    entry = None if process is None else ProcessStatementsEntry(**process)  # type: ignore[arg-type]
    cell = replace(cell_of(arm, kind=FANUC), tasks=(task,))
    cell = replace(cell, controllers={CONTROLLER: ControllerEntry(kind=FANUC, process=entry)})
    rows = [row for number in range(passes) for row in _seam_rows(task.name, number)]
    count = len(rows)
    seams = tuple(
        Seam(task=task.name, first=SEAM_ROWS * number + 1, last=SEAM_ROWS * number + 7) for number in range(passes)
    )
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    rng = np.random.default_rng(0)
    robot_rows = RobotRows(
        robot=NAMES[0],
        q=np.array([0.2, 0.3, -0.2, 0.1, -0.9, 0.3]) + rng.uniform(-0.1, 0.1, (count, 6)),
        times=np.arange(count) * 0.5,
        seams=seams,
        **columns,  # type: ignore[arg-type]
    )
    stations = {NAMES[0]: (Station(tasks=(task.name,), number=4, X=np.eye(4)),)}
    program = ProgramRows(name=None, robots={NAMES[0]: robot_rows})
    job = counted(job_of(cell, program, promise=Promise.PACED), zero)
    return replace(job, frame=replace(job.frame, moves=Moves.LINEAR, stations=stations), **changes)  # type: ignore[arg-type]


SEAM_ROWS = 9  # of one pass


def _seam_rows(task: str, number: int) -> list[dict[str, object]]:
    """Rows of one pass: a transfer, the entry, the seam, a transfer."""
    places = {  # [mm] of the tool in its frame, by row
        2: (0, 0, 0),
        3: (60, 0, 0),
        4: (100, 40, 0),
        5: (60, 80, 0),
        6: (-20, 80, 0),
        7: (-20, 80, 50),
    }
    rows = []
    for row in range(SEAM_ROWS):
        X = (
            np.full((4, 4), np.nan)
            if row not in places
            else pose(np.array(places[row]) / 1e3, (0.1 * number, 0.2, 3.0))
        )
        feed = np.nan if row not in places else 0.0125 if row in {2, 7} else 0.008
        share = {3: 0.06, 5: 0.05}.get(row, 0.0)
        rows.append({"X_PT": X, "feeds": feed, "middles": row == 4, "process": 2 <= row < 6, "rounding": share})
    return rows
