"""Starts of motions: the tools of many cells brought to their paths, or coming to them smoothly from beside them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.transforms import rotation_exp
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.task.task import Frame
from cellplan.model.task.time_law import REST_TO_REST, advance
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired
from cellplan.scene.kinematics.batched import Placement

NEWTON_STEPS: Final = 20  # to bring the tools to the starts of their paths; about six where they come there
LARGEST_STEP: Final = 0.5  # [rad] or [m] of one of them
SETTLED_SHARE: Final = 1e-3  # of the accuracy: a Newton step below this share in [rad] or [m] changes nothing any more
QUIET: Final = 0.1  # share of the accuracy up to which a start counts as on its path
ROUNDS: Final = 8  # of projecting the offset through the components that a task keeps; the first is nearly right


@dataclass(frozen=True, slots=True, eq=False)
class StartOffset:
    r"""How far the tools stand from where they are desired at first, and when they have to be there.

    Targets are moved by ``v (1 - \sigma(t / T))`` with the quintic law ``\sigma``: from the tool's own pose to the
    path, from rest to rest.
    """

    linear: Array  # desired tip minus actual one in the frame of each task, in [m], shape (3, tasks)
    angular: Array  # rotation vector from the actual to the desired orientation, in [rad], shape (3, tasks)
    until: Array  # times in [s] from which on nothing is left of it, shape (tasks,)

    def applied(self, times: Array, X: Array, V: Array) -> Desired:
        """Targets moved so that they begin where the tools are.

        Args:
            times: Times in [s], shape (N,).
            X: Desired poses, shape (4, 4, tasks, N).
            V: Desired twists, shape (6, tasks, N).
        """
        law = advance(REST_TO_REST, np.clip(times / self.until[:, None], 0.0, 1.0))
        left, rate = 1.0 - law.share, law.rate / self.until[:, None]
        back = np.moveaxis(rotation_exp(-np.moveaxis(self.angular[:, :, None] * left, 0, -1)), (-2, -1), (0, 1))
        moved, turned = X.copy(), V.copy()
        turned[:3] += self.linear[:, :, None] * rate
        turned[3:] = np.einsum("ijtb,jtb->itb", back, V[3:]) + self.angular[:, :, None] * rate
        moved[:3, :3] = np.einsum("ijtb,jktb->iktb", back, X[:3, :3])
        moved[:3, 3] -= self.linear[:, :, None] * left
        return moved, turned


def start_offset(
    tasks: BatchTasks, desired: Desired, placement: Placement, *, start: Array, until: Array, accuracy: float
) -> StartOffset | None:
    """How far the tools stand beside their paths at the start; None when they stand on them.

    Args:
        desired: Desired poses and twists of the tools at first, a batch of one.
        start: Stacked start posture, shape (nq,).
        until: Times in [s] from which on they have to be there, shape (tasks,).
        accuracy: Largest tool error that is let pass, in [m] and [rad].
    """
    offset = StartOffset(np.zeros((3, len(until))), np.zeros((3, len(until))), until)
    at_start = np.zeros(1)
    for number in range(ROUNDS):
        X, _ = offset.applied(at_start, *desired)
        error = tasks.task_errors(start[:, None], X, placement)[:, :, 0]
        if np.max(np.abs(error), initial=0.0) <= QUIET * accuracy:
            return offset if number else None
        offset = StartOffset(offset.linear + error[:3], offset.angular + error[3:], until)
    return offset


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
        if not np.any(longest > SETTLED_SHARE * accuracy):
            break
        q = q + step * np.minimum(1.0, LARGEST_STEP / np.maximum(longest, LARGEST_STEP))
    return q, np.abs(tasks.errors(q, desired[0], placement)).max(axis=(0, 1)) <= accuracy
