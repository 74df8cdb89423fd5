"""A program at a cycle time of its own: how near its joints come to their limits, and what binds it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Final, Self

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.measures.limit_shares import KINDS, ORDERS
from cellplan.model.cell.cell import Cell, joint_at
from cellplan.model.progress import Progress
from cellplan.model.report.report import TaskAccuracy
from cellplan.model.task.task import Task, TimedPath
from cellplan.model.units import MM
from cellplan.report.record.figures import Figures, figures_of
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.runs.greatest_feeds import OpenFeed, stated_values
from cellplan.runs.plan.retiming import RowLimits, row_limits
from cellplan.runs.solution import Run, Solution
from cellplan.runs.solve import certified, solve_motion
from cellplan.scene.scene import Scene

BINDS: Final = 0.99  # [-] share of a limit from which on it binds
TORQUE: Final = "torque"
TASK_LIMITS: Final = ("feed", "tolerance between rows")
NEAR: Final = 1e-9  # [-] of a number of steps: rounding


class Law(StrEnum):
    """What decides when the joints are where on their path."""

    AS_WRITTEN = "as_written"
    TIME_LAWS = "time_laws"
    COMMON_SPEED = "common_speed"
    REDUCED_SPEED = "reduced_speed"


RETIMED: Final = (Law.COMMON_SPEED, Law.REDUCED_SPEED)


@dataclass(frozen=True, slots=True, kw_only=True)
class Binding:
    """The joint or tool and the limit that ask for most time in a phase."""

    phase: str
    robot: str
    joint: str  # name of the joint; that of the task for its feed and its tolerance between rows
    kind: str  # its limit: velocity, acceleration, jerk, torque, tool speed, feed or tolerance between rows
    share: float  # what is reached of it, 0..1
    time_share: float  # share of the time of the phase that it asks for, 0..1

    @property
    def text(self) -> str:
        """One line of text."""
        limit = self.kind if self.kind in TASK_LIMITS else f"{self.kind} limit"
        name = self.robot if self.kind == "tool speed" else f"{self.robot} {self.joint}"
        return f"{name} {'binds at' if self.binds else 'reaches'} {100.0 * self.share:.4g} % of its {limit}"

    @property
    def binds(self) -> bool:
        """Whether the limit is reached, not only neared."""
        return self.share >= BINDS


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimedProgram:
    """A program at a cycle time of its own."""

    law: Law
    values: Mapping[str, object]  # what was set in the cell for it, by address; see ``Cell.with_values``
    solution: Solution
    scene: Scene = field(repr=False)
    bindings: tuple[Binding, ...]  # what binds each phase with tasks; transfer moves are as fast as can be anyway
    load: float  # share of its time in which the limits of joints, tools and part would allow the same motion

    @classmethod
    def solved(
        cls,
        cell: Cell,
        law: Law,
        values: Mapping[str, object],
        *,
        task: str | None,
        progress: Progress,
        early: EarlyClearance | None = None,
    ) -> Self:
        """The program of a cell with other values, verified but for its clearance.

        Args:
            early: Begins with its clearance at once.
        """
        scene, solution = solve_motion(cell.with_values(values), task=task, progress=progress, early=early)
        scaled = [run for run in solution.runs if _is_scaled(run, cell)]
        return cls(
            law=law,
            values=values,
            solution=solution,
            scene=scene,
            bindings=tuple(_binding(run, is_retimed=law in RETIMED) for run in scaled),
            load=max(_load(run, scene) for run in scaled),
        )

    def load_of(self, robot: str) -> float:
        """Share of the time of the program in which the joints of one robot would allow their motion."""
        loads, columns = [0.0], self.solution.cell.columns(robot)
        for run in self.solution.runs:
            loads += [float(_demanded(run)[1][:, columns].max(initial=0.0))] if run.phase.tasks else []
        return max(loads)

    def certified(self, progress: Progress, early: EarlyClearance | None = None) -> Self:
        """The same program with the clearance of every phase checked; ``early`` has it without curves."""
        return replace(self, solution=certified(self.solution, progress=progress, early=early))

    @property
    def figures(self) -> Figures:
        """Its figures; the clearance is among them once it is certified."""
        return figures_of([run.report for run in self.solution.runs], cycle=self.cycle, load=self.load)

    @property
    def cycle(self) -> float:
        """Time from the first row to the last one in [s]."""
        return float(self.solution.motion.times[-1])

    @property
    def phases(self) -> list[float]:
        """Times in [s] that a demanded ``cycle_s`` stands for: of its phases, or of its cycles from home to home."""
        program = self.solution.cell.program
        if program.is_home_to_home:
            return [self.cycle / program.cycles] * program.cycles
        return [run.report.cycle_time for run in self.solution.runs]


SolvedAt = Callable[[Law, dict[str, object], str], TimedProgram]  # with values by address, and what is shown of it


def _is_scaled(run: Run, cell: Cell) -> bool:
    """Whether a phase has tasks of the cell, so that it takes longer where they do."""
    tasks = {task.name for task in cell.tasks}
    return bool(run.phase.tasks) and tasks.issuperset(run.phase.tasks)


def _rows(run: Run) -> tuple[RowLimits, Array]:
    """Limits and written joint positions of a phase."""
    names = [robot.name for robot in run.cell.robots]
    return row_limits(run.scene, run.schedule), np.concatenate([run.report.q[name] for name in names], axis=1)


def _load(run: Run, scene: Scene) -> float:
    """Share of the time of a phase in which the limits of joints, tools and part would allow the same motion."""
    limits, q = _rows(run)
    return replace(limits, scene=scene, paths=()).slower(run.schedule.times, q)


def _demanded(run: Run) -> tuple[Array, Array]:
    """What of its limits each joint reaches, and what share of the time that asks for, by kind, shape (4, nq) each."""
    limits, q = _rows(run)
    shares, times = limits.shares(run.schedule.times, q), run.schedule.times
    torque, slower = limits.torques(times, q, sigma=times)
    required = [share**order for share, order in zip(shares, ORDERS, strict=True)]
    return np.array([*shares, torque]), np.array([*required, slower])


def _binding(run: Run, *, is_retimed: bool) -> Binding:
    """The limit that asks for most time in one phase; those of a task are limits of retimed programs."""
    limits, _ = _rows(run)
    shares, required = _demanded(run)
    kind, column = np.unravel_index(int(required.argmax()), required.shape)
    robot, joint = joint_at(run.cell, int(column))
    candidates = [(float(required.max()), robot, joint, (*KINDS, TORQUE)[kind], float(shares[kind][column]))]
    for name, feed in limits.feeds(run.motion.sigma, run.motion.times).items() if is_retimed else ():
        candidates.append((feed, run.cell.task(name).robot, name, "feed", feed))
    for errors in run.report.accuracy if is_retimed else ():
        share = _share_between(errors, run.cell)
        candidates.append((share**0.5, errors.robot, errors.task, "tolerance between rows", share))
    limit = run.cell.checks.tool_speed_mm_s
    if limit is not None:
        for name, speed in run.report.speeds.items():
            share = speed.tool_peak / limit.si
            candidates.append((share, name, "", "tool speed", share))
    most, robot, joint, name, share = max(candidates, key=lambda candidate: candidate[0])
    return Binding(phase=run.phase.name, robot=robot, joint=joint, kind=name, share=share, time_share=most)


def _share_between(errors: TaskAccuracy, cell: Cell) -> float:
    """Largest error of a tool between rows as a share of its tolerance; it grows with the square of the speed."""
    if errors.between is None:
        return 0.0
    position, orientation = cell.task(errors.task).tolerance.between
    on_path = errors.between.position
    return max(on_path.easing * on_path.largest / position, errors.between.orientation.largest / orientation)


def scaled_values(cell: Cell, factor: float, opened: Sequence[OpenFeed] = ()) -> dict[str, object]:
    """Values of the cell file by address with which everything takes ``factor`` times as long.

    Args:
        opened: Processes whose feeds are sought: they are scaled too.
    """
    motion = cell.motion
    values: dict[str, object] = {}
    if motion.duration is not None:
        values["motion.duration_s"] = motion.duration * factor
    for index, lock in enumerate(motion.locked):
        if lock.from_s > 0.0:
            values[f"motion.locked_joints[{index}].from_s"] = lock.from_s * factor
    for task in cell.tasks:
        values |= {f"tasks.{task.name}.{key}": value for key, value in _scaled_task(task, factor).items()}
    feeds = {feed.task.name: (cell.task(feed.task.name).feed or 0.0) / factor for feed in opened}
    return values | stated_values(opened, feeds)


def refuse_fixed_times(cell: Cell) -> None:
    """Refuse trajectories and times to settle, which have times of their own."""
    for task in cell.tasks:
        if isinstance(task.path, TimedPath):
            raise InputError(
                f"{task.where('path')}: expected a path without times, got a trajectory with its own clock"
            )
        if task.settle > 0.0:
            where = task.where("settle_s")
            raise InputError(f"{where}: expected 0 where the shortest cycle is sought, got {task.settle:g}")


def whole_steps(cell: Cell, factor: float, *, longer_than: float = 0.0) -> float:
    """A factor with which the clock takes whole steps, not below a given one and more than another."""
    duration, step = cell.motion.duration, cell.motion.step
    if duration is None:
        return factor
    steps = int(np.ceil(factor * duration / step * (1.0 - NEAR)))
    return max(steps, round(longer_than * duration / step) + 1 if longer_than else 1) * step / duration


def steps_within(seconds: float, step: float) -> int:
    """Number of whole steps that a time holds."""
    return int(np.floor(seconds / step * (1.0 + NEAR)))


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
