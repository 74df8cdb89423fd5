"""Program: the phases of a plan as rows on one clock, and these rows cut into their phases again."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.errors import InputError
from cellplan.files.run.stored import CLOCK
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.motion import Clock, ClockTable, JointTable, Motion, Schedule
from cellplan.model.motion.plan import Hold, Interval, Phase, Plan, rows_of
from cellplan.model.task.clocked_path import are_within, fixed_rests
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import TIME_DECIMALS, retimed_schedule, schedule_tasks

STILL_TOL: Final = 1e-9  # [rad] or [m] tables have twelve decimals of a degree or a millimetre


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramClock:
    """A plan on the clock of its program, and the desired tool poses of each phase.

    The rows of the phases follow one another. A phase begins in the last row of the one before it; where something that
    is not part of the program lies between two phases, it takes the step between their rows, and no motion is
    described or certified there.

    Attributes:
        schedules: Desired tool poses of each phase of the program, on the phase's own time, which starts at 0.
    """

    plan: Plan  # the plan, its phases on the nominal time of the whole program
    times: Array  # times of all rows in [s], shape (N,)
    sigma: Array  # nominal time of each row in [s], shape (N,)
    schedules: tuple[Schedule, ...]

    @classmethod
    def of(cls, cell: Cell, plan: Plan, schedules: Sequence[Schedule]) -> Self:
        """Put the phases of a program, whose plan is on no clock yet, one after the other."""
        steps = [len(schedule.times) - 1 for schedule in schedules]
        first = np.cumsum([0, *(count + gap for count, gap in zip(steps, _gap_steps(plan), strict=True))]).tolist()
        times = np.round(np.arange(first[-1] + 1) * cell.motion.step, TIME_DECIMALS)
        ends = [(float(times[row]), float(times[row + count])) for row, count in zip(first[:-1], steps, strict=True)]
        placed = [replace(phase, begin=b, end=e) for phase, (b, e) in zip(plan.program, ends, strict=True)]
        return cls(plan=_placed(plan, placed, schedules), times=times, sigma=times, schedules=tuple(schedules))

    @classmethod
    def from_cell(cls, cell: Cell, plan: Plan) -> Self:
        """The clock of a program as its cell demands it; nothing of it is taken from a run."""
        schedules = []
        for phase in plan.program:
            toolpaths = [build_toolpath(cell.task(name), cell.part) for name in phase.tasks]
            schedules.append(schedule_tasks(cell, toolpaths))
        return cls.of(cell, plan, schedules)

    def retimed(self, sigma: Array) -> Self:
        """The same program with other nominal times in its rows, a step of the clock apart as before.

        Args:
            sigma: Nominal times of all rows in [s], shape (N,), increasing; the first and the last row of each phase
                have those at which it begins and ends.
        """
        step = self.schedules[0].step
        schedules = []
        for phase, schedule in zip(self.plan.program, self.schedules, strict=True):
            nominal = sigma[rows_of(phase, sigma)] - phase.begin
            times = np.round(np.arange(len(nominal)) * step, TIME_DECIMALS)
            schedules.append(retimed_schedule(schedule, Clock(times=times, sigma=nominal)))
        times = np.round(np.arange(len(sigma)) * step, TIME_DECIMALS)
        return replace(self, times=times, sigma=sigma, schedules=tuple(schedules))

    @property
    def gaps(self) -> dict[int, str]:
        """Names of interruptions of the program, by the first row after each."""
        return self.plan.gaps(self.sigma)

    @property
    def timed_phases(self) -> tuple[Phase, ...]:
        """All phases of the plan with the times of their first and last rows in [s]."""
        if self.sigma is self.times:
            return self.plan.phases
        ends = np.array([[phase.begin, phase.end] for phase in self.plan.phases])
        at = Clock(times=self.times, sigma=self.sigma).reached_at(ends).tolist()
        return tuple(replace(p, begin=b, end=e) for p, (b, e) in zip(self.plan.phases, at, strict=True))

    def motion(self, q: Sequence[Array]) -> Motion:
        """The motion of the program from that of its phases, shape (n, nq) each."""
        clock = Clock(times=self.times, sigma=self.sigma)
        return Motion(times=clock.times, sigma=clock.sigma, q=self.joined(q), plan=self.plan)

    def joined(self, rows: Sequence[Array]) -> Array:
        """The rows of all phases one after the other; a row that two of them share is that of the first.

        Args:
            rows: Values in the rows of each phase of the program, shape (n, ...) each.
        """
        shared = [False, *(gap == 0 for gap in _gap_steps(self.plan)[:-1])]
        return np.concatenate([stacked[1:] if skip else stacked for stacked, skip in zip(rows, shared, strict=True)])

    def table(self, tasks: Sequence[str]) -> ClockTable:
        """What happens at each row, with columns for tasks in this order."""
        names = [""] * len(self.times)
        lengths = {task: np.zeros(len(self.times)) for task in tasks}
        for phase, schedule in zip(self.plan.program, self.schedules, strict=True):
            rows = rows_of(phase, self.sigma)
            names[rows] = [phase.name] * (rows.stop - rows.start)
            for scheduled in (task for task in schedule.tasks if task.task.name in lengths):
                lengths[scheduled.task.name][rows] = scheduled.travelled
                lengths[scheduled.task.name][rows.stop :] = scheduled.travelled[-1]
        process = {task: are_within(self.sigma, self.plan.process[task]) for task in tasks}
        return ClockTable(
            times=self.times, sigma=self.sigma, phases=tuple(names), lengths=lengths, process=process, gaps=self.gaps
        )

    def cut(self, tables: Sequence[JointTable], place: int) -> list[JointTable]:
        """The rows of one phase of the program on the phase's own time.

        Args:
            tables: One table per robot, with all rows of the program and its times.
            place: Number of the phase among those of the program.
        """
        rows = rows_of(self.plan.program[place], self.sigma)
        times = self.schedules[place].times
        return [replace(table, times=times, q=table.q[rows], gaps={}) for table in tables]


def refuse_clock_name(cell: Cell) -> None:
    """Refuse a robot whose table would have the name of the clock.

    Raises:
        InputError: There is such a robot.
    """
    for robot in cell.robots:
        if robot.name.lower() == CLOCK:
            where = cell.origin.at(f"robots.{robot.name}")
            raise InputError(f"{where}: expected another name: tables/{CLOCK}.csv is the clock of the whole program")


def moved_while_holding(phase: Phase, robot: str, q: Array) -> tuple[int, int] | None:
    """The first row and joint at which a robot moves that holds still in a phase; None where it does hold still.

    Args:
        q: Its joint positions in the rows of the phase in [rad] or [m], shape (n, joints).
    """
    if not isinstance(phase.roles[robot], Hold):
        return None
    row, joint = np.nonzero(np.abs(q - q[0]) > STILL_TOL)
    return (int(row[0]), int(joint[0])) if len(row) else None


def off_given_path(phase: Phase, robot: Robot, sigma: Array, q: Array) -> tuple[int, int] | None:
    """The first row and joint at which a robot is off the path that its cell gives; None where it keeps to it.

    Args:
        phase: The phase, which is the only one of its program.
        sigma: Nominal times of the rows in [s], shape (N,).
        q: Its joint positions in these rows in [rad] or [m], shape (N, joints).
    """
    if robot.path is None or isinstance(phase.roles[robot.name], Hold):
        return None
    row, joint = np.nonzero(np.abs(q - robot.path.at(np.clip(sigma / phase.end, 0.0, 1.0))) > STILL_TOL)
    return (int(row[0]), int(joint[0])) if len(row) else None


def _gap_steps(plan: Plan) -> list[int]:
    """Steps between the last row of each phase of the program and the first of the next: 1 over a gap, else 0."""
    after = [not phase.in_program for phase in plan.phases[1:]]
    return [int(gap) for phase, gap in zip(plan.phases, [*after, False], strict=True) if phase.in_program]


def _placed(plan: Plan, placed: Sequence[Phase], schedules: Sequence[Schedule]) -> Plan:
    """The plan with the phases of its program on the clock, and all others between them."""
    left = list(placed)
    phases: list[Phase] = []
    for phase in plan.phases:
        phases.append(left.pop(0) if phase.in_program else replace(phase, begin=phases[-1].end, end=left[0].begin))
    stops: dict[str, tuple[float, ...]] = {}
    process: dict[str, tuple[Interval, ...]] = {}
    dwells: set[Interval] = set()
    for phase, schedule in zip(placed, schedules, strict=True):
        begin = phase.begin
        for scheduled in schedule.tasks:
            task = scheduled.task
            working = tuple((begin + on, begin + off) for on, off in scheduled.process_on)
            process[task.name] = (*process.get(task.name, ()), *working)
            stops[task.name] = (*stops.get(task.name, ()), *(begin + stop for stop in scheduled.stops))
        rests = (rest for path in schedule.paths for rest in fixed_rests(path))
        dwells |= {(begin + first, begin + last) for first, last in rests}
    return replace(plan, phases=tuple(phases), stops=stops, process=process, dwells=tuple(sorted(dwells)))
