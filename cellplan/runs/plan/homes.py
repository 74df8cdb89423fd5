"""Homes of idle robots: found near their starts, free of everything for the whole of every run they are idle in."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.certify.run_pairs import rows_moved_by, scene_of_rows, scene_of_run
from cellplan.certify.still_robots import HomeTrials, RunSamples
from cellplan.checks.clearance.check import check_clearance
from cellplan.errors import HomeNotFoundError
from cellplan.files.input.findings import listed
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.idle import idle_robots
from cellplan.model.progress import Progress, silent
from cellplan.model.seeds import generator
from cellplan.planning.modes import homeless, standing
from cellplan.planning.start.given import home_key, home_place
from cellplan.planning.start.home_candidates import home_candidates
from cellplan.runs.plan.rounded import rounded
from cellplan.runs.plan.run import PlannedRun
from cellplan.scene.scene import Scene

STAGE: Final = "searching for homes of idle robots"
TRIED_SAMPLES: Final = 32  # samples of each phase at which candidates are tried before one is certified
# [m] beyond the demanded clearance that the part and other robots are to leave a home
EXTRA_CLEARANCES: Final = (0.05, 0.02, 0.0)
MAX_CERTIFIED: Final = 24  # candidates per robot of which certification is tried; each failure adds its sample


def find_homes(
    scene: Scene, runs: Sequence[PlannedRun], *, known: Mapping[str, Array] | None = None, progress: Progress = silent
) -> Mapping[str, Array]:
    """Homes of all robots that are idle in some run and have none yet, in [rad] or [m], shape (n,) each.

    A home keeps the demanded clearance from everything, by the same check that judges the run afterwards, in every run
    in which its robot is idle. One robot after another is placed, in the order of their names; one that finds no extra
    comes before the others in the next try. All start postures of the scene are filled in.

    Raises:
        HomeNotFoundError: A robot has no such place.
    """
    order = sorted({name for run in runs for name in homeless(scene.cell, run.phase)})
    tried: set[str] = set()
    while True:
        homes: dict[str, Array] = {}
        cell = scene.cell
        for index, name in enumerate(order):
            progress(STAGE, index / len(order))
            search = _HomeSearch(replace(scene, cell=cell), runs, cell.robot(name))
            home = search.home((known or {}).get(name))
            if home is None and (index == 0 or name in tried):
                raise HomeNotFoundError(search.why_nothing())
            if home is None:
                tried.add(name)
                order.insert(0, order.pop(index))
                break
            homes[name] = home
            cell = with_homes(cell, homes, given=cell)
        else:
            return homes


def with_homes(cell: Cell, homes: Mapping[str, Array], *, given: Cell) -> Cell:
    """The cell with the homes that its idle robots stand at.

    Args:
        cell: The cell, every start posture filled in.
        given: The cell as it was written. A robot without any work whose start was left open starts at its home.
    """
    never_at_work = idle_robots(cell, [task.name for task in cell.tasks])
    robots = []
    for robot in cell.robots:
        home = homes.get(robot.name, robot.home)
        starts_there = home is not None and robot.name in never_at_work and given.robot(robot.name).start is None
        robots.append(replace(robot, home=home, start=home if starts_there else robot.start))
    return replace(cell, robots=tuple(robots))


def depends_on_homes(cell: Cell, runs: Sequence[PlannedRun]) -> bool:
    """Whether the motion of a run is another one when idle robots stand elsewhere: a goal keeps away from them."""
    return (cell.solver.secondary.obstacles is not None) and any(homeless(cell, run.phase) for run in runs)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _IdleRun:
    """One run in which the robot is idle."""

    run: PlannedRun
    scene: Scene  # its scene, with those pairs only that the robot's configuration matters to
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq), the homes that are known in place


class _HomeSearch:
    """The search for the home of one robot."""

    def __init__(self, scene: Scene, runs: Sequence[PlannedRun], robot: Robot) -> None:
        """Look up the runs in which the robot is idle; the scene has all homes that are known so far."""
        self._cell, self._robot, self._chain = scene.cell, robot, scene.chains[robot.name]
        self._runs = [_idle_run(scene, run, robot.name) for run in runs if robot.name in run.phase.idle]
        picked = [np.unique(np.linspace(0, len(run.q) - 1, TRIED_SAMPLES).astype(int)) for run in self._runs]
        samples = [RunSamples(scene=run.scene, q=run.q[few]) for run, few in zip(self._runs, picked, strict=True)]
        self._trials = HomeTrials(robot.name, samples)
        self._failed = Counter[str]()

    def home(self, known: Array | None) -> Array | None:
        """A known home that is certified to be free; else the nearest to the start, with extra clearance; or None."""
        robot = self._robot
        if known is not None and _is_within(robot, known) and self._is_certified(known):
            return known
        rng = generator(robot.name, self._cell.solver.seed)
        candidates = home_candidates(robot.model, self._chain, self._start(), rng)
        for extra in EXTRA_CLEARANCES:
            for candidate in candidates:
                if self._trials.is_refused(candidate, extra=extra):
                    continue
                home = rounded(robot, self._nearer(candidate, extra))
                if self._is_certified(home):
                    return home
                if self._failed.total() >= MAX_CERTIFIED:
                    return None
        return None

    def _nearer(self, q: Array, extra: float) -> Array:
        """The configuration with every joint back at its start that need not be elsewhere, the last joint first."""
        start = self._start()
        for joint in reversed(range(len(q))):
            back = q.copy()
            back[joint] = start[joint]
            if back[joint] != q[joint] and not self._trials.is_refused(back, extra=extra):
                q = back
        return q

    def why_nothing(self) -> str:
        """One line on what prevented a home most often."""
        name, cell = self._robot.name, self._cell
        tasks = [f"'{task}'" for run in self._runs for task in run.run.phase.tasks]
        while_worked = f"{listed(tasks)} {'is' if len(tasks) == 1 else 'are'} worked on"
        often = ""
        if self._trials.refused:
            first, second = self._trials.refused.most_common(1)[0][0]
            often = f", most often because '{first}' comes too close to '{second}'"
        elif self._failed:
            often = f", most often: {self._failed.most_common(1)[0][0]}"
        return (
            f"{home_place(cell, self._robot)}: no home found near the start for '{name}', which is idle "
            f"while {while_worked}, that keeps {cell.checks.clearance_mm:g} mm from everything{often} "
            f"(several hundred configurations tried): give {home_key(self._robot)} or move the base"
        )

    def _start(self) -> Array:
        """Where the search begins: the start, which every robot has by now."""
        start = self._robot.start
        if start is None:
            raise ValueError(f"'{self._robot.name}' has no start to search near")
        return start

    def _is_certified(self, home: Array) -> bool:
        """Whether a configuration passes all checks of clearance; where one fails its sample is added to the trials."""
        for place, idle in enumerate(self._runs):
            if not idle.scene.pairs:
                continue
            q = idle.q.copy()
            q[:, self._cell.columns(self._robot.name)] = home
            checks = check_clearance(idle.scene, idle.run.schedule, q)[1]
            failed = next((check for check in checks if not check.passed), None)
            if failed is not None:
                self._failed[failed.message] += 1
                self._trials.add(place, _at(idle.run.schedule.times, q, failed.at_s or 0.0))
                return False
        return True


def _is_within(robot: Robot, q: Array) -> bool:
    """Whether a configuration, shape (n,), keeps the joint limits."""
    return bool(np.all((q >= robot.model.lower) & (q <= robot.model.upper)))


def _idle_run(scene: Scene, run: PlannedRun, robot: str) -> _IdleRun:
    """One run as the robot has to stand it out; those whose homes are not known yet are not there."""
    run_scene = scene if run.scene is None else replace(run.scene, cell=with_homes_of(run.scene.cell, scene.cell))
    of_run = scene_of_run(run_scene, run.phase.tasks)
    away = {row for name in homeless(scene.cell, run.phase) - {robot} for row in rows_moved_by(of_run, name)}
    rows = [row for row in rows_moved_by(of_run, robot) if row not in away]
    return _IdleRun(run=run, scene=scene_of_rows(of_run, rows), q=standing(scene.cell, run.phase, run.motion.q))


def with_homes_of(cell: Cell, other: Cell) -> Cell:
    """A cell with the homes of another one, which has the same robots."""
    return replace(cell, robots=tuple(replace(robot, home=other.robot(robot.name).home) for robot in cell.robots))


def _at(times: Array, q: Array, at_s: float) -> Array:
    """Stacked configuration at a time, linear in time from row to row, shape (nq,)."""
    return np.array([np.interp(at_s, times, column) for column in q.T])
