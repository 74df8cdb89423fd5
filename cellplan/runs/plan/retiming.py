"""Retiming of a program: each phase as fast as joints, feeds and errors between rows allow, or in a demanded time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.certify.point_speeds import point_speeds
from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.measures.accelerations import part_acceleration
from cellplan.measures.limit_shares import rate_limits, row_loads
from cellplan.measures.tool_errors import error_lengths, part_poses, relative_to_task_frame
from cellplan.model.cell.cell import Cell, Relation, Timing
from cellplan.model.motion.joint_path import JointPath
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.settings.units import si_or_none
from cellplan.model.task.clocked_path import ClockedPath, fixed_rests, run_easing, travel_speeds, work_span
from cellplan.model.task.task import Task
from cellplan.planning.timing.fixed_rates import FixedRate
from cellplan.planning.timing.retime import JointLimitsInTime, Retimer
from cellplan.planning.timing.schedule import TIME_DECIMALS
from cellplan.runs.plan.program import ProgramClock
from cellplan.runs.plan.torque_limits import torque_limits
from cellplan.scene.scene import Scene

POINTS: Final = 2000  # [-] nominal times at which the bend of the joint path is taken
HALF_STEP: Final = 1e-3  # [s] of nominal time, but for short paths
SHARES: Final = tuple(tenth / 10.0 for tenth in range(1, 10))  # [-] of a step at which errors are taken
SAFELY: Final = 1.02  # [-] by which a speed is lowered more than the square root of an error asks for
PER_BEND: Final = 6.5  # [-] a step of length h errs by b h^2 / 8; out of rest, where b grows with time, b h^2 / 6.8
ROUNDING: Final = 5e-10  # [s] of nominal times in rows
NOMINAL_STEP: Final = 1e-4  # [s] of nominal time over which the speed of a tool is taken


class StepErrors:
    """Errors of all tools in steps along a joint path, in which the joints move linearly."""

    def __init__(self, scene: Scene, paths: Sequence[ClockedPath], path: JointPath) -> None:
        """Take the bend of the joint path once."""
        self._scene, self._paths, self._path = scene, tuple(paths), path
        half = min(HALF_STEP, 0.25 * path.end)
        self._at = np.linspace(half, path.end - half, POINTS + 1)
        middle = 0.5 * (path.at(self._at - half) + path.at(self._at + half))
        self._root = np.sqrt(8.0 / PER_BEND * self._shares(self._at, middle)) / (2.0 * half)
        self._tightened = self._root.copy()

    def steepness(self, sigma: Array, step: float) -> Array:
        """Reciprocal of the largest rate of the nominal time with which steps of a length in [s] keep the tolerances.

        Args:
            sigma: Nominal times in [s], shape (N,).
            step: Time between two rows in [s].
        """
        return step * np.interp(sigma, self._at, self._root)

    def largest(self, sigma: Array) -> Array:
        """Largest error in each step between nominal times in [s], as a share of what is allowed, shape (N - 1,)."""
        q, errors = self._path.at(sigma), np.zeros(len(sigma) - 1)
        for share in SHARES:
            between = (1.0 - share) * q[:-1] + share * q[1:]
            nominal = (1.0 - share) * sigma[:-1] + share * sigma[1:]
            errors = np.maximum(errors, self._shares(nominal, between))
        return errors

    def tighten(self, sigma: Array) -> bool:
        """Make the motion slower from now on where steps miss a tolerance.

        Args:
            sigma: Nominal times of rows in [s], shape (N,).

        Returns:
            Whether no step misses one.
        """
        errors = self.largest(sigma)
        for k in np.flatnonzero(errors > 1.0).tolist():
            ends = np.searchsorted(self._at, sigma[[max(0, k - 1), min(len(sigma) - 1, k + 2)]])
            around = slice(int(ends[0]), int(ends[1]) + 1)
            factor = (SAFELY * errors[k]) ** 0.5
            self._tightened[around] = np.maximum(self._tightened[around], factor * self._root[around])
        self._root = self._tightened.copy()
        return bool(errors.max() <= 1.0)

    def _shares(self, sigma: Array, q: Array) -> Array:
        """Largest error at each nominal time in [s] with these joints, as a share of what is allowed, shape (N,)."""
        cell, chains = self._scene.cell, self._scene.chains
        by_robot = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}
        X_WP = part_poses(cell, chains, by_robot)
        closure = np.array([cell.checks.closure_mm.si, cell.checks.closure_deg.si])
        relations: list[tuple[Relation, Array, Array]] = [
            *((path.task, path.poses(sigma), _allowed(path, sigma)) for path in self._paths),
            *((grasp, grasp.X_PT[None], closure) for grasp in cell.closures),
        ]
        worst = np.zeros(len(sigma))
        for relation, desired, allowed in relations:
            X_WT = chains[relation.robot].tool_poses(by_robot[relation.robot])
            shares = error_lengths(relative_to_task_frame(relation, X_WT, X_WP), desired, relation) / allowed
            worst = np.maximum(worst, shares.max(axis=1))
        return worst


def _allowed(path: ClockedPath, sigma: Array) -> Array:
    """Largest errors of a tool between rows in [m] and [rad] at nominal times in [s], shape (N, 2)."""
    easing = run_easing(path.task, (path.start, path.end), work_span(path), sigma)
    position, orientation = path.task.tolerance.between
    return np.stack([position / easing, np.full(len(sigma), orientation)], axis=1)


def retimed(
    scenes: Sequence[Scene], clock: ProgramClock, motions: Sequence[Motion], *, progress: Progress = silent
) -> tuple[ProgramClock, list[Motion]]:
    """A program and the motions of its phases, as their time laws have them, on the clock that the cell asks for.

    Returns:
        The same objects where the program runs as it is written.

    Raises:
        InputError: The joints cannot go as fast as the demanded cycle asks for.
    """
    cell = scenes[0].cell
    if cell.motion.timing is Timing.AS_WRITTEN:
        return clock, list(motions)
    phases = clock.plan.program
    paths = [joint_path(motion) if phase.tasks else None for phase, motion in zip(phases, motions, strict=True)]
    retimed_phases = _Retimed(scenes, clock, motions, paths)
    is_whole = cell.program.is_home_to_home  # the cycle is that of all phases together
    clocks = retimed_phases.nominal([None if is_whole else cell.motion.cycle] * len(motions), progress)
    if is_whole and cell.motion.cycle is not None:
        clocks = retimed_phases.nominal(retimed_phases.cycles(clocks), progress)
    nominal = [phase.begin + sigma for phase, sigma in zip(phases, clocks, strict=True)]
    for phase, sigma in zip(phases, nominal, strict=True):
        np.round(sigma, TIME_DECIMALS, out=sigma)
        sigma[0], sigma[-1] = phase.begin, phase.end
    clock = clock.retimed(clock.joined(nominal))
    return clock, retimed_phases.motions_at(clock, nominal)


@dataclass(frozen=True, slots=True, eq=False)
class _Retimed:
    """The phases of a program that is retimed; transfer moves and dwells keep their rows."""

    scenes: Sequence[Scene]  # the scene of each phase
    clock: ProgramClock  # the program as its time laws have it
    motions: Sequence[Motion]  # motion of each phase, likewise
    paths: Sequence[JointPath | None]  # the joints of each phase between its rows too; None where it keeps its rows

    def nominal(self, cycles: Sequence[float | None], progress: Progress) -> list[Array]:
        """Nominal times of the rows of each phase in [s] from its begin, as fast as possible or in given times."""
        curves: dict[tuple[int, float | None], Array] = {}  # all cycles of a program have the same motions
        for place, (motion, path, cycle) in enumerate(zip(self.motions, self.paths, cycles, strict=True)):
            progress("retiming", place / len(cycles))
            if (key := (id(motion), cycle)) not in curves:
                schedule = self.clock.schedules[place]
                scene = self.scenes[place]
                curves[key] = motion.times if path is None else _nominal_times(scene, schedule, path, cycle)
        return [curves[id(motion), cycle].copy() for motion, cycle in zip(self.motions, cycles, strict=True)]

    def cycles(self, fastest: Sequence[Array]) -> list[float | None]:
        """Times in [s] of the phases in the demanded cycle of a program from home to home, all slower alike."""
        cell = self.scenes[0].cell
        motion, count = cell.motion, cell.program.cycles
        of_one = len(fastest) // count
        steps = np.array([len(sigma) - 1 for sigma in fastest[:of_one]])
        is_open = np.array([path is not None for path in self.paths[:of_one]])
        left = round((motion.cycle or 0.0) / motion.step) - int(steps[~is_open].sum())
        if left < steps[is_open].sum():
            raise InputError(
                f"{cell.origin.at('motion.timing')}: expected a cycle of at least {steps.sum() * motion.step:.6g} s, "
                f"which the program with its transfer moves takes, got {motion.cycle:g}; make it longer, or write "
                "fastest"
            )
        ends = np.round(np.cumsum(steps * is_open) * (left / max(1, int(steps[is_open].sum())))).astype(int)
        counts = np.diff(ends, prepend=0)
        return [
            float(cycle * motion.step) if free else None for cycle, free in zip(counts, is_open, strict=True)
        ] * count

    def motions_at(self, clock: ProgramClock, nominal: Sequence[Array]) -> list[Motion]:
        """The motion of each phase in the rows of another clock."""
        made: list[Motion] = []
        for place, (phase, path, motion) in enumerate(zip(clock.plan.program, self.paths, self.motions, strict=True)):
            nominal_times, times = nominal[place] - phase.begin, clock.schedules[place].times
            q = motion.q if path is None else path.at(nominal_times)
            made.append(replace(motion, times=times, sigma=nominal_times, q=q, iterations=None, slack=None))
        return made


def joint_path(motion: Motion) -> JointPath:
    """The joints over the nominal time, also between the rows; those that stand still in the rows do so everywhere."""
    if motion.path is None:
        return JointPath.through(motion.times, motion.q)
    stands = np.all(motion.q == motion.q[0], axis=0)
    nodes = [np.where(stands[:, None], motion.q[0][:, None], node) for node in motion.path.nodes]
    return replace(motion.path, start=motion.q[0], nodes=nodes)


def joint_bounds(cell: Cell) -> JointLimitsInTime:
    """Limits of all joints of a cell: stated ones, else those that the cell assumes."""
    velocity, acceleration, jerk = rate_limits(cell)
    return JointLimitsInTime(velocity=velocity, acceleration=acceleration, jerk=jerk)


@dataclass(frozen=True, slots=True, eq=False)
class RowLimits:
    """The limits of a cell in rows of one phase, as the checks compute them."""

    scene: Scene  # the scene of the cell
    paths: tuple[ClockedPath, ...]  # paths of the tasks that are worked on
    bounds: JointLimitsInTime  # limits of all joints
    step: float  # time between two rows in [s]
    # the joints over the nominal time; needed for the speed of the tools in the world only
    path: JointPath | None = None
    errors: StepErrors | None = None  # errors of the tools between rows; None where they do not bound the speed

    def shares(self, times: Array, q: Array) -> tuple[Array, Array, Array]:
        """Largest velocity, acceleration and jerk of each joint, in shares of the limits, shape (nq,) each."""
        cell = self.scene.cell
        loads = [row_loads(robot, times, q[:, cell.columns(robot.name)]).max(axis=1) for robot in cell.robots]
        velocity, acceleration, jerk = np.concatenate(loads, axis=1)
        return velocity / self.bounds.velocity, acceleration / self.bounds.acceleration, jerk / self.bounds.jerk

    def slower(self, sigma: Array, q: Array) -> float:
        """By which factor rows have to be slower for every limit to hold in them.

        Args:
            sigma: Nominal times of the rows in [s], shape (N,).
            q: Stacked joint positions in [rad] or [m], shape (N, nq).
        """
        return max(self._slower_by_rates(sigma, q), self._slower_by_torques(sigma, q))

    def slower_at_first(self, sigma: Array, q: Array) -> float:
        """The same, but torques, which take longest to work out, count once all other limits hold."""
        factor = self._slower_by_rates(sigma, q)
        return factor if factor > 1.0 else max(factor, self._slower_by_torques(sigma, q))

    def _slower_by_torques(self, sigma: Array, q: Array) -> float:
        times = np.round(np.arange(len(q)) * self.step, TIME_DECIMALS)
        return float(self.torques(times, q, sigma=sigma)[1].max(initial=0.0))

    def _slower_by_rates(self, sigma: Array, q: Array) -> float:
        """By which factor rows have to be slower for all limits but those of torques."""
        times = np.round(np.arange(len(q)) * self.step, TIME_DECIMALS)
        velocity, acceleration, jerk = (float(shares.max()) for shares in self.shares(times, q))
        feed = max([self._waits(sigma), *self.feeds(sigma, times).values()])
        tools = float(self._tool_moves(q[:-1], q[1:]).max()) / self.step
        points = max((float(it.travel(q).max()) / (self.step * it.limit) for it in self.bounds.points), default=0.0)
        part = self._part_share(times, q) ** 0.5
        return max(velocity, acceleration**0.5, jerk ** (1.0 / 3.0), feed, tools, points, part)

    def torques(self, times: Array, q: Array, *, sigma: Array) -> tuple[Array, Array]:
        """Largest torque of each joint as a share of its limit, and how much slower it asks for, shape (nq,) each."""
        shares, factors = np.zeros((2, q.shape[1]))
        for it in self.bounds.torques:
            shares[it.columns], factors[it.columns] = it.in_rows(times, q, sigma=sigma)
        return shares, factors

    def feeds(self, sigma: Array, times: Array) -> dict[str, float]:
        """Largest speed of each tool along its path between rows, as a share of its feed, by task with a feed.

        Args:
            sigma: Nominal times of the rows in [s], shape (N,).
            times: Their times in [s], shape (N,).
        """
        return {
            path.task.name: float((np.diff(path.targets(sigma)[2]) / np.diff(times)).max() / _largest_feed(path.task))
            for path in self.paths
            if path.task.feed is not None
        }

    def _waits(self, sigma: Array) -> float:
        """Longest stretch of nominal time of a delay or a dwell in a step, as a share of the step."""
        within = [
            np.minimum(sigma[1:], end) - np.maximum(sigma[:-1], begin)
            for path in self.paths
            for begin, end in fixed_rests(path)
        ]
        return float(np.max(within, initial=0.0) - ROUNDING) / self.step

    def feed_share(self, sigma: Array) -> Array:
        """Share of the speed limits of the tools that is taken up at the speed of the nominal time, shape (N,)."""
        share = np.zeros(len(sigma))
        for path in self.paths:
            if path.task.feed is not None:
                is_moving = (sigma >= path.start) & (sigma <= path.end)
                share = np.maximum(share, is_moving * travel_speeds(path, sigma) / path.task.feed)
            for begin, end in fixed_rests(path):
                share = np.maximum(share, (sigma >= begin) & (sigma <= end))
        if self.errors is not None:
            share = np.maximum(share, self.errors.steepness(sigma, self.step))
        if self.path is not None:
            q, move = self.path.at(sigma), 0.5 * NOMINAL_STEP * self.path.at(sigma, 1)
            share = np.maximum(share, self._tool_moves(q - move, q + move) / NOMINAL_STEP)
        return share

    def _tool_moves(self, before: Array, after: Array) -> Array:
        """Longest moves of a tool tip in the world, divided by the speed that is allowed, in [s], shape (N,)."""
        cell, limit = self.scene.cell, si_or_none(self.scene.cell.checks.tool_speed_mm_s)
        longest = np.zeros(len(before))
        for robot in cell.robots if limit is not None else ():
            columns, chain = cell.columns(robot.name), self.scene.chains[robot.name]
            at = [chain.tool_poses(q[:, columns])[:, :3, 3] for q in (before, after)]
            longest = np.maximum(longest, np.linalg.norm(at[1] - at[0], axis=1) / limit)
        return longest

    def _part_share(self, times: Array, q: Array) -> float:
        """Acceleration of the part as a share of what is allowed."""
        cell, limit = self.scene.cell, self.scene.cell.checks.part_acceleration_m_s2
        if limit is None or not cell.positioners:
            return 0.0
        by_robot = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}
        X_WP = part_poses(cell, self.scene.chains, by_robot)
        cycle = cell.robot(cell.positioners[0]).controller_cycle
        return part_acceleration(cell, times, X_WP, window=cycle).corner.peak / limit


def row_limits(scene: Scene, schedule: Schedule) -> RowLimits:
    """The limits in the rows of one phase; its schedule names the tasks, and says when their processes are on."""
    bounds = replace(joint_bounds(scene.cell), torques=torque_limits(scene, schedule.tasks))
    return RowLimits(scene, schedule.paths, bounds, scene.cell.motion.step)


def transfer_retimer(scene: Scene) -> Retimer:
    """What transfer moves are timed by: the limits of all joints, of the tools in the world and of the part.

    The limits of ``program.transfer`` are among them.
    """
    cap = scene.cell.program.transfer
    bounds = replace(joint_bounds(scene.cell), torques=torque_limits(scene)).in_slow_motion(cap.share)
    bounds = replace(bounds, points=point_speeds(scene, si_or_none(cap.tcp_mm_s)))
    limits = RowLimits(scene, (), bounds, scene.cell.motion.step)
    return Retimer(bounds=limits.bounds, step=limits.step, feed_share=limits.feed_share, slower=limits.slower_at_first)


def fixed_rates(paths: Sequence[ClockedPath]) -> tuple[FixedRate, ...]:
    """Where the rate of the nominal time is demanded: while a process is on, and in dwells."""
    rates = []
    for path in paths:
        process = path.task.process
        if process is not None:
            rates.append(FixedRate(begin=path.start, end=path.end, tolerance=process.tolerance))
        rates += [FixedRate(begin=begin, end=end) for begin, end in fixed_rests(path)]
    return tuple(rates)


def _largest_feed(task: Task) -> float:
    """Largest speed in [m/s] of a task with a feed."""
    return (task.feed or np.inf) * (1.0 + (task.process.tolerance if task.process else 0.0))


def _nominal_times(scene: Scene, schedule: Schedule, path: JointPath, cycle: float | None) -> Array:
    """Nominal times of the rows of one phase in [s], shape (N,): as fast as possible, or within a cycle in [s]."""
    errors, motion = StepErrors(scene, schedule.paths, path), scene.cell.motion
    limits = replace(row_limits(scene, schedule), path=path, errors=errors)
    retimer = Retimer(
        bounds=limits.bounds,
        step=motion.step,
        feed_share=limits.feed_share,
        slower=limits.slower_at_first,
        fixed_rates=fixed_rates(schedule.paths),
        errors=errors,
    )
    fastest = retimer.fastest(path)
    if cycle is None:
        return fastest.sigma
    steps = round(cycle / motion.step)
    if fastest.steps <= steps:
        sigma = fastest.lasting(steps).sigma
        if len(sigma) != steps + 1:
            raise InputError(
                f"{scene.cell.origin.at('motion.timing')}: expected a cycle of {fastest.steps * motion.step:g} s, as "
                f"feeds of processes, delays and dwells decide how long all motion takes, got {cycle:g}"
            )
        if limits.slower(sigma, path.at(sigma)) <= 1.0:
            return sigma
    least = max(fastest.steps, steps + (fastest.steps <= steps)) * motion.step
    raise InputError(
        f"{scene.cell.origin.at('motion.timing')}: expected a cycle of at least {least:.6g} s, in which all joints "
        f"keep their limits along this path, got {cycle:g}; make it longer, or write fastest"
    )
