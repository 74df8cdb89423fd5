"""Small cells made by hand, for tests of scenes and clearance."""

from dataclasses import replace

import numpy as np

from cellplan.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Shape, Solid, Sphere
from cellplan.geometry.transforms import Array, pose, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell, Grasp, Mode, MotionSettings, Obstacle, Part, Robot, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.origin import Origin
from cellplan.model.robot.robot import Body, Joint, JointKind, RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.task.task import CirclePath, PlaneName, Task, TimeLaw, TimeLawKind
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

QUARTER = 0.5 * np.pi


def random_pose(rng: np.random.Generator, *, reach: float) -> Array:
    """A pose with any rotation and a position within a cube."""
    return pose_from(rotation_exp(rng.normal(size=3) * 2.0), rng.uniform(-reach, reach, 3))


def joint(name: str, parent: int, *, axis=(0.0, 0.0, 1.0), point=(0.0, 0.0, 0.0), slides: bool = False) -> Joint:
    return Joint(
        name=name,
        kind=JointKind.PRISMATIC if slides else JointKind.REVOLUTE,
        parent=parent,
        axis_B=np.array(axis, dtype=float),
        point_B=np.array(point, dtype=float),
        lower=-3.0,
        upper=3.0,
        velocity=5.0,
    )


def body(name: str, link: int, *, shape: Solid, at=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)) -> Body:
    return Body(name=name, link=link, shape=shape, X_BS=pose(at, rpy))


def arm_model() -> RobotModel:
    """An elbow arm with six joints and slender links: 1.4 m reach, hand along x at the reference configuration."""
    z, y, x = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
    joints = (
        joint("a1", -1, axis=z),
        joint("a2", 0, axis=y, point=(0.0, 0.0, 0.4)),
        joint("a3", 1, axis=y, point=(0.0, 0.0, 1.0)),
        joint("a4", 2, axis=x, point=(0.3, 0.0, 1.0)),
        joint("a5", 3, axis=y, point=(0.6, 0.0, 1.0)),
        joint("a6", 4, axis=x, point=(0.7, 0.0, 1.0)),
    )
    bodies = (
        body("foot", -1, shape=Cylinder(0.15, 0.2), at=(0.0, 0.0, 0.1)),
        body("column", 0, shape=Box((0.2, 0.2, 0.15)), at=(0.0, 0.0, 0.3)),
        body("upper_arm", 1, shape=Capsule(0.06, 0.4), at=(0.0, 0.0, 0.7)),
        body("forearm", 2, shape=Capsule(0.05, 0.2), at=(0.18, 0.0, 1.0), rpy=(0.0, QUARTER, 0.0)),
        body("tube", 3, shape=Cylinder(0.04, 0.2), at=(0.42, 0.0, 1.0), rpy=(0.0, QUARTER, 0.0)),
        body("wrist", 4, shape=Sphere(0.045), at=(0.6, 0.0, 1.0)),
        body("hand", 5, shape=Cylinder(0.03, 0.04), at=(0.68, 0.0, 1.0), rpy=(0.0, QUARTER, 0.0)),
    )
    X_BF = pose((0.7, 0.0, 1.0), (0.0, QUARTER, 0.0))
    return RobotModel(name="elbow", source="test", joints=joints, flange_link=5, X_BF=X_BF, bodies=bodies)


def slide_model(shape: Solid, *, axis=(1.0, 0.0, 0.0)) -> RobotModel:
    """One body on one sliding joint; flange at its middle, z along the world's."""
    return RobotModel(
        name="slide",
        source="test",
        joints=(joint("s", -1, axis=axis, slides=True),),
        flange_link=0,
        X_BF=np.eye(4),
        bodies=(body("block", 0, shape=shape),),
    )


def stick(length: float = 0.1, radius: float = 0.01) -> Tool:
    """A straight tool that ends at its tip."""
    shaft = Body(name="tool", link=0, shape=Cylinder(radius, length), X_BS=pose((0.0, 0.0, 0.5 * length)))
    return Tool(X_FT=pose((0.0, 0.0, length)), bodies=(shaft,))


def no_tool() -> Tool:
    return Tool(X_FT=np.eye(4), bodies=())


def placed(name: str, model: RobotModel, *, base: Array | None = None, tool: Tool | None = None) -> Robot:
    return Robot(
        name=name,
        model=model,
        X_WB=np.eye(4) if base is None else base,
        tool=tool or no_tool(),
        start=None,
        weights=np.ones(len(model.joints)),
    )


def fixed_part(shape: Solid, X_WP: Array) -> Part:
    return Part(shape=shape, X_PS=np.eye(4), held_by=(), X_WP=X_WP)


def held_part(shape: Solid, robot: str, X_PT: Array) -> Part:
    return Part(shape=shape, X_PS=np.eye(4), held_by=(Grasp(robot=robot, X_PT=X_PT),), X_WP=None)


def thing(name: str, shape: Shape, X_WS: Array | None = None) -> Obstacle:
    return Obstacle(name=name, shape=shape, X_WS=np.eye(4) if X_WS is None else X_WS)


def floor() -> Obstacle:
    return thing("floor", HalfSpace())


def work(robot: str) -> Task:
    """A task, of which only the robot matters here."""
    return Task(
        name=f"work_of_{robot}",
        robot=robot,
        path=CirclePath(plane=PlaneName.XY, center=(0.0, 0.0), radius=0.1),
        project=None,
        plane_offset=0.0,
        tool_axis=None,
        tool_x=np.array([1.0, 0.0, 0.0]),
        turn=0.0,
        axes=tuple(range(6)),
        is_spin_free=False,
        tolerance=ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1e-4)),
        start=0.0,
        duration=1.0,
        feed=None,
        time_law=TimeLaw(kind=TimeLawKind.QUINTIC),
        blend=None,
    )


def make_cell(*robots: Robot, part: Part | None = None, things=(), tasks=(), checks: ChecksEntry | None = None) -> Cell:
    """A cell; without a part of its own a small one lies far away."""
    return Cell(
        name="test",
        robots=robots,
        part=part or fixed_part(Sphere(0.01), pose((0.0, 0.0, 50.0))),
        tasks=tuple(tasks),
        obstacles=tuple(things),
        motion=MotionSettings(mode=Mode.SIMULTANEOUS, duration=1.0, step=0.001),
        solver=SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=500.0),
        checks=checks or ChecksEntry(),
        origin=Origin(),
        inputs={},
    )


def schedule(samples: int, *tasks: Task, duration: float = 1.0) -> Schedule:
    """A clock on which the tools of some tasks stand still."""
    times = np.linspace(0.0, duration, samples)
    still = np.broadcast_to(np.eye(4), (samples, 4, 4))
    return Schedule(
        times=times,
        tasks=tuple(
            TaskSchedule(
                task=task,
                X_PT=still,
                V_PT_P=np.zeros((samples, 6)),
                travelled=np.zeros(samples),
                length=1.0,
                end=duration,
            )
            for task in tasks
        ),
    )


def displaced(cell: Cell, X: Array) -> Cell:
    """The whole cell at another place in the world."""
    part = cell.part if cell.part.X_WP is None else replace(cell.part, X_WP=X @ cell.part.X_WP)
    return replace(
        cell,
        robots=tuple(replace(robot, X_WB=X @ robot.X_WB) for robot in cell.robots),
        part=part,
        obstacles=tuple(replace(obstacle, X_WS=X @ obstacle.X_WS) for obstacle in cell.obstacles),
    )


def demanding(scene: Scene, demand: float) -> Scene:
    """The scene in which pairs with the rule ``clearance`` are to keep a distance in [m]."""
    pairs = (replace(pair, demand=demand) if pair.rule is Rule.CLEARANCE else pair for pair in scene.pairs)
    return replace(scene, pairs=tuple(pairs))
