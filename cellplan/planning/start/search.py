"""Starts that are to be found: several inverse-kinematics branches per robot, tried out, the best one kept."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import islice
from typing import Final

import numpy as np

from cellplan.errors import StartNotFoundError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, joint_at
from cellplan.model.cell.name_order import NameOrder
from cellplan.model.progress import Progress, silent
from cellplan.model.seeds import generator
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.planning.start.branches import Branch, Failures, StartSearch, branches_of, holder_configurations
from cellplan.planning.start.near_ties import best_first, levels
from cellplan.planning.start.reasons import why_nothing
from cellplan.planning.start.trial_motion import StartTrial, StartTrials
from cellplan.scene.scene import Scene

CANDIDATES: Final = 10  # configurations of the whole cell that are tried out at first
ROUNDS: Final = 3  # times that as many are tried out while none keeps all limits and touches nothing
COMBINATIONS_PER_HOLDER: Final = 3  # candidates taken from one configuration of the positioner, to compare several
Picks = tuple[int, ...]
MOST_LOOKS: Final = 20_000  # partial combinations evaluated before the search is given up: a second of work


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StartChoice:
    """A start of the whole cell, and how it was chosen."""

    start: Array  # stacked start configuration in the order of the file, shape (nq,)
    tried: int = 0  # how many were tried out; 0 when all were given
    trial: StartTrial | None = None  # what is known of the motion from it; None when all were given
    fault: str = ""  # what is wrong with that motion; empty where nothing is

    @property
    def words(self) -> str | None:
        """How the start was chosen, in one line; None when all were given."""
        if self.trial is None:
            return None
        among = "the only one found" if self.tried == 1 else f"the best of {self.tried} found"
        if self.trial.is_sound:
            share = 100.0 * float(self.trial.shares[0])
            margins = f"its whole motion keeps limits and speeds, {share:.0f} % of the tightest one left free"
            return f"start chosen: {among}; on trial {margins}"
        return f"start chosen: {among}, but no trial was without fault: {self.fault}"

    @property
    def warning(self) -> str | None:
        """The same words where no trial was without fault; None otherwise."""
        return None if self.trial is None or self.trial.is_sound else self.words


def choose_start(scene: Scene, paths: Mapping[str, ClockedPath], *, progress: Progress = silent) -> StartChoice:
    """Start configuration of the whole cell; given ones are kept, the others chosen.

    Candidates put every tool on the start of its task, within limits and without collision. They are ranked by joint
    margin and manipulability; the best are tried out on a coarse clock. Those whose whole motion keeps all limits and
    touches nothing come first, and of these the one that leaves the largest share of its joint ranges and speeds free;
    of equal ones that whose next joint leaves more free, and so on. While there is none, more are tried out.

    The search works in the order of names, each robot with random numbers of its own, drawn from ``solver.seed`` and
    its name: the order in which the file lists robots and tasks changes nothing.

    Raises:
        StartNotFoundError: No configuration reaches all tasks within limits and without collision.
    """
    cell = scene.cell
    if all(robot.start is not None for robot in cell.robots):
        return StartChoice(start=np.concatenate([robot.start for robot in cell.robots if robot.start is not None]))
    order = NameOrder.of(cell)
    search = StartSearch(
        cell=order.cell,
        chains=scene.chains,
        paths=paths,
        trials=StartTrials(scene, paths),
        random={robot.name: generator(robot.name, cell.solver.seed) for robot in cell.robots},
        failures=Failures(),
    )
    tried = _tried(search, progress)
    best = tried[best_first(np.array([trial.figures for trial in tried]))[0]]
    fault = "" if best.is_sound else _fault(best, [joint_at(order.cell, k) for k in range(len(best.start))])
    return StartChoice(start=order.as_listed(best.start), tried=len(tried), trial=best, fault=fault)


def _tried(search: StartSearch, progress: Progress) -> list[StartTrial]:
    """Trials of the candidates, round by round until one is sound."""
    candidates = _candidates(search, progress)
    tried: list[StartTrial] = []
    for _ in range(ROUNDS):
        judged = []
        for index, candidate in enumerate(islice(candidates, CANDIDATES)):
            progress("trying start configurations", index / CANDIDATES)
            judged.append(search.trials.judge(candidate))
        tried += search.trials.looked_at_closely(judged)
        if len(judged) < CANDIDATES or any(trial.is_sound for trial in tried):
            break
    return tried


def _candidates(search: StartSearch, progress: Progress) -> Iterator[Array]:
    """Configurations of the whole cell that reach all tasks without touching, best first for each of the positioner."""
    configurations = holder_configurations(search)
    yielded = 0
    for index, configuration in enumerate(configurations):
        progress("searching start configurations", index / len(configurations))
        limit = CANDIDATES * ROUNDS if len(configurations) == 1 else COMBINATIONS_PER_HOLDER
        for candidate in islice(_combinations(search, configuration), limit):
            yielded += 1
            yield candidate
    if not yielded:
        raise StartNotFoundError(why_nothing(search, len(configurations)))


def _combinations(search: StartSearch, holder_configuration: Array | None) -> Iterator[Array]:
    """Configurations of the whole cell for one of the positioner, best first, that touch nothing."""
    cell = search.cell
    choices: list[list[Branch]] = []
    for robot in cell.robots:
        branches = branches_of(search, robot, holder_configuration)
        if not branches:
            return
        choices.append(branches)
    blocked: set[tuple[tuple[int, int], ...]] = set()

    def collides(picks: Picks) -> bool:
        return any(all(robot < len(picks) and picks[robot] == pick for robot, pick in known) for known in blocked)

    for picks in best_combinations(_scores(choices), collides):
        q = np.concatenate([branches[pick][1] for branches, pick in zip(choices, picks, strict=True)])
        pair = search.trials.touching(q)
        if pair is None:
            yield q
            continue
        search.failures.touched(q)
        culprits = _culprits(cell, pair, picks)
        if not culprits:
            return
        blocked.add(culprits)


def _scores(choices: list[list[Branch]]) -> list[list[float]]:
    """What the branches of each robot are worth; what is near-equal, of whichever robots, is equal."""
    levelled = iter(levels([score for branches in choices for score, _ in branches]))
    return [list(islice(levelled, len(branches))) for branches in choices]


def _culprits(cell: Cell, pair: tuple[str, str], picks: Picks) -> tuple[tuple[int, int], ...]:
    """Robots of a pair that touches with the branches they are on: no other robot can keep these from touching."""
    owners = {name.split("/")[0] for name in pair}
    return tuple(
        (index, picks[index])
        for index, robot in enumerate(cell.robots)
        if robot.name in owners or (robot.name in cell.positioners[:1] and "part" in owners)
    )


def _fault(trial: StartTrial, joints: Sequence[tuple[str, str]]) -> str:
    """What is wrong with the motion of a trial; joints are named by robot and joint."""
    if not trial.is_followed:
        return "a tool loses its path"
    faults = [trial.contact] if trial.contact else []
    if trial.ranges.min() < 0.0:
        name = "/".join(joints[int(trial.ranges.argmin())])
        faults.append(f"{name} goes {-100.0 * trial.ranges.min():.3g} % of half its range beyond its limit")
    if trial.speeds.min() < 0.0:
        name = "/".join(joints[int(trial.speeds.argmin())])
        faults.append(f"{name} is {-100.0 * trial.speeds.min():.3g} % above its top speed")
    return " and ".join(faults)


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
