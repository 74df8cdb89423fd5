"""Motions that are known at samples only, brought onto their tasks at each of these, all at once."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.collocation.batch_targets import sampled
from cellplan.planning.collocation.batch_tasks import BatchTasks
from cellplan.planning.collocation.solver import largest
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.batched import CACHE_BLOCK

STEPS: Final = 2  # of Newton's method: from a thousandth of a millimetre the first one goes nearly all the way
SMALL: Final = 1e-3  # [rad] and [m] of such a step: a larger one is no correction any more


def brought_onto_tasks(motion: MotionTask, q: Array) -> Array:
    """Configurations near given ones, shape (N, nq), with the tools on their tasks at every sample of the clock.

    Newton's method with the weighted pseudo-inverse moves the joints as little as it can. Where that is no small
    correction, as at a singularity or out of reach, or brings nothing, the configuration stays as it is. Joints that
    fail on the way (``motion.locked_joints``) leave everything as it is.

    Args:
        q: Configurations at the samples of the clock, shape (N, nq).
    """
    cell, schedule, grasps = motion.cell, motion.schedule, motion.grasps
    if cell.motion.locked:
        return q
    tasks = BatchTasks(cell, motion.relations, motion.moving)
    placement, everything = tasks.chains.placement(cell), np.ones(cell.joint_count)
    brought = q.copy()
    for first in range(0, len(q), CACHE_BLOCK):
        some = slice(first, first + CACHE_BLOCK)
        desired, at = sampled(schedule, some, grasps), q[some].T
        still, before = np.zeros_like(at), largest(tasks.errors(at, desired[0], placement))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):  # what is not a number is left out below
            for _ in range(STEPS):
                at = at + tasks.linearise(at, desired, placement, mobile=everything).correction(still)
            is_better = largest(tasks.errors(at, desired[0], placement)) < before
        is_better &= np.abs(at - q[some].T).max(axis=0) <= SMALL
        brought[some][is_better] = at.T[is_better]
    return brought
