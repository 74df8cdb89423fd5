"""Shortest cycle of a cell: by its time laws, and with the best common speed of all robots along the same path."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell, joint_at
from cellplan.model.progress import Progress, silent
from cellplan.model.task import Task, TimedPath
from cellplan.model.units import MM
from cellplan.pipeline.plan.retiming import RowLimits, row_limits
from cellplan.pipeline.solution import Solution
from cellplan.pipeline.solve import certified, solve_motion
from cellplan.scene.scene import Scene

KINDS: Final = ("velocity", "acceleration", "jerk")
ORDERS: Final = (1.0, 0.5, 1.0 / 3.0)  # how the time that a limit asks for grows with its share
MOST_TRIALS: Final = 8  # durations tried until every limit holds
NEAR: Final = 1e-9  # [-] of a number of steps: rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Binding:
    """The joint or tool and the limit that ask for most time in a phase.

    Attributes:
        phase: Name of the phase.
        robot: Name of the robot.
        joint: Name of the joint; that of the task for a feed.
        kind: Its limit: velocity, acceleration, jerk or feed.
        share: What is reached of it, 0..1.
    """

    phase: str
    robot: str
    joint: str
    kind: str
    share: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShortestCycle:
    """A program at the shortest time found.

    Attributes:
        solution: The program, solved and verified at that time.
        bindings: What binds each of its phases.
    """

    solution: Solution
    bindings: tuple[Binding, ...]

    @property
    def cycle(self) -> float:
        """Time from the first row to the last one in [s]."""
        return float(self.solution.motion.times[-1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShortestCycles:
    """The shortest cycles of a cell.

    Attributes:
        written: Time of the program as it is written in [s].
        by_time_laws: With the durations, feeds and laws of the cell, all faster or slower by one factor.
        by_common_speed: With the best speed of all robots together along the path that the time laws give.
    """

    written: float
    by_time_laws: ShortestCycle
    by_common_speed: ShortestCycle

    @property
    def passed(self) -> bool:
        """Whether both programs passed every check."""
        return self.by_time_laws.solution.passed and self.by_common_speed.solution.passed


def fastest(cell: Cell, *, task: str | None = None, progress: Progress = silent) -> ShortestCycles:
    """The shortest time in which a program keeps the velocity, acceleration and jerk limits of all joints.

    Feeds are scaled with the time laws; for the common speed they are upper limits. Other checks, as tool errors and
    clearance, are made at the times found and do not change these.

    Args:
        cell: The cell, as ``load_cell`` gives it; its own timing does not matter.
        task: Name of the only task to work on.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The cell cannot be worked with, or a task has times that do not follow the clock.
        NoSolutionError: No start posture or no home was found, or the time laws keep no limit however slow they are.
    """
    _refuse_fixed_times(cell)
    written = cell.with_values({"motion.timing": "as_written"})
    scene, solution = solve_motion(written, task=task, progress=progress)
    times, factor = solution.motion.times, 1.0
    now, made = scene, solution
    for _ in range(MOST_TRIALS):
        needed = max(_slower(now, run_limits, q) for run_limits, q in _rows(now, made))
        if needed <= 1.0 and factor != 1.0:
            break
        factor = _whole_steps(cell, factor * needed, longer_than=factor if needed > 1.0 else 0.0)
        now, made = solve_motion(written.with_values(scaled_values(cell, factor)), task=task, progress=progress)
    else:
        raise NoSolutionError(
            f"{cell.origin.at('motion.time_law')}: expected time laws that keep all limits when slow enough, got "
            "speeds that jump; use the time law quintic, or write acceleration: unlimited"
        )
    laws = ShortestCycle(
        solution=certified(made, now, progress=progress), bindings=_bindings(now, made, has_feeds=False)
    )
    now, made = solve_motion(cell.with_values({"motion.timing": "fastest"}), task=task, progress=progress)
    bindings = _bindings(now, made, has_feeds=True)
    common = ShortestCycle(solution=certified(made, now, progress=progress), bindings=bindings)
    return ShortestCycles(written=float(times[-1]), by_time_laws=laws, by_common_speed=common)


def scaled_values(cell: Cell, factor: float) -> dict[str, object]:
    """Values of the cell file with which everything takes longer by a factor, by address; see ``Cell.with_values``.

    Args:
        cell: The cell.
        factor: More than 1 for slower.
    """
    motion = cell.motion
    values: dict[str, object] = {}
    if motion.duration is not None:
        values["motion.duration_s"] = motion.duration * factor
    for index, lock in enumerate(motion.locked):
        if lock.since > 0.0:
            values[f"motion.locked_joints[{index}].from_s"] = lock.since * factor
    for task in cell.tasks:
        values |= {f"tasks.{task.name}.{key}": value for key, value in _scaled_task(task, factor).items()}
    return values


def _scaled_task(task: Task, factor: float) -> dict[str, object]:
    """Values of one task, by its keys."""
    values: dict[str, object] = {}
    if task.start > 0.0:
        values["start_s"] = task.start * factor
    if task.duration is not None:
        values["duration_s"] = task.duration * factor
    if task.feed is not None and task.process is None:
        values["feed_mm_s"] = MM * task.feed / factor
    for key, move in (("approach_s", task.approach), ("retract_s", task.retract)):
        if move is not None:
            values[key] = move.duration * factor
    return values


def _refuse_fixed_times(cell: Cell) -> None:
    """Refuse trajectories and times to settle, which have times of their own.

    Raises:
        InputError: There is one.
    """
    for task in cell.tasks:
        if isinstance(task.path, TimedPath):
            raise InputError(
                f"{task.where('path')}: expected a path without times, got a trajectory with its own clock"
            )
        if task.settle > 0.0:
            where = task.where("settle_s")
            raise InputError(f"{where}: expected 0 where the shortest cycle is sought, got {task.settle:g}")


def _whole_steps(cell: Cell, factor: float, *, longer_than: float) -> float:
    """A factor with which the clock takes whole steps, not below a given one and more than another."""
    duration, step = cell.motion.duration, cell.motion.step
    if duration is None:
        return factor
    steps = int(np.ceil(factor * duration / step * (1.0 - NEAR)))
    return max(steps, round(longer_than * duration / step) + 1 if longer_than else 1) * step / duration


def _rows(scene: Scene, solution: Solution) -> list[tuple[RowLimits, Array]]:
    """Limits and written joint positions of each phase."""
    names = [robot.name for robot in scene.cell.robots]
    return [
        (row_limits(scene, run.schedule), np.concatenate([run.report.q[name] for name in names], axis=1))
        for run in solution.runs
    ]


def _slower(scene: Scene, limits: RowLimits, q: Array) -> float:
    """Factor of time that the limits of one phase ask for; feeds do not, they are scaled."""
    return replace(limits, scene=scene, paths=()).slower(np.zeros(len(q)), q)


def _bindings(scene: Scene, solution: Solution, *, has_feeds: bool) -> tuple[Binding, ...]:
    """What binds each phase; feeds do where they are limits."""
    found = []
    for run, (limits, q) in zip(solution.runs, _rows(scene, solution), strict=True):
        shares = limits.shares(run.schedule.times, q)
        asked = np.array([share**order for share, order in zip(shares, ORDERS, strict=True)])
        kind, column = np.unravel_index(int(asked.argmax()), asked.shape)
        robot, joint = joint_at(scene.cell, int(column))
        share = float(shares[kind][column])
        binding = Binding(phase=run.phase.name, robot=robot, joint=joint, kind=KINDS[kind], share=share)
        feeds = limits.feeds(run.motion.sigma, run.motion.times) if has_feeds else {}
        for name, feed in sorted(feeds.items(), key=lambda each: each[1]):
            if feed > asked.max():
                own = Binding(
                    phase=run.phase.name, robot=scene.cell.task(name).robot, joint=name, kind="feed", share=feed
                )
                binding = own
        found.append(binding)
    return tuple(found)


def figures(solution: Solution) -> Mapping[str, float | None]:
    """Largest tool errors in [m] and [rad], between the rows too, and smallest clearance in [m] of all phases."""
    position, orientation, clearance = 0.0, 0.0, []
    for run in solution.runs:
        for errors in run.report.accuracy:
            first = solution.cell.task(errors.task).first_judged(run.report.times)
            position = max(position, float(np.linalg.norm(errors.position_error[first:], axis=1).max()))
            orientation = max(orientation, float(np.linalg.norm(errors.orientation_error[first:], axis=1).max()))
            if errors.between is not None:
                position = max(position, errors.between.position.largest)
                orientation = max(orientation, errors.between.orientation.largest)
        clearance += [each.minimum for each in run.report.clearance.minima.values() if each.minimum is not None]
    return {"position": position, "orientation": orientation, "clearance": min(clearance, default=None)}
