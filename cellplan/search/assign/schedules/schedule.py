"""Schedules in blocks: which tasks begin together, by which robots and at which station."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cellplan.search.assign.problem.goals import TaskGoal
from cellplan.search.assign.problem.instance import Instance

Choice = tuple[str, int]  # robot and station of a task


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockSchedule:
    """Blocks of tasks that begin together; the next one begins when all of them are done and all robots rest."""

    blocks: tuple[tuple[str, ...], ...]  # tasks, in the order of the blocks
    chosen: Mapping[str, Choice]  # by task

    def station_of(self, block: Sequence[str]) -> int:
        """The station at which a block is done."""
        return self.chosen[block[0]][1]

    @property
    def identity(self) -> tuple[frozenset[frozenset[str]], frozenset[tuple[str, Choice]]]:
        """What is done together, and by whom at which station, in whatever order."""
        return frozenset(map(frozenset, self.blocks)), frozenset(self.chosen.items())

    def work(self, instance: Instance) -> int:
        """Whole steps of all blocks and of all services, without transfers and rests."""
        services = instance.rules.services
        cleaning = sum(max((services[it].steps for it in robots), default=0) for robots in self.cleaned(instance))
        return cleaning + sum(max(instance.steps(task) for task in block) for block in self.blocks)

    def cleaned(self, instance: Instance) -> list[frozenset[str]]:
        """Robots whose tools are cleaned on the way to each block: where one must be, all that work in it."""
        services, robots = instance.rules.services, list[frozenset[str]]()
        since = {robot: it.most if it.is_due else 0 for robot, it in services.items()}
        for block in self.blocks if services else ():
            working = [robot for task in block if (robot := self.chosen[task][0]) in services]
            is_due = any(since[robot] == services[robot].most for robot in working)
            robots.append(frozenset(robot for robot in working if is_due and since[robot]))
            since |= {robot: 1 + (0 if robot in robots[-1] else since[robot]) for robot in working}
        return robots or [frozenset()] * len(self.blocks)


def keeps_columns(instance: Instance, schedule: BlockSchedule) -> bool:
    """Whether at the station of a column a block has its tasks, all of them and by the same robots."""
    keys = ({(task, *schedule.chosen[task]) for task in block} for block in schedule.blocks)
    return all(it == instance.columns.get(next(iter(it))[2], it) for it in keys)


def in_order(blocks: Sequence[tuple[str, ...]], goals: Mapping[str, TaskGoal]) -> tuple[tuple[str, ...], ...] | None:
    """Blocks so that every task comes after those that it must follow, else as they are; None where no order does."""
    left, ordered = list(blocks), list[tuple[str, ...]]()
    while left:
        open_tasks = {task for block in left for task in block}
        ready = (block for block in left if all(open_tasks.isdisjoint(goals[task].after) for task in block))
        block = next(ready, None)
        if block is None:
            return None
        left.remove(block)
        ordered.append(block)
    return tuple(ordered)


def refuse_impossible(instance: Instance, schedule: BlockSchedule) -> None:
    """Refuse a schedule that is not one of an instance.

    Raises:
        ValueError: With what is wrong with it.
    """
    done = [task for block in schedule.blocks for task in block]
    if in_order(schedule.blocks, instance.goals) != schedule.blocks:
        raise ValueError("expected every task after those that it must follow")
    if sorted(done) != sorted(instance.tasks):
        raise ValueError(f"expected every task once, got {done}")
    if not instance.rules.hold_for(schedule.blocks, schedule.chosen):
        raise ValueError("expected one robot for tasks of the same robot, and one block for those together")
    if not keeps_columns(instance, schedule):
        raise ValueError("expected all tasks of a column together, by its robots")
    for block in schedule.blocks:
        robots = [schedule.chosen[task][0] for task in block]
        if len(set(robots)) < len(robots) or len({schedule.chosen[task][1] for task in block}) > 1:
            raise ValueError(f"expected different robots at one station, got {block}")
        keys = [(task, *schedule.chosen[task]) for task in block]
        if any(key not in instance.modes for key in keys):
            raise ValueError(f"expected tasks with modes, got {block}")
        if any(frozenset((a, b)) in instance.conflicts for a in keys for b in keys):
            raise ValueError(f"expected no conflict, got {block}")
