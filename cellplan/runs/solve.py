"""Solve a cell: from what the user wrote to verified joint tables."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePath

from cellplan.checks.clearance.phase_ends import JudgedPhase, with_phase_ends
from cellplan.checks.joints.joins import with_joins
from cellplan.checks.task_rules import with_task_rules
from cellplan.checks.verify import completed, run_clearance, verify_motion, with_clocks
from cellplan.files.run.clock_table import render_clock
from cellplan.files.run.joint_tables import TableHeader, parse_table, program_digest, render_table, replace_header
from cellplan.guard import ForkedWork
from cellplan.model.cell.cell import Cell, stacked_positions
from cellplan.model.motion.branches import Branches, MovedStart
from cellplan.model.motion.motion import Motion, Program
from cellplan.model.motion.plan import Phase, Plan
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Report
from cellplan.planning.modes import plan_phases, standing
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.runs.greatest_feeds import OpenFeed, at_greatest_feeds, open_feeds
from cellplan.runs.plan.given_starts import with_chosen_start, with_placed_starts
from cellplan.runs.plan.headers import table_headers
from cellplan.runs.plan.homes import depends_on_homes, find_homes, with_homes
from cellplan.runs.plan.near import read_branches, with_run_named
from cellplan.runs.plan.program import ProgramClock, refuse_clock_name
from cellplan.runs.plan.retiming import retimed
from cellplan.runs.plan.run import plan_run
from cellplan.runs.plan.run_reach import refuse_far_runs
from cellplan.runs.plan.start import chosen_start
from cellplan.runs.run_lengths import open_runs, with_run_lengths
from cellplan.runs.solution import Run, Solution
from cellplan.scene.scene import Scene


def solve(
    cell: Cell,
    *,
    task: str | None = None,
    near: Path | None = None,
    is_reported: bool = True,
    progress: Progress = silent,
) -> Solution:
    """Plan the motion of all robots, render their joint tables, read these back and verify them.

    A program that violates a limit or collides is returned like any other: its reports state where, when and how much.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        task: Name of the only task to work on; the other operators stay at their homes.
        near: Folder of a run of the same robots, of which starts and homes that are to be found keep the branches.
        is_reported: Whether figures of clocks that no check judges are worked out too, which a search does not need:
            the allowed skew, and stops of a robot.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be worked with: a path misses the part, a given start is off its task.
        NoSolutionError: No start posture or no home was found, or a tool lost its path.
    """
    _, solution = solve_motion(cell, task=task, near=near, progress=progress)
    return certified(solution, is_reported=is_reported, progress=progress)


def solve_motion(
    cell: Cell, *, task: str | None, near: Path | None = None, progress: Progress, early: EarlyClearance | None = None
) -> tuple[Scene, Solution]:
    """All phases, verified but for their clearance, and the scene of the solved cell; see ``solve``.

    Args:
        near: Folder of a run of which the branches are kept.
        early: Begins with the clearance of each phase as soon as its rows are known.
    """
    if opened := open_feeds(cell, task):
        return _at_greatest_feeds(cell, opened, task=task, near=near, progress=progress, early=early)
    if sought := open_runs(cell, task):
        made = partial(solve_motion, task=task, near=near, progress=progress)
        return _begun(with_run_lengths(cell, sought, made, progress=progress), early)
    refuse_clock_name(cell)
    branches = None if near is None else read_branches(near, cell)
    cell = with_run_named(cell, branches)
    refuse_far_runs(cell)
    if cell.program.is_home_to_home:
        return _solve_program(cell, task=task, near=branches, early=early, progress=progress)
    scene = Scene.from_cell(cell)
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    paths = clock_paths(cell, toolpaths.values())
    plan = plan_phases(cell, only=task)
    placed, moved = with_placed_starts(cell, toolpaths, scene.chains, near=branches)
    choice = chosen_start(replace(scene, cell=placed), paths, progress=progress)
    started, more = with_chosen_start(placed, choice.start, toolpaths)
    planned = [plan_run(started, paths, phase, progress=progress) for phase in plan.program]
    known = {} if branches is None else branches.homes
    homes = find_homes(replace(scene, cell=started), planned, known=known, progress=progress)
    solved = with_homes(started, homes, given=placed)
    if depends_on_homes(started, planned):
        planned = [plan_run(solved, paths, phase, progress=progress) for phase in plan.program]
    scene = replace(scene, cell=solved)
    nominal = [replace(run.motion, q=standing(solved, run.phase, run.motion.q)) for run in planned]
    clock = ProgramClock.of(solved, plan, [run.schedule for run in planned])
    motion, runs = _runs(solved, clock, nominal, [scene] * len(planned), early=early, progress=progress)
    runs = tuple(replace(run, moved=_of_phase((*moved, *more), run.phase)) for run in runs)
    return scene, Solution(cell=solved, motion=motion, runs=runs, remark=choice.warning)


def _at_greatest_feeds(
    cell: Cell,
    opened: Sequence[OpenFeed],
    *,
    task: str | None,
    near: Path | None,
    progress: Progress,
    early: EarlyClearance | None,
) -> tuple[Scene, Solution]:
    """The program at the greatest feeds; see ``solve_motion``."""
    solved = partial(solve_motion, task=task, near=near, progress=progress)
    return _begun(at_greatest_feeds(cell, opened, solved, is_leximin=cell.motion.is_leximin, progress=progress), early)


def _begun(result: tuple[Scene, Solution], early: EarlyClearance | None) -> tuple[Scene, Solution]:
    """A program that was chosen from several, the clearance of its phases begun with."""
    for run in result[1].runs:
        if early is not None:
            early.begin(run.scene, run.schedule, stacked_positions(run.cell, run.report.q))
    return result


def _of_phase(moved: Sequence[MovedStart], phase: Phase) -> tuple[MovedStart, ...]:
    """Starts that were moved to a task of a phase, or to a grasp."""
    return tuple(start for start in moved if start.task in phase.tasks or "@" in start.task)


def _solve_program(
    cell: Cell, *, task: str | None, near: Branches | None, early: EarlyClearance | None, progress: Progress
) -> tuple[Scene, Solution]:
    """The stages of a program from home to home, verified but for their clearance, and the scene with the part held."""
    from cellplan.planning.sequence.arrangement import with_only_task
    from cellplan.runs.plan.sequence import plan_program  # with all transfer moves, which few cells have

    planned = plan_program(cell if task is None else with_only_task(cell, task), near=near, progress=progress)
    stages, cycles = planned.stages, planned.cell.program.cycles
    plan = Plan(phases=tuple(stage.stage.phase for stage in stages) * cycles)
    clock = ProgramClock.of(planned.cell, plan, [stage.schedule for stage in stages] * cycles)
    motions, scenes = [stage.motion for stage in stages] * cycles, [stage.scene for stage in stages] * cycles
    motion, runs = _runs(planned.cell, clock, motions, scenes, early=early, progress=progress)
    runs = tuple(
        replace(run, rungs=stage.rungs, moved=planned.moved.get(run.phase.name, ()))
        for run, stage in zip(runs, stages, strict=True)
    )
    remark = "; ".join(planned.remarks) or None
    return replace(planned.scenes.held, cell=planned.cell), Solution(
        cell=planned.cell, motion=motion, runs=runs, remark=remark
    )


def certified(
    solution: Solution, *, is_reported: bool = True, progress: Progress, early: EarlyClearance | None = None
) -> Solution:
    """The solution with the clearance of every phase checked and the verdict in the headers of its tables.

    Args:
        is_reported: See ``solve``; never of a clearance without the curves of a report.
        early: Has the clearance.
    """
    phases = []
    for run in solution.runs:
        q = stacked_positions(run.cell, run.report.q)
        clearance = (
            run_clearance(run.scene, run.schedule, q, progress=progress)
            if early is None
            else early.of(run.scene, run.schedule, q, progress)
        )
        with_figures = is_reported and (early is None or early.with_curves)
        report = completed(run.report, clearance)
        report = with_clocks(report, run.scene, run.schedule, is_reported=with_figures, progress=progress)
        phases.append(JudgedPhase(scene=run.scene, schedule=run.schedule, report=report))
    reports = with_task_rules(solution.cell, phases, with_joins(solution.cell, with_phase_ends(solution.cell, phases)))
    program = with_verdict(solution.cell, solution.program, [run.phase for run in solution.runs], reports)
    runs = zip(solution.runs, reports, strict=True)
    return replace(solution, runs=tuple(replace(run, report=report, program=program) for run, report in runs))


def _runs(
    cell: Cell,
    clock: ProgramClock,
    nominal: Sequence[Motion],
    scenes: Sequence[Scene],
    *,
    early: EarlyClearance | None = None,
    progress: Progress,
) -> tuple[Motion, tuple[Run, ...]]:
    """The motion of the program, and its phases verified on the rows that would be written, but for their clearance.

    Of several cycles, which have the same rows, the phases of the first are verified.
    """
    clock, motions = retimed(scenes, clock, nominal, progress=progress)
    motion = clock.motion([motion.q for motion in motions])
    program = render_program(cell, motion)
    tasks = [task.name for task in cell.tasks if task.name in clock.plan.process]
    text = render_clock(clock.table(tasks), cell=cell.name, program=program_digest(program.tables))
    program = replace(program, clock=text)
    tables = [parse_table(text, f"tables/{robot}.csv") for robot, text in program.tables.items()]
    runs = []
    for place in range(len(motions) // cell.program.cycles):
        schedule, scene, moves = clock.schedules[place], scenes[place], motions[place]
        phase, rows = clock.plan.program[place], clock.cut(tables, place)
        if early is not None:
            early.begin(scene, schedule, stacked_positions(cell, {table.robot: table.q for table in rows}))
        report = verify_motion(scene, schedule, rows, moving=phase.moving, idle=phase.idle, progress=progress)
        report = replace(report, mode=str(cell.motion.mode), phases=clock.timed_phases, phase=phase.label)
        runs.append(Run(phase=phase, schedule=schedule, motion=moves, program=program, report=report, scene=scene))
    return motion, tuple(runs)


def render_program(cell: Cell, motion: Motion) -> Program:
    """Joint tables of all robots as text, not yet verified."""
    header = TableHeader(cell=cell.name, mode=str(cell.motion.mode), digests={})
    times, gaps = motion.times, motion.gaps
    return Program(
        tables={
            robot.name: render_table(robot, times, motion.q[:, cell.columns(robot.name)], header=header, gaps=gaps)
            for robot in cell.robots
        }
    )


def with_verdict(
    cell: Cell, program: Program, phases: Sequence[Phase], reports: Sequence[Report], *, remark: str = ""
) -> Program:
    """The same rows under headers that carry the verdict, the digests, a remark, and what is left out.

    Args:
        remark: What else has to be known of the rows.
    """
    names = [f"{phase.name}: " if len(phases) > 1 else "" for phase in phases]
    checks = [(name, check) for name, report in zip(names, reports, strict=True) for check in report.checks]
    failed = [f"{name}{check.message}" for name, check in checks if not check.passed]
    digests = _digests(cell, program)
    headers = table_headers(cell, phases, reports, digests=digests, remark=remark)
    if failed:
        verdict = f"REJECTED: {failed[0]}"
        headers = {name: replace(header, verdict=verdict) for name, header in headers.items()}
    tables = {name: replace_header(text, header=headers[name]) for name, text in program.tables.items()}
    return replace(program, tables=tables)


def _digests(cell: Cell, program: Program) -> dict[str, str]:
    """Digest of the cell file, where there is one, and of the rows of all tables."""
    file = PurePath(cell.origin.file).name  # inputs are known by their path from the folder of the cell
    of_cell = {"cell": cell.inputs[file]} if file in cell.inputs else {}
    return of_cell | {"program": program_digest(program.tables)}


def solve_in_parallel(
    cell: Cell, *, task: str | None = None, near: Path | None = None, progress: Progress = silent
) -> Solution:
    """Solve as ``solve`` does; copies of this process check the clearance while it does all else.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        near: Folder of a run of which the branches are kept.
    """
    with ForkedWork(progress) as work:
        if not work.is_possible:
            return solve(cell, task=task, near=near, progress=progress)
        early = EarlyClearance(work.begin, with_curves=True)
        _, solution = solve_motion(cell, task=task, near=near, progress=progress, early=early)
        return certified(solution, progress=progress, early=early)
