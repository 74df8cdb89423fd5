"""Solve a cell: from what the user wrote to verified joint tables."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cellplan.checks.verify import verify
from cellplan.geometry.transforms import Array
from cellplan.io.tables import TableHeader, parse_table, program_digest, render_table, replace_header
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Program
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Report
from cellplan.model.toolpath import Toolpath
from cellplan.pipeline.solution import Run, Solution
from cellplan.planning.follow import follow
from cellplan.planning.given_starts import examine_given_starts
from cellplan.planning.modes import RunPlan, plan_runs
from cellplan.planning.schedule import schedule_tasks
from cellplan.planning.start_search import find_start
from cellplan.planning.toolpaths import build_toolpath
from cellplan.scene.scene import Scene


def solve(cell: Cell, *, progress: Progress = silent) -> Solution:
    """Plan the motion of all robots, render their joint tables, read these back and verify them.

    A run that breaks a limit or collides is returned like any other: its report says by how much, where and when.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        progress: Who wants to know how far it is.

    Raises:
        InputError: The cell cannot be worked with: a path misses the part, a given start is off its task.
        NoSolutionError: No start posture was found, or a tool lost its path.
    """
    scene = Scene.from_cell(cell)
    toolpaths = {task.name: build_toolpath(task, cell.part, cell.origin) for task in cell.tasks}
    examine_given_starts(cell, toolpaths)
    start = find_start(scene, toolpaths, progress=progress)
    solved = with_start(cell, start)
    runs = tuple(_run(scene, toolpaths, plan, start=start, progress=progress) for plan in plan_runs(cell))
    return Solution(cell=solved, runs=runs)


def _run(scene: Scene, toolpaths: Mapping[str, Toolpath], plan: RunPlan, *, start: Array, progress: Progress) -> Run:
    """Follow the tasks of one run and verify what would be written."""
    cell = scene.cell
    schedule = schedule_tasks(cell, [toolpaths[name] for name in plan.tasks])
    motion = follow(cell, schedule, start=start, moving=plan.moving, progress=progress)
    program = render_program(cell, motion)
    tables = [parse_table(text, f"tables/{robot}.csv") for robot, text in program.tables.items()]
    report = verify(scene, schedule, tables, moving=plan.moving, progress=progress)
    return Run(
        name=plan.name,
        moving=plan.moving,
        schedule=schedule,
        motion=motion,
        program=_with_verdict(cell, program, report),
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


def _with_verdict(cell: Cell, program: Program, report: Report) -> Program:
    """The same rows under headers that carry the verdict and the digests."""
    failed = [check for check in report.checks if not check.passed]
    header = TableHeader(
        cell=cell.name,
        mode=str(cell.motion.mode),
        verdict=f"REJECTED: {failed[0].message}" if failed else "passed",
        digests=_digests(cell, program),
    )
    return Program(tables={name: replace_header(text, header=header) for name, text in program.tables.items()})


def _digests(cell: Cell, program: Program) -> dict[str, str]:
    """Digest of the cell file, where there is one, and of the rows of all tables."""
    of_cell = {"cell": cell.inputs[cell.origin.file]} if cell.origin.file in cell.inputs else {}
    return of_cell | {"program": program_digest(program.tables)}


def with_start(cell: Cell, start: Array) -> Cell:
    """The cell with every start posture filled in."""
    robots = tuple(replace(robot, start=np.array(start[cell.columns(robot.name)])) for robot in cell.robots)
    return replace(cell, robots=robots)
