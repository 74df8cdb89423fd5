"""Singularity: which robot is nearest to a singular configuration where a motion cannot be continued."""

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.motion import NearestSingular
from cellplan.planning.tracking.problem import TrackingProblem


def nearest_to_singular(problem: TrackingProblem, k: int, q: Array) -> NearestSingular | None:
    """The robot whose own Jacobian, with the rows that its task or grasp constrains, is nearest to losing rank.

    Joints that move nothing are left out; so are robots that cannot move. Units are mixed: metres and radians.

    Args:
        q: Stacked configuration, shape (nq,), in [rad] or [m].

    Returns:
        The robot with the smallest singular value; None where nothing moves or a joint position is no number.
    """
    if not np.all(np.isfinite(q)):
        return None
    blocks = problem.rows(k, q)
    stack = _smallest(np.concatenate(blocks))
    candidates: list[NearestSingular] = []
    for task, block in zip(problem.tasks, blocks, strict=True):
        smallest = _smallest(block[:, problem.cell.columns(task.robot)])
        if smallest is not None and stack is not None:
            candidates.append(NearestSingular(robot=task.robot, task=task.name, smallest=smallest, stack=stack))
    return min(candidates, key=lambda candidate: candidate.smallest, default=None)


def singular_words(problem: TrackingProblem, k: int, q: Array) -> str:
    """What to add to a finding about a motion that cannot be continued; nothing where there is nothing to say."""
    nearest = nearest_to_singular(problem, k, q)
    return "" if nearest is None else f"; {nearest.words}"


def _smallest(J: Array) -> float | None:
    """Smallest singular value over the joints that move anything; None where none does."""
    J = J[:, np.any(J != 0.0, axis=0)]
    return float(np.linalg.svd(J, compute_uv=False)[-1]) if J.size else None
