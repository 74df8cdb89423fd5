"""Schedules without a solver: station by station, the scarcest tasks first, then exchanges while they save time."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

from cellplan.errors import NoSolutionError
from cellplan.search.assign.problem.instance import Instance
from cellplan.search.assign.schedules.schedule import BlockSchedule, Choice, in_order, keeps_columns


def greedy_schedule(instance: Instance) -> BlockSchedule:
    """The stations at which most tasks are left first; at each, every robot takes a task that few others can do.

    Raises:
        NoSolutionError: No choice of robots keeps the rules between tasks.
    """
    instance, left = _settled(_at_rest(instance)), set(instance.tasks)
    blocks, chosen = list[tuple[str, ...]](), dict[str, Choice]()
    while left:
        station = max(instance.used, key=lambda it: (len(_here(instance, left, it)), -it))
        if not _here(instance, left, station):
            raise NoSolutionError(
                f"{instance.rules.where}: no order keeps what tasks come after: {', '.join(sorted(left))}"
            )
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
        whole = (it for it in shorter if keeps_columns(instance, it))
        allowed = (it for it in whole if instance.rules.hold_for(it.blocks, it.chosen))
        ordered = ((it, in_order(it.blocks, instance.goals)) for it in allowed)
        better = next((replace(it, blocks=blocks) for it, blocks in ordered if blocks is not None), None)
        if better is None:
            return best
        best, shortest = better, better.work(instance)


def _at_rest(instance: Instance) -> Instance:
    """The instance without columns but those that tasks need which cannot be done on a part at rest.

    Raises:
        NoSolutionError: Some of these tasks have no columns of their own.
    """
    if not instance.columns:
        return instance
    resting = {task for task, _, at in instance.modes if at not in instance.columns}
    needed = [task for task in instance.tasks if task not in resting]
    chosen = _cover(needed, {at: {key[0] for key in keys} for at, keys in instance.columns.items()})
    if chosen is None:
        raise NoSolutionError(f"no choice of blocks in which the part moves has each task once: {', '.join(needed)}")
    moving = {key[0] for station in chosen for key in instance.columns[station]}

    def is_left(task: str, station: int) -> bool:
        return station in chosen if task in moving else station not in instance.columns

    return instance.with_modes({key: it for key, it in instance.modes.items() if is_left(key[0], key[2])})


def _cover(needed: Sequence[str], columns: Mapping[int, set[str]]) -> list[int] | None:
    """Stations of columns that have each of some tasks, and none twice, large ones first; None where none do."""
    if not needed:
        return []
    for station in sorted(columns, key=lambda it: (-len(columns[it]), it)):
        if needed[0] in columns[station]:
            apart = {at: tasks for at, tasks in columns.items() if tasks.isdisjoint(columns[station])}
            rest = _cover([task for task in needed if task not in columns[station]], apart)
            if rest is not None:
                return [station, *rest]
    return None


def _settled(instance: Instance) -> Instance:
    """The instance in which tasks with rules have one robot only, and those that begin together one station."""
    rules = instance.rules
    alone = dict.fromkeys(it for group in rules.same_robot for it in group)
    for it in (it for group in rules.together for it in group):
        alone.pop(it, None)
    chosen = _choice(instance, [*rules.together, *((it,) for it in alone)], {})
    if chosen is None:
        groups = "; ".join(", ".join(group) for group in (*rules.same_robot, *rules.together))
        raise NoSolutionError(
            f"{rules.where}: no choice of robots and poses of the part keeps same_robot and together of {groups}"
        )

    def is_chosen(task: str, robot: str, at: int) -> bool:
        return task not in chosen or chosen[task] == (robot, at) or (task in alone and chosen[task][0] == robot)

    return replace(instance, modes={key: modes for key, modes in instance.modes.items() if is_chosen(*key)})


def _choice(
    instance: Instance, units: Sequence[Sequence[str]], chosen: Mapping[str, Choice]
) -> Mapping[str, Choice] | None:
    """Robots and stations of units of tasks, the robots with least work first; None where none keep the rules."""
    if not units:
        return chosen

    def most_work(trial: Mapping[str, Choice]) -> int:
        return max(sum(instance.steps(task) for task, (by, _) in trial.items() if by == it) for it in instance.robots)

    choices = product(*(instance.options.get(task, ()) for task in units[0]))
    trials = [{**chosen, **dict(zip(units[0], it, strict=True))} for it in choices if _is_block(instance, units[0], it)]
    for trial in sorted(trials, key=most_work):
        robots = ({trial[task][0] for task in group if task in trial} for group in instance.rules.same_robot)
        if all(len(it) < 2 for it in robots) and (whole := _choice(instance, units[1:], trial)) is not None:
            return whole
    return None


def _is_block(instance: Instance, tasks: Sequence[str], choices: Sequence[Choice]) -> bool:
    """Whether robots can do tasks together."""
    keys = [(task, *choice) for task, choice in zip(tasks, choices, strict=True)]
    return all(
        a[1] != b[1] and a[2] == b[2] and frozenset((a, b)) not in instance.conflicts for a, b in combinations(keys, 2)
    )


def _here(instance: Instance, left: set[str], station: int) -> set[str]:
    """Tasks that are left, can be done at a station and come after no other one that is left; whole groups only."""
    here = {
        task
        for task in left
        if left.isdisjoint(instance.goals[task].after) and any(at == station for _, at in instance.options[task])
    }
    if len(here) < len(instance.columns.get(station, ())):
        return set()
    return here - {task for group in instance.rules.together if not here.issuperset(group) for task in group}


def _able(instance: Instance, task: str, station: int) -> list[str]:
    """Robots that can do a task at a station."""
    return [robot for robot, at in instance.options[task] if at == station]


def _block(instance: Instance, station: int, here: set[str]) -> dict[str, str]:
    """One block: tasks that begin together, then a task for each robot, the ones with fewest tasks first."""
    if station in instance.columns:
        return {robot: task for task, robot, _ in sorted(instance.columns[station])}
    grouped = [group for group in instance.rules.together if here.issuperset(group)]
    block = {_able(instance, task, station)[0]: task for group in grouped[:1] for task in group}
    here = here - {task for group in grouped for task in group}
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
