"""Correct a program from pass to pass: execute, measure, replace the references, plan again with the written cell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.checks.real_cell import RealCell, largest, worst_share
from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.measures.tool_errors import pose_accuracy
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.rehearsal import Correction, JointExecution, Outcome, Round
from cellplan.model.report.report import TaskAccuracy
from cellplan.model.settings.cell_errors import MeasurementEntry
from cellplan.planning.collocation.at_samples import brought_onto_tasks
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.euler.measured_feedback import (
    corrected_references,
    integrate_measured,
    measured_start,
    partly,
    settled_start,
)
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.dynamics.simulated_cell import SimulatedCell

CONVERGED_FRACTION: Final = 0.02  # [-] share of the tolerance below which errors are not reduced further
STALLED_RATIO: Final = 0.9  # [-] an error that is not below this share of the last one falls no more
DIVERGED_RATIO: Final = 2.0  # [-] an error above this multiple of the first one diverges


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pass:
    """What stays the same from pass to pass."""

    cell: Cell  # the written cell, with its start postures
    schedule: Schedule  # desired tool poses
    moving: tuple[str, ...]  # names of the robots that may move
    judged_from: dict[str, int]  # first sample that is judged, by task
    q: Array  # joint positions of the program as it was solved, shape (N, nq)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plant:
    """What programs are executed on: a real cell, its arms, and what measures its tools."""

    real: RealCell
    arms: SimulatedCell
    system: MeasurementEntry
    rng: np.random.Generator  # noise of the measurements

    def measured(self, schedule: Schedule, q: Array, rows: slice = slice(None)) -> tuple[Array, ...]:
        """Measured tools X_PT of all tasks, at executed positions of shape (N, nq) in some rows of a schedule."""
        desired = [(scheduled.task, scheduled.X_PT[rows]) for scheduled in schedule.tasks]
        return self.real.measured(desired, q, self.system, self.rng)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Attempt:
    """One execution: the references, the commanded joint positions, the measured poses, and the errors."""

    references: Schedule
    q: Array
    measured: tuple[Array, ...]
    accuracy: tuple[TaskAccuracy, ...]
    figures: Round


def correct_from_pass_to_pass(job: Pass, plant: Plant, *, rounds: int, on_round: Callable[[int], None]) -> Correction:
    """Repeat the program on the real cell until its error converges.

    The loop goes by the measured errors, as it would have to beside a real cell; the true ones are reported.
    """
    executions = _Executions(job, plant)
    executions.add(job.schedule, job.q)
    outcome = _outcome(executions.rounds, rounds)
    while outcome is None:
        last = executions.all[-1]
        on_round(last.figures.number + 1)
        references = corrected_references(job.schedule, last.references, last.measured)
        try:
            start = settled_start(MotionTask(job.cell, references, job.moving, last.q[0]))
            q = _planned(job, references, start)
        except NoSolutionError:
            outcome = Outcome.DIVERGED
            break
        executions.add(references, q)
        outcome = _outcome(executions.rounds, rounds)
    best = min(executions.all, key=lambda attempt: attempt.figures.measured_share)
    return Correction(
        outcome=outcome,
        rounds=executions.rounds,
        best=best.figures.number,
        accuracy=best.accuracy,
        references=best.references,
        q=best.q,
    )


def correct_within_the_pass(job: Pass, plant: Plant) -> tuple[tuple[TaskAccuracy, ...], JointExecution] | None:
    """True errors and joints when each measured error is fed back at once; None when a tool loses its path.

    Before the pass the tools stand on the first poses of their tasks and are put right there, measurement by
    measurement: a pass that began with the whole error would begin with a jerk. Tools that come to their paths from
    beside them begin where they do.
    """
    motion = MotionTask(job.cell, job.schedule, job.moving, job.q[0])
    try:
        if all(scheduled.task.settle == 0.0 for scheduled in job.schedule.tasks):
            start = measured_start(motion, measure=lambda q: plant.measured(job.schedule, q, slice(1)))
            motion = replace(motion, start=start)
        loop = _Loop(job, plant)
        q = integrate_measured(motion, observe=loop.observe).q
    except NoSolutionError:
        return None
    loop.observe(len(q) - 1, q[-1:])
    executed, torque = np.array(loop.rows).transpose(1, 0, 2)
    return plant.real.accuracy(job.schedule, executed), JointExecution(commanded=q, executed=executed, torque=torque)


class _Loop:
    """Execution and measurement, sample by sample, while the motion is planned."""

    def __init__(self, job: Pass, plant: Plant) -> None:
        """Begin before the first sample."""
        self._job, self._plant = job, plant
        period, step = plant.system.period_ms, job.schedule.step
        self._every = 1 if period is None else max(1, round(period.si / step))
        self.rows: list[tuple[Array, Array]] = []  # executed positions and torques

    def observe(self, k: int, q: Array) -> list[Array] | None:
        """Command a row of shape (1, nq), and measure when it is time."""
        arms, schedule, system = self._plant.arms, self._job.schedule, self._plant.system
        self.rows.append(arms.follow(q[0], schedule.step) if k else arms.begin(q[0]))
        if k % self._every:
            return None
        seen = self._plant.measured(schedule, self.rows[-1][0][None], slice(k, k + 1))
        return [
            X if system.share == 1.0 else partly(scheduled.task, scheduled.X_PT[k : k + 1], X, share=system.share)
            for scheduled, X in zip(schedule.tasks, seen, strict=True)
        ]


def _planned(job: Pass, references: Schedule, start: Array) -> Array:
    """Motion on new references, which are known at the samples only: by steps, then corrected at the samples."""
    q = integrate_schedule(MotionTask(job.cell, references, job.moving, start)).q
    return (
        brought_onto_tasks(MotionTask(job.cell, references, job.moving, q[0]), q) if job.cell.solver.is_accurate else q
    )


class _Executions:
    """Executions of one job on one real cell."""

    def __init__(self, job: Pass, plant: Plant) -> None:
        """Remember what stays the same."""
        self._job, self._plant = job, plant
        self.all: list[_Attempt] = []

    @property
    def rounds(self) -> tuple[Round, ...]:
        """The errors of every execution."""
        return tuple(attempt.figures for attempt in self.all)

    def add(self, references: Schedule, q: Array) -> None:
        """Command a motion to the real cell and measure its tools."""
        job, plant = self._job, self._plant
        executed = plant.arms.execute(job.schedule.times, q).executed
        true = plant.real.tool_poses([scheduled.task for scheduled in job.schedule.tasks], executed)
        measured = plant.measured(job.schedule, executed)
        accuracy, measured_accuracy = (
            tuple(pose_accuracy(task, X_PT) for task, X_PT in zip(job.schedule.tasks, poses, strict=True))
            for poses in (true, measured)
        )
        figures = Round(
            number=len(self.all),
            position={one.task: largest(one.position_error, job.judged_from[one.task]) for one in accuracy},
            orientation={one.task: largest(one.orientation_error, job.judged_from[one.task]) for one in accuracy},
            share=worst_share(job.cell, accuracy, job.judged_from),
            measured_share=worst_share(job.cell, measured_accuracy, job.judged_from),
        )
        self.all.append(_Attempt(references=references, q=q, measured=measured, accuracy=accuracy, figures=figures))


def _outcome(rounds: Sequence[Round], limit: int) -> Outcome | None:
    """How correcting ended; None while another round is worth its while."""
    shares = [round_.measured_share for round_ in rounds]
    last = shares[-1]
    if last <= CONVERGED_FRACTION:
        return Outcome.CONVERGED
    if not last <= DIVERGED_RATIO * shares[0]:
        return Outcome.DIVERGED
    if len(shares) > 1 and last > STALLED_RATIO * shares[-2]:
        return Outcome.CONVERGED if min(shares) <= 1.0 else Outcome.STALLED
    return Outcome.UNFINISHED if len(shares) > limit else None
