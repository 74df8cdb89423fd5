"""Start trials: what a start posture is worth, seen from the motion that follows from it on a coarse clock."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell, Mode
from cellplan.model.task import Task
from cellplan.model.toolpath import Toolpath
from cellplan.planning.follow import follow
from cellplan.planning.inverse_kinematics import finite_limits, margin_shares
from cellplan.planning.modes import RunPlan, plan_runs, standing
from cellplan.planning.run_pairs import present_pairs
from cellplan.planning.schedule import schedule_tasks
from cellplan.scene.scene import Scene

SAMPLES: Final = 160  # instants of the coarse motion that a posture is judged by
GAIN: Final = 0.5  # feedback gain times step of the coarse motion
TOUCH_INSTANTS: Final = 12  # instants of the coarse motion that are looked at for collisions
TRIED_WITH: Final = "weighted_pseudo_inverse"  # fast, and it shows how far a posture would go beyond its limits
TOUCHING: Final = 2.0  # taken off the quality of a posture that collides on the way


class StartTrials:
    """The coarse clock of one cell, on which start postures are tried.

    Attributes:
        open_pairs: Pairs of bodies that a choice of the search moves and that meet in some run, shape (pairs,); what
            given postures make collide is for the report to say.
    """

    def __init__(self, scene: Scene, toolpaths: Mapping[str, Toolpath]) -> None:
        """Choose a step that makes few samples of the whole motion, of which every path is gone through once."""
        cell = replace(scene.cell, tasks=tuple(_first_cycle(task) for task in scene.cell.tasks))
        schedule = schedule_tasks(cell, [toolpaths[task.name] for task in cell.tasks])
        step = float(max(cell.motion.step, schedule.times[-1] / SAMPLES))
        self._scene, self._toolpaths, self._step = scene, toolpaths, step
        self._cell = replace(
            cell,
            motion=replace(
                cell.motion, step=step, locked=(), cyclic=False
            ),  # which joint fails is not known beforehand
            solver=replace(cell.solver, gain=GAIN / step, method=TRIED_WITH),
        )
        self._alone: dict[str, Cell] = {}
        self._plans = plan_runs(self._cell)
        is_present = np.any([present_pairs(scene, plan) for plan in self._plans], axis=0)
        self.open_pairs = _open_pairs(scene) & is_present

    def judge(self, start: Array) -> tuple[float, Array]:
        """Quality of a start posture of the whole cell, and the posture on the turns that leave its joints most room.

        The quality is the smallest share of joint range and joint speed left free, less when something collides; -inf
        when a tool loses its path.
        """
        try:
            motions = self._motions(self._cell, start, self._plans)
        except NoSolutionError:
            return -np.inf, start
        turns = _whole_turns(self._cell, np.concatenate(motions))
        quality = min(_share_left_free(self._cell, q + turns, self._step) for q in motions)
        for plan, q in zip(self._plans, motions, strict=True):
            instants = np.linspace(0, len(q) - 1, TOUCH_INSTANTS).astype(int)
            placed, among = standing(self._cell, plan, q[instants]), self.open_pairs & present_pairs(self._scene, plan)
            if any(self._scene.touching(posture, among=among) is not None for posture in placed):
                quality = min(quality, 1.0) - TOUCHING
        return quality, start + turns

    def judge_alone(self, task: Task, posture: Array, holder_posture: Array | None) -> float:
        """Quality of one operator's posture, as if its task were the only one beside what the first holder does.

        Collisions and the other holders are not looked at.
        """
        cell = self._cell_alone(task.robot)
        start = np.concatenate([np.clip(0.0, *finite_limits(robot.model)) for robot in cell.robots])
        start[cell.columns(task.robot)] = posture
        for name in cell.positioners[:1]:
            start[cell.columns(name)] = holder_posture
        movers = () if cell.motion.mode is Mode.PART_AT_REST else cell.positioners
        is_together = cell.motion.mode is Mode.SIMULTANEOUS
        tasks = tuple(
            each.name for each in cell.tasks if each.name == task.name or (is_together and each.robot in movers)
        )
        try:
            motions = self._motions(cell, start, [RunPlan(name=None, tasks=tasks, moving=(*movers, task.robot))])
        except NoSolutionError:
            return -np.inf
        turns = _whole_turns(cell, motions[0])
        return _share_left_free(cell, motions[0] + turns, self._step, only=(*movers, task.robot))

    def _cell_alone(self, robot: str) -> Cell:
        """The cell with the first holder and one operator; all robots stay where goals may look at them."""
        if robot not in self._alone:
            whole = self._cell
            kept = {robot, *whole.positioners[:1]} if not whole.solver.goals else {each.name for each in whole.robots}
            self._alone[robot] = replace(
                whole,
                robots=tuple(each for each in whole.robots if each.name in kept),
                tasks=tuple(each for each in whole.tasks if each.robot in kept),
                part=replace(whole.part, held_by=whole.part.held_by[:1]),
            )
        return self._alone[robot]

    def _motions(self, cell: Cell, start: Array, plans: Sequence[RunPlan]) -> list[Array]:
        """Joint positions of each run on the coarse clock, shape (N, nq) each."""
        motions = []
        for run in plans:
            schedule = schedule_tasks(cell, [self._toolpaths[name] for name in run.tasks])
            motions.append(follow(cell, schedule, start=start, moving=run.moving).q)
        return motions


def _first_cycle(task: Task) -> Task:
    """A task that goes through its path once, as fast as it does on the whole."""
    duration = None if task.duration is None else task.duration / task.repeat
    return replace(task, repeat=1, duration=duration)


def _open_pairs(scene: Scene) -> NDArray[np.bool_]:
    """Pairs of bodies that a choice of the search moves; what given postures make collide is for the report to say."""
    given = {None, *(robot.name for robot in scene.cell.robots if robot.start is not None)}
    bodies = scene.bodies
    is_open = [not {bodies[pair.first].robot, bodies[pair.second].robot} <= given for pair in scene.pairs]
    return np.array(is_open, dtype=bool)


def _whole_turns(cell: Cell, q: Array) -> Array:
    """Whole turns in [rad] that bring the motion of each joint nearest to mid-range; none where the start is given.

    A posture does not show on which turn its joints are, and a wrist may need a whole turn of room on one side.
    """
    turns = np.zeros(q.shape[1])
    for robot in cell.robots:
        if robot.start is None:
            lower, upper = robot.model.lower, robot.model.upper
            motion = q[:, cell.columns(robot.name)]
            turning = np.isfinite(upper - lower) & np.array([joint.is_revolute for joint in robot.model.joints])
            middle = 0.5 * np.where(turning, lower + upper, 0.0)
            own = -2 * np.pi * np.round((0.5 * (motion.min(axis=0) + motion.max(axis=0)) - middle) / (2 * np.pi))
            start = motion[0] + own
            turns[cell.columns(robot.name)] = np.where(turning & (start >= lower) & (start <= upper), own, 0.0)
    return turns


def _share_left_free(cell: Cell, q: Array, step: float, *, only: Sequence[str] | None = None) -> float:
    """Smallest share of a joint's half range or speed limit that a motion leaves free; negative when it breaks one."""
    shares = [1.0]
    for robot in cell.robots:
        if only is not None and robot.name not in only:
            continue
        positions = q[:, cell.columns(robot.name)]
        shares.append(float(margin_shares(robot.model, positions).min()))
        speeds = np.abs(np.diff(positions, axis=0)) / step
        shares.append(1.0 - float((speeds / robot.model.velocity).max(initial=0.0)))
    return min(shares)
