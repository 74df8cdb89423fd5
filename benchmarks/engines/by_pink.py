"""Pink: one pinocchio model of all arms and one relative frame task per tool, kept exactly; DAQP."""

from collections.abc import Callable

import numpy as np
import pink
import pinocchio as pin
from job import Array, Job

from engines.urdf import PART, joint_names, tool_name, urdf


def prepare(job: Job) -> Callable[[], Array]:
    """Build the model and the targets; a run takes one step of the solver per instant.

    Tasks as constraints beside an objective of unit damping ask for the shortest step that does them: faster here than
    tasks in the objective, and without their trace of damping. The desired step is taken whole, so the time is left
    out.
    """
    model = pin.buildModelFromXML(urdf(job))
    data = model.createData()
    columns = np.array([model.joints[model.getJointId(name)].idx_q for name in joint_names(job)])
    start = np.empty(model.nq)
    start[columns] = job.start
    desired = [[pin.SE3(X_PT) for X_PT in at_instant] for at_instant in job.X_PT]

    def run() -> Array:
        configuration = pink.Configuration(model, data, start)
        tasks = [pink.tasks.RelativeFrameTask(tool_name(arm), PART, 1.0, 1.0) for arm in job.operators]
        q = np.empty((len(job.times), model.nq))
        q[0] = start
        for k in range(1, len(q)):
            for task, X_PT in zip(tasks, desired[k], strict=True):
                task.set_target(X_PT)
            step = pink.solve_ik(
                configuration, (), 1.0, "daqp", damping=1.0, limits=(), constraints=tasks, safety_break=False
            )
            configuration.integrate_inplace(step, 1.0)
            q[k] = configuration.q
        return q[:, columns]

    return run
