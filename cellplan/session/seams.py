"""Tools at work in a live motion: position of the weld, push of the torch, depth; how far arms are from singular."""

from collections.abc import Iterator
from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.tool_errors import part_poses
from cellplan.measures.weld_position import position_name, torch_angles, weld_angles
from cellplan.model.cell.cell import Cell, joint_at
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.report.report import Report
from cellplan.model.task.task import Frame
from cellplan.model.units import DEG, MM
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.kernel.job import Job
from cellplan.search.kernel.singular_values import usual_values
from cellplan.session.blocks import Block
from cellplan.session.figures import DEPTH_TOL, Figure
from cellplan.session.motion import LiveMotion

OTHER_BRANCH: Final = np.radians(90.0)  # [rad] of a joint at the start beside that of the layout that is held to
ROUNDING: Final = 1e-7  # [rad] beyond a bound that is stated in whole degrees
MOVES: Final = 1e-9  # [m/s] of a tool along its path: below it there is no direction of travel


def seam_figures(block: Block, motion: LiveMotion) -> Iterator[Figure]:
    """Positions and push angles of all processes, and the arm that is nearest to a singular configuration."""
    placed = block.variables.placed(motion.x)
    for scheduled in block.schedule.tasks:
        task = scheduled.task
        if task.process or task.weld_position or task.torch:
            yield from _of_weld(placed, scheduled, block.schedule.times, motion)
    if block.problem is not None and motion.is_followed and not motion.is_planned:
        arms = block.problem.arms(motion.point())
        shares = arms.values / np.maximum(_usual(block.problem.job), np.finfo(float).tiny)
        if shares.size:
            node, arm = np.unravel_index(int(shares.argmin()), shares.shape)
            yield Figure(
                name="singular",
                value=100.0 * float(shares[node, arm]),
                unit="%",
                limit=None,
                is_met=True,
                binds=arms.names[arm],
                at=float(motion.times[node]),
            )


def branch_figures(block: Block, motion: LiveMotion) -> Iterator[Figure]:
    """Of each robot the joint that begins on another branch or turn than in the layout that is held to, if one does."""
    change = np.where(block.cell.joint_limits.is_revolute, motion.q[0] - block.start, 0.0)
    for robot in block.cell.robots:
        columns = block.cell.columns(robot.name)
        joint = columns.start + int(np.argmax(np.abs(change[columns])))
        if abs(change[joint]) > OTHER_BRANCH:
            value, binds = DEG * float(change[joint]), "/".join(joint_at(block.cell, joint))
            yield Figure(name="branch", value=value, unit="deg", limit=None, is_met=True, binds=binds, at=0.0)


def depth_figures(block: Block, report: Report | None) -> Iterator[Figure]:
    """The tool that is deepest in the part for its limit, as it is judged at rest.

    Args:
        report: Of the block; None while things move.
    """
    if report is None:
        if any(scheduled.task.relative_to is Frame.PART for scheduled in block.schedule.tasks):
            binds = "judged at rest"
            yield Figure(name="tool depth", value=None, unit="mm", limit=None, is_met=True, binds=binds)
    elif report.depths:
        deepest = max(report.depths, key=lambda it: it.depth - it.limit)
        yield Figure(
            name="tool depth",
            value=MM * deepest.depth,
            unit="mm",
            limit=MM * deepest.limit,
            is_met=deepest.depth <= deepest.limit + DEPTH_TOL,
            binds=deepest.task,
            at=deepest.at_s,
        )


def _of_weld(placed: Cell, scheduled: TaskSchedule, times: Array, motion: LiveMotion) -> Iterator[Figure]:
    """The rotation of a weld with all positions that it passes, push or drag, and what else the task demands."""
    task, rows = scheduled.task, np.minimum(np.searchsorted(times, motion.times), len(times) - 1)
    torch, weld = task.torch, task.weld_position
    speeds = np.linalg.norm(scheduled.V_PT_P[rows, :3], axis=1)
    spans = scheduled.process_on if torch is None and weld is None else ()
    is_on = np.any(
        [(motion.times > begin) & (motion.times < end) for begin, end in spans or ((scheduled.begin, scheduled.end),)],
        axis=0,
    )
    at = np.flatnonzero((speeds > MOVES) & is_on)
    if not len(at):
        return
    names = {task.robot, *placed.positioners[:1]}
    chains = {name: ScrewChain(placed.robot(name)) for name in names}
    q = {name: motion.q[at, placed.columns(name)] for name in names}
    X_WT, travel = chains[task.robot].tool_poses(q[task.robot]), scheduled.V_PT_P[rows[at], :3] / speeds[at, None]
    if task.relative_to is Frame.PART:
        travel = (part_poses(placed, chains, q)[:, :3, :3] @ travel[:, :, None])[..., 0]
    slope, rotation = weld_angles(X_WT, travel)
    positions = sorted({position_name(*angles) for angles in zip(slope.tolist(), rotation.tolist(), strict=True)})
    push, on = np.arcsin(np.clip((X_WT[:, :3, 2] * travel).sum(axis=1), -1.0, 1.0)), motion.times[at]
    binds = f"{task.name}: {', '.join(positions)}"
    yield _of_angles("weld rotation", rotation, None if weld is None else weld.rotation, binds, on)
    if weld is not None:
        yield _of_angles("weld slope", slope, weld.slope, task.name, on)
    if torch is not None:
        yield _of_angles("torch", torch_angles(X_WT), (-np.inf, torch.within_deg.si), task.name, on)
    yield _of_angles("push", push, None, task.name, on)


def _of_angles(name: str, angles: Array, bounds: tuple[float, float] | None, binds: str, times: Array) -> Figure:
    """The angle in [rad] that comes nearest to its bounds or is farthest beyond them, else the largest one."""
    low, high = bounds or (-np.inf, np.inf)
    worst = int(np.argmax(np.abs(angles) if bounds is None else np.maximum(low - angles, angles - high)))
    value, at = float(angles[worst]), float(times[worst])
    limit = None if bounds is None else DEG * (high if value - high >= low - value else low)
    is_met = low - ROUNDING <= value <= high + ROUNDING
    return Figure(name=name, value=DEG * value, unit="deg", limit=limit, is_met=is_met, binds=binds, at=at)


@lru_cache(maxsize=32)
def _usual(job: Job) -> Array:
    """What is usual of the singular values of the arms."""
    return usual_values(job)
