"""Arms from Denavit-Hartenberg parameters and schedules of points or poses, for tests of the searches.

The arms are those of the published examples; the part is fixed at the world's origin, so P is the robot's base.
"""

from dataclasses import replace

import numpy as np

from builders.random_cells import make_task
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose_from, rotation_about, rotation_vector
from cellplan.model.cell.cell import Cell, Mode, MotionSettings, Part, Robot, Tool
from cellplan.model.motion.motion import Motion, Schedule, TaskSchedule
from cellplan.model.origin import Origin
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.solver import SearchEntry, SolverEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain

ANTHROPOMORPHIC = [(0.0, np.pi / 2, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]  # a, alpha, d: table 4.1
FOUR_LINKS = [(0.2, 0.0, 0.0)] * 4  # section 4.2
PUMA = [  # table 4.2
    (0.0, -np.pi / 2, 0.0),
    (0.4318, 0.0, 0.0),
    (0.0203, -np.pi / 2, 0.1254),
    (0.0, np.pi / 2, 0.4318),
    (0.0, -np.pi / 2, 0.0),
    (0.0, 0.0, 0.0),
]
WHOLE_TURN = 2 * np.pi


def dh_arm(
    rows: list[tuple[float, float, float]], *, limits: dict[int, tuple[float, float]] | None = None, slides=()
) -> RobotModel:
    """A chain of standard Denavit-Hartenberg rows a, alpha, d; every joint reads zero where theta does."""
    X = np.eye(4)
    joints = []
    for i, (a, alpha, d) in enumerate(rows):
        lower, upper = (limits or {}).get(i, (-2 * WHOLE_TURN, 2 * WHOLE_TURN))
        joints.append(
            Joint(
                name=f"j{i + 1}",
                kind=JointKind.PRISMATIC if i in slides else JointKind.REVOLUTE,
                parent=i - 1 if i else BASE,
                axis_B=X[:3, 2].copy(),
                point_B=X[:3, 3].copy(),
                lower=lower,
                upper=upper,
                velocity=1e3,
            )
        )
        link = np.eye(4)
        link[:3, :3] = rotation_about(np.array([1.0, 0.0, 0.0]), alpha)
        link[:3, 3] = [a, 0.0, d]
        X = X @ link
    return RobotModel(name="arm", source="DH", joints=tuple(joints), flange_link=len(rows) - 1, X_BF=X, bodies=())


def arm_cell(model: RobotModel, *, method: str, axes=(0, 1, 2), **search) -> Cell:
    """One arm, one task, a part fixed at the world's origin."""
    robot = Robot(
        name="arm",
        model=model,
        X_WB=np.eye(4),
        tool=Tool(X_FT=np.eye(4), bodies=()),
        start=None,
        weights=np.ones(len(model.joints)),
    )
    solver = SolverEntry(integrator="euler", method=method, gain_per_s=100.0, search=SearchEntry(**search))
    return Cell(
        name="arm",
        robots=(robot,),
        part=Part(shape=Sphere(0.01), X_PS=np.eye(4), held_by=(), X_WP=np.eye(4)),
        tasks=(make_task("arm", axes=tuple(axes)),),
        obstacles=(),
        motion=MotionSettings(mode=Mode.SIMULTANEOUS, duration=1.0, step=1e-2),
        solver=solver,
        checks=ChecksEntry(),
        origin=Origin(),
        inputs={},
    )


def with_weights(cell: Cell, weights) -> Cell:
    return replace(cell, robots=(replace(cell.robots[0], weights=np.array(weights, dtype=float)),))


def with_velocity(model: RobotModel, index: int, velocity: float) -> RobotModel:
    joints = list(model.joints)
    joints[index] = replace(joints[index], velocity=velocity)
    return replace(model, joints=tuple(joints))


def schedule_of(cell: Cell, times: Array, X_PT: Array) -> Schedule:
    """Reference poses on a clock; the searches need no twists."""
    task = TaskSchedule(
        task=cell.tasks[0],
        X_PT=X_PT,
        V_PT_P=np.zeros((len(times), 6)),
        travelled=times,
        length=1.0,
        end=float(times[-1]),
    )
    return Schedule(times=times, tasks=(task,))


def points_schedule(cell: Cell, times: Array, points: Array) -> Schedule:
    return schedule_of(cell, times, pose_from(np.eye(3), points))


def quintic(times: Array) -> Array:
    """From 0 to 1 at rest at both ends."""
    s = times / times[-1]
    return s**3 * (10 - 15 * s + 6 * s**2)


def followed(cell: Cell, schedule: Schedule, start) -> Motion:
    return integrate_schedule(
        MotionTask(cell, schedule, [robot.name for robot in cell.robots], np.array(start, dtype=float))
    )


def tool_poses(cell: Cell, q: Array) -> Array:
    return ScrewChain(cell.robots[0]).tool_poses(q)


def position_errors(cell: Cell, schedule: Schedule, motion: Motion) -> Array:
    """Distances of the tool from its desired place on the axes that count, without the start."""
    axes = [axis for axis in cell.tasks[0].axes if axis < 3]
    actual = tool_poses(cell, motion.q)[:, :3, 3]
    return np.linalg.norm((schedule.tasks[0].X_PT[:, :3, 3] - actual)[1:, axes], axis=1)


def turn_errors(cell: Cell, schedule: Schedule, motion: Motion) -> Array:
    actual = tool_poses(cell, motion.q)[:, :3, :3]
    E = schedule.tasks[0].X_PT[:, :3, :3] @ np.swapaxes(actual, 1, 2)
    return np.linalg.norm(rotation_vector(E)[1:], axis=1)
