"""Thinning: fewer rows, between which joints move evenly, common to all robots that share a controller.

Rows are chosen by the method of Douglas and Peucker with the common time as parameter: from a set of rows that must be
kept, each stretch between two of them that leaves a tolerance is split at the row that is off most. The joints come
first; then the tools and further holders on the part, whose poses are worked out from the thinned rows.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.corners import switches
from cellplan.programs.rows.interpolant import row_velocities
from cellplan.programs.rows.part_targets import ToolsOnPart
from cellplan.programs.rows.rows import EssentialRows, WorkRows, times_of
from cellplan.scene.scene import Scene

TIME_TOL: Final = 1e-9  # [s] rounding of differences of times
NO_ROWS: Final = EssentialRows((), ())


@dataclass(frozen=True, slots=True, kw_only=True)
class ThinningLimits:
    """How far thinned rows may be off the rows that they are chosen from."""

    turn: float  # of a turning joint in [rad]
    slide: float  # of a sliding joint in [m]
    tool: float  # of a tool on the part, or in the world for a task there, in [m]; less where the cell allows less
    shortest_time: float = 0.0  # shortest time in [s] between two rows, unless both must be kept; 0 for no limit
    shortest_distance: float = 0.0  # shortest way in [m] of the tool that moves most between two rows, likewise


def thinned(
    scene: Scene,
    program: ProgramRows,
    *,
    groups: Sequence[Sequence[str]],
    limits: ThinningLimits,
    essential_rows: EssentialRows = NO_ROWS,
) -> ProgramRows:
    """A program with fewer rows.

    The robots of a group keep the same rows. Rows with a mark, rows at which the process of a robot goes on or off, and
    the ends of standstills of a group stay. A tolerance is what is left over from the cell's own demands between rows
    where that is less: of the tools on the part, and of further holders.

    Args:
        program: Rows of all robots of the cell on one clock; those that are in no group are left out of the result.
        groups: Names of the robots of each controller; one group for all robots of a synchronised export.
        essential_rows: Further rows that stay, and the phases in which tools are judged.

    Raises:
        InputError: A tolerance cannot be kept with rows as far apart as the limits say.
    """
    robots = {name: rows for group in groups for name, rows in program.robots.items() if name in group}
    sets = [
        _RowGroup(scene, [robots[name] for name in group if name in robots], limits, essential_rows.rows)
        for group in groups
        if any(name in robots for name in group)
    ]
    for one in sets:
        one.split_by_joints()
    _split_by_tools(scene, program, sets, work=essential_rows.work)
    chosen = {rows.robot: one.chosen for one in sets for rows in one.rows}
    thinned_rows = {
        name: chosen_rows(scene, rows, chosen[name]) for name, rows in program.robots.items() if name in chosen
    }
    return replace(program, robots=thinned_rows)


class _RowGroup:
    """Robots that share rows, and the rows chosen so far."""

    def __init__(
        self, scene: Scene, rows: Sequence[RobotRows], limits: ThinningLimits, essential_rows: Sequence[int]
    ) -> None:
        self.rows, self.limits = rows, limits
        joints = [joint for end_rows in rows for joint in scene.cell.robot(end_rows.robot).model.joints]
        self._q = np.concatenate([end_rows.q for end_rows in rows], axis=1)
        self._scaled = self._q / np.array([limits.turn if joint.is_revolute else limits.slide for joint in joints])
        self.times = times_of(rows[0])
        tips = [scene.chains[end_rows.robot].tool_poses(end_rows.q)[:, :3, 3] for end_rows in rows]
        lengths = np.max([np.linalg.norm(np.diff(tip, axis=0), axis=1) for tip in tips], axis=0)
        self._travel = np.concatenate([[0.0], np.cumsum(lengths)])
        self._is_chosen = np.zeros(len(self.times), dtype=bool)
        self._is_chosen[[0, -1, *essential_rows]] = True
        self._is_chosen |= _ends_of_standstill(self._q)
        for end_rows in rows:
            self._is_chosen[[*end_rows.marks, *end_rows.stops]] = True
            self._is_chosen |= switches(end_rows)

    @property
    def chosen(self) -> Indices:
        """The rows chosen so far, increasing."""
        return np.flatnonzero(self._is_chosen)

    def linear(self) -> dict[str, Array]:
        """Positions at all rows when joints move evenly between the chosen ones, by robot, shape (N, n)."""
        chosen = self.chosen
        k = np.clip(np.searchsorted(chosen, np.arange(len(self.times)), side="right") - 1, 0, len(chosen) - 2)
        first, last = chosen[k], chosen[k + 1]
        share = ((self.times - self.times[first]) / (self.times[last] - self.times[first]))[:, None]
        return {row.robot: row.q[first] + share * (row.q[last] - row.q[first]) for row in self.rows}

    def split_by_joints(self) -> None:
        """Choose rows until every joint keeps its tolerance."""
        chosen = self.chosen
        stretches = list(zip(chosen[:-1].tolist(), chosen[1:].tolist(), strict=True))
        while stretches:
            first, last = stretches.pop()
            if last - first < 2:
                continue
            inner = self._scaled[first + 1 : last]
            share = (self.times[first + 1 : last] - self.times[first]) / (self.times[last] - self.times[first])
            ends = self._scaled[first], self._scaled[last]
            off = np.abs(inner - ends[0] - share[:, None] * (ends[1] - ends[0])).max(axis=1)
            if off.max() <= 1.0:
                continue
            row = self._split(first, last, off, what="joints")
            stretches += [(first, row), (row, last)]

    def split_by_tools(self, tools: ToolsOnPart, phase: slice, full: Mapping[str, Array], count: Array) -> None:
        """Choose rows of a phase, both ends chosen already, until its tools and holders keep their tolerances.

        ``full`` has the positions of all robots in these rows, as in the run; ``count`` groups share each tolerance.
        """
        first, last = phase.start, min(phase.stop, len(self.times)) - 1
        self._is_chosen[[first, last]] = True
        tips = tools.tips(full)
        desired, rows = tools.poses(tips), np.arange(first, last + 1)
        while len(rows):
            relative = rows - first
            moved = tools.tips({name: q[rows] for name, q in self.linear().items()})
            poses = tools.poses({name: X_WT[relative] for name, X_WT in tips.items()} | moved)
            shares = tools.shares([velocities[relative] for velocities in desired], poses, most=self.limits.tool)
            off = np.zeros(len(self.times))
            off[rows] = (np.stack(shares, axis=1) * count).max(axis=1)
            rows = self._split_where(off, " and ".join(tools.names))

    def _split_where(self, off: Array, what: str) -> Indices:
        """Split each stretch with a row that is off by more than 1, shape (N,), at the worst; rows in these."""
        chosen, split = self.chosen, [np.zeros(0, dtype=np.intp)]
        for place in np.unique(np.searchsorted(chosen, np.flatnonzero(off > 1.0))).tolist():
            first, last = int(chosen[place - 1]), int(chosen[place])
            if last - first > 1 and off[first + 1 : last].max() > 1.0:
                self._split(first, last, off[first + 1 : last], what)
                split.append(np.arange(first + 1, last))
        return np.concatenate(split)

    def _split(self, first: int, last: int, off: Array, what: str) -> int:
        """Choose the row that is off most of those that are far enough from both ends of a stretch."""
        times, travel, least = self.times, self._travel, self.limits
        inner = slice(first + 1, last)
        nearest = np.minimum(times[inner] - times[first], times[last] - times[inner])
        moved = np.minimum(travel[inner] - travel[first], travel[last] - travel[inner])
        fits = (nearest >= least.shortest_time - TIME_TOL) & (moved >= least.shortest_distance)
        if not np.any(fits):
            names = ", ".join(row.robot for row in self.rows)
            raise InputError(
                f"rows of {names} at {times[first + 1 + int(np.argmax(off))]:.3f} s: expected tolerances that rows at "
                f"least {least.shortest_time:g} s and {MM * least.shortest_distance:g} mm apart can keep, got {what} "
                f"off by {float(off.max()):.3g} times what is allowed"
            )
        row = first + 1 + int(np.argmax(np.where(fits, off, -1.0)))
        self._is_chosen[row] = True
        return row


def _split_by_tools(
    scene: Scene, program: ProgramRows, groups: Sequence[_RowGroup], *, work: Sequence[WorkRows]
) -> None:
    """Choose rows until the tools and further holders keep their tolerances on the part in all phases.

    Where several groups move a tool, each has an equal share of its tolerance, with the others as they are in the run:
    the errors of all are no more than added.
    """
    names = [[row.robot for row in group.rows] for group in groups]
    for phase in work:
        full = {name: rows.q[phase.rows] for name, rows in program.robots.items()}
        for place, group in enumerate(groups):
            tools = ToolsOnPart.of(phase.cell, scene.chains, tasks=phase.tasks, robots=names[place])
            if tools.relations:
                count = [sum(bool(movers & set(others)) for others in names) for movers in tools.movers]
                group.split_by_tools(tools, phase.rows, full, np.array(count))


def bends(q: Array, within: Array | float, *, needed: Iterable[int] = ()) -> list[int]:
    """Rows between which joints move on straight lines, whatever their times: both ends, those needed, and the bends.

    Positions are in [rad] or [m], shape (N, n); each joint may be off its line by so much, shape (n,).
    """
    scaled = q / within
    rows = {0, len(q) - 1, *needed}
    stretches = list(pairwise(sorted(rows)))
    while stretches:
        first, last = stretches.pop()
        along, offset = scaled[last] - scaled[first], scaled[first : last + 1] - scaled[first]
        share = np.clip(offset @ along / max(float(along @ along), 1.0), 0.0, 1.0)
        off = np.abs(offset - share[:, None] * along).max(axis=1)
        off[[0, -1]] = 0.0
        row = first + int(np.argmax(off))
        if off.max() > 1.0:
            rows.add(row)
            stretches += [(first, row), (row, last)]
    return sorted(rows)


def chosen_rows(scene: Scene, rows: RobotRows, chosen: Indices) -> RobotRows:
    """Some rows of a robot, with the speeds and marks that belong to them."""
    model = scene.cell.robot(rows.robot).model
    times, q, qd = times_of(rows)[chosen], rows.q[chosen], None
    if rows.qd is not None:
        rests = np.all(rows.qd[chosen] == 0.0, axis=1)
        qd = row_velocities(times, q, rests=rests, lower=model.lower, upper=model.upper)
    return replace(
        rows,
        q=q,
        times=times,
        qd=qd,
        process=None if rows.process is None else rows.process[chosen],
        marks=tuple(np.searchsorted(chosen, rows.marks).tolist()),
        stops=tuple(np.searchsorted(chosen, rows.stops).tolist()),
    )


def _ends_of_standstill(q: Array) -> Flags:
    """Rows at which all robots of a group come to rest or leave it, shape (N,)."""
    still = np.concatenate([[False], np.all(np.diff(q, axis=0) == 0.0, axis=1), [False]])
    return still[1:] != still[:-1]
