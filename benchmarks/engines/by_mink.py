"""mink: one MuJoCo model of all arms and one relative frame task per tool, kept exactly; DAQP."""

from collections.abc import Callable, Iterator

import mink
import mujoco
import numpy as np
from job import Array, Job

from engines.urdf import PART, joint_frames, joint_name, joint_names, numbers, tool_frame, tool_name

INERTIAL = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'  # not used


def prepare(job: Job) -> Callable[[], Array]:
    """Build the model and the targets; a run takes one step of the solver per instant.

    Tasks as constraints beside an objective of unit damping ask for the shortest step that does them: no slower here
    than tasks in the objective, and without their trace of damping. The step is taken whole, so the time is left out.
    """
    model = mujoco.MjModel.from_xml_string(mjcf(job))
    columns = np.array([model.joint(name).qposadr[0] for name in joint_names(job)])
    start = np.empty(model.nq)
    start[columns] = job.start
    desired = [[mink.SE3.from_matrix(X_PT) for X_PT in at_instant] for at_instant in job.X_PT]

    def run() -> Array:
        configuration = mink.Configuration(model, start)
        tasks = [mink.RelativeFrameTask(tool_name(arm), "site", PART, "site", 1.0, 1.0) for arm in job.operators]
        q = np.empty((len(job.times), model.nq))
        q[0] = start
        for k in range(1, len(q)):
            for task, X_PT in zip(tasks, desired[k], strict=True):
                task.set_target(X_PT)
            step = mink.solve_ik(configuration, (), 1.0, "daqp", damping=1.0, limits=(), constraints=tasks)
            configuration.integrate_inplace(step, 1.0)
            q[k] = configuration.q
        return q[:, columns]

    return run


def mjcf(job: Job) -> str:
    """The job as a MuJoCo model; every body frame is parallel to its arm's base at the reference configuration."""
    arms = (line for index in range(len(job.arms)) for line in _arm(job, index))
    return "\n".join(['<mujoco><compiler angle="radian"/><worldbody>', *arms, "</worldbody></mujoco>"])


def _arm(job: Job, index: int) -> Iterator[str]:
    """Nested bodies of one arm, with sites at its tool tip and at the part it holds."""
    arm = job.arms[index]
    for joint, (axis, X) in enumerate(zip(arm.axes_B, joint_frames(arm), strict=True)):
        yield f'<body {_pose(X)}>{INERTIAL}<joint name="{joint_name(index, joint)}" axis="{numbers(axis)}"/>'
    yield f'<site name="{tool_name(index)}" {_pose(tool_frame(arm))}/>'
    if index == job.holder:
        yield f'<site name="{PART}" {_pose(tool_frame(arm) @ job.X_HP)}/>'
    yield "</body>" * len(arm.axes_B)


def _pose(X: Array) -> str:
    """A pose as MuJoCo writes it: place and quaternion."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, X[:3, :3].ravel())
    return f'pos="{numbers(X[:3, 3])}" quat="{numbers(quaternion)}"'
