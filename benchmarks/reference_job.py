"""The reference job: the four robots of [Ribeiro2010]_ tables 4-7, 24 joints, three tools on the moving part, 4 s.

It is made from the shipped cell and judged by the kinematics of cellplan's checks, which knows none of the engines. A
result is judged where the tables have samples and between them, where a controller makes up the rest.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from job import Arm, Array, Job

from cellplan import Cell, load_cell
from cellplan.geometry.transforms import inverse
from cellplan.measures.tool_errors import errors_on_part, part_poses
from cellplan.model.motion.motion import Schedule
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain

CELL: Final = Path(__file__).resolve().parent.parent / "cells/four_robots.yaml"
BETWEEN: Final = 4  # [-] points between two samples that are evaluated
FINE: Final = (4, 8)  # [-] steps per sample of the two runs that the true end is extrapolated from


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Largest errors of all tools on the part.

    Attributes:
        samples: Position at the samples in [m].
        lines: Position in [m] when the joints go straight from sample to sample, between the samples too.
        smooth: The same when the joints follow the cubic through the four nearest samples.
        orientation: Orientation in [rad], straight from sample to sample.
        end: Largest distance of a joint from where it ends when all steps are infinitely small, in [rad]: how well the
            redundancy is resolved.
    """

    samples: float
    lines: float
    smooth: float
    orientation: float
    end: float


def reference_job(path: Path = CELL) -> Job:
    """The job as plain arrays.

    Raises:
        ValueError: The cell is not of the kind that all engines can take.
    """
    cell = load_cell(path)
    schedule = _schedule(cell)
    grasp, names = cell.part.held_by[0], [robot.name for robot in cell.robots]
    for robot in cell.robots:
        is_chain = [joint.parent for joint in robot.model.joints] == list(range(-1, len(robot.model.joints) - 1))
        if robot.start is None or robot.model.followers or not is_chain:
            raise ValueError(f"{robot.name}: expected a plain chain with a start posture")
    return Job(
        cell=str(path),
        arms=tuple(
            Arm(
                X_WB=robot.X_WB,
                points_B=np.array([joint.point_B for joint in robot.model.joints]),
                axes_B=np.array([joint.axis_B for joint in robot.model.joints]),
                X_BT=robot.model.X_BF @ robot.tool.X_FT,
            )
            for robot in cell.robots
        ),
        holder=names.index(grasp.robot),
        X_HP=inverse(grasp.X_PT),
        operators=np.array([names.index(task.robot) for task in cell.tasks]),
        times=schedule.times,
        X_PT=np.stack([task.X_PT for task in schedule.tasks], axis=1),
        start=np.concatenate([robot.start for robot in cell.robots if robot.start is not None]),
    )


class Judge:
    """Evaluates the joints of a run, with references that are exact between the samples as well."""

    def __init__(self, job: Job) -> None:
        """Sample the references on a finer clock, and find where the joints ought to end."""
        cell = load_cell(Path(job.cell))
        motion = replace(cell.motion, step=cell.motion.step / (BETWEEN + 1))
        self._cell, self._fine = cell, _schedule(replace(cell, motion=motion))
        self._chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
        coarse, fine = (_end(cell, steps, start=job.start) for steps in FINE)
        self._end = 2.0 * fine - coarse  # the error of Euler steps is in proportion to their length

    def errors(self, q: Array) -> Errors:
        """What is wrong with joint positions at the samples, shape (N, nq)."""
        samples, _ = self._largest(q, slice(None, None, BETWEEN + 1))
        lines, orientation = self._largest(filled(q, degree=1))
        smooth, _ = self._largest(filled(q, degree=3))
        return Errors(
            samples=samples,
            lines=lines,
            smooth=smooth,
            orientation=orientation,
            end=float(np.abs(q[-1] - self._end).max()),
        )

    def _largest(self, q: Array, samples: slice = slice(None)) -> tuple[float, float]:
        """Largest position error in [m] and orientation error in [rad] of all tasks at samples of the fine clock."""
        cell = self._cell
        of = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}
        X_PW = inverse(part_poses(cell, self._chains, of))
        results = []
        for task in self._fine.tasks:
            X_PT = X_PW @ self._chains[task.task.robot].tool_poses(of[task.task.robot])
            error = errors_on_part(X_PT, task.X_PT[samples], task.task)
            results.append([np.linalg.norm(part, axis=1).max() for part in (error[:, :3], error[:, 3:])])
        position, orientation = np.max(results, axis=0).tolist()
        return position, orientation


def thinned(job: Job, every: int, looks: int) -> Job:
    """The job at every so many samples only, each of them so many times in a row but for the first."""
    chosen = np.repeat(np.arange(0, len(job.times), every), looks)[looks - 1 :]
    return replace(job, times=job.times[: len(chosen)], X_PT=job.X_PT[chosen])


def filled(q: Array, *, degree: int, parts: int = BETWEEN + 1) -> Array:
    """Joint positions at the samples and between, on polynomials through the ``degree + 1`` nearest samples.

    Args:
        q: Positions at the samples, shape (N, nq).
        degree: Of the polynomials.
        parts: How many parts each step is cut into.

    Returns:
        Positions, shape (parts (N - 1) + 1, nq).
    """
    places = np.arange(parts * (len(q) - 1) + 1) / parts  # [samples]
    first = np.clip(places.astype(int) - (degree - 1) // 2, 0, len(q) - 1 - degree)
    nodes = np.arange(degree + 1)
    x = places - first
    weights = [np.prod([(x - j) / (k - j) for j in nodes if j != k], axis=0) for k in nodes]
    result: Array = np.einsum("kp,pkj->pj", weights, q[first[:, None] + nodes])
    return result


def _schedule(cell: Cell) -> Schedule:
    """All tasks on the clock."""
    return schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])


def _end(cell: Cell, steps: int, *, start: Array) -> Array:
    """Where the joints end by so many Euler steps per sample, with the feedback as strong in each, shape (nq,)."""
    motion = replace(cell.motion, step=cell.motion.step / steps)
    finer = replace(cell, motion=motion, solver=cell.solver.changed(gain_per_s=cell.solver.gain * steps))
    end: Array = integrate_schedule(
        MotionTask(finer, _schedule(finer), [robot.name for robot in cell.robots], start)
    ).q[-1]
    return end
