"""Start trials: what a start posture is worth, seen from the motion that follows from it on a coarse clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Final

import numpy as np

from cellplan.certify.depths import mounted_depths
from cellplan.certify.run_pairs import rows_moved_by
from cellplan.errors import NoSolutionError
from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.name_order import NameOrder
from cellplan.model.motion.motion import Schedule
from cellplan.model.motion.plan import Phase
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import Task
from cellplan.model.units import MM
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.layout_screening import Candidates, Screening, screen_layouts
from cellplan.planning.modes import homeless, plan_phases, standing
from cellplan.planning.start.inverse_kinematics import finite_limits
from cellplan.planning.start.near_ties import ALIKE
from cellplan.planning.timing.schedule import clock_path, clock_times, schedule_paths
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.mounting import Mount
from cellplan.scene.scene import Scene

SAMPLES: Final = 160  # times of the coarse motion that a configuration is judged by
GAIN: Final = 0.5  # feedback gain times step of the coarse motion
TOUCH_INSTANTS: Final = 12  # times of the coarse motion that are considered for collisions
TRIED_WITH: Final = "weighted_pseudo_inverse"  # fast, and it shows how far a configuration would go beyond its limits
CLOSE_ENOUGH: Final = 1e-4  # [m] and [rad] tool error of the closer look: it is about joints
MOST_BREAKS: Final = 500  # of the desired motion up to which a closer look costs some tenths of a second
ARM: Final = 6  # joints of an arm whose Jacobian is square
LOST: Final = -1e6  # stands for the share that a motion leaves free which loses its path


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StartTrial:
    """What is known of the motion from one start configuration of the whole cell."""

    start: Array  # stacked start configuration on the turns that leave its joints most room, shape (nq,)
    ranges: Array  # share of half its range that each joint leaves free at least, shape (nq,); negative beyond a limit
    speeds: Array  # share of its speed limit that each joint leaves free, shape (nq,); negative above the limit
    is_followed: bool = True  # whether every tool keeps to its path
    contact: str = ""  # what collides first on the way, and where; empty where nothing does
    # arms that pass a singular configuration while their process is on, where no controller could move a tool on lines
    crossing: frozenset[str] = frozenset()

    @property
    def touches(self) -> bool:
        """Whether something collides on the way."""
        return bool(self.contact)

    @property
    def shares(self) -> Array:
        """All shares, the worst first, shape (2 nq,)."""
        return np.sort(np.concatenate([self.ranges, self.speeds]))

    @property
    def is_sound(self) -> bool:
        """Whether the motion keeps its paths, limits and speeds and touches nothing."""
        return self.is_followed and not self.touches and self.keeps_limits

    @property
    def keeps_limits(self) -> bool:
        """Whether all joints stay within their limits of position and speed."""
        return bool(self.shares[0] >= -ALIKE)

    @property
    def figures(self) -> Array:
        """What trials are compared by: sound ones first, then by the worst share, the next one, the configuration."""
        signs = [float(self.is_sound), float(self.is_followed), float(not self.touches), -float(len(self.crossing))]
        return np.concatenate([signs, self.shares, self.start])


class StartTrials:
    """The coarse clock of one cell, on which start postures are tried.

    Attributes:
        bodies: All solids of the cell.
        pairs: Pairs of them that must keep apart.
        pair_names: The names of these pairs.
        open_pairs: Pairs of bodies that a choice of the search moves and that meet in some run, shape (pairs,); what
            given configurations make collide is for the report to say.
    """

    def __init__(self, scene: Scene, paths: Mapping[str, ClockedPath]) -> None:
        """Choose a step that makes few samples of the whole motion, of which every path is gone through once."""
        self._order = NameOrder.of(scene.cell)
        once = self._order.cell
        tasks = once.tasks
        if any(robot.path is not None for robot in once.robots):  # which is one over all cycles
            self._once = once
        else:
            tasks = tuple(_first_cycle(task, once.motion.duration) for task in tasks)
            self._once = replace(once, tasks=tasks, motion=replace(once.motion, duration=None))
        self._scene = scene
        self._paths = {task.name: _once_through(self._once, task, paths[task.name]) for task in tasks}
        end = clock_times(self._once, self._paths_of([task.name for task in tasks]))[-1]
        self._step = float(max(once.motion.step, end / SAMPLES))
        self._schedules: dict[tuple[str, ...], Schedule] = {}
        # which joint fails is not known beforehand
        motion = replace(once.motion, step=self._step, locked=(), cyclic=False)
        solver = once.solver.changed(gain_per_s=GAIN / self._step, method=TRIED_WITH)
        self._cell = replace(self._once, motion=motion, solver=solver)
        self._alone: dict[str, Cell] = {}
        self._phases = plan_phases(self._cell).program
        open_grips = tuple(pair for pair in scene.mounted if pair.moves and pair.mount is Mount.GRIP)
        self._open_grips = replace(scene, mounted=open_grips)
        self.bodies, self.pairs = scene.bodies, scene.pairs
        self.pair_names = [scene.names(pair) for pair in scene.pairs]
        is_present = np.any([present_pairs(scene, phase) for phase in self._phases], axis=0)
        self.open_pairs = _open_pairs(scene) & is_present

    def touching(self, q: Array) -> tuple[str, str] | None:
        """Two bodies that a choice of the search moves and that touch, at a configuration in the order of names."""
        return self._scene.touching(self._order.as_listed(q), among=self.open_pairs)

    def contacts(self, q: Array, *, among: Flags) -> list[tuple[str, str]]:
        """All of some pairs, shape (pairs,), that touch at a configuration in the order of names, shape (nq,)."""
        listed, left = self._order.as_listed(q), among.copy()
        pairs: list[tuple[str, str]] = []
        while (pair := self._scene.touching(listed, among=left)) is not None:
            pairs.append(pair)
            left[self.pair_names.index(pair)] = False
        return pairs

    def judge(self, start: Array, *, may_turn: bool = True) -> StartTrial:
        """What follows from a start configuration of the whole cell in the order of names, shape (nq,).

        Args:
            may_turn: Whether joints are turned by whole turns to where they have most room.
        """
        try:
            motions = self._motions(self._cell, start, self._phases)
        except NoSolutionError:
            lost = np.full(len(start), LOST)
            return StartTrial(start=start, ranges=lost, speeds=lost, is_followed=False)
        turns = _whole_turns(self._cell, np.concatenate(motions)) if may_turn else np.zeros(len(start))
        shares = [_shares_left_free(self._cell, q + turns, self._step) for q in motions]
        return StartTrial(
            start=start + turns,
            ranges=np.min([ranges for ranges, _ in shares], axis=0),
            speeds=np.min([speeds for _, speeds in shares], axis=0),
            contact=next(filter(None, map(self._contact_on_path, self._phases, motions)), ""),
            crossing=frozenset[str]().union(*map(self._crossing, self._phases, motions)),
        )

    def looked_at_closely(self, trials: Sequence[StartTrial]) -> list[StartTrial]:
        """Trials with the shares of the whole motion on the accurate clock, which sees what lies between samples.

        A trial that the accurate mode cannot follow keeps the shares of the coarse clock, and so do all of them where
        the cell asks for another mode, for goals or for changing weights.
        """
        cell = self._once
        if len(trials) < 2 or not cell.solver.is_accurate or cell.solver.is_varied:
            return list(trials)
        schedules = [schedule_paths(cell, self._paths_of(run.tasks)) for run in self._phases]
        if max(len(schedule.breaks) for schedule in schedules) > MOST_BREAKS:
            return list(trials)
        candidates = Candidates.of([cell] * len(trials), np.array([trial.start for trial in trials]))
        runs = [
            screen_layouts(cell, schedule, candidates, moving=run.moving, accuracy=CLOSE_ENOUGH)
            for run, schedule in zip(self._phases, schedules, strict=True)
        ]
        worst = reduce(Screening.worst, runs)
        ranges = _range_shares(cell, worst.margins)
        return [
            replace(trial, ranges=ranges[k], speeds=1.0 - worst.speed_ratios[k]) if worst.is_followed[k] else trial
            for k, trial in enumerate(trials)
        ]

    def judge_alone(self, task: Task, configuration: Array, holder_configuration: Array | None) -> Array:
        """Shares that one operator's configuration leaves free if its task were the only one, the worst first.

        Of the other robots only the first holder moves. Collisions and the other holders are not checked.
        """
        cell = self._cell_alone(task.robot)
        start = np.concatenate([np.clip(0.0, *finite_limits(robot.model)) for robot in cell.robots])
        start[cell.columns(task.robot)] = configuration
        for name in cell.positioners[:1]:
            start[cell.columns(name)] = holder_configuration
        of_task = next(phase for phase in self._phases if task.name in phase.tasks)
        phase = of_task.among({*cell.positioners, task.robot})
        chosen = np.concatenate([np.full(len(robot.model.joints), robot.name in phase.moving) for robot in cell.robots])
        try:
            motions = self._motions(cell, start, [phase])
        except NoSolutionError:
            return np.full(2 * int(chosen.sum()), LOST)
        turns = _whole_turns(cell, motions[0])
        ranges, speeds = _shares_left_free(cell, motions[0] + turns, self._step)
        return np.sort(np.concatenate([ranges[chosen], speeds[chosen]]))

    def _contact_on_path(self, phase: Phase, q: Array) -> str:
        """What collides in the motion of a run, shape (N, nq), judged at a few samples; empty where nothing does.

        A grip that leaves components free and is too deep in the part at the start counts as well.
        """
        sample_times = np.linspace(0, len(q) - 1, TOUCH_INSTANTS).astype(int)
        placed = self._order.as_listed(standing(self._cell, phase, q[sample_times]))
        among = self.open_pairs & present_pairs(self._scene, phase)
        for grip in mounted_depths(self._open_grips, placed[:1]):
            if grip.depth > grip.pair.limit:
                first, second = (self.bodies[end].name for end in (grip.pair.first, grip.pair.second))
                return f"'{first}' is {MM * grip.depth:.3g} mm deep in '{second}' at the start"
        for sample, configuration in zip(sample_times, placed, strict=True):
            pair = self._scene.touching(configuration, among=among)
            if pair is not None:
                return f"'{pair[0]}' touches '{pair[1]}' at {100 * sample / max(1, len(q) - 1):.0f} % of the way"
        return ""

    def _crossing(self, phase: Phase, q: Array) -> frozenset[str]:
        """Arms of six joints whose Jacobian changes its sign while their tool is in a process, in a motion (N, nq)."""
        crossing = set()
        for task in self._cell.tasks:
            columns = self._cell.columns(task.robot)
            if task.name not in phase.tasks or task.process is None or columns.stop - columns.start != ARM:
                continue
            determinants = np.linalg.det(self._scene.chains[task.robot].flange_screws(q[:, columns]))
            if determinants.min() < 0.0 < determinants.max():
                crossing.add(task.robot)
        return frozenset(crossing)

    def _paths_of(self, names: Sequence[str]) -> list[ClockedPath]:
        """Paths of some tasks, gone through once, in the order of the cell."""
        return [path for name, path in self._paths.items() if name in names]

    def _schedule(self, names: Sequence[str]) -> Schedule:
        """Some tasks on the coarse clock, sampled once for all trials."""
        paths = self._paths_of(names)
        key = tuple(path.task.name for path in paths)
        if key not in self._schedules:
            self._schedules[key] = schedule_paths(self._cell, paths)
        return self._schedules[key]

    def _cell_alone(self, robot: str) -> Cell:
        """The cell with the first holder and one operator; all robots stay where goals may evaluate them."""
        if robot not in self._alone:
            whole = self._cell
            names = (
                {robot, *whole.positioners[:1]}
                if not whole.solver.secondary.goals
                else {robot.name for robot in whole.robots}
            )
            self._alone[robot] = replace(
                whole,
                robots=tuple(robot for robot in whole.robots if robot.name in names),
                tasks=tuple(task for task in whole.tasks if task.robot in names),
                part=replace(whole.part, held_by=whole.part.held_by[:1]),
            )
        return self._alone[robot]

    def _motions(self, cell: Cell, start: Array, phases: Sequence[Phase]) -> list[Array]:
        """Joint positions of each run on the coarse clock, shape (N, nq) each."""
        motions = []
        for phase in phases:
            schedule = self._schedule(phase.tasks)
            motions.append(integrate_schedule(MotionTask(cell, schedule, phase.moving, start)).q)
        return motions


def _first_cycle(task: Task, clock: float | None) -> Task:
    """A task that goes through its path once, as fast as it does on the whole."""
    duration = task.time_for_path(clock)
    return replace(task, repeat=1, duration=None if duration is None else duration / task.repeat)


def _once_through(cell: Cell, task: Task, path: ClockedPath) -> ClockedPath:
    """A path gone through once: the same times, unless it is repeated."""
    return path if path.task.repeat == 1 else clock_path(cell, task, path.toolpath)


def _open_pairs(scene: Scene) -> Flags:
    """Pairs of bodies that a choice of the search moves; collisions of given configurations are left to the report."""
    given = {None, *(robot.name for robot in scene.cell.robots if robot.start is not None)}
    bodies = scene.bodies
    is_open = [not {bodies[pair.first].robot, bodies[pair.second].robot} <= given for pair in scene.pairs]
    return np.array(is_open, dtype=bool)


def _whole_turns(cell: Cell, q: Array) -> Array:
    """Whole turns in [rad] that bring the motion of each joint nearest to mid-range; none where the start is given.

    A configuration does not show on which turn its joints are, and a wrist may need a whole turn of room on one side.
    """
    turns = np.zeros(q.shape[1])
    for robot in cell.robots:
        if robot.start is None:
            lower, upper = robot.model.lower, robot.model.upper
            motion = q[:, cell.columns(robot.name)]
            turning = np.isfinite(upper - lower) & np.array([joint.is_revolute for joint in robot.model.joints])
            middle = 0.5 * np.add(lower, upper, out=np.zeros_like(lower), where=turning)
            turn = -2 * np.pi * np.round((0.5 * (motion.min(axis=0) + motion.max(axis=0)) - middle) / (2 * np.pi))
            start = motion[0] + turn
            turns[cell.columns(robot.name)] = np.where(turning & (start >= lower) & (start <= upper), turn, 0.0)
    return turns


def _shares_left_free(cell: Cell, q: Array, step: float) -> tuple[Array, Array]:
    """Shares of half its range and of its speed limit that each joint leaves free in a motion, shape (nq,) each."""
    limits = cell.joint_limits
    ranges = _range_shares(cell, np.minimum(q.min(axis=0) - limits.lower, limits.upper - q.max(axis=0)))
    return ranges, 1.0 - np.abs(np.diff(q, axis=0)).max(axis=0, initial=0.0) / step / limits.velocity


def _range_shares(cell: Cell, margins: Array) -> Array:
    """Distances of joints from their limits as shares of half their ranges, 1 without limits, shape (..., nq)."""
    half = 0.5 * (cell.joint_limits.upper - cell.joint_limits.lower)
    half = np.where(np.isfinite(half), half, np.pi)
    return np.minimum(margins / np.where(half > 0.0, half, 1.0), 1.0)


def present_pairs(scene: Scene, phase: Phase) -> Flags:
    """Which pairs of a scene do not depend on a home that is still to be found, shape (pairs,)."""
    is_present = np.ones(len(scene.pairs), dtype=bool)
    for name in homeless(scene.cell, phase):
        is_present[rows_moved_by(scene, name)] = False
    return is_present
