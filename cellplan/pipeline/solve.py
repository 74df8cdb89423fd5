"""Solve a cell: from what the user wrote to verified joint tables."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import PurePath
from typing import Final

import numpy as np

from cellplan.checks.verify import verify
from cellplan.geometry.transforms import Array
from cellplan.io.cell_writer import as_written
from cellplan.io.tables import TableHeader, parse_table, program_digest, render_table, replace_header
from cellplan.model.cell import Cell, Robot
from cellplan.model.motion import Motion, Program
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Report
from cellplan.model.toolpath import Toolpath
from cellplan.pipeline.drawing import Drawing
from cellplan.pipeline.solution import Run, Solution
from cellplan.planning.closer_look import resolve_closely
from cellplan.planning.given_starts import examine_given_starts
from cellplan.planning.modes import RunPlan, plan_runs
from cellplan.planning.schedule import examine_times, sample, time_tasks
from cellplan.planning.start_search import find_start
from cellplan.planning.toolpaths import build_toolpath
from cellplan.report.acceleration_record import table_line
from cellplan.scene.scene import Scene

START_DECIMALS: Final = 12  # of a degree or a metre, as in the tables: below the noise of the arithmetic


def solve(
    cell: Cell, *, task: str | None = None, progress: Progress = silent, drawing: Drawing | None = None
) -> Solution:
    """Plan the motion of all robots, render their joint tables, read these back and verify them.

    A run that breaks a limit or collides is returned like any other: its report says by how much, where and when.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        task: Name of the only task to work on; the other operators stand still at their start posture.
        progress: Who wants to know how far it is.
        drawing: Who paints the plots, and may begin while the clearance is checked.

    Raises:
        InputError: The cell cannot be worked with: a path misses the part, a given start is off its task.
        NoSolutionError: No start posture was found, or a tool lost its path.
    """
    scene = Scene.from_cell(cell)
    toolpaths = {task.name: build_toolpath(task, cell.part, cell.origin) for task in cell.tasks}
    examine_times(cell, tuple(toolpaths.values()))
    examine_given_starts(cell, toolpaths)
    solved = with_start(cell, find_start(scene, toolpaths, progress=progress))
    start = np.concatenate([robot.start for robot in solved.robots if robot.start is not None])
    runs = tuple(
        _run(scene, toolpaths, plan, start=start, progress=progress, drawing=drawing)
        for plan in plan_runs(cell, only=task)
    )
    return Solution(cell=solved, runs=runs)


def _run(
    scene: Scene,
    toolpaths: Mapping[str, Toolpath],
    plan: RunPlan,
    *,
    start: Array,
    progress: Progress,
    drawing: Drawing | None,
) -> Run:
    """Follow the tasks of one run and verify what would be written."""
    cell = scene.cell
    timed = time_tasks(cell, [toolpaths[name] for name in plan.tasks])
    schedule = sample(timed)
    motion = resolve_closely(cell, timed, schedule, start=start, moving=plan.moving, progress=progress)
    program = render_program(cell, motion)
    tables = [parse_table(text, f"tables/{robot}.csv") for robot, text in program.tables.items()]
    preview = None if drawing is None else partial(drawing.begin, cell=cell)
    report = verify(scene, schedule, tables, moving=plan.moving, progress=progress, preview=preview)
    return Run(
        name=plan.name,
        moving=plan.moving,
        schedule=schedule,
        motion=motion,
        program=with_verdict(cell, program, report),
        report=report,
    )


def render_program(cell: Cell, motion: Motion) -> Program:
    """Joint tables of all robots as text, not yet verified."""
    header = TableHeader(cell=cell.name, mode=str(cell.motion.mode), digests={})
    return Program(
        tables={
            robot.name: render_table(robot, motion.times, motion.q[:, cell.columns(robot.name)], header=header)
            for robot in cell.robots
        }
    )


def with_verdict(cell: Cell, program: Program, report: Report, *, remark: str = "") -> Program:
    """The same rows under headers that carry the verdict, the digests, and a remark where there is one."""
    failed = [check for check in report.checks if not check.passed]
    header = TableHeader(
        cell=cell.name,
        mode=str(cell.motion.mode),
        verdict=f"REJECTED: {failed[0].message}" if failed else "passed",
        digests=_digests(cell, program),
        remark=remark,
    )
    headers = {name: replace(header, accelerations=table_line(report.accelerations, name)) for name in program.tables}
    return Program(tables={name: replace_header(text, header=headers[name]) for name, text in program.tables.items()})


def _digests(cell: Cell, program: Program) -> dict[str, str]:
    """Digest of the cell file, where there is one, and of the rows of all tables."""
    file = PurePath(cell.origin.file).name  # inputs are known by their path from the folder of the cell
    of_cell = {"cell": cell.inputs[file]} if file in cell.inputs else {}
    return of_cell | {"program": program_digest(program.tables)}


def with_start(cell: Cell, start: Array) -> Cell:
    """The cell with every start posture filled in; found ones are rounded to what is written of them."""
    robots = []
    for robot in cell.robots:
        found = start[cell.columns(robot.name)]
        robots.append(robot if robot.start is not None else replace(robot, start=_rounded(robot, found)))
    return replace(cell, robots=tuple(robots))


def _rounded(robot: Robot, q: Array) -> Array:
    """A posture with few decimals of a degree or millimetre, as the resolved cell file gives it back."""
    turns = [joint.is_revolute for joint in robot.model.joints]
    rounded = np.where(turns, np.deg2rad(np.round(np.rad2deg(q), START_DECIMALS)), np.round(q, START_DECIMALS))
    return as_written(robot.model, np.clip(rounded, robot.model.lower, robot.model.upper))
