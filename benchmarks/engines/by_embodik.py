"""EmbodiK: one pinocchio model of all arms and one relative frame task per tool; its own solver in C++."""

from collections.abc import Callable

import embodik
import numpy as np
from job import Array, Job

from engines.urdf import PART, joint_names, tool_name, write_urdf

SMALLEST = 1e-9  # [-] singular values below which the solver damps; none is near
DAMPING = 1e-12  # [-] of singular directions


def prepare(job: Job) -> Callable[[], Array]:
    """Build the model and the targets; a run takes one step of the solver per instant."""
    robot = embodik.RobotModel(write_urdf(job))
    columns = np.array([robot.get_joint_config_index(name) for name in joint_names(job)])
    start = np.empty(len(columns))
    start[columns] = job.start
    desired = [[(X[:3, 3].copy(), np.asfortranarray(X[:3, :3])) for X in at_instant] for at_instant in job.X_PT]

    def run() -> Array:
        solver = embodik.KinematicsSolver(robot)
        solver.set_tolerance(SMALLEST)
        solver.set_damping(DAMPING)
        tasks = [solver.add_relative_frame_task(tool_name(arm), PART, tool_name(arm)) for arm in job.operators]
        q = np.empty((len(job.times), len(columns)))
        q[0] = start
        for k in range(1, len(q)):
            for task, (place, R) in zip(tasks, desired[k], strict=True):
                task.set_target_pose(place, R)
            q[k] = q[k - 1] + solver.solve_velocity_dq(q[k - 1], False)  # a task weight of 1 takes the whole step
        return q[:, columns]

    return run
