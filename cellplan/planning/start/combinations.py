"""Choices of one branch per robot, the best combinations first, however many robots there are."""

from collections.abc import Callable, Iterator, Sequence
from heapq import heappop, heappush
from typing import Final

Picks = tuple[int, ...]

MOST_LOOKS: Final = 20_000  # partial combinations evaluated before the search is given up: a second of work


def best_combinations(scores: Sequence[Sequence[float]], is_ruled_out: Callable[[Picks], bool]) -> Iterator[Picks]:
    """Combinations in the order of their worst score, the best first; equal ones in the order of the lists.

    Partial combinations are grown best first, each by the worst score that it cannot do without: that of its own picks
    and of the best branches of the robots to come. So the number of all combinations, which grows exponentially with
    the number of robots, is never worked through. The search ends after ``MOST_LOOKS`` partial combinations.

    Args:
        scores: Scores of each robot's branches; a larger one is better.
        is_ruled_out: Says of a partial combination, one pick for each of the first robots, that nothing can come of it;
            evaluated anew for each, so that what is learned meanwhile counts.

    Yields:
        The index of the branch for each robot.
    """
    least = [min((-score for score in branches), default=float("inf")) for branches in scores]
    to_come = [max(least[count:], default=float("-inf")) for count in range(len(scores) + 1)]
    heap: list[tuple[float, int, Picks]] = [(to_come[0], 0, ())]
    for _ in range(MOST_LOOKS):
        if not heap:
            return
        badness, _, picks = heappop(heap)
        if is_ruled_out(picks):
            continue
        if len(picks) == len(scores):
            yield picks
            continue
        for pick, score in enumerate(scores[len(picks)]):
            worst = max(badness, -score, to_come[len(picks) + 1])
            heappush(heap, (worst, -len(picks) - 1, (*picks, pick)))
