"""Solve a cell: from what the user wrote to verified joint tables."""

from dataclasses import replace
from pathlib import PurePath

from cellplan.checks.verify import verify_motion, with_clearance
from cellplan.geometry.transforms import Array
from cellplan.io.run.joint_tables import TableHeader, parse_table, program_digest, render_table, replace_header
from cellplan.model.cell import Cell
from cellplan.model.idle import not_in_program
from cellplan.model.motion import Motion, Program
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Report
from cellplan.pipeline.background_plots import BackgroundPlots
from cellplan.pipeline.plan.homes import depends_on_homes, find_homes, with_homes
from cellplan.pipeline.plan.rounded import rounded
from cellplan.pipeline.plan.run import PlannedRun, plan_run
from cellplan.pipeline.plan.start import chosen_start
from cellplan.pipeline.solution import Run, Solution
from cellplan.planning.modes import plan_phases, standing
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import examine_given_starts
from cellplan.planning.timing.schedule import examine_times
from cellplan.report.record.accelerations import table_line
from cellplan.scene.scene import Scene


def solve(cell: Cell, *, task: str | None = None, progress: Progress = silent) -> Solution:
    """Plan the motion of all robots, render their joint tables, read these back and verify them.

    A run that breaks a limit or collides is returned like any other: its report says by how much, where and when.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        task: Name of the only task to work on; the other operators stand at their homes.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be worked with: a path misses the part, a given start is off its task.
        NoSolutionError: No start posture or no home was found, or a tool lost its path.
    """
    scene, solution = _solve_motion(cell, task=task, progress=progress)
    return _with_clearance(solution, scene, progress=progress)


def solve_with_plots(
    cell: Cell, plots: BackgroundPlots, *, task: str | None = None, progress: Progress = silent
) -> Solution:
    """Solve as ``solve`` does, while the plots of the motion are drawn in the background during the clearance check.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        plots: Takes the reports of all runs as soon as all of them is known but the clearance.
        task: Name of the only task to work on; the other operators stand at their homes.
        progress: Called with the stage and the fraction done.
    """
    scene, solution = _solve_motion(cell, task=task, progress=progress)
    for run in solution.runs:
        plots.begin(run.report, cell=solution.cell)
    return _with_clearance(solution, scene, progress=progress)


def _solve_motion(cell: Cell, *, task: str | None, progress: Progress) -> tuple[Scene, Solution]:
    """All runs, verified but for their clearance, and the scene of the solved cell."""
    scene = Scene.from_cell(cell)
    toolpaths = {task.name: build_toolpath(task, cell.part, cell.origin) for task in cell.tasks}
    examine_times(cell, tuple(toolpaths.values()))
    examine_given_starts(cell, toolpaths)
    choice = chosen_start(scene, toolpaths, progress=progress)
    started = with_start(cell, choice.start)
    plans = plan_phases(cell, only=task).program
    planned = [plan_run(started, toolpaths, plan, progress=progress) for plan in plans]
    solved = with_homes(started, find_homes(replace(scene, cell=started), planned, progress=progress), given=cell)
    if depends_on_homes(started, planned):
        planned = [plan_run(solved, toolpaths, plan, progress=progress) for plan in plans]
    scene = replace(scene, cell=solved)
    runs = tuple(_run(scene, each, progress=progress) for each in planned)
    return scene, Solution(cell=solved, runs=runs, remark=choice.warning)


def _with_clearance(solution: Solution, scene: Scene, *, progress: Progress) -> Solution:
    """The solution with the clearance of every run checked and the verdict in the headers of its tables."""
    runs = []
    for run in solution.runs:
        report = with_clearance(run.report, scene, run.schedule, progress=progress)
        runs.append(replace(run, report=report, program=with_verdict(solution.cell, run.program, report)))
    return replace(solution, runs=tuple(runs))


def _run(scene: Scene, planned: PlannedRun, *, progress: Progress) -> Run:
    """Verify what would be written of one run, but for its clearance."""
    cell, plan = scene.cell, planned.phase
    motion = replace(planned.motion, q=standing(cell, plan, planned.motion.q))
    program = render_program(cell, motion)
    tables = [parse_table(text, f"tables/{robot}.csv") for robot, text in program.tables.items()]
    report = verify_motion(scene, planned.schedule, tables, moving=plan.moving, progress=progress)
    return Run(
        name=plan.task,
        moving=plan.moving,
        schedule=planned.schedule,
        motion=motion,
        program=program,
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
    """The same rows under headers that carry the verdict, the digests, a remark, and what is left out."""
    failed = [check for check in report.checks if not check.passed]
    header = TableHeader(
        cell=cell.name,
        mode=str(cell.motion.mode),
        verdict=f"REJECTED: {failed[0].message}" if failed else "passed",
        digests=_digests(cell, program),
        remark="; ".join(filter(None, [remark, not_in_program(cell, report.tasks)])),
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
        robots.append(robot if robot.start is not None else replace(robot, start=rounded(robot, found)))
    return replace(cell, robots=tuple(robots))
