"""Situations that break careless inverse kinematics: lost rank, goals out of reach, extreme settings, no joints."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from builders.random_cells import random_cell
from builders.search_arms import PUMA, arm_cell, dh_arm
from cellplan.geometry.transforms import Array, inverse, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.robot.robot import Joint
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.solver import SearchEntry
from cellplan.scene.kinematics.screw_chain import ScrewChain

STEPS = 20
STEP = 2e-3  # [s]
LINKS = (2.0, 1.0, 1.0)  # [m] of the planar arm in Vargas 2012
PLANAR = (0, 1, 5)
ROUNDS = 100  # of a search: goals out of reach use them up


@dataclass(frozen=True, kw_only=True)
class Situation:
    """A cell, what its tools are to do, where they start and who may move."""

    cell: Cell
    schedule: Schedule
    start: Array
    moving: Sequence[str]


def planar(
    start: Sequence[float],
    twist: Sequence[float],
    *,
    axes: Sequence[int] = (0, 1),
    links: Sequence[float] = LINKS,
    step: float = STEP,
    turn: float = 0.0,
    joint: Callable[[Joint], Joint] = lambda joint: joint,
    **solver: object,
) -> Situation:
    """A planar arm whose tip goes straight from its start, by ``twist`` in [m], and turns by ``turn``."""
    model = dh_arm([(length, 0.0, 0.0) for length in links])
    model = replace(model, joints=tuple(joint(entry) for entry in model.joints))
    cell = arm_cell(model, method="weighted_pseudo_inverse", axes=axes)
    return straight(cell, start, [*twist, 0.0, 0.0, turn], step=step, **solver)


def puma(
    start: Sequence[float], twist: Sequence[float], *, axes: Sequence[int] = range(6), **solver: object
) -> Situation:
    """An arm of six joints with a spherical wrist; ``twist``: displacement in [m] and rotation vector in [rad]."""
    cell = arm_cell(dh_arm(PUMA), method="weighted_pseudo_inverse", axes=tuple(axes))
    return straight(cell, start, twist, step=STEP, **solver)


def pair(*, joints: int = 6, moving: Sequence[str] = ("holder", "op0"), weights: object = None) -> Situation:
    """A robot that carries the part and one that works on it, with sliding joints and a linkage."""
    cell = random_cell(11, operators=1, joints=joints, with_follower=True)
    if weights is not None:
        cell = replace(cell, robots=tuple(replace(robot, weights=np.asarray(weights)) for robot in cell.robots))
    start = np.random.default_rng(4).uniform(-1.0, 1.0, cell.joint_count)
    return replace(straight(cell, start, [0.01, 0.005, 0.0, 0.0, 0.02, 0.0], step=STEP), moving=tuple(moving))


def straight(cell: Cell, start: Sequence[float], twist: Sequence[float], *, step: float, **solver: object) -> Situation:
    """All tools along the same screw in the part, from where they are at the start, at constant speed."""
    q = np.array(start, dtype=float)
    times = np.arange(STEPS + 1) * step
    share = times / times[-1]
    tasks = []
    for task in cell.tasks:
        X_0 = tool_on_part(cell, task.robot, q[None])[0]
        R = np.stack([rotation_exp(s * np.asarray(twist[3:])) for s in share]) @ X_0[:3, :3]
        tasks.append(
            TaskSchedule(
                task=task,
                X_PT=pose_from(R, X_0[:3, 3] + share[:, None] * np.asarray(twist[:3])),
                V_PT_P=np.tile(np.asarray(twist) / times[-1], (len(times), 1)),
                travelled=times,
                length=1.0,
                end=float(times[-1]),
            )
        )
    settings = cell.solver.changed(gain_per_s=0.5 / step, search=SearchEntry(rounds=ROUNDS))
    cell = replace(
        cell,
        solver=settings.changed(**solver),
        motion=replace(cell.motion, step=step, duration=float(times[-1])),
        robots=tuple(replace(robot, start=q[cell.columns(robot.name)]) for robot in cell.robots),
    )
    schedule = Schedule(times=times, tasks=tuple(tasks))
    return Situation(cell=cell, schedule=schedule, start=q, moving=[robot.name for robot in cell.robots])


def tool_on_part(cell: Cell, robot: str, q: Array) -> Array:
    """Poses of a robot's tool in the part for stacked joint vectors, shape (N, nq): a second kinematics."""
    X_WT = ScrewChain(cell.robot(robot)).tool_poses(q[:, cell.columns(robot)])
    if not cell.part.held_by:
        return inverse(np.asarray(cell.part.X_WP)) @ X_WT
    grasp = cell.part.held_by[0]
    X_WH = ScrewChain(cell.robot(grasp.robot)).tool_poses(q[:, cell.columns(grasp.robot)])
    return grasp.X_PT @ inverse(X_WH) @ X_WT


def off_the_path() -> Situation:
    """The tip starts 0.4 m off and has to settle first."""
    situation = planar([-0.8, 1.0, 1.0], [0.2, 0.1, 0.0])
    (scheduled,) = situation.schedule.tasks
    X = scheduled.X_PT.copy()
    X[:, :2, 3] += [0.3, -0.3]
    task = replace(scheduled.task, settle=STEP * (STEPS // 2))
    cell = replace(situation.cell, tasks=(task,))
    schedule = replace(situation.schedule, tasks=(replace(scheduled, task=task, X_PT=X),))
    return replace(situation, cell=cell, schedule=schedule)


def locked(situation: Situation, *names: str, since: float = 0.0) -> Situation:
    """The same with joints that fail."""
    robot = situation.cell.robots[-1].name
    locks = tuple(LockedJointEntry(robot=robot, joint=name, from_s=since) for name in names)
    return replace(situation, cell=replace(situation.cell, motion=replace(situation.cell.motion, locked=locks)))


def weighted(situation: Situation, weights: Sequence[float]) -> Situation:
    """The same with other joint weights."""
    robot = replace(situation.cell.robots[0], weights=np.array(weights, dtype=float))
    return replace(situation, cell=replace(situation.cell, robots=(robot,)))


BENT = [-0.8, 1.0, 1.0]
FOLDED = [0.3, np.pi, 0.0]  # the outer links lie on the inner one: the tip is at the base
WRIST = [0.3, -0.9, 0.4, 0.2, 0.0, 0.1]  # the fourth and the sixth axis coincide
ELBOW = [0.3, -0.9, np.arctan2(0.4318, 0.0203), 0.2, 0.5, 0.1]  # the arm is stretched
SLOW = {"velocity": 0.05}
TIGHT_TOL = {"lower": -1.0001, "upper": 1.0001, "acceleration": 5.0}


def tight(joint: Joint) -> Joint:
    """Limits that the start all but touches."""
    return replace(joint, **TIGHT_TOL)


def slow(joint: Joint) -> Joint:
    """A joint that cannot keep up."""
    return replace(joint, **SLOW)


def endless(joint: Joint) -> Joint:
    """A joint without limits of position."""
    return replace(joint, lower=-np.inf, upper=np.inf)


SITUATIONS: dict[str, Callable[[], Situation]] = {
    "stretched arm drawn in along its own line": lambda: planar([0, 0, 0], [-0.01, 0, 0]),
    "stretched arm moved across": lambda: planar([0, 0, 0], [0, 0.01, 0]),
    "stretched arm pulled beyond its reach": lambda: planar([0, 0, 0], [0.1, 0, 0]),
    "stretched arm pulled far beyond its reach": lambda: planar([0, 0, 0], [2.0, 0, 0]),
    "stretched arm with all rows": lambda: planar([0, 0, 0], [-0.01, 0.01, 0], axes=PLANAR, turn=0.1),
    "folded arm whose tip leaves the base": lambda: planar(FOLDED, [0.02, 0.0, 0]),
    "folded arm whose tip moves along its links": lambda: planar(FOLDED, [0.02 * np.cos(0.3), 0.02 * np.sin(0.3), 0]),
    "folded arm that stands still": lambda: planar(FOLDED, [0, 0, 0]),
    "path through the singular posture": lambda: planar([0.0, 3.1, 0.1], [0.09, -0.04, 0]),
    "wrist singularity, turned about the lost axis": lambda: puma(WRIST, [0, 0, 0, 0.1, 0, 0]),
    "wrist singularity, moved and turned": lambda: puma(WRIST, [0.01, 0.01, 0, 0.05, 0.05, 0.05]),
    "elbow singularity, pulled outwards": lambda: puma(ELBOW, [0.05, 0.05, -0.05, 0, 0, 0]),
    "joints that do not move the tip": lambda: puma(WRIST, [0.01, 0, 0, 0, 0, 0], axes=(0, 1, 2)),
    "step a hundred times too long": lambda: planar(BENT, [1.5, 1.0, 0], step=0.2),
    "whole path in the reach of one step": lambda: planar(BENT, [-5.0, 0.3, 0], step=0.2),
    "start off the path": off_the_path,
    "gain at its upper bound": lambda: planar(BENT, [0.1, 0.1, 0], gain_per_s=1.999 / STEP),
    "gain at its upper bound and singular": lambda: planar([0, 0, 0], [-0.01, 0, 0], gain_per_s=1.999 / STEP),
    "hardly any gain": lambda: planar(BENT, [0.1, 0.1, 0], gain_per_s=1e-9),
    "damping 0": lambda: planar(BENT, [0.1, 0.1, 0], damping=0.0),
    "damping 0 and singular": lambda: planar([0, 0, 0], [-0.01, 0, 0], damping=0.0),
    "damping 0 and all but singular": lambda: planar([0, 1e-7, 0], [-0.01, 0, 0], damping=0.0),
    "damping 0 and wrist singular": lambda: puma(WRIST, [0, 0, 0, 0.1, 0, 0], damping=0.0),
    "damping 1e6": lambda: planar(BENT, [0.1, 0.1, 0], damping=1e6),
    "weights from 1e-6 to 1e6": lambda: weighted(planar(BENT, [0.1, 0.1, 0]), [1e6, 1.0, 1e-6]),
    "all weights 1e6": lambda: weighted(planar(BENT, [0.1, 0.1, 0]), [1e6, 1e6, 1e6]),
    "all weights 1e-6 at a singularity": lambda: weighted(planar([0, 0, 0], [-0.01, 0, 0]), [1e-6, 1e-6, 1e-6]),
    "one joint locked": lambda: locked(planar(BENT, [0.1, 0.1, 0]), "j2"),
    "two joints locked on the way": lambda: locked(planar(BENT, [0.1, 0.1, 0]), "j1", "j2", since=0.02),
    "all joints locked": lambda: locked(planar(BENT, [0.1, 0.1, 0]), "j1", "j2", "j3"),
    "fewer joints than rows": lambda: planar([0.2, 1.0], [0.05, 0, 0], links=(1.0, 1.0), axes=PLANAR),
    "one joint for two rows": lambda: planar([0.2], [0.05, 0, 0], links=(1.0,)),
    "rows that no joint touches": lambda: planar(BENT, [0.05, 0, 0], axes=(0, 1, 2)),
    "joints without limits": lambda: planar(BENT, [0.1, 0.1, 0], joint=endless),
    "start at the limits": lambda: planar([-1.0, 1.0, 1.0], [0.2, 0.2, 0], joint=tight),
    "start outside the limits": lambda: planar([-1.1, 1.1, 1.1], [0.01, 0.01, 0], joint=tight),
    "joints too slow for the path": lambda: planar(BENT, [0.1, 0.1, 0], joint=slow),
    "two robots": pair,
    "two robots, part at rest": lambda: pair(moving=("op0",)),
    "two robots of three joints each": lambda: pair(joints=3),
    "operator with fewer joints than rows, part at rest": lambda: pair(joints=3, moving=("op0",)),
    "two robots, weights from 1e-6 to 1e6": lambda: pair(weights=[1e-6, 1e6, 1.0, 1e3, 1e-3, 1e6]),
    "nobody may move": lambda: pair(moving=()),
}
