"""Seams of a live motion: position of the weld, push of the torch, and how far arms are from singular."""

from collections.abc import Iterator
from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.tool_errors import part_poses
from cellplan.measures.weld_position import position_name, weld_angles
from cellplan.model.cell.cell import Cell, joint_at
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.task.task import Frame
from cellplan.model.units import DEG
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.kernel.job import Job
from cellplan.search.kernel.singular_values import usual_values
from cellplan.session.blocks import Block
from cellplan.session.figures import Figure
from cellplan.session.motion import LiveMotion

OTHER_BRANCH: Final = np.radians(90.0)  # [rad] of a joint at the start beside that of the layout that is held to
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
    """The joint that begins on another branch or turn than in the layout that is held to, if one does."""
    change = motion.q[0] - block.start
    change[~block.cell.joint_limits.is_revolute] = 0.0
    joint = int(np.argmax(np.abs(change)))
    if abs(change[joint]) > OTHER_BRANCH:
        binds = "/".join(joint_at(block.cell, joint))
        value = DEG * float(change[joint])
        yield Figure(name="branch", value=value, unit="deg", limit=None, is_met=True, binds=binds, at=0.0)


def _of_weld(placed: Cell, scheduled: TaskSchedule, times: Array, motion: LiveMotion) -> Iterator[Figure]:
    """Where the rotation of a weld is largest, with all positions that it passes, and the largest push or drag."""
    task, rows = scheduled.task, np.minimum(np.searchsorted(times, motion.times), len(times) - 1)
    speeds = np.linalg.norm(scheduled.V_PT_P[rows, :3], axis=1)
    spans = scheduled.process_on or ((scheduled.begin, scheduled.end),)
    is_on = np.any([(motion.times > begin) & (motion.times < end) for begin, end in spans], axis=0)
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
    push = np.arcsin(np.clip((X_WT[:, :3, 2] * travel).sum(axis=1), -1.0, 1.0))
    for name, angles, words in (("weld rotation", rotation, f": {', '.join(positions)}"), ("push", push, "")):
        worst = int(np.argmax(np.abs(angles)))
        yield Figure(
            name=name,
            value=DEG * float(angles[worst]),
            unit="deg",
            limit=None,
            is_met=True,
            binds=f"{task.name}{words}",
            at=float(motion.times[at[worst]]),
        )


@lru_cache(maxsize=32)
def _usual(job: Job) -> Array:
    """What is usual of the singular values of the arms."""
    return usual_values(job)
