"""Random cells for tests of planning: any number of operators, revolute and prismatic joints, followers on the way."""

from dataclasses import replace

import numpy as np

from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell, Grasp, Mode, MotionSettings, Part, Robot, Tool
from cellplan.model.origin import Origin
from cellplan.model.robot.robot import BASE, FollowerJoint, Joint, JointKind, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.task.task import CirclePath, Frame, PlaneName, Task, TimeLaw, TimeLawKind


def random_pose(rng: np.random.Generator) -> Array:
    return pose_from(rotation_exp(rng.normal(size=3)), rng.normal(size=3))


def random_model(rng: np.random.Generator, joints: int, *, with_follower: bool = False) -> RobotModel:
    """An arm; with followers one of them carries the flange, or with an odd number of joints the last joint."""
    lever = joints + 1
    carries_joint = with_follower and joints % 2 == 1
    axes = [
        Joint(
            name=f"j{i}",
            kind=JointKind.PRISMATIC if i % 3 == 2 else JointKind.REVOLUTE,
            parent=lever if carries_joint and i == joints - 1 else i - 1 if i else BASE,
            axis_B=_unit(rng),
            point_B=rng.normal(size=3),
            lower=-3.0,
            upper=3.0,
            velocity=3.0,
        )
        for i in range(joints)
    ]
    followers = ()
    if with_follower:  # one lever beside the way to the flange, one on it; the second joint drives both
        followers = (
            FollowerJoint(
                name="side_lever",
                kind=JointKind.REVOLUTE,
                parent=1,
                axis_B=_unit(rng),
                point_B=rng.normal(size=3),
                leader=1,
                ratio=1.3,
                offset=-0.4,
            ),
            FollowerJoint(
                name="lever",
                kind=JointKind.REVOLUTE,
                parent=joints - 2 if carries_joint else joints - 1,
                axis_B=_unit(rng),
                point_B=rng.normal(size=3),
                leader=1,
                ratio=-0.7,
                offset=0.2,
            ),
        )
    return RobotModel(
        name="random",
        source="drawn",
        joints=tuple(axes),
        followers=followers,
        flange_link=lever if with_follower and not carries_joint else joints - 1,
        X_BF=random_pose(rng),
        bodies=(),
    )


def _unit(rng: np.random.Generator) -> Array:
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def make_task(robot: str, **changes: object) -> Task:
    task = Task(
        name=f"task_{robot}",
        robot=robot,
        path=CirclePath(plane=PlaneName.XY, center=(0.0, 0.0), radius=0.1),
        project=None,
        plane_offset=0.0,
        tool_axis=np.array([0.0, 0.0, -1.0]),
        tool_x=np.array([1.0, 0.0, 0.0]),
        turn=0.0,
        axes=(0, 1, 2, 3, 4, 5),
        is_spin_free=False,
        tolerance=ToleranceEntry(position_mm=0.1, orientation_deg=0.01),
        start=0.0,
        duration=1.0,
        feed=None,
        time_law=TimeLaw(kind=TimeLawKind.QUINTIC),
        blend=None,
    )
    return replace(task, **changes)  # type: ignore[arg-type]


def random_cell(
    seed: int, *, operators: int, held: bool = True, with_follower: bool = False, joints: int | None = None
) -> Cell:
    """A holder and operators with random axes, bases and tools; every third joint slides."""
    rng = np.random.default_rng(seed)
    names = ["holder", *(f"op{i}" for i in range(operators))]
    robots = tuple(
        Robot(
            name=name,
            model=random_model(rng, joints or int(rng.integers(5, 8)), with_follower=with_follower),
            X_WB=random_pose(rng),
            tool=Tool(X_FT=random_pose(rng), bodies=()),
            start=None,
            weights=np.ones(0),
        )
        for name in names
    )
    robots = tuple(replace(r, weights=rng.uniform(0.5, 2.0, len(r.model.joints))) for r in robots)
    grasp = Grasp(robot="holder", X_PT=random_pose(rng))
    part = Part(
        shape=Sphere(0.1),
        X_PS=np.eye(4),
        held_by=(grasp,) if held else (),
        X_WP=None if held else random_pose(rng),
    )
    return Cell(
        name="random",
        robots=robots,
        part=part,
        tasks=tuple(make_task(name) for name in names[1:]),
        obstacles=(),
        motion=MotionSettings(mode=Mode.SIMULTANEOUS, duration=1.0, step=1e-3),
        solver=SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=500.0),
        checks=ChecksEntry(),
        origin=Origin(),
        inputs={},
    )


def sharing(cell: Cell, holders: int, *, axes: tuple[int, ...] = (0, 1, 2, 3, 4, 5)) -> Cell:
    """The cell with its last operators as further holders of the part, at grasps drawn at random."""
    rng = np.random.default_rng(holders)
    names = [task.robot for task in cell.tasks[-holders:]]
    grasps = tuple(Grasp(robot=name, X_PT=random_pose(rng), axes=axes) for name in names)
    part = replace(cell.part, held_by=(*cell.part.held_by, *grasps))
    return replace(cell, part=part, tasks=cell.tasks[:-holders])


def carried(cell: Cell) -> Cell:
    """The cell with one more task, which says where the holder carries the part in the world."""
    return replace(cell, tasks=(*cell.tasks, make_task("holder", relative_to=Frame.WORLD)))


def moved(cell: Cell, X: Array) -> Cell:
    """The whole cell carried along by a rigid motion of the world."""
    part = cell.part if cell.part.X_WP is None else replace(cell.part, X_WP=X @ cell.part.X_WP)
    return replace(cell, robots=tuple(replace(robot, X_WB=X @ robot.X_WB) for robot in cell.robots), part=part)
