"""Rows of a verified run as an exported program starts from them: positions, times, speeds and process."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import JointTable, Piece
from cellplan.model.motion.plan import Interval, Plan
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.task.clocked_path import are_within, stated_feeds
from cellplan.model.task.task import TIME_TOLERANCE
from cellplan.programs.elements.timed_rows import are_near
from cellplan.programs.rows.interpolant import resting, row_velocities


class NominalRows(NamedTuple):
    """A program of a run with the nominal time of its rows."""

    name: str | None  # its name among several; None for the only one
    tables: dict[str, JointTable]  # its rows by robot
    sigma: Array  # nominal times of the rows in [s], shape (N,)
    begins: tuple[float, ...]  # nominal times in [s] at which its phases begin, and the one at which the last ends


class WorkRows(NamedTuple):
    """Rows of a phase, in which tools and further holders keep their tolerances on the part."""

    rows: slice  # the rows, both ends included
    cell: Cell  # the cell as it is in the phase
    tasks: tuple[str, ...]  # names of the tasks that are worked on
    # by task, the rows nearest to where its tool stops between the ends, or its file states another feed
    corners: Mapping[str, tuple[int, ...]]
    # by task whose file states feeds, that of each step in [m/s], NaN in rapids, rests and where it is not reached
    feeds: Mapping[str, Array]


class EssentialRows(NamedTuple):
    """What a thinned program keeps."""

    rows: tuple[int, ...]  # ends, ends of phases, stops, and the ends of dwells
    work: tuple[WorkRows, ...]  # the phases of the program


def full_rows(run: VerifiedRun) -> tuple[ProgramRows, ...]:
    """All rows, without marks, of every program of a run."""
    names = [robot.name for robot in run.cell.robots]
    plan = run.motion.plan
    return tuple(
        ProgramRows(
            name=nominal.name, robots={name: _robot_rows(run.cell, plan, nominal, robot=name) for name in names}
        )
        for nominal in _programs(run)
    )


def essential_rows(run: VerifiedRun) -> tuple[EssentialRows, ...]:
    """What a thinned program keeps of each program of a run, in their order."""
    plan = run.motion.plan
    rows_of_programs = []
    for piece, nominal in zip(run.motion.pieces, _programs(run), strict=True):
        times = [*nominal.begins, *(stop for stops in plan.stops.values() for stop in stops)]
        times += [end for dwell in plan.dwells for end in dwell]
        rows = {0, len(nominal.sigma) - 1}
        for time in times:
            if nominal.sigma[0] - TIME_TOLERANCE <= time <= nominal.sigma[-1] + TIME_TOLERANCE:
                first = int(np.searchsorted(nominal.sigma, time - TIME_TOLERANCE))
                last = int(np.searchsorted(nominal.sigma, time + TIME_TOLERANCE, side="right")) - 1
                rows |= {min(first, len(nominal.sigma) - 1), max(last, 0)}
        rows_of_programs.append(EssentialRows(tuple(sorted(rows)), tuple(_work(run, piece))))
    return tuple(rows_of_programs)


def times_of(rows: RobotRows) -> Array:
    """Times of rows that have them."""
    if rows.times is None:
        raise ValueError(f"rows of '{rows.robot}': expected times")
    return rows.times


def _programs(run: VerifiedRun) -> Iterator[NominalRows]:
    """The programs of a run in their order."""
    for piece, tables in zip(run.motion.pieces, run.programs.values(), strict=True):
        begins = (*(phase.begin for _, phase, _ in piece.phases), piece.phases[-1].phase.end)
        yield NominalRows(piece.name, dict(tables), run.motion.sigma[piece.rows], begins)


def _work(run: VerifiedRun, piece: Piece) -> Iterator[WorkRows]:
    """The phases of a program, those of all cycles."""
    sigma = run.motion.sigma[piece.rows]
    for place, phase, rows in piece.phases:
        motion = run.motions[place % len(run.motions)]
        tasks = tuple(scheduled.task.name for scheduled in motion.schedule.tasks)
        paced = {path.task.name: path for path in motion.schedule.paths if path.pace is not None}
        stops = {task: np.array(run.motion.plan.stops.get(task, ())) for task in tasks}
        stops |= {task: phase.begin + np.unique(path.corners) for task, path in paced.items()}
        corners = {task: _corner_rows(sigma, rows, times) for task, times in stops.items()}
        feeds = {task: stated_feeds(path, sigma[rows] - phase.begin) for task, path in paced.items()}
        yield WorkRows(rows, motion.cell, tasks, corners, feeds)


def _corner_rows(sigma: Array, rows: slice, stops: Array) -> tuple[int, ...]:
    """Rows of a phase that are nearest to the inner ones of the nominal times at which a tool stops in it."""
    there = sigma[rows]
    inside = stops[(stops >= there[0]) & (stops <= there[-1])]
    return tuple(rows.start + int(np.argmin(np.abs(there - time))) for time in inside[1:-1])


def _robot_rows(cell: Cell, plan: Plan, nominal: NominalRows, *, robot: str) -> RobotRows:
    """Rows of one robot."""
    table, model = nominal.tables[robot], cell.robot(robot).model
    tasks = [task.name for task in cell.tasks if task.robot == robot]
    rests = resting(table.q) | are_near(nominal.sigma, _all_stop(plan, nominal), TIME_TOLERANCE)
    return RobotRows(
        robot=robot,
        q=table.q,
        times=table.times,
        qd=row_velocities(table.times, table.q, rests=rests, lower=model.lower, upper=model.upper),
        process=_in_process(nominal.sigma, [stretch for task in tasks for stretch in plan.process.get(task, ())]),
        stops=tuple(np.flatnonzero(are_near(nominal.sigma, _task_stops(plan, tasks), TIME_TOLERANCE)).tolist()),
    )


def _task_stops(plan: Plan, tasks: Sequence[str]) -> list[float]:
    """Nominal times at which the tool of some tasks stops on its path: at corners, and at the ends of dwells."""
    return [
        *(stop for task in tasks for stop in plan.stops.get(task, ())),
        *(end for dwell in plan.dwells for end in dwell),
    ]


def _all_stop(plan: Plan, nominal: NominalRows) -> tuple[float, ...]:
    """Nominal times at which no tool moves along its path: phases meet, or all tasks that are on have a stop there."""
    stops_of_all = list(nominal.begins)
    for time in {stop for stops in plan.stops.values() for stop in stops}:
        on = [task for task, stretches in plan.process.items() if np.any(are_within(np.array([time]), stretches))]
        if all(np.any(np.abs(np.array(plan.stops.get(task, ())) - time) <= TIME_TOLERANCE) for task in on):
            stops_of_all.append(time)
    return tuple(stops_of_all)


def _in_process(sigma: Array, stretches: Sequence[Interval]) -> Flags:
    """Whether a tool is in process from each row to the next: from the first row in a stretch to the last one."""
    process = np.zeros(len(sigma), dtype=bool)
    for stretch in stretches:
        inside = are_within(sigma, (stretch,))
        process[:-1] |= inside[:-1] & inside[1:]
    return process
