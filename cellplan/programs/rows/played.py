"""A program as its targets play it: positions of all robots at any time, by the interpolation of the format."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.report.exported import Interpolation, ProgramRows, RobotRows
from cellplan.model.report.verified_run import VerifiedMotion, VerifiedRun
from cellplan.programs.elements.timed_rows import are_near
from cellplan.programs.rows.interpolant import HermiteRows, resting, row_velocities
from cellplan.programs.rows.rows import times_of

SAME_TIME: Final = 1e-7  # [s] rows nearer than this are one
STRAIGHT: Final = 1e-6  # [rad] or [m] that a part of a cubic curve may be off its chord
MOST_PARTS: Final = 10  # [-] of a step of a cubic curve


@dataclass(frozen=True, slots=True, kw_only=True)
class ExecutedStretch:
    """One phase of a played program."""

    place: int  # place of its motion among those of the run
    motion: VerifiedMotion  # what is demanded in it
    begin: float  # time in [s] of the played program at which it begins
    end: float  # time at which it ends


@dataclass(frozen=True, kw_only=True, eq=False)
class ExecutedProgram:
    """One program as it is played: rows that were read, with those of the run for robots that are not exported."""

    run: VerifiedRun
    place: int  # place of the program among those of the run
    rows: Mapping[str, RobotRows]  # rows with times of all robots of the cell, by robot
    interpolation: Interpolation  # how the target moves the joints of the robots that are exported
    exported: tuple[str, ...]  # names of these
    lead: float  # time in [s] by which the rows are later than those of the run
    shares: Mapping[str, Array]  # of the shorter segment within which their rows are rounded, shape (N,)

    @classmethod
    def of(
        cls,
        run: VerifiedRun,
        full: ProgramRows,
        files: tuple[ProgramRows, ProgramRows],
        *,
        shares: Mapping[str, Array],
        interpolation: Interpolation,
        lead: float,
    ) -> "ExecutedProgram":
        """A program that was read.

        Args:
            full: All rows of all robots, as in the run.
            files: What was read, and what was written; times that were not read are those that were written.
            shares: Within which rows are rounded, by robot, where what was read does not say so.
            lead: Time in [s] by which rows are later than those of the run.
        """
        rows, (read, written) = {}, files
        for robot in run.cell.robots:
            name = robot.name
            if name in read.robots:
                one, other = read.robots[name], written.robots[name]
                times, qd = (other.times if one.times is None else one.times), one.qd
                process = other.process if one.tube is None else one.process
                rows[name] = RobotRows(
                    robot=name, q=one.q, times=times, qd=qd, process=process, marks=one.marks, tube=one.tube
                )
            else:
                one = full.robots[name]
                rows[name] = RobotRows(robot=name, q=one.q, times=times_of(one) + lead)
        stated = {name: one.rounding for name, one in read.robots.items() if one.rounding is not None}
        return cls(
            run=run,
            place=list(run.programs).index(full.name),
            rows=rows,
            interpolation=interpolation,
            exported=tuple(read.robots),
            lead=lead,
            shares={**shares, **stated},
        )

    def at(self, times: Array) -> dict[str, Array]:
        """Positions of all robots at times in [s] of the played program, shape (M,), shape (M, n), by robot."""
        positions = {}
        for name, rows in self.rows.items():
            if name in self._curves:
                positions[name] = self._curves[name].at(times)
            else:
                row_times = times_of(rows)
                positions[name] = np.stack([np.interp(times, row_times, column) for column in rows.q.T], axis=1)
        return positions

    @cached_property
    def _curves(self) -> Mapping[str, HermiteRows]:
        """The curves of robots whose target runs a cubic."""
        if self.interpolation is not Interpolation.CUBIC:
            return {}
        return {name: self.curve(name) for name in self.exported}

    def curve(self, robot: str) -> HermiteRows:
        """The cubic through the rows of a robot with the speeds that were read, or else with those of the rows."""
        rows, model = self.rows[robot], self.run.cell.robot(robot).model
        qd = rows.qd
        if qd is None:
            qd = row_velocities(times_of(rows), rows.q, rests=resting(rows.q), lower=model.lower, upper=model.upper)
        return HermiteRows(times=times_of(rows), q=rows.q, qd=qd)

    def parts(self, robot: str) -> int:
        """Parts of a step of a robot's cubic that are taken as straight: enough to make them so, or ten."""
        steps = np.diff(times_of(self.rows[robot]))[:, None]
        sag = float((self._curves[robot].largest_accelerations() * steps**2 / 8.0).max())
        return int(np.clip(np.ceil(np.sqrt(sag / STRAIGHT)), 1, MOST_PARTS))

    @property
    def end(self) -> float:
        """Time in [s] at which the last row of any robot ends."""
        return max(float(times_of(rows)[-1]) for rows in self.rows.values())

    @property
    def run_times(self) -> Array:
        """Times of the rows of the run in the played program, in [s]."""
        tables = list(self.run.programs.values())[self.place]
        return next(iter(tables.values())).times + self.lead

    def stretches(self) -> Iterator[ExecutedStretch]:
        """All phases in their order, those of all cycles."""
        run = self.run
        for number, _, rows in run.motion.pieces[self.place].phases:
            place = number % len(run.motions)
            begin, end = self.run_times[rows.start], self.run_times[rows.stop - 1]
            if end > begin:
                yield ExecutedStretch(place=place, motion=run.motions[place], begin=float(begin), end=float(end))

    def phase_at(self, at_s: float | None) -> str:
        """Name of the phase at a time in [s] of the played program; empty for a program of one, or without a time."""
        if at_s is None or len(self.run.motions) == 1:
            return ""
        names = [stretch.motion.name or "" for stretch in self.stretches() if stretch.begin <= at_s + SAME_TIME]
        return names[-1] if names else ""

    def grid(self, begin: float, end: float, *, with_run: bool = True, with_corners: bool = False) -> Array:
        """Times in [s] from begin to end, between which joints move evenly, or on a part of a cubic taken as even.

        Rows of the run may be among them, and the times at which the rounding of a row begins and ends.
        """
        times = [times_of(self.rows[name]) for name in self.exported]
        if self.interpolation is Interpolation.CUBIC:
            times = [_finer(times_of(self.rows[name]), self.parts(name)) for name in self.exported]
        if with_run or len(self.exported) < len(self.rows):
            times.append(self.run_times)
        if with_corners:
            times += [_ends_of_corners(times_of(self.rows[name]), self.shares[name]) for name in self.exported]
        every = np.unique(np.concatenate(times))
        inner = every[(every > begin + SAME_TIME) & (every < end - SAME_TIME)]
        inner = inner[np.diff(inner, prepend=-np.inf) > SAME_TIME]
        return np.concatenate([[begin], inner, [end]])

    def is_row(self, times: Array) -> Flags:
        """Which times are rows of the run, shape (M,)."""
        return are_near(times, self.run_times, SAME_TIME)

    def is_break(self, times: Array) -> Flags:
        """Which times of a grid are needed, as a robot may change its direction there: its ends, and rows as played."""
        is_break = are_near(times, self.grid(float(times[0]), float(times[-1]), with_run=False), SAME_TIME)
        is_break[[0, -1]] = True
        return is_break


def _ends_of_corners(times: Array, shares: Array) -> Array:
    """Times at which the rounding of rows begins and ends."""
    rows, h = np.flatnonzero(shares > 0.0), np.diff(times)
    return np.concatenate([times[rows] - shares[rows] * h[rows - 1], times[rows] + shares[rows] * h[rows]])


def _finer(times: Array, parts: int) -> Array:
    """Times with some parts in each step."""
    share = np.arange(parts) / parts
    return np.append((times[:-1, None] + np.diff(times)[:, None] * share).ravel(), times[-1])
