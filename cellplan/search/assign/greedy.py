"""Schedules without a solver: station by station, the scarcest tasks first, then exchanges while they save time."""

from collections.abc import Iterator
from dataclasses import replace

from cellplan.search.assign.instance import Instance
from cellplan.search.assign.schedule import BlockSchedule, Choice, in_order


def greedy_schedule(instance: Instance) -> BlockSchedule:
    """The stations at which most tasks are left first; at each, every robot takes a task that few others can do."""
    left = set(instance.tasks)
    blocks, chosen = list[tuple[str, ...]](), dict[str, Choice]()
    while left:
        station = max(instance.used, key=lambda it: (len(_here(instance, left, it)), -it))
        while here := _here(instance, left, station):
            block = _block(instance, station, here)
            chosen |= {task: (robot, station) for robot, task in block.items()}
            blocks.append(tuple(block.values()))
            left -= set(block.values())
    return BlockSchedule(blocks=tuple(blocks), chosen=chosen)


def improved(instance: Instance, schedule: BlockSchedule) -> BlockSchedule:
    """Tasks moved to other blocks and robots, one or two at a time, while the work of all blocks gets shorter."""
    best, shortest = schedule, schedule.work(instance)
    while True:
        shorter = (it for it in _neighbours(instance, best) if it.work(instance) < shortest)
        ordered = ((it, in_order(it.blocks, instance.goals)) for it in shorter)
        better = next((replace(it, blocks=blocks) for it, blocks in ordered if blocks is not None), None)
        if better is None:
            return best
        best, shortest = better, better.work(instance)


def _here(instance: Instance, left: set[str], station: int) -> set[str]:
    """Tasks that are left, can be done at a station and come after no other one that is left."""
    return {
        task
        for task in left
        if left.isdisjoint(instance.goals[task].after) and any(at == station for _, at in instance.options[task])
    }


def _able(instance: Instance, task: str, station: int) -> list[str]:
    """Robots that can do a task at a station."""
    return [robot for robot, at in instance.options[task] if at == station]


def _block(instance: Instance, station: int, here: set[str]) -> dict[str, str]:
    """One block: a task for each robot, the ones with fewest tasks first."""
    block: dict[str, str] = {}
    count = {robot: sum(robot in _able(instance, task, station) for task in here) for robot in instance.robots}
    for robot in sorted(instance.robots, key=lambda name: (count[name], name)):
        free = [
            task
            for task in sorted(here - set(block.values()))
            if robot in _able(instance, task, station) and _fits(instance, station, block, robot, task)
        ]
        if free:
            block[robot] = min(
                free, key=lambda task: (len(_able(instance, task, station)), -instance.steps(task), task)
            )
    return block


def _fits(instance: Instance, station: int, block: dict[str, str], robot: str, task: str) -> bool:
    """Whether a task of a robot has no conflict in a block."""
    key = (task, robot, station)
    return robot not in block and all(
        frozenset((key, (other, name, station))) not in instance.conflicts for name, other in block.items()
    )


def _neighbours(instance: Instance, schedule: BlockSchedule) -> Iterator[BlockSchedule]:
    """Schedules in which one task is in another block, or two tasks have changed places."""
    blocks = [
        (schedule.station_of(block), {schedule.chosen[task][0]: task for task in block}) for block in schedule.blocks
    ]
    for source, (_, old) in enumerate(blocks):
        for robot, task in old.items():
            for target, (station, _) in enumerate(blocks):
                if target == source:
                    continue
                for other in _able(instance, task, station):
                    moved = [(at, dict(it)) for at, it in blocks]
                    del moved[source][1][robot]
                    replaced = moved[target][1].pop(other, None)
                    if not _fits(instance, station, moved[target][1], other, task):
                        continue
                    moved[target][1][other] = task
                    if replaced is not None and not _put_back(instance, moved[source], replaced):
                        continue
                    yield _schedule(moved)


def _put_back(instance: Instance, block: tuple[int, dict[str, str]], task: str) -> bool:
    """Give a task that was replaced to a robot of the block that the other one came from; whether one can do it."""
    station, robots = block
    for robot in _able(instance, task, station):
        if _fits(instance, station, robots, robot, task):
            robots[robot] = task
            return True
    return False


def _schedule(blocks: list[tuple[int, dict[str, str]]]) -> BlockSchedule:
    """Blocks by robot as a schedule; empty ones are left out."""
    return BlockSchedule(
        blocks=tuple(tuple(block.values()) for _, block in blocks if block),
        chosen={task: (robot, station) for station, block in blocks for robot, task in block.items()},
    )
