"""Our two trees beside OMPL's RRT-Connect on the same cells and the same check of moves: ``pip install ompl`` first.

``python benchmarks/transfer_peers.py --cells 20`` prints processor time, moves checked and the length of the way as it
was found, in seconds at top speed, for each cell of which the straight move is blocked.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
from ompl import base, geometric, util
from transfers import Case, cases

from cellplan.geometry.arrays import Array
from cellplan.planning.transfer.in_turn import SAMPLES
from cellplan.planning.transfer.move_check import MoveCheck, Others
from cellplan.planning.transfer.query import TransferQuery
from cellplan.planning.transfer.trees import STEP, JointBox, connected

RESERVE = 0.002  # [m]


class Counted(MoveCheck):
    """The check that counts what it is asked."""

    moves = 0

    def is_free(self, first: Array, second: Array) -> bool:
        """See ``MoveCheck``."""
        self.moves += 1
        return super().is_free(first, second)


class Motions(base.MotionValidator):
    """The check as OMPL calls it."""

    def __init__(self, si: base.SpaceInformation, check: MoveCheck, box: JointBox) -> None:
        """Keep what is called."""
        super().__init__(si)
        self.check, self.scale = check, box.velocity

    def checkMotion(self, first: base.State, second: base.State) -> bool:
        """Whether the straight move between two states is free."""
        n = range(len(self.scale))
        a, b = (np.array([state[k] for k in n]) * self.scale for state in (first, second))
        return self.check.is_free(a, b)


def ours(check: MoveCheck, ends: tuple[Array, Array], box: JointBox, seed: int) -> Array | None:
    """A way by our trees, in seconds at top speed."""
    rng = np.random.default_rng(seed)
    result = connected(check, ends, box=box, samples=SAMPLES, rng=rng, tick=lambda _: None)
    return None if result.path is None else result.path / box.velocity


def by_ompl(check: MoveCheck, ends: tuple[Array, Array], box: JointBox, seed: int) -> Array | None:
    """The same by RRT-Connect of OMPL, seeded before the query, ended by a count."""
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed + 1)
    n = len(box.velocity)
    space, bounds = base.RealVectorStateSpace(n), base.RealVectorBounds(n)
    for k in range(n):
        bounds.setLow(k, box.lower[k] / box.velocity[k])
        bounds.setHigh(k, box.upper[k] / box.velocity[k])
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)
    information = setup.getSpaceInformation()
    setup.setStateValidityChecker(lambda state: check.are_free(np.array([[state[k] for k in range(n)]]) * box.velocity))
    information.setMotionValidator(Motions(information, check, box))
    states = [space.allocState() for _ in ends]
    for state, q in zip(states, ends, strict=True):
        for k in range(n):
            state[k] = q[k] / box.velocity[k]
    setup.setStartAndGoalStates(*states)
    planner = geometric.RRTConnect(information)
    planner.setRange(STEP)
    setup.setPlanner(planner)
    begun = check.moves
    if not setup.solve(base.PlannerTerminationCondition(lambda: check.moves - begun > 2 * SAMPLES)):
        return None
    path = setup.getSolutionPath()
    return np.array([[path.getState(i)[k] for k in range(n)] for i in range(path.getStateCount())])


def compared(case: Case, planner: Callable[..., Array | None], seed: int) -> tuple[float, int, float] | None:
    """Processor time in [s], moves checked and length in [s]; None where the straight move is free."""
    query = TransferQuery.of(case.scene, case.start, case.goal, seed=seed)
    check = Counted(case.scene, "arm", Others.moving(case.scene, case.start[None]), reserve=RESERVE)
    ends = query.ends_of("arm")
    for end in ends:
        check.relax_at(end)
    if check.is_free(*ends):
        return None
    check.moves, begin = 0, time.process_time()
    path = planner(check, ends, query.box("arm"), seed)
    seconds = time.process_time() - begin
    length = np.inf if path is None else float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    return seconds, check.moves, length


def main() -> None:
    """Print one line for each cell, then the medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=20)
    planners = {"own": ours, "ompl": by_ompl}
    results: dict[str, list[tuple[float, int, float]]] = {name: [] for name in planners}
    for number, case in enumerate(cases(parser.parse_args().cells, is_walled=False)):
        for name, planner in planners.items():
            figures = compared(case, planner, seed=0)
            if figures is not None:
                results[name].append(figures)
                print(f"{number:3d} {name:5s} {figures[0]:6.2f} s CPU {figures[1]:5d} moves, length {figures[2]:.2f} s")
    for name, figures in results.items():
        seconds, moves, lengths = np.array(figures).T
        print(
            f"{name}: {np.isfinite(lengths).sum()} of {len(lengths)} found, medians {np.median(seconds):.2f} s CPU, "
            f"{np.median(moves):.0f} moves checked, length {np.median(lengths):.2f} s; sum {seconds.sum():.1f} s CPU"
        )


if __name__ == "__main__":
    main()
