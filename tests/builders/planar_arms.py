"""Planar arms of revolute joints whose tip is to go through given points: the examples of the papers."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from builders.jacobian_cells import model_of
from builders.random_cells import make_task, random_cell
from cellplan.geometry.transforms import Array, pose_from
from cellplan.model.cell.cell import Cell, Part, Robot, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.settings.task import ToleranceEntry


def planar_cell(lengths: Sequence[float], solver: SolverEntry, *, settle: float = 0.0) -> Cell:
    """One arm in the plane z = 0 of the world, which is the part's frame; its task is the position of its tip."""
    joints = np.concatenate([[0.0], np.cumsum(lengths)])
    axes = [("R", (0.0, 0.0, 1.0), (x, 0.0, 0.0)) for x in joints[:-1]]
    model = model_of(axes, pose_from(np.eye(3), np.array([joints[-1], 0.0, 0.0])))
    arm = Robot(
        name="arm",
        model=model,
        X_WB=np.eye(4),
        tool=Tool(X_FT=np.eye(4), bodies=()),
        start=None,
        weights=np.ones(len(lengths)),
    )
    task = make_task(
        "arm", axes=(0, 1), settle=settle, tolerance=ToleranceEntry(position_mm=1000.0, orientation_deg=np.degrees(1.0))
    )
    template = random_cell(0, operators=1)
    part = Part(shape=template.part.shape, X_PS=np.eye(4), held_by=(), X_WP=np.eye(4))
    return replace(template, name="planar", robots=(arm,), part=part, tasks=(task,), solver=solver)


def tip_schedule(
    cell: Cell, point: Callable[[Array], Array], *, velocity: Callable[[Array], Array], duration: float, step: float
) -> Schedule:
    """The tip's desired positions and velocities, given as functions of the instants with values of shape (N, 2)."""
    times = np.arange(round(duration / step) + 1) * step
    X = np.tile(np.eye(4), (len(times), 1, 1))
    X[:, :2, 3] = point(times)
    V = np.zeros((len(times), 6))
    V[:, :2] = velocity(times)
    task = TaskSchedule(task=cell.tasks[0], X_PT=X, V_PT_P=V, travelled=times, length=1.0, end=duration)
    return Schedule(times=times, tasks=(task,))


def tips(lengths: Sequence[float], q: Array) -> Array:
    """Positions of the tip, shape (N, 2), for joint angles of shape (N, n)."""
    angles = np.cumsum(q, axis=1)
    return np.stack([np.cos(angles) @ np.asarray(lengths), np.sin(angles) @ np.asarray(lengths)], axis=1)


def tip_jacobians(lengths: Sequence[float], q: Array) -> Array:
    """Jacobians of the tip, shape (N, 2, n)."""
    angles = np.cumsum(q, axis=1)
    links = np.stack([-np.sin(angles) * np.asarray(lengths), np.cos(angles) * np.asarray(lengths)], axis=1)
    jacobians: Array = np.cumsum(links[:, :, ::-1], axis=2)[:, :, ::-1]
    return jacobians
