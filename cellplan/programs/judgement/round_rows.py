"""Rounding: which rows of a program are rounded, and within which share of their segments each of them.

Every row that may be rounded begins with the largest share. Where a tool, with all that it may be off there, leaves
what is allowed, the rows at whose corners it does get the next smaller share, until none is left. Then bodies: the way
that they may make at a corner is bounded by less and less, until all distances are kept; first for each phase on the
clock of the rows, and then, where robots wait for one another at marks, for every order between two marks.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.cache import without_cache
from cellplan.certify.lever_arms import LeverArms
from cellplan.geometry.arrays import Array, Flags
from cellplan.measures.tool_errors import error_lengths, part_poses, relative_to_task_frame
from cellplan.model.cell.cell import Relation, stacked_positions
from cellplan.model.report.exported import ExportJob, Moves, ProgramRows, RobotRows
from cellplan.programs.elements.corners import LARGEST_SHARE, may_round, row_shares, units_of
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.judgement.judge import played_programs
from cellplan.programs.judgement.judge_path import (
    PathRows,
    keeps_clearance,
    keeps_tools,
    path_rows,
    schedule_at,
    straight_depths,
)
from cellplan.programs.promises.orders import Orders, blocked_orders
from cellplan.programs.rows.margins import body_reach, corner_vectors, movers_of, robot_corners
from cellplan.programs.rows.played import ExecutedProgram, ExecutedStretch
from cellplan.programs.rows.rows import times_of
from cellplan.programs.shared import Shared
from cellplan.scene.scene import Scene

ROUNDS: Final = 28  # of lowering shares until all tools are where they may be
MARGINS: Final = (0.999, 0.95, 0.8)  # [-] of what is allowed that is used at rows; what lies between them may need more
REACHES: Final = (np.inf, 4e-3, 1e-3, 2.5e-4)  # [m] that bodies may move at a corner, the largest first
SAME: Final = 1e-12  # [rad] or [m] phases that are written alike are rounded alike
SAME_TIME: Final = 1e-7  # [s] likewise
NEARLY: Final = 1.05  # [-] of the share of a row: what is off beside it is its doing


def with_rounding(
    dialect: Dialect,
    job: ExportJob,
    *,
    shared: Shared,
    read: Sequence[ProgramRows] | None = None,
    orders: Sequence[Orders] = (),
    lead: float = 0.0,
) -> ExportJob:
    """A job with the share of its segments within which each row is rounded.

    Args:
        job: What is to be written; its own share does not count.
        read: Its rows as a reader finds them, with the decimals of the format; None for the rows as they are.
        orders: Marks of its programs; empty where robots do not wait for one another.
        lead: Time in [s] by which rows are later than those of the run.
    """
    with without_cache():
        rounded = replace(job, blend=LARGEST_SHARE)
        programs, largest = [], 0.0
        played = played_programs(shared.run, dialect, rounded, _plain(read or job.programs), lead=lead)
        for place, (program, executed) in enumerate(zip(job.programs, played, strict=True)):
            chosen = _Choice(dialect, rounded, program, executed, shared)
            chosen.keep_demands()
            if orders:
                chosen.keep_orders(orders[place])
            programs.append(chosen.program)
            largest = max(largest, chosen.largest)
    return replace(job, programs=tuple(programs), blend=largest)


def _plain(programs: Sequence[ProgramRows]) -> list[ProgramRows]:
    """Programs whose rows do not say how they are rounded."""
    return [
        replace(program, robots={name: replace(rows, rounding=None) for name, rows in program.robots.items()})
        for program in programs
    ]


def stops_left(job: ExportJob) -> tuple[int, int]:
    """Rows of a job that may be rounded and are not, and all that may be."""
    stops = count = 0
    for program in job.programs:
        free, shares = may_round(program, units_of(job.frame)), row_shares(job, program)
        stops += sum(int(np.count_nonzero(free[name] & (shares[name] == 0.0))) for name in free)
        count += sum(int(np.count_nonzero(shares)) for shares in free.values())
    return stops, count


class _Choice:
    """The shares of one program while they are chosen."""

    def __init__(
        self,
        dialect: Dialect,
        job: ExportJob,
        program: ProgramRows,
        played: ExecutedProgram,
        shared: Shared,
    ) -> None:
        self._ladder = np.array(dialect.shares[::-1])  # shares that the format can state, the smallest first
        self._job, self._given, self._played, self._shared = job, program, played, shared
        self._units = units_of(job.frame)
        self._is_linear = job.frame.moves is Moves.LINEAR and dialect.has_seams(job.frame)
        self._free = may_round(program, self._units)
        self._chosen = {name: np.where(free, self._ladder[-1], 0.0) for name, free in self._free.items()}
        self._times = {name: times_of(played.rows[name]) for name in self._chosen}

    @property
    def program(self) -> ProgramRows:
        """The rows with the shares chosen so far."""
        robots = {n: replace(rows, rounding=self._chosen[n]) for n, rows in self._given.robots.items()}
        return replace(self._given, robots=robots)

    @property
    def largest(self) -> float:
        """Largest share chosen so far."""
        return max(float(shares.max(initial=0.0)) for shares in self._chosen.values())

    def keep_demands(self) -> None:
        """Choose shares with which every phase keeps what is demanded of tools and bodies."""
        known: list[tuple[int, Mapping[str, slice]]] = []
        for stretch in self._played.stretches():
            inside = {name: _inside(times, stretch) for name, times in self._times.items()}
            if self._is_linear and _are_replaced(stretch, self._free, inside, self._units):
                for name, rows in inside.items():
                    self._chosen[name][rows] = 0.0
                continue
            played, before = self._played.rows, (o for place, o in known if place == stretch.place)
            alike = (o for o in before if all(_are_alike(played[n], self._free[n], o[n], inside[n]) for n in inside))
            same = next(alike, None)
            if same is None:
                self._round(stretch, inside)
                known.append((stretch.place, inside))
            else:
                for name, rows in inside.items():
                    self._chosen[name][rows] = self._chosen[name][same[name]]

    def keep_orders(self, orders: Orders) -> None:
        """Take back what does not keep its distance in every order between two marks."""
        for reach in (*REACHES[1:], 0.0):
            executed, run = replace(self._played, shares=self._shares()), self._shared.run
            known = self._shared.known_orders
            blocked = {
                place for place, _ in blocked_orders(run, orders, self.program, robot_corners(executed), known=known)
            }
            if not blocked:
                return
            for place in blocked:
                between = {
                    name: slice(rows.marks[place], rows.marks[place + 1] + 1)
                    for name, rows in self._given.robots.items()
                }
                self._limit(between, self._shared.scene, reach)

    def _round(self, stretch: ExecutedStretch, inside: Mapping[str, slice]) -> None:
        """Choose the shares of a phase."""
        scene = self._shared.scenes[stretch.place]
        begun = {name: self._chosen[name][rows].copy() for name, rows in inside.items()}
        for margin in MARGINS:
            for name, rows in inside.items():
                self._chosen[name][rows] = begun[name]
            if self._keep_tools(stretch, margin):
                break
        else:
            self._limit(inside, scene, 0.0)
            return
        for reach in REACHES:
            self._limit(inside, scene, reach)
            if keeps_clearance(self._rows(stretch)):
                return
        self._limit(inside, scene, 0.0)

    def _keep_tools(self, stretch: ExecutedStretch, reserve: float) -> bool:
        """Lower shares until no tool leaves a share of what is allowed; whether all is kept then, between rows too."""
        for _ in range(ROUNDS):
            rows = self._rows(stretch)
            lowered = False
            for relation, errors, limit in _errors(rows):
                is_over = np.any(errors > reserve * np.array(limit), axis=1)
                lowered |= self._lower(rows.times[is_over] + stretch.begin, movers_of(rows.scene, relation))
            lowered |= self._lower_depths(stretch, rows, reserve)
            if not lowered:
                return keeps_tools(rows)
        return False

    def _lower_depths(self, stretch: ExecutedStretch, rows: PathRows, reserve: float) -> bool:
        """Lower the shares of rows at which a tool may be deeper by more than it may; whether there were any."""
        lowered = False
        for task, straight in straight_depths(rows):
            is_over = rows.depth_off(task) > reserve * max(straight.limit - straight.depth, 0.0)
            lowered |= self._lower(rows.times[is_over] + stretch.begin, movers_of(rows.scene, task))
        return lowered

    def _lower(self, times: Array, movers: Collection[str]) -> bool:
        """Lower the shares of the rows of some robots that are rounded at some times; whether there were any."""
        shares, lowered = self._shares(), False
        rows_of = {name: _rounded_at(self._times[name], shares[name], times) for name in self._chosen if name in movers}
        for unit in self._units:
            if every := [rows_of[name] for name in unit if name in rows_of]:
                shared: Flags = np.any(every, axis=0)
                rows_of |= dict.fromkeys(unit, shared)
        for name, is_near in rows_of.items():
            chosen = self._chosen[name]
            is_lowered = is_near & (chosen > 0.0)
            chosen[is_lowered] = _largest_within(chosen[is_lowered] - SAME, self._ladder)
            lowered |= bool(np.any(is_lowered))
        return lowered

    def _limit(self, names: Mapping[str, slice], scene: Scene, reach: float) -> None:
        """Lower the shares of some rows of each robot until no two bodies come nearer by more in [m] at one of them."""
        if np.isinf(reach):
            return
        arms = LeverArms(scene, stacked_positions(scene.cell, self._played.at(self._played.run_times)))
        most = {}
        for name in self._chosen:
            executed = self._played.rows[name]
            off = np.zeros((len(executed), scene.cell.joint_count))
            off[:, scene.cell.columns(name)] = np.abs(corner_vectors(executed, np.ones(len(executed))))
            approach = np.sort(body_reach(arms, scene, off), axis=0)[-2:].sum(axis=0)
            most[name] = reach / np.maximum(approach, 1e-12)
        for unit in self._units:
            most |= dict.fromkeys(unit, np.min([most[name] for name in unit], axis=0))
        for name, rows in names.items():
            self._chosen[name][rows] = np.minimum(
                self._chosen[name][rows], _largest_within(most[name][rows], self._ladder)
            )

    def _shares(self) -> Mapping[str, Array]:
        """Share within which each row counts as rounded, by robot."""
        return row_shares(self._job, self.program)

    def _rows(self, stretch: ExecutedStretch) -> PathRows:
        """The path of a phase with the shares chosen so far."""
        return path_rows(replace(self._played, shares=self._shares()), stretch, self._shared)


def _inside(times: Array, stretch: ExecutedStretch) -> slice:
    """Rows in a phase, both ends included, from their times in [s], shape (N,)."""
    first, last = np.searchsorted(times, [stretch.begin - SAME_TIME, stretch.end + SAME_TIME])
    return slice(int(first), int(last))


def _are_replaced(
    stretch: ExecutedStretch, free: Mapping[str, Flags], inside: Mapping[str, slice], units: Sequence[Sequence[str]]
) -> bool:
    """Whether lines and arcs take the place of all rows of a phase that may be rounded."""
    arms = {entry.task.robot for entry in stretch.motion.schedule.tasks}
    on_lines = {name for unit in units if arms.intersection(unit) for name in unit}
    left = {name: free[name][rows] for name, rows in inside.items()}
    return not any(flags[[0, -1]].any() or (name not in on_lines and flags.any()) for name, flags in left.items())


def _are_alike(rows: RobotRows, free: Flags, one: slice, other: slice) -> bool:
    """Whether two stretches of rows are the same after the same times, and may be rounded alike."""
    times = times_of(rows)
    if len(times[one]) != len(times[other]) or not len(times[one]):
        return False
    late = np.abs(np.diff(times[one]) - np.diff(times[other]))
    off = np.abs(rows.q[one] - rows.q[other])
    return bool(np.all(late <= SAME_TIME) and np.all(off <= SAME) and np.all(free[one] == free[other]))


def _errors(rows: PathRows) -> Iterator[tuple[Relation, Array, tuple[float, float]]]:
    """Errors of each tool and further holder at all times, with what it may be off, (M, 2); and what is allowed."""
    scene = rows.scene
    cell, schedule = scene.cell, schedule_at(rows.schedule, rows.times)
    X_WP = part_poses(cell, scene.chains, rows.q)
    checks = cell.checks
    pairs: list[tuple[Relation, Array, tuple[float, float], int]] = [
        (task.task, task.X_PT, task.task.tolerance.between, task.task.first_judged(rows.times))
        for task in schedule.tasks
    ]
    limits = checks.closure_mm.si, checks.closure_deg.si
    pairs += [(grasp, grasp.X_PT[None], limits, 0) for grasp in cell.closures]
    for relation, desired, allowed, first in pairs:
        X_WT = scene.chains[relation.robot].tool_poses(rows.q[relation.robot])
        X_PT = relative_to_task_frame(relation, X_WT, X_WP)
        lengths = error_lengths(X_PT, desired, relation) + rows.tool_off(relation)
        lengths[:first] = 0.0
        yield relation, lengths, allowed


def _rounded_at(row_times: Array, shares: Array, times: Array) -> Flags:
    """Rows that are rounded at one of some times, or all but, shape (N,)."""
    is_inside = np.zeros(len(row_times), dtype=bool)
    step = np.clip(np.searchsorted(row_times, times, side="right") - 1, 0, len(row_times) - 2)
    u = (times - row_times[step]) / np.maximum(row_times[step + 1] - row_times[step], SAME)
    is_inside[step[u <= NEARLY * shares[step]]] = True
    is_inside[step[1.0 - u <= NEARLY * shares[step + 1]] + 1] = True
    return is_inside & (shares > 0.0)


def _largest_within(most: Array, ladder: Array) -> Array:
    """The largest of the shares that are tried, by rising size, and not larger than each."""
    return ladder[np.maximum(np.searchsorted(ladder, most, side="right") - 1, 0)]
