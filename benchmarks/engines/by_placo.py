"""PlaCo: one pinocchio model of all arms and one relative frame task per tool; its own solver in C++."""

from collections.abc import Callable

import numpy as np
import placo
from job import Array, Job

from engines.urdf import PART, joint_names, tool_name, write_urdf

DAMPING = 1e-9  # [-] weight of short steps beside the tasks: picks the shortest step among those that do them


def prepare(job: Job) -> Callable[[], Array]:
    """Build the model and the targets; a run takes one step of the solver per instant."""
    robot = placo.RobotWrapper(write_urdf(job), placo.Flags.ignore_collisions)
    columns = np.array([robot.get_joint_offset(name) for name in joint_names(job)])
    start = robot.state.q.copy()  # begins with the pose of a free base, which stays where it is
    start[columns] = job.start
    desired = [[np.asfortranarray(X_PT) for X_PT in at_instant] for at_instant in job.X_PT]

    def run() -> Array:
        robot.state.q = start
        robot.update_kinematics()
        solver = placo.KinematicsSolver(robot)
        solver.mask_fbase(True)
        solver.enable_joint_limits(False)
        solver.enable_velocity_limits(False)
        solver.add_regularization_task(DAMPING)
        tasks = [solver.add_relative_frame_task(PART, tool_name(arm), np.eye(4)) for arm in job.operators]
        for arm, task in zip(job.operators, tasks, strict=True):
            task.configure(tool_name(arm), "soft", 1.0, 1.0)
        q = np.empty((len(job.times), len(columns)))
        q[0] = job.start
        for k in range(1, len(q)):
            for task, X_PT in zip(tasks, desired[k], strict=True):
                task.T_a_b = X_PT
            solver.solve(True)
            robot.update_kinematics()
            q[k] = robot.state.q[columns]
        return q

    return run
