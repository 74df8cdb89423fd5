"""Export jobs for RAPID: robots in step on one controller, and robots that meet at signals with names."""

from collections.abc import Mapping, Sequence
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
    zero_of,
)
from builders.scene_builders import arm_model, held_part, work
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Robot, Tool
from cellplan.model.report.exported import ExportFrame, ExportJob, Moves, ProgramRows, Promise, RobotRows
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.controllers import ControllerEntry, HandshakeEntry

ABB = "abb"
CONTROLLER = "irc5"


def named_signals(names: Sequence[str]) -> dict[str, HandshakeEntry]:
    """Handshake signals between all robots, each with a name."""
    return {
        name: HandshakeEntry.model_construct(
            output=f"do_{name}", inputs={other: f"di_{name}_{other}" for other in names if other != name}
        )
        for name in names
    }


def multimove_cell(models: Mapping[str, RobotModel]) -> Cell:
    """Robots on one controller, each with a task and a mechanical unit of its own."""
    robots: list[Robot] = [
        controlled(name, model, id=CONTROLLER, task=f"T_ROB{number}")
        for number, (name, model) in enumerate(models.items(), start=1)
    ]
    cell = cell_of(*robots, kind=ABB)
    units = {
        f"T_ROB{number}": f"ROB_{number}" if len(model.joints) >= 6 else f"STN_{number}"
        for number, model in enumerate(models.values(), start=1)
    }
    controllers = {CONTROLLER: ControllerEntry(kind=ABB, tasks=units)}
    return replace(cell, controllers=controllers)


def multimove_job(*, rows: int = 20, seed: int = 0, at_limit: bool = False, **changes: object) -> ExportJob:
    """An arm, an arm on a rail and a positioner in step."""
    rng = np.random.default_rng(seed)
    cell = multimove_cell(
        {
            NAMES[0]: replace(drawn_limits(arm_model(), rng), controller=zero_of(6)),
            NAMES[1]: drawn_limits(rail_model(), rng),
            NAMES[2]: drawn_limits(positioner_model(), rng),
        }
    )
    program = random_program(cell, rows=rows, seed=seed, at_limit=at_limit)
    return job_of(cell, program, **{"promise": Promise.SYNCHRONISED, **changes})  # type: ignore[arg-type]


def sequence_job(*, rows: int = 20, seed: int = 0, marks: Sequence[int] = (0, 7, 19), **changes: object) -> ExportJob:
    """Two arms on controllers of their own that wait for each other."""
    rng = np.random.default_rng(seed)
    signals = named_signals(NAMES[:2])
    robots = (controlled(name, drawn_limits(arm_model(), rng), handshake=signals[name]) for name in NAMES[:2])
    cell = cell_of(*robots, kind=ABB)
    return job_of(cell, random_program(cell, rows=rows, seed=seed, marks=marks), **changes)  # type: ignore[arg-type]


def part_cell() -> Cell:
    """An arm and an arm on a rail that work on a block on a positioner, all on one controller."""
    cell = multimove_cell({NAMES[0]: arm_model(), NAMES[1]: rail_model(), NAMES[2]: positioner_model()})
    tool = Tool(X_FT=pose((0.02, -0.03, 0.2), (0.1, 0.4, -0.3)), bodies=(), mass=1.25)
    bases = (pose((-0.9, 0.1, 0.2), (0.0, 0.0, 0.3)), pose((0.9, 0.0, 0.0)), pose((0.0, 0.2, 0.1), (0.0, 0.1, 0.0)))
    robots = (replace(robot, tool=tool, X_WB=base) for robot, base in zip(cell.robots, bases, strict=True))
    grip = pose((0.0, 0.01, -0.1), (0.0, 0.0, 0.5))
    return replace(
        cell,
        robots=tuple(robots),
        part=held_part(Box((0.2, 0.2, 0.2)), NAMES[2], grip),
        tasks=(work(NAMES[0]), work(NAMES[1])),
    )


def part_job(
    *, rows: int = 20, seed: int = 0, process: bool = True, step: float | None = None, **changes: object
) -> ExportJob:
    """A job with targets on the part, its poses not yet filled in; no wrist is stretched.

    Rows are anywhere, or each joint moves by at most ``step`` in [rad] or [m] from one to the next.
    """
    cell, rng = part_cell(), np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 0.2, rows - 1))])
    on = np.zeros(rows, dtype=bool)
    on[rows // 4 : rows // 2] = process
    robots = {}
    for robot in cell.robots:
        q = rng.uniform(0.98 * robot.model.lower, 0.98 * robot.model.upper, (rows, len(robot.model.joints)))
        if len(robot.model.joints) >= 6:
            q[:, -2] = rng.uniform(0.4, 2.4, rows) * rng.choice([-1.0, 1.0], rows)
            q[:, -4] = rng.uniform(-1.2, 1.2, rows)
        if step is not None:
            q = q[:1] + np.cumsum(rng.uniform(-step, step, q.shape), axis=0)
        robots[robot.name] = RobotRows(robot=robot.name, q=q, times=times, process=on)
    frame = ExportFrame(
        cell=cell,
        robots=tuple(robots),
        programs=(None,),
        promise=Promise.SYNCHRONISED,
        moves=Moves.LINEAR,
    )
    job = ExportJob(frame=frame, programs=(ProgramRows(name=None, robots=robots),), notes=("on the part",))
    return replace(job, **changes)  # type: ignore[arg-type]
