"""Feedback: references corrected so that the tools of a real cell come where they are desired, not those of the model.

[Nicolato2007]_ section 3.5, Eq. 3.31: ``s_d* = g(r_d - r_n) + s~_n`` replaces the desired pose by the nominal one plus
the *measured* error, so that the method cancels what is measured instead of what is modelled.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, inverse, pose_from, rotation_exp, rotation_vector
from cellplan.model.motion.motion import Motion, Schedule, TaskSchedule
from cellplan.model.settings.solver import SecondaryEntry
from cellplan.model.task.task import Task
from cellplan.planning.euler.integrate import integrate_schedule, step_from
from cellplan.planning.methods import method_named
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem

SETTLING_STEPS: Final = 60  # Newton steps from one start posture to the next; a few are enough away from singularities
START_MEASUREMENTS: Final = 6  # times that standing tools are measured and put right before a pass begins

Measure = Callable[[Array], Sequence[Array]]  # stacked joints (1, nq) -> X_PT of every task, (1, 4, 4) each
Observe = Callable[[int, Array], Sequence[Array] | None]  # the same at one sample after the other, where measured


def corrected_references(desired: Schedule, references: Schedule, measured: Sequence[Array]) -> Schedule:
    r"""References for the next pass from what was measured in the last one.

    .. math:: X_{ref}^{i+1}(k) = \Delta(k) \, X_{ref}^{i}(k), \quad \Delta = X_{PT,d} \, X_{PT,measured}^{-1}

    Where a task leaves components open, ``Delta`` takes the measured pose to the nearest one that the task desires. A
    real cell whose tool stands at ``X_ref E``, with an ``E`` that does not depend on the reference, is corrected in one
    pass. In general the error shrinks as long as ``E`` changes less than its argument, which is so for small errors.

    Args:
        references: What the model was given in the last pass.
        measured: Measured tool poses of that pass, shape (N, 4, 4) for each task.
    """
    passed = zip(desired.tasks, references.tasks, measured, strict=True)
    return Schedule(
        times=desired.times,
        tasks=tuple(
            _with_poses(reference, displaced(task.task, task.X_PT, seen, nominal=reference.X_PT), desired.times)
            for task, reference, seen in passed
        ),
    )


def displaced(task: Task, X_desired: Array, X_measured: Array, *, nominal: Array) -> Array:
    """Nominal poses moved in P by the displacement from measured to desired ones, shape (N, 4, 4)."""
    error = pose_errors(X_desired, X_measured, [task.is_spin_free] * len(X_desired))
    error[:, [axis for axis in range(6) if axis not in task.axes]] = 0.0
    turn, tip = rotation_exp(error[:, 3:]), X_measured[:, :3, 3]
    lever = (turn @ (nominal[:, :3, 3] - tip)[..., None])[..., 0]
    return pose_from(turn @ nominal[:, :3, :3], tip + error[:, :3] + lever)


def partly(task: Task, X_desired: Array, X_measured: Array, *, share: float) -> Array:
    """Poses that are off the desired ones by a share of what the measured ones are, shape (N, 4, 4)."""
    error = share * pose_errors(X_desired, X_measured, [task.is_spin_free] * len(X_desired))
    return pose_from(rotation_exp(-error[:, 3:]) @ X_desired[:, :3, :3], X_desired[:, :3, 3] - error[:, :3])


def settled_start(motion: MotionTask) -> Array:
    """The configuration near the start from which the model's tools stand on the first references, shape (nq,)."""
    cell = motion.cell
    times: Array = cell.motion.step * np.arange(SETTLING_STEPS + 1, dtype=np.float64)
    still = Schedule(times=times, tasks=tuple(_standing(task, len(times)) for task in motion.schedule.tasks))
    newton = replace(
        cell,
        solver=cell.solver.changed(
            method="weighted_pseudo_inverse",
            gain_per_s=1.0 / cell.motion.step,
            damping="auto",
            secondary=SecondaryEntry(),
        ),
        motion=replace(cell.motion, cyclic=False),
    )
    return integrate_schedule(replace(motion, cell=newton, schedule=still)).q[-1]


def measured_start(motion: MotionTask, *, measure: Measure) -> Array:
    """Configuration from which the real tools stand on the first poses of their tasks, shape (nq,).

    The standing tools are measured and put right several times: a pass that began with the whole error would begin with
    a jerk.
    """
    desired = motion.schedule
    first = Schedule(times=desired.times[:1], tasks=tuple(_standing(task, 1) for task in desired.tasks))
    references, q = first, motion.start
    for _ in range(START_MEASUREMENTS):
        references = corrected_references(first, references, measure(q[None]))
        q = settled_start(replace(motion, schedule=references, start=q))
    return q


def integrate_measured(motion: MotionTask, *, observe: Observe) -> Motion:
    r"""Follow a schedule with the error measured at each sample fed back at once ([Nicolato2007]_ section 3.5).

    At sample k the method is given ``Delta(k) X_nominal(q_k)`` in place of the desired pose, with ``Delta`` of
    `corrected_references`, and for the next sample the displacement from what is measured now to what is desired then.
    Until the next measurement references are displaced from this one on.

    Args:
        motion: The tasks in the written cell: what the method knows.
        observe: Measures the tools at the first sample, and at those of the others at which there is a measurement.
    """
    cell, desired = motion.cell, motion.schedule
    targets, _ = motion.references()
    references = targets.copy()
    problem = TrackingProblem(motion, references=references)
    advance = method_named(cell.solver.method)(problem)
    q = np.empty((len(desired.times), cell.joint_count))
    q[0] = motion.start
    anchors: list[tuple[Array, Array]] = []  # measured and nominal poses at the last measurement, by task
    for k in range(len(q) - 1):
        if (measured := observe(k, q[k : k + 1])) is not None:
            state = problem.state(q[k])
            frames = inverse(problem.constraints.reference_frames(state.X_WP))
            nominal = frames @ state.X_WT[problem.constraints.operators]
            anchors = [
                (np.repeat(X, 2, axis=0), np.repeat(N[None], 2, axis=0)) for X, N in zip(measured, nominal, strict=True)
            ]
        for place, (scheduled, (seen, model)) in enumerate(zip(desired.tasks, anchors, strict=True)):
            references[k : k + 2, place] = displaced(scheduled.task, targets[k : k + 2, place], seen, nominal=model)
        q[k + 1] = step_from(problem, advance, k, q[k]).q
    return Motion(times=desired.times, q=q)


def _with_poses(scheduled: TaskSchedule, X_PT: Array, times: Array) -> TaskSchedule:
    """A schedule of other poses, with the mean twist from each sample to the next; it ends at rest."""
    step = np.diff(times)[:, None]
    V_PT_P = np.zeros((len(times), 6))
    V_PT_P[:-1, :3] = np.diff(X_PT[:, :3, 3], axis=0) / step
    V_PT_P[:-1, 3:] = rotation_vector(X_PT[1:, :3, :3] @ np.swapaxes(X_PT[:-1, :3, :3], 1, 2)) / step
    return replace(scheduled, X_PT=X_PT, V_PT_P=V_PT_P)


def _standing(scheduled: TaskSchedule, count: int) -> TaskSchedule:
    """A tool that stands still at its first pose for so many samples."""
    return replace(
        scheduled,
        X_PT=np.repeat(scheduled.X_PT[:1], count, axis=0),
        V_PT_P=np.zeros((count, 6)),
        travelled=np.zeros(count),
    )
