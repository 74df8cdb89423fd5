"""Start postures of many cells brought to the starts of their paths."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.task.task import Frame
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired
from cellplan.scene.kinematics.batched import Placement

NEWTON_STEPS: Final = 20  # to bring the tools to the starts of their paths; about six where they come there
LARGEST_STEP: Final = 0.5  # [rad] or [m] of one of them
QUIET: Final = 1e-3  # of the accuracy: a Newton step below this share in [rad] or [m] changes nothing any more


def settling_joints(cell: Cell, tasks: Sequence[Relation]) -> Array:
    """1 for joints that may move to bring the tools to their paths, 0 for the others, shape (nq,).

    Where all tasks are on the part its positioner keeps the configuration that was chosen for it.
    """
    at_rest = cell.positioners[:1] if all(task.relative_to is Frame.PART for task in tasks) else ()
    return np.concatenate([np.full(len(r.model.joints), float(r.name not in at_rest)) for r in cell.robots])


def settled(
    tasks: BatchTasks, desired: Desired, placement: Placement, start: Array, *, mobile: Array, accuracy: float
) -> tuple[Array, Flags]:
    """Start postures with the tools brought to their paths, by Newton's method.

    Args:
        start: Start postures near them in [rad] or [m], shape (nq, cells).
        mobile: See ``settling_joints``.
        accuracy: Tool error in [m] and [rad] up to which a tool counts as on its path.

    Returns:
        Start postures, shape (nq, cells), and which of them came to the paths, shape (cells,).
    """
    q, still = start.copy(), np.zeros_like(start)
    for _ in range(NEWTON_STEPS):
        step = tasks.linearise(q, desired, placement, mobile=mobile).correction(still)
        longest = np.abs(step).max(axis=0)
        if not np.any(longest > QUIET * accuracy):
            break
        q = q + step * np.minimum(1.0, LARGEST_STEP / np.maximum(longest, LARGEST_STEP))
    return q, np.abs(tasks.errors(q, desired[0], placement)).max(axis=(0, 1)) <= accuracy
