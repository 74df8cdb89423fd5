"""Standoff: how far the tip of each tool is from the part along its path, to the nearest point and along its axis."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.line_spans import line_spans
from cellplan.geometry.shapes import Solid, Sphere
from cellplan.geometry.transforms import inverse
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Standoff
from cellplan.model.task.clocked_path import are_within
from cellplan.model.task.task import Frame, OffPart, Task
from cellplan.scene.collision.bodies import BodyPoses, prepare
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.kinematics.screw_chain import Chains

UNSTATED: Final = 0.002  # [m] beyond its tolerance: a process that states nothing is at the surface within that
TIP_RADIUS: Final = 1e-6  # [m] of the ball that stands for a tip: less than distances are worked out to
AT_SURFACE: Final = 1e-5  # [m] by which a tip may be inside the part and still stand at its surface
POSE_COUNT: Final = 1000  # rows of a task that are measured


def standoffs(cell: Cell, schedule: Schedule, chains: Chains, q: RobotRows) -> tuple[Standoff, ...]:
    """Distances of the tip of every task on the part, from where errors are judged on its path to the end of it."""
    standoffs = []
    for scheduled in schedule.tasks:
        task, times = scheduled.task, schedule.times
        if task.relative_to is not Frame.PART:
            continue
        rows = np.flatnonzero((times >= max(task.start, task.judged_from)) & (times <= scheduled.end + task.off_delay))
        lead = 0.0 if task.process is None else task.process.lead_s
        several = tuple((on + lead, off + lead) for on, off in scheduled.process_on)
        spans = several if len(several) > 1 else (scheduled.work,)
        if len(spans) > 1 or any(scheduled.runs):
            rows = rows[are_within(times[rows], spans)]
        rows = rows if len(rows) else np.array([len(times) - 1])
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(POSE_COUNT, len(rows))).round().astype(np.intp))]
        some = {name: values[rows] for name, values in q.items()}
        X_PT = inverse(part_poses(cell, chains, some)) @ chains[task.robot].tool_poses(some[task.robot])
        standoffs.append(standoff_on(cell, task, X_PT, times=times[rows]))
    return tuple(standoffs)


def standoff_on(cell: Cell, task: Task, X_PT: Array, *, times: Array | None = None) -> Standoff:
    """Distances of a tip at some poses of a tool along the path of its task.

    Args:
        X_PT: Tool poses on the part, shape (N, 4, 4).
        times: Their times in [s], shape (N,); None before there is a motion.
    """
    X_ST = inverse(cell.part.X_PS) @ X_PT
    along = _along(cell.part.shape, X_ST)
    nearest = np.zeros(len(X_PT))
    nearest[along > 0.0] = _nearest(cell.part.shape, X_ST[along > 0.0, :3, 3])
    low, high = task.standoff or (0.0, UNSTATED)
    judged = along if low > 0.0 else nearest
    is_off = (judged > high + task.tolerance.position_mm.si) | (judged < low - task.tolerance.position_mm.si)
    is_excused, excused = _excused(task, is_off, X_PT[:, :3, 3])
    beyond = np.where(is_excused, -np.inf, np.maximum(judged - high, low - judged))
    worst = int(np.argmax(beyond))
    return Standoff(
        task=task.name,
        nearest=(float(nearest.min()), float(nearest.max())),
        along=(float(along.min()), float(along.max())),
        worst_nearest=float(nearest[worst]),
        worst_along=float(along[worst]),
        at_s=None if times is None else float(times[worst]),
        is_off=bool(np.any(is_off & ~is_excused)),
        excused=excused,
    )


def _along(shape: Solid, X_ST: Array) -> Array:
    """Distance in [m] from each tip to the part ahead of it along its axis, shape (N,); 0 inside, inf past the part."""
    spans = line_spans(shape, X_ST[:, :3, 3], X_ST[:, :3, 2])
    is_ahead = spans.leave > AT_SURFACE
    along = np.full(len(X_ST), np.inf)
    np.minimum.at(along, spans.line[is_ahead], np.maximum(spans.enter[is_ahead], 0.0))
    return along


def _nearest(shape: Solid, points: Array) -> Array:
    """Distance in [m] of points from the surface of a solid, shape (N,)."""
    engine = Engine([prepare("tip", Sphere(TIP_RADIUS)), prepare("part", shape)])
    p = np.stack([points, np.zeros_like(points)])
    poses = BodyPoses(np.broadcast_to(np.eye(3), (2, len(points), 3, 3)), p)
    readings = [measure(engine, (0, 1), poses, sample=sample) for sample in range(len(points))]
    return np.array([0.0 if reading.touches else reading.bound + TIP_RADIUS for reading in readings])


def _excused(task: Task, is_off: Flags, p_PT: Array) -> tuple[Flags, Mapping[str, float]]:
    """Where a task may be off its standoff, and the length of path in [m] that each of its reasons excuses.

    A tool that is nowhere where it should be is excused nowhere.
    """
    excused, lengths = np.zeros(len(is_off), dtype=bool), dict[str, float]()
    on = np.flatnonzero(~is_off)
    if not len(on):
        return excused, lengths
    rows, steps = np.arange(len(is_off)), np.append(np.linalg.norm(np.diff(p_PT, axis=0), axis=1), 0.0)
    stretches = {
        OffPart.RUN_IN: rows < on[0],
        OffPart.RUN_OUT: rows > on[-1],
        OffPart.CUT: (rows > on[0]) & (rows < on[-1]),
    }
    for name in task.off_part:
        if np.any(mine := stretches[name] & is_off):
            excused, lengths[str(name)] = excused | mine, float(steps[mine].sum())
    return excused, lengths
