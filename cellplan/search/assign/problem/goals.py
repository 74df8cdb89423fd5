"""What an assignment chooses from: tasks with their tool poses, robots that may do them, and poses of the part."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse
from cellplan.measures.weld_position import torch_angles, weld_angles
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.settings.task import TorchEntry, WeldPositionEntry
from cellplan.model.task.clocked_path import ClockedPath, demanded_spans, fixed_rests
from cellplan.model.task.task import ProgrammedPath, Service, ViaPoint
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths
from cellplan.scene.kinematics.screw_chain import ScrewChain

SAMPLES: Final = 7  # [-] poses along a path; twice as many, less one, along a closed one
ROUNDING: Final = 1e-9  # [rad, m]
STRAIGHT: Final = 1e-6  # [-] cosine of the angle between tool axis and path: below it the tool neither pushes nor drags


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskGoal:
    """A task as an assignment sees it."""

    name: str
    robots: tuple[str, ...]  # that may do it, in the order of the cell
    X_PT: Array  # tool poses at the end of the approach's way, along the path, and after the retraction, (S + 2, 4, 4)
    steps: int  # whole steps from the begin of the approach to the end of the retraction; the least where it is retimed
    is_reversible: bool  # whether it may be done from its end to its begin with the same tool poses
    is_mirrored: bool = False  # whether it is its way back, with the tool mirrored across the path
    after: tuple[str, ...] = ()  # tasks that must be done before it begins
    torch: TorchEntry | None = None  # how its tool is held to gravity
    weld_position: WeldPositionEntry | None = None  # how its weld lies to gravity
    holder_q: Array | None = None  # given configuration of the holder in [rad] or [m], shape (n,); None for any station
    start_q: Array | None = None  # given start of its robot likewise; None for any
    is_spin_free: bool = True  # whether the tool may be turned about its axis beside what is written
    path_values: tuple[tuple[str, object], ...] = ()  # with which its path begins elsewhere, by address in a cell file
    stand_off_steps: int | None = None  # of the steps where it is retimed, those of approach and retraction
    via_before: tuple[Array | None, ...] = ()  # what its robot passes on its way to it, shape (n,) each; None for home
    via_after: tuple[Array | None, ...] = ()  # likewise on its way from it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stations:
    """Poses of the part at which tasks may be done."""

    holder: str | None  # robot that brings the part there; None where it is fixed
    q: Array  # configurations of the holder in [rad] or [m], shape (K, n); one without joints for a fixed part
    X_WP: Array  # the part, shape (K, 4, 4), or (K, S + 2, 4, 4) where it moves along the poses of a task
    q_end: Array | None = None  # configurations in which the holder leaves them; None for those in which it comes

    @property
    def left(self) -> Array:
        """Configurations in which the holder leaves the stations, shape (K, n)."""
        return self.q if self.q_end is None else self.q_end

    def of_samples(self, places: Indices | slice = slice(None)) -> Array:
        """The part at some stations, for one sample of a task or all, shape (K, 1, 4, 4) or (K, S + 2, 4, 4)."""
        X_WP: Array = self.X_WP[places]
        return X_WP[:, None] if X_WP.ndim == 3 else X_WP

    def allowed(self, goal: TaskGoal) -> dict[bool, Flags]:
        """Stations at which a task may be done as it is written, and backwards, as given and to gravity, shape (K,)."""
        is_given = np.ones(len(self.q), dtype=bool)
        if goal.holder_q is not None:
            is_given = np.all(np.abs(self.q - goal.holder_q) <= ROUNDING, axis=1)
        X_WP = self.of_samples()
        X_WT = (X_WP @ goal.X_PT)[:, 1:-1]
        rows, samples = X_WT.shape[:2]
        torch = torch_angles(X_WT.reshape(-1, 4, 4)).reshape(rows, samples)
        is_upright = is_given & (
            torch.max(axis=1) <= (np.pi if goal.torch is None else goal.torch.within_deg.si) + ROUNDING
        )
        if goal.weld_position is None:
            return {False: is_upright, True: is_upright}
        steps = np.gradient(X_WT[..., :3, 3], axis=1) if self.X_WP.ndim == 3 else self._along(goal)
        travel = (steps / np.linalg.norm(steps, axis=-1, keepdims=True)).reshape(-1, 3)
        is_allowed = {}
        for is_reversed, sign in ((False, 1.0), (True, -1.0)):
            angles = weld_angles(X_WT.reshape(-1, 4, 4), sign * travel)
            ranges = goal.weld_position.slope, goal.weld_position.rotation
            keeps = [
                (low - ROUNDING <= it) & (it <= high + ROUNDING) for it, (low, high) in zip(angles, ranges, strict=True)
            ]
            is_allowed[is_reversed] = is_upright & np.all(np.logical_and(*keeps).reshape(rows, samples), axis=1)
        return is_allowed

    def _along(self, goal: TaskGoal) -> Array:
        """Steps along a path on a part that moves, as it lies meanwhile, in the world, shape (K, S, 3)."""
        steps = np.gradient(goal.X_PT[1:-1, :3, 3], axis=0)[1:-1]  # at both ends those of the neighbours
        inner = (self.X_WP[:, 2:-2, :3, :3] @ steps[..., None])[..., 0]
        return np.concatenate([inner[:, :1], inner, inner[:, -1:]], axis=1)

    @classmethod
    def of(cls, cell: Cell, q: Array) -> "Stations":
        """Stations of the first holder at some configurations, shape (K, n); the part where it is without a holder."""
        if not cell.positioners:
            X_WP = np.eye(4) if cell.part.X_WP is None else cell.part.X_WP
            return cls(holder=None, q=np.zeros((1, 0)), X_WP=X_WP[None])
        grasp = cell.part.held_by[0]
        X_WT = ScrewChain(cell.robot(grasp.robot)).tool_poses(q)
        return cls(holder=grasp.robot, q=q, X_WP=X_WT @ inverse(grasp.X_PT))


def task_goals(cell: Cell, robots: Mapping[str, Sequence[str]]) -> list[TaskGoal]:
    """The tasks of a cell with their tool poses and durations.

    Args:
        robots: Names of the robots that may do a task, by its name; the task's own where it is absent.

    Raises:
        InputError: A path cannot be drawn or timed.
    """
    toolpaths = [build_toolpath(task, cell.part) for task in cell.tasks]
    clocked = clock_paths(cell, toolpaths)
    goals = []
    for task, toolpath in zip(cell.tasks, toolpaths, strict=True):
        on_path = toolpath.without_weave.spread(2 * SAMPLES - 1 if toolpath.is_closed else SAMPLES)
        ends = on_path[[0, -1]].copy()
        for end, move in zip(ends, (task.approach, task.retract), strict=True):
            end[:3, 3] -= (0.0 if move is None else move.distance) * end[:3, 2]
        able = tuple(robot.name for robot in cell.robots if robot.name in robots.get(task.name, (task.robot,)))
        goals.append(
            TaskGoal(
                name=task.name,
                robots=able,
                X_PT=np.concatenate([ends[:1], on_path, ends[1:]]),
                steps=int(np.ceil(_seconds(cell, clocked[task.name]) / cell.motion.step - 1e-9)),
                is_reversible=not isinstance(task.path, ProgrammedPath) and is_reversible(toolpath, on_path),
                after=task.after,
                torch=task.torch,
                weld_position=task.weld_position,
                via_before=_without_services(task.via_before),
                via_after=_without_services(task.via_after),
            )
        )
    return goals


def _without_services(points: Sequence[ViaPoint]) -> tuple[Array | None, ...]:
    """Via points but services, which an assignment chooses."""
    return tuple(it for it in points if not isinstance(it, Service))


def _seconds(cell: Cell, path: ClockedPath) -> float:
    """Time of a task; of one that is retimed, what its process or its feed and its rests take at least."""
    task = path.task
    if cell.motion.timing is Timing.AS_WRITTEN:
        return path.over
    rests = sum(end - begin for begin, end in fixed_rests(path))
    if task.process is not None:
        return rests + sum(span.end - span.begin for span in demanded_spans(path))
    return rests + (0.0 if task.feed is None else task.repeat * float(path.behind[-1]) / task.feed)


def is_reversible(toolpath: Toolpath, on_path: Array) -> bool:
    """Whether an open path has its tool across its direction everywhere, so that backwards is neither push nor drag."""
    if toolpath.is_closed or toolpath.is_timed or toolpath.turn:
        return False
    steps = np.diff(on_path[:, :3, 3], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    along = [(steps * on_path[rows, :3, 2]).sum(axis=1) for rows in (slice(None, -1), slice(1, None))]
    return bool(np.all(np.abs(along) <= STRAIGHT * np.maximum(lengths, STRAIGHT)))
