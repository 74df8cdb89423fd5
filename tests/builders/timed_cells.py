"""Timed tasks of shipped cells and of random ones, and what is independent of the planner to judge their motion by."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from builders.batch_cells import everyone, relations, seen_poses
from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import Array
from cellplan.measures.tool_errors import errors_on_part
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.model.task.clocked_path import distinct
from cellplan.model.task.task import SpacePolylinePath
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.collocation.joint_polynomials import CollocatedPath
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_path, clock_paths, schedule_paths
from cellplan.planning.tracking.motion_task import MotionTask, closures
from cellplan.scene.scene import Scene

SIDE = 0.06  # [m]
SHIPPED = Path(__file__).parents[2] / "cells"


@dataclass(frozen=True)
class Case:
    """A cell, its tasks on the clock, who moves, and where it starts; every motion of it is planned once."""

    cell: Cell
    schedule: Schedule
    moving: tuple[str, ...]
    start: Array
    _planned: dict[Any, Any] = field(init=False, repr=False, compare=False, default_factory=dict)

    @property
    def task(self) -> MotionTask:
        return MotionTask(self.cell, self.schedule, self.moving, self.start)

    def resolved(self, **changes: Any) -> Motion:
        """The motion, with changed solver settings; not to be changed."""
        key = ("motion", *sorted(changes.items()))
        if key not in self._planned:
            cell = replace(self.cell, solver=self.cell.solver.changed(**changes))
            self._planned[key] = plan_motion(replace(self.task, cell=cell))
        return self._planned[key]

    def path(self, **changes: Any) -> CollocatedPath:
        """The whole motion as polynomials; not to be changed."""
        key = ("path", *sorted(changes.items()))
        if key not in self._planned:
            cell = replace(self.cell, solver=self.cell.solver.changed(**changes))
            run = AccurateRun(replace(self.task, cell=cell))
            self._planned[key] = run.path(self.start, begin=0.0, end=run.end)
        return self._planned[key]


def case_of(cell: Cell, *, moving: Sequence[str] | None = None, start: Array | None = None) -> Case:
    """All tasks of a cell at once."""
    if moving is None and start is None:
        return _shared("whole", cell, _case_of)
    return _case_of(cell, moving=moving, start=start)


def _case_of(cell: Cell, *, moving: Sequence[str] | None = None, start: Array | None = None) -> Case:
    cell = replace(cell, solver=cell.solver.changed(integrator="accurate"))
    schedule = schedule_paths(cell, [clock_path(cell, task, build_toolpath(task, cell.part)) for task in cell.tasks])
    if start is None:
        start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    return Case(cell, schedule, tuple(everyone(cell) if moving is None else moving), start)


_SHARED: dict[tuple[str, int], tuple[Cell, Case]] = {}


def _shared(kind: str, cell: Cell, make: Callable[[Cell], Case]) -> Case:
    """One case for each cell, so that tests share the motions that are planned of it."""
    key = (kind, id(cell))  # the cell is kept, so that no other takes its place in memory
    if key not in _SHARED:
        _SHARED[key] = (cell, make(cell))
    return _SHARED[key][1]


@cache
def shipped(name: str) -> Cell:
    """A cell of the folder ``cells`` that has start postures."""
    return load_cell(SHIPPED / f"{name}.yaml")


def solved_start(scene: Scene, toolpaths: Mapping[str, Toolpath]) -> Array:
    """Stacked start configuration of the whole cell, its paths put on the clock."""
    return choose_start(scene, clock_paths(scene.cell, toolpaths.values())).start


def slowly_clocked(cell: Cell, step: float, **changes: Any) -> Cell:
    """The cell with another step of the clock and a feedback that goes with it."""
    return replace(
        cell,
        motion=replace(cell.motion, step=step, **changes),
        solver=cell.solver.changed(gain_per_s=0.5 / step),
    )


def largest_error(case: Case, path: CollocatedPath, times: Array) -> float:
    """Largest distance in [m] or angle in [rad] of any tool from where it belongs, by successive screws.

    The times must increase and keep off the breaks, at which a target may have two values.
    """
    breaks = case.schedule.breaks
    place = np.clip(np.searchsorted(breaks, times, side="right"), 1, len(breaks) - 1)
    within = (breaks[place - 1], breaks[place])
    seen = seen_poses(case.cell, path.at(times))
    desired = [path.at(times, within)[0] for path in case.schedule.paths]
    desired += [np.broadcast_to(grasp.X_PT, (len(times), 4, 4)) for grasp in closures(case.cell, case.moving)]
    names = [path.task.name for path in case.schedule.paths]
    judged = [task for task in relations(case.cell) if isinstance(task, Grasp) or task.name in names]
    worst = 0.0
    for index, (task, poses) in enumerate(zip(judged, desired, strict=True)):
        error = errors_on_part(seen[:, index], poses, task)
        worst = max(worst, *(float(np.linalg.norm(part, axis=1).max()) for part in (error[:, :3], error[:, 3:])))
    return worst


def between_samples(case: Case, path: CollocatedPath, *, count: int = 10) -> Array:
    """Instants strictly between all samples of the clock and the panels of a path, so many in each gap."""
    ends = distinct(np.concatenate([case.schedule.times, case.schedule.breaks, [panel.end for panel in path.panels]]))
    shares = (np.arange(count) + 0.5) / count
    return (ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel()


def triangles(cell: Cell, *, side: float = SIDE, start: Array | None = None, **words: Any) -> Case:
    """A random cell whose tools go along triangles in space that begin where they are at a start posture."""
    if side == SIDE and start is None and not words:
        return _shared("triangles", cell, _triangles)
    return _triangles(cell, side=side, start=start, **words)


def _triangles(cell: Cell, *, side: float = SIDE, start: Array | None = None, **words: Any) -> Case:
    q = np.random.default_rng(2).uniform(-1.0, 1.0, cell.joint_count) if start is None else start
    seen = seen_poses(cell, q[None])[0]
    tasks = []
    for task, X in zip(cell.tasks, seen, strict=False):
        corners = X[:3, 3] + side * np.array([[0.0, 0.0, 0.0], [1.0, 0.3, 0.2], [0.4, 0.9, -0.3]])
        path = SpacePolylinePath(points=tuple(tuple(corner.tolist()) for corner in corners), is_closed=True)
        plain = {"path": path, "tool_axis": X[:3, 2], "tool_x": X[:3, 0], "duration": None}
        tasks.append(replace(task, **(plain | words)))
    grasps = zip(cell.closures, seen[len(cell.tasks) :], strict=True)
    held_by = cell.part.held_by[:1] + tuple(replace(grasp, X_PT=X) for grasp, X in grasps)
    robots = tuple(replace(robot, start=q[cell.columns(robot.name)]) for robot in cell.robots)
    part = replace(cell.part, held_by=held_by)
    return _case_of(replace(cell, tasks=tuple(tasks), robots=robots, part=part))
