"""Rehearse a cell with errors: solve it, execute the program on real cells, and correct it from measurements."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.checks.real_cell import RealCell, check_true_errors, path_figures, pose_figures
from cellplan.checks.verify import verify_motion, with_clearance
from cellplan.errors import InputError
from cellplan.files.run.joint_tables import parse_table
from cellplan.jobs.rehearsal.correct import Pass, Plant, correct_from_pass_to_pass, correct_within_the_pass
from cellplan.model.cell.cell import Cell, stacked_positions
from cellplan.model.cell.cell_errors import CellErrors
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.model.motion.plan import Phase
from cellplan.model.progress import Progress, silent
from cellplan.model.report.check_kinds import TOOL_ERRORS
from cellplan.model.report.rehearsal import CorrectedProgram, IsoFigures, Rehearsal, RunRehearsal, Trial
from cellplan.model.report.report import Check, Report, TaskAccuracy
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.runs.plan.program import ProgramClock
from cellplan.runs.solution import Run
from cellplan.runs.solve import render_program, solve, with_verdict
from cellplan.scene.dynamics.simulated_cell import SimulatedCell
from cellplan.scene.kinematics.perturbed_cell import draw_errors, perturbed_cell
from cellplan.scene.scene import Scene

MEASUREMENT_STREAM: Final = 1  # stream of random numbers of the measurements of a trial; its cell has stream 0
IN_PASS_STREAM: Final = 2
MAX_ERRORS: Final = 4_000_000  # trials times samples times tasks that are kept: 200 MB, twice with feedback
DEFAULT_ROUNDS: Final = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class _Options:
    """What is to be done on every real cell."""

    feedback: bool
    in_pass: bool
    rounds: int


def rehearse(
    cell: Cell,
    errors: CellErrors,
    *,
    feedback: bool = False,
    in_pass: bool = False,
    rounds: int = DEFAULT_ROUNDS,
    progress: Progress = silent,
) -> Rehearsal:
    """Solve a cell, execute its program on perturbed cells, and compute the actual errors of the tools.

    With feedback the program is repeated on each real cell: the tools are measured on the part, the references are
    corrected, and the written cell is planned again, until the error converges. For a single real cell the corrected
    program is rendered and verified on the written cell.

    Args:
        cell: The cell, as ``load_cell`` gives it.
        errors: How real cells differ from it, as ``load_errors`` gives them.
        feedback: Correct from pass to pass.
        in_pass: Also execute with the error measured at each sample fed back at the next.
        rounds: Maximum number of corrections from pass to pass.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be worked with, several robots hold the part, there are more trials than can be
            stored, a program from home to home is to be corrected, or a simulated arm has no masses or runs away.
        NoSolutionError: The cell has no solution.
    """
    if rounds < 1:
        raise InputError(f"--rounds: expected a whole number of at least 1, got {rounds}")
    if cell.closures:
        raise InputError(
            f"{cell.origin.at('part.held_by')}: expected one robot that holds the part, got {len(cell.part.held_by)}: "
            "the pose of a part between several holders depends on their stiffness, which a cell does not state"
        )
    trials = errors.trials if errors.is_random else 1
    if not cell.program.is_home_to_home:
        _refuse_too_many(cell, ProgramClock.from_cell(cell, plan_phases(cell)).schedules, trials, errors)
    elif feedback or in_pass:
        raise InputError(
            f"{cell.origin.at('program')}: expected a cell without a program from home to home for --feedback and "
            "--in-pass, as corrected tasks would not begin and end where its transfer moves do; rehearse it without "
            "them, or its tasks without this key"
        )
    solution = solve(cell, is_reported=False, progress=progress)
    _refuse_too_many(cell, [run.schedule for run in solution.runs], trials, errors)  # retimed ones have other samples
    options = _Options(feedback=feedback, in_pass=in_pass, rounds=rounds)
    jobs = [_pass(solution.cell, run) for run in solution.runs]
    made: list[list[Trial]] = [[] for _ in jobs]
    for number in range(trials):
        progress("rehearsing", number / trials)
        tried = _try(jobs, errors, number, options=options, progress=_within(progress, number, trials))
        for into, trial in zip(made, tried, strict=True):
            into.append(trial)
    runs = tuple(
        _run_rehearsal(job, run, tuple(of_run), options=options, progress=progress)
        for job, run, of_run in zip(jobs, solution.runs, made, strict=True)
    )
    return Rehearsal(
        cell=solution.cell,
        errors=errors,
        runs=runs,
        checks=tuple(
            check for run, made in zip(solution.runs, runs, strict=True) for check in _checks(solution.cell, run, made)
        ),
        has_feedback=feedback,
        has_in_pass=in_pass,
    )


def _checks(cell: Cell, run: Run, made: RunRehearsal) -> tuple[Check, ...]:
    """The true errors, and what the program that counts fails of limits and clearance on the written cell."""
    report = _without_tool_errors(run.report) if made.corrected is None else made.corrected.report
    return (*check_true_errors(cell, made), *(check for check in report.checks if not check.passed))


def _without_tool_errors(report: Report) -> Report:
    """A report that leaves tool errors to the real cell: on the written one they say nothing of it."""
    return replace(report, checks=tuple(check for check in report.checks if check.name not in TOOL_ERRORS))


def _refuse_too_many(cell: Cell, schedules: Sequence[Schedule], trials: int, errors: CellErrors) -> None:
    """Refuse more trials than fit into memory: six errors of a task, and three figures of a joint that is simulated."""
    joints = 0 if errors.simulation is None else cell.joint_count
    samples = sum(len(schedule.times) * (len(schedule.tasks) + math.ceil(joints / 2)) for schedule in schedules)
    most = MAX_ERRORS // samples
    if trials > max(most, 1):
        whose = "its tasks and joints" if joints else "its tasks"
        raise InputError(
            f"{errors.file}: trials: expected at most {max(most, 1)} for this cell ({samples} samples of {whose}), "
            f"got {trials}; reduce trials or increase motion.step_s"
        )


def _pass(cell: Cell, run: Run) -> Pass:
    """What stays the same of a run; in a program each has its own state of the part, and moves that are no tasks."""
    names = {task.name for task in cell.tasks}
    schedule = run.schedule
    if not names.issuperset(schedule.names):
        schedule = replace(schedule, tasks=tuple(it for it in schedule.tasks if it.task.name in names), paths=())
    return Pass(
        cell=run.cell,
        schedule=schedule,
        moving=run.moving,
        judged_from=_judged_from(schedule),
        q=stacked_positions(run.cell, run.report.q),
    )


def _run_rehearsal(
    job: Pass, run: Run, trials: tuple[Trial, ...], *, options: _Options, progress: Progress
) -> RunRehearsal:
    """All executions of one run."""
    is_corrected = len(trials) == 1 and options.feedback
    return RunRehearsal(
        name=run.name,
        times=run.schedule.times,
        judged_from=job.judged_from,
        trials=trials,
        before=_iso_figures(job, [trial.before for trial in trials]),
        after=_iso_figures(job, [trial.final for trial in trials]) if options.feedback else None,
        corrected=_corrected(job, trials[0], run.phase, progress) if is_corrected else None,
    )


def _within(progress: Progress, number: int, trials: int) -> Progress:
    """Progress of one trial among many."""
    return lambda stage, share: progress(stage, (number + share) / trials)


def _try(
    jobs: Sequence[Pass], errors: CellErrors, number: int, *, options: _Options, progress: Progress
) -> Iterator[Trial]:
    """One real cell, run by run; arms go on from run to run of a program from home to home."""
    arms: SimulatedCell | None = None
    for job in jobs:
        draw = draw_errors(job.cell, errors, number)
        cell = perturbed_cell(job.cell, draw)
        goes_on = arms is not None and cell.program.is_home_to_home
        if arms is None:
            arms = SimulatedCell(cell, errors.simulation, file=errors.file)
        arms.carry(cell)
        joints = arms.execute(job.schedule.times, job.q, goes_on=goes_on)
        plant = Plant(
            real=RealCell(cell), arms=arms, system=errors.measurement, rng=_rng(errors, number, MEASUREMENT_STREAM)
        )
        before = plant.real.accuracy(job.schedule, joints.executed)
        correction, in_pass = None, None
        if options.feedback:
            correction = correct_from_pass_to_pass(
                job,
                plant,
                rounds=options.rounds,
                on_round=lambda made: progress(f"correction, round {made}", made / (options.rounds + 1)),
            )
        if options.in_pass:
            progress("correction within the pass", 1.0)
            in_pass = correct_within_the_pass(job, replace(plant, rng=_rng(errors, number, IN_PASS_STREAM)))
        yield Trial(
            draw=draw,
            before=before,
            correction=correction,
            in_pass=None if in_pass is None else in_pass[0],
            joints=joints if arms.has_arms else None,
            joints_in_pass=None if in_pass is None or not arms.has_arms else in_pass[1],
        )


def _rng(errors: CellErrors, number: int, stream: int) -> np.random.Generator:
    """Random numbers of a trial."""
    return np.random.default_rng([errors.seed, number, stream])


def _corrected(job: Pass, trial: Trial, phase: Phase, progress: Progress) -> CorrectedProgram | None:
    """The corrected joint tables, verified on the written cell against the corrected references."""
    if trial.correction is None:
        return None
    cell, references = job.cell, trial.correction.references
    program = render_program(cell, Motion(times=references.times, q=trial.correction.q))
    tables = [parse_table(text, f"tables/{robot}.csv") for robot, text in program.tables.items()]
    scene = Scene.from_cell(cell)
    report = verify_motion(scene, references, tables, moving=job.moving, progress=progress)
    report = _without_tool_errors(with_clearance(report, scene, references, is_reported=False, progress=progress))
    best_round = trial.correction.best
    remark = f"corrected for measured errors, round {best_round}: right for the measured cell, not for the written one"
    alone = replace(phase, begin=0.0, end=float(references.times[-1]))  # a program of its own
    return CorrectedProgram(program=with_verdict(cell, program, [alone], [report], remark=remark), report=report)


def _judged_from(schedule: Schedule) -> dict[str, int]:
    """First sample of each task that is judged: the first one after it has settled."""
    first = {}
    for scheduled in schedule.tasks:
        task = scheduled.task
        settled = int(np.searchsorted(schedule.times, task.start + task.settle)) if task.settle > 0.0 else 0
        first[task.name] = min(settled, len(schedule.times) - 1)
    return first


def _iso_figures(job: Pass, trials: Sequence[tuple[TaskAccuracy, ...]]) -> dict[str, IsoFigures]:
    figures = {}
    times = job.schedule.times
    for place, scheduled in enumerate(job.schedule.tasks):
        name, first = scheduled.task.name, job.judged_from[scheduled.task.name]
        errors = np.stack(
            [np.concatenate([made[place].position_error, made[place].orientation_error], axis=1) for made in trials]
        )
        behind = build_toolpath(scheduled.task, job.cell.part).behind
        stops = [max(int(np.argmin(np.abs(scheduled.travelled - length))), first) for length in behind]
        figures[name] = IsoFigures(
            poses=tuple(pose_figures(errors[:, k], float(times[k])) for k in dict.fromkeys(stops)),
            path=path_figures(errors[:, first:], times[first:]),
        )
    return figures
