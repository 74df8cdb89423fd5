"""Correct a program from pass to pass: execute, measure, replace the references, plan again with the written cell."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.checks.real_cell import RealCell, largest, measured_poses, worst_share
from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.measures.tool_errors import pose_accuracy
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.rehearsal import Correction, Outcome, Round
from cellplan.model.report.report import TaskAccuracy
from cellplan.model.settings.cell_errors import MeasurementEntry
from cellplan.planning.collocation.at_samples import brought_onto_tasks
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.euler.measured_feedback import (
    corrected_references,
    integrate_measured,
    measured_start,
    settled_start,
)
from cellplan.planning.tracking.motion_task import MotionTask

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

    @property
    def operators(self) -> tuple[str, ...]:
        """Robots whose tools are measured, one per task."""
        return tuple(scheduled.task.robot for scheduled in self.schedule.tasks)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Attempt:
    """One execution: the references, the commanded joint positions, the measured poses, and the errors."""

    references: Schedule
    q: Array
    measured: tuple[Array, ...]
    accuracy: tuple[TaskAccuracy, ...]
    figures: Round


def correct_from_pass_to_pass(
    job: Pass,
    real: RealCell,
    system: MeasurementEntry,
    *,
    rng: np.random.Generator,
    rounds: int,
    on_round: Callable[[int], None],
) -> Correction:
    """Repeat the program on the real cell until its error converges.

    The loop goes by the measured errors, as it would have to beside a real cell; the true ones are reported.
    """
    executions = _Executions(job, real, system, rng)
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


def correct_within_the_pass(
    job: Pass, real: RealCell, system: MeasurementEntry, *, rng: np.random.Generator
) -> tuple[TaskAccuracy, ...] | None:
    """True errors when every instant's measured error is fed back at the next one; None when a tool loses its path.

    Before the pass the tools stand on the first poses of their tasks and are put right there, measurement by
    measurement: a pass that began with the whole error would begin with a jerk.
    """

    def measure(q: Array) -> Sequence[Array]:
        return measured_poses(real.tool_poses(job.operators, q), system, rng)

    try:
        start = measured_start(MotionTask(job.cell, job.schedule, job.moving, job.q[0]), measure=measure)
        motion = integrate_measured(MotionTask(job.cell, job.schedule, job.moving, start), measure=measure)
    except NoSolutionError:
        return None
    return real.accuracy(job.schedule, motion.q)


def _planned(job: Pass, references: Schedule, start: Array) -> Array:
    """Motion on new references, which are known at the samples only: by steps, then corrected at the samples."""
    q = integrate_schedule(MotionTask(job.cell, references, job.moving, start)).q
    return (
        brought_onto_tasks(MotionTask(job.cell, references, job.moving, q[0]), q) if job.cell.solver.is_accurate else q
    )


class _Executions:
    """Executions of one job on one real cell."""

    def __init__(self, job: Pass, real: RealCell, system: MeasurementEntry, rng: np.random.Generator) -> None:
        """Remember what stays the same."""
        self._job, self._real, self._system, self._rng = job, real, system, rng
        self.all: list[_Attempt] = []

    @property
    def rounds(self) -> tuple[Round, ...]:
        """The errors of every execution."""
        return tuple(attempt.figures for attempt in self.all)

    def add(self, references: Schedule, q: Array) -> None:
        """Command a motion to the real cell and measure its tools."""
        job = self._job
        true = self._real.tool_poses(job.operators, q)
        measured = measured_poses(true, self._system, self._rng)
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
