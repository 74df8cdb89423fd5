"""Robotics Toolbox for Python: kinematics and Jacobian of each arm; the relative tasks are put together in NumPy."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import roboticstoolbox as rtb
from job import Arm, Array, Job
from spatialmath import SE3

from engines.urdf import at


def prepare(job: Job) -> Callable[[], Array]:
    """Build the chains; a run takes one step to each instant, the shortest that does the tasks to first order."""
    X_BT = [arm.X_BT for arm in job.arms]
    X_BT[job.holder] = X_BT[job.holder] @ job.X_HP
    chains = [_chain(arm, X) for arm, X in zip(job.arms, X_BT, strict=True)]
    edges = np.cumsum([0, *(chain.n for chain in chains)])
    columns = [slice(a, b) for a, b in pairwise(edges)]

    def run() -> Array:
        q = np.empty((len(job.times), edges[-1]))
        q[0] = job.start
        J = np.zeros((6 * len(job.operators), edges[-1]))
        error = np.empty(6 * len(job.operators))
        for k in range(1, len(q)):
            here = q[k - 1]
            X_WP, J_P = _state(chains[job.holder], here[columns[job.holder]])
            for task, arm in enumerate(job.operators):
                rows = slice(6 * task, 6 * task + 6)
                X_WT, J_T = _state(chains[arm], here[columns[arm]])
                X_desired = X_WP @ job.X_PT[k, task]
                J[rows, columns[arm]] = J_T
                J[rows, columns[job.holder]] = -_moved(J_P, X_WT[:3, 3] - X_WP[:3, 3])
                error[rows] = _error(X_desired, X_WT)
            q[k] = here + J.T @ np.linalg.solve(J @ J.T, error)
        return q

    return run


def _chain(arm: Arm, X_BT: Array) -> rtb.ETS:
    """Elementary transforms of one arm: to each joint's frame, turned so that the axis is z, and back."""
    parts = [rtb.ET.SE3(SE3(arm.X_WB, check=False))]
    place = np.zeros(3)
    for point, axis in zip(arm.points_B, arm.axes_B, strict=True):
        R = np.eye(4)
        R[:3, :3] = _onto_z(axis)
        back = R.T
        parts += [rtb.ET.SE3(SE3(at(point - place) @ R, check=False)), rtb.ET.Rz(), rtb.ET.SE3(SE3(back, check=False))]
        place = point
    parts.append(rtb.ET.SE3(SE3(at(-place) @ X_BT, check=False)))
    return rtb.ETS(parts).compile()


def _onto_z(axis: Array) -> Array:
    """A rotation whose third column is the axis, shape (3, 3)."""
    across = np.eye(3)[np.argmin(np.abs(axis))]
    x = np.cross(across, axis)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(axis, x), axis])


def _state(chain: rtb.ETS, q: Array) -> tuple[Array, Array]:
    """Tip of a chain, shape (4, 4), and its Jacobian in the world, linear part first, shape (6, n)."""
    return chain.eval(q), chain.jacob0(q)


def _moved(J: Array, lever: Array) -> Array:
    """The Jacobian of a point that is carried along a lever away, shape (6, n)."""
    moved = J.copy()
    x, y, z = lever
    moved[:3] -= np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ J[3:]
    return moved


def _error(X_desired: Array, X: Array) -> Array:
    """Place and small rotation from a pose to the desired one, in the world, shape (6,)."""
    error = np.empty(6)
    error[:3] = X_desired[:3, 3] - X[:3, 3]
    R = X_desired[:3, :3] @ X[:3, :3].T
    error[3:] = 0.5 * (R[2, 1] - R[1, 2]), 0.5 * (R[0, 2] - R[2, 0]), 0.5 * (R[1, 0] - R[0, 1])
    return error
