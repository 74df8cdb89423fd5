"""Paced programs of two arms that weld at once and wait for one another, made by hand, for all makers."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from builders.seam_jobs import (
    ARC_AND_WEAVE,
    CONTROLLER,
    KUKA_ZERO,
    ROBOT,
    STAUBLI_VALVE,
    TASK,
    UR_VALVE,
    run_of,
    seam_job,
)
from cellplan.model.report.exported import ExportJob, ProgramRows, RobotRows
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.settings.controllers import ControllerEntry, KindName, RobotControlEntry
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect

OTHER, OTHER_TASK = "beta", "seam_of_beta"
MARKS = (1, 6)  # at the entry of the seam, and at its end
ABB_ARC = {
    "on": r"ArcLStart {point}, {speed}, seam1, {data}, {zone}, {tool} \WObj:={frame};",
    "inner": r"ArcL {point}, {speed}, seam1, {data}, {zone}, {tool} \WObj:={frame};",
    "off": r"ArcLEnd {point}, {speed}, seam1, {data}, {zone}, {tool} \WObj:={frame};",
    "data": {TASK: "weld1", OTHER_TASK: "weld2"},
}
WELD = {"on": ["Weave Sine[1]", "Weld Start[1,1]"], "off": ["Weld End[1,1]", "Weave End"]}
KUKA_ARC = {
    "on": ["$OUT[6]=TRUE", "ARC_ON({data})"],
    "off": ["ARC_OFF()", "$OUT[6]=FALSE"],
    "data": {TASK: "WELD1", OTHER_TASK: "WELD2"},
}
FANUC_ZERO = ControllerZero(  # axis 3 is counted against the horizontal
    zero=np.zeros(6), sign=np.ones(6), coupling=-np.eye(6, k=-1) * (np.arange(6) == 2)[:, None], source="its file"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Maker:
    """What the controllers of a maker state in the cell."""

    kind: KindName
    process: Mapping[str, Any]
    output: str | int
    input: str | int
    stated: Mapping[str, Any]  # of each robot
    levels: tuple[float, ...] = ()
    number: int | None = None  # of the frame of the part


MAKERS = {
    "rapid": Maker(kind="abb", process=ABB_ARC, output="doThere", input="diGo", stated={}),
    "krl": Maker(kind="kuka", process=KUKA_ARC, output=17, input=18, stated={"tool_number": 3}, number=5),
    "fanuc_ls": Maker(
        kind="fanuc", process=WELD, output=11, input=12, stated={"tool_number": 2, "frames": (4,)}, number=4
    ),
    "inform": Maker(
        kind="yaskawa",
        process=ARC_AND_WEAVE,
        output=21,
        input=22,
        stated={"tool_number": 1, "frames": (2,)},
        levels=(1.0, 2.0, 5.0),
        number=2,
    ),
    "val3": Maker(kind="staubli", process=STAUBLI_VALVE, output="doThere", input="diGo", stated={}),
    "urscript": Maker(kind="ur", process=UR_VALVE, output=4, input=5, stated={}),
}


def pair_job(form: str) -> tuple[Dialect, ExportJob, ProgramRows]:
    """A format, the job of two arms in it, and all rows of its run.

    Both arms stand at one place, as nothing is asked here of their bodies; each has a controller of its own.
    """
    maker = MAKERS[form]
    zeros = {"kuka": KUKA_ZERO, "fanuc": FANUC_ZERO}
    job = seam_job(
        maker.kind, process=maker.process, controller=zeros.get(maker.kind), control=maker.stated, number=maker.number
    )
    cell = job.frame.cell
    entry = cell.controllers[CONTROLLER]
    if maker.levels:
        stated = entry.model_dump(exclude_unset=True) | {"position_levels_mm": maker.levels}
        entry = ControllerEntry.model_validate(stated)
    controllers = {CONTROLLER: entry, "other_box": entry}
    robots = tuple(
        replace(
            cell.robot(ROBOT),
            name=name,
            control=RobotControlEntry(
                id=control, handshake={"output": maker.output, "inputs": {other: maker.input}}, **maker.stated
            ),
        )
        for name, other, control in ((ROBOT, OTHER, CONTROLLER), (OTHER, ROBOT, "other_box"))
    )
    tasks = (cell.task(TASK), replace(cell.task(TASK), name=OTHER_TASK, robot=OTHER))
    cell = replace(cell, robots=robots, tasks=tasks, controllers=controllers)
    stations = {
        name: (replace(job.frame.stations[ROBOT][0], tasks=(task,)),)
        for name, task in ((ROBOT, TASK), (OTHER, OTHER_TASK))
    }
    frame = replace(job.frame, cell=cell, robots=(ROBOT, OTHER), stations=stations)
    rows = replace(job.programs[0].robots[ROBOT], marks=MARKS)
    others = replace(rows, robot=OTHER, seams=(replace(rows.seams[0], task=OTHER_TASK),))
    every = run_of(job).robots[ROBOT]
    run = ProgramRows(name=None, robots={ROBOT: every, OTHER: _renamed(every)})
    programs = (ProgramRows(name=None, robots={ROBOT: rows, OTHER: others}),)
    return DIALECTS[form], replace(job, frame=frame, programs=programs), run


def _renamed(rows: RobotRows) -> RobotRows:
    return replace(rows, robot=OTHER)
