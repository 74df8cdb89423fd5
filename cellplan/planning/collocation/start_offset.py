"""Start offset: tools that start beside their paths come to them smoothly, instead of by a jump."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, rotation_exp
from cellplan.model.task.time_law import REST_TO_REST, advance
from cellplan.planning.collocation.batch_tasks import BatchTasks, Desired
from cellplan.scene.kinematics.batched import Placement

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
