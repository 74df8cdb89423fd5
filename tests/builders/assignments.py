"""Small instances of assignments whose robots have two joints: what a schedule needs to know, and nothing of a cell."""

from dataclasses import replace

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.search.assign.problem.goals import Stations, TaskGoal
from cellplan.search.assign.problem.instance import Instance, with_rules
from cellplan.search.assign.problem.moving_blocks import Column, with_columns
from cellplan.search.assign.problem.rules import TaskRules
from cellplan.search.assign.problem.table import TaskMode

STEP = 0.02  # [s]
ROBOTS = ("a", "b")


def small_instance(
    seed: int,
    count: int,
    *,
    stations: int = 2,
    modes: int = 1,
    chained: bool = False,
    rules: TaskRules | None = None,
    columns: int = 0,
) -> Instance:
    """Tasks at chance places with chance conflicts.

    Args:
        modes: Number of modes of every robot for every task.
        chained: Whether the third task must follow the first, and the second the third.
        rules: What holds between the tasks beside that.
        columns: Number of blocks of two tasks, one, two and so on, in which the part moves; the first has two first.
    """
    rng = np.random.default_rng(seed)
    names = [f"t{k}" for k in range(count)]
    after = {"t2": ("t0",), "t1": ("t2",)} if chained else {}
    goals = {
        name: TaskGoal(
            name=name,
            robots=ROBOTS,
            X_PT=np.tile(np.eye(4), (3, 1, 1)),
            steps=int(rng.integers(10, 60)),
            is_reversible=False,
            after=after.get(name, ()),
        )
        for name in names
    }
    modes_by_key = {}
    for name in names:
        able = [(robot, at) for robot in ROBOTS for at in range(stations) if rng.random() < 0.7]
        for robot, at in able or [("a", 0)]:
            modes_by_key[name, robot, at] = tuple(_mode(name, robot, at, rng) for _ in range(modes))
    conflicts = frozenset(
        frozenset((first, second))
        for first in modes_by_key
        for second in modes_by_key
        if first[0] != second[0] and first[1] != second[1] and first[2] == second[2] and rng.random() < 0.3
    )
    limits = JointLimitsInTime(velocity=np.full(2, 2.7), acceleration=np.full(2, 10.0), jerk=np.full(2, np.inf))
    slow = replace(limits, velocity=np.full(2, 1.4), acceleration=np.full(2, 5.0))
    instance = Instance(
        goals=goals,
        robots=ROBOTS,
        modes=modes_by_key,
        stations=Stations(
            holder="table", q=rng.uniform(-1, 1, (stations, 2)), X_WP=np.tile(np.eye(4), (stations, 1, 1))
        ),
        used=tuple(range(stations)),
        conflicts=conflicts,
        homes={"a": np.zeros(2), "b": np.zeros(2), "table": np.zeros(2)},
        bounds={"a": limits, "b": limits, "table": slow},
        step=STEP,
    )
    moving = [_column(names if place else names[:2], 2 - place % 2, rng) for place in range(columns)]
    return with_rules(with_columns(instance, moving), rules or TaskRules())


def _column(names: list[str], size: int, rng: np.random.Generator) -> Column:
    tasks, robots = rng.permutation(names)[:size].tolist(), rng.permutation(ROBOTS)[:size].tolist()
    modes = tuple(_mode(task, robot, 0, rng) for task, robot in zip(tasks, robots, strict=True))
    begin, end = rng.uniform(-1, 1, (2, 2))
    return Column(modes=modes, begin=begin, end=end, X_WP=np.eye(4))


def _mode(task: str, robot: str, station: int, rng: np.random.Generator) -> TaskMode:
    begin = rng.uniform(-1.5, 1.5, 2)
    q: Array = np.array([begin, begin + rng.uniform(-0.3, 0.3, 2)])
    return TaskMode(task=task, robot=robot, station=station, spin=0.0, q=q, margin=0.1, directions=(False,))
