"""A planar arm with more joints than its task needs: four links of 0.2 m, and a circle of 0.15 m in 1 s for its tip."""

from dataclasses import replace

import numpy as np

from builders.random_cells import make_task, random_cell
from cellplan.geometry.transforms import Array, pose_from
from cellplan.model.cell.cell import Cell, Robot, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel

START = np.array([np.pi / 4, np.pi / 6, np.pi / 2, np.pi / 4])  # [Nicolato2007]_ section 4.2
LINK, RADIUS = 0.2, 0.15  # [m]


def planar_arm_cell(*, method: str = "quadratic_program", limits: dict[str, dict[str, float]] | None = None) -> Cell:
    """The arm alone with its circle; ``limits`` changes joints (``q1`` .. ``q4``) by name."""
    joints = tuple(
        Joint(
            name=f"q{i + 1}",
            kind=JointKind.REVOLUTE,
            parent=i - 1 if i else BASE,
            axis_B=np.array([0.0, 0.0, 1.0]),
            point_B=np.array([LINK * i, 0.0, 0.0]),
            lower=-np.pi,
            upper=np.pi,
            velocity=20.0,
        )
        for i in range(4)
    )
    joints = tuple(replace(joint, **(limits or {}).get(joint.name, {})) for joint in joints)
    X_BF = pose_from(np.eye(3), np.array([4 * LINK, 0.0, 0.0]))
    model = RobotModel(name="4r", source="test", joints=joints, flange_link=3, X_BF=X_BF, bodies=())
    tool = Tool(X_FT=np.eye(4), bodies=())
    arm = Robot(name="arm", model=model, X_WB=np.eye(4), tool=tool, start=START, weights=np.ones(4))
    cell = random_cell(0, operators=1, held=False)
    return replace(
        cell,
        robots=(arm,),
        part=replace(cell.part, X_WP=np.eye(4)),
        tasks=(make_task("arm", axes=(0, 1)),),
        solver=cell.solver.changed(method=method, gain_per_s=500.0),
    )


def tips(q: Array) -> Array:
    """Where the tip is, shape (N, 2), in closed form."""
    angles = np.cumsum(q, axis=1)
    return LINK * np.stack([np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)], axis=1)


def circle_schedule(cell: Cell, *, duration: float = 1.0, steps: int = 1000, smooth: bool = False) -> Schedule:
    """Once round a circle that begins at the start posture; ``smooth`` starts and ends at rest."""
    times = np.linspace(0.0, duration, steps + 1)
    tau = times / duration
    share = 10 * tau**3 - 15 * tau**4 + 6 * tau**5 if smooth else tau
    rate = (30 * tau**2 - 60 * tau**3 + 30 * tau**4 if smooth else np.ones_like(tau)) / duration
    phase = 2 * np.pi * share
    p, V = np.zeros((len(times), 3)), np.zeros((len(times), 6))
    p[:, :2] = tips(START[None]) + RADIUS * np.stack([np.cos(phase) - 1.0, np.sin(phase)], axis=1)
    V[:, :2] = 2 * np.pi * RADIUS * rate[:, None] * np.stack([-np.sin(phase), np.cos(phase)], axis=1)
    X = np.tile(np.eye(4), (len(times), 1, 1))
    X[:, :3, 3] = p
    scheduled = TaskSchedule(
        task=cell.tasks[0], X_PT=X, V_PT_P=V, travelled=times, length=2 * np.pi * RADIUS, end=duration
    )
    return Schedule(times=times, tasks=(scheduled,))


def largest_error(schedule: Schedule, q: Array) -> float:
    """Largest distance of the tip from its path in [m]."""
    return float(np.linalg.norm(tips(q) - schedule.tasks[0].X_PT[:, :2, 3], axis=1).max())
