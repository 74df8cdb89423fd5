"""Cells with forces: random ones whose processes and masses are drawn, and schedules whose processes are always on."""

from dataclasses import replace

import numpy as np

from builders.random_cells import random_cell, random_pose, sharing
from builders.scene_builders import schedule
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.settings.forces import ProcessForceEntry
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.settings.units import MmPerS
from cellplan.model.task.task import Task

FRAMES = ("tool", "part", "world")


def process(newton=(0.0, 0.0, 0.0), newton_metre=(0.0, 0.0, 0.0), *, frame: str = "tool") -> ProcessEntry:
    """A process with a force."""
    force = ProcessForceEntry.model_validate({"frame": frame, "newton": newton, "newton_metre": newton_metre})
    return ProcessEntry(feed_mm_s=MmPerS(10.0), force=force)


def with_force(task: Task, *args: tuple[float, float, float], frame: str = "tool") -> Task:
    return replace(task, process=process(*args, frame=frame))


def random_forces(seed: int, *, operators: int = 3, holders: int = 0) -> Cell:
    """Random robots of seven joints with tools and part of random masses; of the operators some hold the part too."""
    rng = np.random.default_rng(seed)
    cell = random_cell(seed, operators=operators + holders, joints=7, with_follower=bool(seed % 2))
    cell = sharing(cell, holders) if holders else cell
    robots = tuple(
        replace(robot, tool=replace(robot.tool, mass=float(rng.uniform(1.0, 9.0)), centre=rng.normal(size=3)))
        for robot in cell.robots
    )
    tasks = tuple(
        with_force(task, tuple(rng.normal(size=3) * 50.0), tuple(rng.normal(size=3) * 5.0), frame=FRAMES[k % 3])
        for k, task in enumerate(cell.tasks)
    )
    part = replace(cell.part, mass=float(rng.uniform(1.0, 9.0)), X_PS=random_pose(rng))
    return replace(cell, robots=robots, tasks=tasks, part=part)


def always_on(cell: Cell, samples: int = 2, *, duration: float = 1.0) -> Schedule:
    """A clock on which all processes are on at each row."""
    plain = schedule(samples, *cell.tasks, duration=duration)
    return replace(plain, tasks=tuple(replace(it, process_on=((0.0, duration),)) for it in plain.tasks))


def drawn_rows(cell: Cell, seed: int, samples: int = 2) -> dict[str, Array]:
    """Random positions of all joints, by robot."""
    rng = np.random.default_rng(seed)
    return {robot.name: rng.uniform(-1.5, 1.5, (samples, len(robot.model.joints))) for robot in cell.robots}
