"""Cliques: tasks of robots at one station of which only one can be at work at a time, by robot or by conflict.

The block model and the bound both say that a station takes at least as long as the tasks of any of its cliques.
"""

from collections.abc import Sequence

from cellplan.search.assign.problem.instance import Instance

Pair = tuple[str, str]  # task and robot


def cliques_at(instance: Instance, station: int) -> list[list[Pair]]:
    """Cliques grown from each task of a robot at a station, the ones that exclude most first; all of one robot too."""
    pairs = [(task, robot) for task, robot, at in sorted(instance.modes) if at == station]
    excluded = {pair: {other for other in pairs if excludes(instance, station, pair, other)} for pair in pairs}
    order = sorted(pairs, key=lambda pair: (-len(excluded[pair]), -instance.steps(pair[0]), pair))
    cliques = {frozenset(_grown(seed, order, excluded)) for seed in pairs}
    for robot in instance.robots:
        of_robot = frozenset(pair for pair in pairs if pair[1] == robot)
        if of_robot and not any(of_robot <= clique for clique in cliques):
            cliques.add(of_robot)
    return [sorted(clique) for clique in sorted(cliques, key=sorted) if len(clique) > 1]


def excludes(instance: Instance, station: int, first: Pair, second: Pair) -> bool:
    """Whether two tasks of robots cannot be at work at once at a station."""
    if first[0] == second[0] or first[1] == second[1]:
        return True
    return frozenset(((*first, station), (*second, station))) in instance.conflicts


def _grown(seed: Pair, order: Sequence[Pair], excluded: dict[Pair, set[Pair]]) -> list[Pair]:
    """A clique with one pair, made as large as it gets in an order."""
    clique = [seed]
    for pair in order:
        if pair not in clique and all(pair in excluded[other] for other in clique):
            clique.append(pair)
    return clique
