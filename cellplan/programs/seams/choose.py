"""Seams chosen from a run: few lines and arcs that follow a tool on a part that rests, or moves in step with it."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Flags
from cellplan.geometry.transforms import Array, inverse, rotation_vector
from cellplan.measures.tool_errors import error_lengths, part_poses
from cellplan.model.report.exported import ExportJob, ProgramRows, RobotRows, Seam
from cellplan.model.task.task import Frame, Task
from cellplan.programs.elements.corners import LARGEST_SHARE, stops_at, switches, units_of
from cellplan.programs.elements.joints import Axes, in_step
from cellplan.programs.rows.part_targets import LEFT_OVER
from cellplan.programs.rows.rows import EssentialRows, WorkRows, times_of
from cellplan.programs.rows.thin import bends, chosen_rows
from cellplan.programs.seams.shapes import STANDS, Shape, arc, corner_cut, line
from cellplan.runs.plan.program import STILL_TOL
from cellplan.scene.scene import Scene

MOST_SPIN: Final = np.deg2rad(3.0)  # [rad] by which a tool may leave its orientation in the run where it is free
ROUNDING_SHARE: Final = 0.25  # [-] of the tolerance that a corner in process may be cut by
THIN_TURN: Final = np.deg2rad(0.05)  # [rad] that a turning joint may be off the path of a transfer
THIN_SLIDE: Final = 5e-5  # [m] that a sliding joint may, likewise
SHARE_STEP: Final = 1e-5  # [-] to which the share of a corner is found
MOST_TURN: Final = np.deg2rad(0.02)  # [rad] that a corner may be cut by
CORNER_SPIN: Final = np.deg2rad(0.2)  # [rad] likewise, with the turn about the axis of a tool whose spin is free
SLOWEST: Final = 1e-4  # [m/s] a tool that is slower turns rather than moves
MOST_HELD: Final = np.deg2rad(0.2)  # [rad] that a joint which moves the part in step may leave its motion in the run
MOST_HELD_SLIDE: Final = 1e-3  # [m] that a sliding one may, likewise
TURNS: Final = np.deg2rad(0.1)  # [rad] a tool that stands and turns by less moves on no line
FEED_STEP: Final = 1e-4  # [m/s] to which speeds are rounded up where no feed is stated


class Piece(NamedTuple):
    """A line or an arc that follows a tool between two rows."""

    last: int  # the row at which it ends; it begins where the one before it ends
    shape: Shape
    middle: int | None = None  # the row through which an arc leads
    through: Array | None = None  # the pose there, turned as the arc turns the tool, shape (4, 4)


class LineLimits(NamedTuple):
    """How near lines and arcs are to the path of a tool."""

    most: float  # how far a tool may be off by rows left out, in [m]
    smallest_zone: float = 0.0  # distance from a corner in [m] below which the format states none, see ``Dialect``


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ToolPath:
    """The path of a tool in the frame of a part."""

    task: Task
    X_PT: Array  # its poses at all rows of a phase in [m], shape (N, 4, 4)
    most: float  # how far a tool may be off its path by rows left out, in [m]
    least: float = 0.0  # length in [m] that the last line or arc before an end exceeds, as it switches outputs ahead
    # joints that move evenly along each line and arc, as shares of what they may be off, shape (N, k); None unless they
    # move in step
    held: Array | None = None
    smallest_zone: float = 0.0  # distance from a corner in process in [m] within which it cannot be rounded by number
    feeds: Array | None = None  # of each step in [m/s], shape (N - 1,), see ``WorkRows``; None with one feed for all

    def pieces(self, ends: Sequence[int]) -> Iterator[Piece]:
        """The longest lines and arcs, one after the other, which end at some rows, increasing."""
        for first, end in pairwise(ends):
            pieces = [Piece(first, line(*self.X_PT[[first, first]]))]
            while pieces[-1].last < end:
                both = (self._longest(pieces[-1].last, end, is_arc=is_arc) for is_arc in (False, True))
                pieces.append(max(both, key=lambda one: one.last))
            if len(pieces) > 2 and pieces[-1].shape.length <= self.least:
                pieces[-2:] = self._halves(pieces[-3].last, end) or pieces[-2:]
            yield from pieces[1:]

    def divided(self, pieces: Sequence[Piece], in_process: Flags) -> Iterator[Piece]:
        """The same, with a short one before each corner in process that may be rounded less than can be stated.

        Controllers begin no corner before the middle of the shorter motion: half of that one is what it may be
        rounded by. ``in_process`` are rows at which a process goes on, shape (N,).
        """
        ends, shares = [0, *(piece.last for piece in pieces)], [*_cuts(self, pieces), 0.0]
        for begin, piece, other, share in zip(ends, pieces, [*pieces[1:], pieces[-1]], shares, strict=False):
            places = [begin if piece.middle is None else piece.middle, piece.last, other.middle or other.last]
            chords = np.linalg.norm(np.diff(self.X_PT[places, :3, 3], axis=0), axis=1)  # as ``shorter_lengths``
            is_short = share * float(chords.min()) < self.smallest_zone and 0.0 < share < LARGEST_SHARE
            zone = share * min(piece.shape.length, other.shape.length)
            parts = self._with_short(begin, piece, 2.0 * zone) if is_short and in_process[piece.last] else []
            yield from parts or [piece]

    def _with_short(self, begin: int, piece: Piece, longest: float) -> list[Piece]:
        """A piece and behind it another, of at most a length in [m], to its end; none where no row is so near to it."""
        is_arc = piece.middle is not None
        p = self.X_PT[begin + 1 : piece.last + 1, :3, 3]
        row = begin + 1 + int(np.argmax(np.linalg.norm(p - p[-1], axis=1) <= longest))
        ahead = self._piece(row, piece.last, is_arc=is_arc) or self._piece(row, piece.last)
        parts = [self._piece(begin, row, is_arc=is_arc), ahead]
        both = [part for part in parts if part is not None and part.shape.length > STANDS]
        return both if len(both) == len(parts) else []

    def _halves(self, first: int, end: int) -> list[Piece]:
        """Two lines or arcs of as many rows; none where there are no such ones."""
        middle = (first + end) // 2
        trials = [
            [self._piece(*rows, is_arc=is_arc) for is_arc in (False, True)] for rows in ((first, middle), (middle, end))
        ]
        halves = [piece for trial in trials for piece in [next(filter(None, trial), None)] if piece is not None]
        return halves if len(halves) == len(trials) else []

    def stands(self, first: int, last: int) -> bool:
        """Whether the tool rests between two rows."""
        off = np.abs(self.X_PT[first : last + 1] - self.X_PT[first])
        return bool(off[:, :3, 3].max() < STANDS and off[:, :3, :3].max() < TURNS)

    def _longest(self, first: int, end: int, *, is_arc: bool) -> Piece:
        """The longest line or arc from a row on, by bisection; one step of the run is a line."""
        low, high = Piece(first + 1, line(*self.X_PT[[first, first + 1]])), end + 1
        trial = end
        while trial > low.last:
            piece = self._piece(first, trial, is_arc=is_arc)
            low, high = (piece, high) if piece is not None else (low, trial)
            trial = (low.last + high) // 2
        return low

    def _piece(self, first: int, last: int, *, is_arc: bool = False) -> Piece | None:
        """The line or the arc between two rows; None where it does not follow the tool."""
        X = self.X_PT[first : last + 1]
        if not is_arc:
            shape = line(X[0], X[-1])
            return Piece(last, shape) if self._follows(shape, first, last) else None
        travel = np.cumsum(np.linalg.norm(np.diff(X[:, :3, 3], axis=0), axis=1))
        middle = 1 + int(np.searchsorted(travel, 0.5 * travel[-1]))
        circle = arc(X[0], X[middle], X[-1]) if middle < last - first else None
        if circle is None:
            return None
        through = circle.poses(circle.shares(X[middle, None, :3, 3]))[0]
        circle = arc(X[0], through, X[-1])
        is_good = circle is not None and self._follows(circle, first, last)
        return Piece(last, circle, first + middle, through) if circle is not None and is_good else None

    def _follows(self, shape: Shape, first: int, last: int) -> bool:
        """Whether a shape keeps a tool as near to its poses in the run from row to row as is allowed."""
        X, held = self.X_PT[first : last + 1], np.zeros((1, 0)) if self.held is None else self.held[first : last + 1]
        shares = shape.shares(X[:, :3, 3])
        if shape.length < STANDS and np.linalg.norm(shape.turn) > TURNS:
            return False
        poses = shape.poses(np.maximum.accumulate(shares))
        errors = error_lengths(poses, X, self.task)
        position, orientation = self.task.tolerance.between
        uneven = np.abs(held - held[0] - np.maximum.accumulate(shares)[:, None] * (held[-1] - held[0]))
        turns = np.linalg.norm(rotation_vector(poses[:, :3, :3] @ np.swapaxes(X[:, :3, :3], 1, 2)), axis=1)
        return bool(
            errors[:, 0].max() <= min(self.most, LEFT_OVER * position)
            and errors[:, 1].max() + shape.rule_margin <= LEFT_OVER * orientation
            and turns.max() <= MOST_SPIN
            and uneven.max(initial=0.0) <= 1.0
        )


def with_seams(
    scene: Scene,
    job: ExportJob,
    full: Sequence[ProgramRows],
    essential: Sequence[EssentialRows],
    *,
    limits: LineLimits,
    by_joints: Collection[str] = (),
) -> ExportJob:
    """A job whose robots move their tools on lines and arcs, but for some tasks, which have no process then.

    In step these lead over a part that may move.

    Args:
        job: Rows of joints, some left out, with their marks and their rounding.
        full: All rows of its programs, with the same marks.
        essential: The phases of its programs.
        limits: How near they are to its path.
        by_joints: Names of tasks whose tools move by joints; on all others the part rests, see ``on_moving_parts``.
    """
    programs = []
    for program, every, phases in zip(job.programs, full, essential, strict=True):
        robots: dict[str, RobotRows] = {}
        for unit in units_of(job.frame):
            first = next((name for name in unit if Axes.of(job.frame.robot(name)).arm), unit[0])
            both = program.robots[first], every
            robots[first] = _seams_of(scene, job, both, phases.work, limits=limits, by_joints=by_joints)
            others = (name for name in unit if name != first)
            robots |= {name: _rows_in_step(scene, every.robots[name], robots[first]) for name in others}
        programs.append(replace(program, robots={name: robots[name] for name in program.robots}))
    return replace(job, programs=tuple(programs))


def on_moving_parts(full: Sequence[ProgramRows], essential: Sequence[EssentialRows]) -> Iterator[tuple[str, str]]:
    """Names of the tasks whose part moves while the tool works, each with the robot that moves it."""
    for program, phases in zip(full, essential, strict=True):
        for phase in phases.work:
            for task in map(phase.cell.task, phase.tasks):
                for holder in phase.cell.part.held_by if task.relative_to is Frame.PART else ():
                    q = program.robots[holder.robot].q[phase.rows]
                    if np.any(np.abs(q - q[0]) > STILL_TOL):
                        yield task.name, holder.robot


def _rows_in_step(scene: Scene, rows: RobotRows, arm: RobotRows) -> RobotRows:
    """The rows of a robot that moves in step with an arm: those of the arm."""
    chosen = np.searchsorted(times_of(rows), times_of(arm))
    return replace(chosen_rows(scene, rows, chosen), rounding=arm.rounding)


@dataclass(kw_only=True, eq=False)
class _SeamRows:
    """The rows of one robot while its seams are chosen, by their number among all rows of the program."""

    scene: Scene
    rows: RobotRows  # all rows
    chosen: set[int]  # those that stay
    rounding: dict[int, float]  # share of the shorter neighbouring segment of each
    poses: dict[int, Array] = field(default_factory=dict)  # of rows on seams, in the frame of the part
    feeds: dict[int, float] = field(default_factory=dict)  # speed of the tool to them in [m/s]
    middles: set[int] = field(default_factory=set)  # intermediate points of arcs
    seams: list[tuple[str, int, int]] = field(default_factory=list)  # task, first and last row

    def follow(self, path: ToolPath, first: int, last: int, *, corners: Sequence[int]) -> None:
        """Follow the tool on lines and arcs from one row to another, with ends at the corners of its path."""
        self.chosen -= set(range(first + 1, last))
        pieces = list(path.pieces(_piece_ends(path, self.rows, (first, last), corners)))
        if path.smallest_zone and self.rows.process is not None:
            goes_on = self.rows.process & ~switches(self.rows)
            pieces = list(path.divided(pieces, goes_on[first : last + 1]))
        ends = [0, *(piece.last for piece in pieces)]
        for begin, piece in zip(ends, pieces, strict=False):
            feed = _feed(path, self.rows, (first, begin, piece.last))
            points = {first + piece.last: path.X_PT[piece.last]}
            if piece.middle is not None and piece.through is not None:
                points[first + piece.middle] = piece.through
                self.middles.add(first + piece.middle)
            for row, pose in points.items():
                self.poses[row], self.feeds[row], self.rounding[row] = pose, feed, 0.0
        for row, share in zip(ends[1:-1], _cuts(path, pieces), strict=True):
            is_stop = stops_at(self.scene.cell, path.task.name, self.rows, first + row)
            self.rounding[first + row] = 0.0 if is_stop else share
        self.seams.append((path.task.name, first, last))

    def switch_off(self, first: int, last: int) -> None:
        """No process is on between two rows, where nothing that controllers know as a seam begins it."""
        if self.rows.process is not None:
            process = self.rows.process.copy()
            process[first:last] = False
            self.rows = replace(self.rows, process=process)

    def straighten(self, first: int, last: int, unit: Sequence[RobotRows]) -> None:
        """Leave out rows that the path of the joints of a unit does not need, whatever their times, as robots wait.

        Rows stay rounded within the same distance: their shares are made smaller as segments become longer.
        """
        inside = sorted(row for row in self.chosen if first <= row <= last)
        joints = [joint for rows in unit for joint in self.scene.cell.robot(rows.robot).model.joints]
        within = np.array([THIN_TURN if joint.is_revolute else THIN_SLIDE for joint in joints])
        q = np.hstack([rows.q for rows in unit])
        needed = [k for k, row in enumerate(inside) if row in self.rows.marks or switches(self.rows)[row]]
        left = [inside[place] for place in bends(q[inside], within, needed=needed)]
        before, after = (_shorter(q, rows) for rows in (inside, left))
        for row in left[1:-1]:
            self.rounding[row] *= min(1.0, before[row] / max(after[row], STANDS))
        self.chosen -= set(inside) - set(left)

    def assembled(self) -> RobotRows:
        """The rows that stay, with what was found of their seams."""
        chosen = sorted(self.chosen | set(self.poses))
        few = chosen_rows(self.scene, self.rows, np.array(chosen))
        few = replace(few, rounding=np.array([self.rounding[row] for row in chosen]))
        if not self.seams:
            return few
        place = {row: index for index, row in enumerate(chosen)}
        inside = [row for _, first, last in self.seams for row in range(place[first], place[last] + 1)]
        return replace(
            few,
            qd=None,
            stops=tuple(row for row in few.stops if row not in inside),
            X_PT=np.array([self.poses.get(row, np.full((4, 4), np.nan)) for row in chosen]),
            feeds=np.array([self.feeds.get(row, np.nan) for row in chosen]),
            middles=np.array([row in self.middles for row in chosen]),
            seams=tuple(Seam(task=task, first=place[first], last=place[last]) for task, first, last in self.seams),
        )


def _seams_of(
    scene: Scene,
    job: ExportJob,
    both: tuple[RobotRows, ProgramRows],
    work: Sequence[WorkRows],
    *,
    limits: LineLimits,
    by_joints: Collection[str],
) -> RobotRows:
    """The rows of one robot, with its seams; ``both`` are those of its joints, and all of the program."""
    thinned, every = both
    rows = every.robots[thinned.robot]
    chosen = np.searchsorted(times_of(rows), times_of(thinned)).tolist()
    shares = np.full(len(thinned), job.blend) if thinned.rounding is None else thinned.rounding
    state = _SeamRows(
        scene=scene, rows=rows, chosen=set(chosen), rounding=dict(zip(chosen, shares.tolist(), strict=True))
    )
    for phase in work:
        first, last = phase.rows.start, min(phase.rows.stop, len(rows)) - 1
        task = next((task for task in map(phase.cell.task, phase.tasks) if task.robot == thinned.robot), None)
        unit = in_step(job.frame, thinned.robot)
        if task is None and job.frame.promise.waits:
            state.straighten(first, last, [every.robots[name] for name in unit])
        elif task is not None and task.name in by_joints:
            state.switch_off(first, last)
        elif task is not None:
            path = _path(scene, every, task, phase, limits, unit=unit)
            state.follow(path, first, last, corners=phase.corners[task.name])
    return state.assembled()


def _path(
    scene: Scene, every: ProgramRows, task: Task, phase: WorkRows, limits: LineLimits, *, unit: Sequence[str]
) -> ToolPath:
    """The path of the tool of a task in a phase; robots of the unit move in step with it."""
    q = {name: rows.q[phase.rows] for name, rows in every.robots.items()}
    is_on_part = task.relative_to is Frame.PART
    X_WP = part_poses(phase.cell, scene.chains, q if len(unit) > 1 else {name: one[:1] for name, one in q.items()})
    X_PW = inverse(X_WP) if is_on_part else np.eye(4)
    X_PT = X_PW @ scene.chains[task.robot].tool_poses(q[task.robot])
    control = phase.cell.robot(task.robot).control
    process = None if control is None else phase.cell.controllers[control.id].process
    least = 0.0 if process is None or task.feed is None else process.off_lead_s * task.feed
    held = [
        q[name] / [MOST_HELD if joint.is_revolute else MOST_HELD_SLIDE for joint in phase.cell.robot(name).model.joints]
        for name in unit
        if name != task.robot
    ]
    path = ToolPath(task=task, X_PT=X_PT, most=limits.most, least=least, held=np.hstack(held) if held else None)
    path = replace(path, feeds=phase.feeds.get(task.name))
    return path if process is None else replace(path, smallest_zone=limits.smallest_zone)


def _shorter(q: Array, places: Sequence[int]) -> dict[int, float]:
    """Length of the shorter segment at each inner one of some rows, in the space of the joints."""
    lengths = np.linalg.norm(np.diff(q[list(places)], axis=0), axis=1)
    return dict(zip(places[1:-1], np.minimum(lengths[:-1], lengths[1:]).tolist(), strict=True))


def _piece_ends(path: ToolPath, rows: RobotRows, both: tuple[int, int], corners: Sequence[int]) -> list[int]:
    """Rows of a phase at which lines and arcs end, counted from its first: waits, switches of the process, corners."""
    first, last = both
    inside = range(first + 1, last)
    needed = {first, last, *(row for row in rows.marks if row in inside)}
    needed |= set((first + np.flatnonzero(switches(rows)[first : last + 1])).tolist())
    ends = sorted(needed)
    for row in sorted({row for row in (*rows.stops, *corners) if row in inside} - needed):
        before, after = max(r for r in ends if r < row), min(r for r in ends if r > row)
        if not path.stands(before - first, row - first) and not path.stands(row - first, after - first):
            ends = sorted([*ends, row])
    return [row - first for row in ends]


def _feed(path: ToolPath, rows: RobotRows, between: tuple[int, int, int]) -> float:
    """Speed of a tool in [m/s] between two rows of a phase: that of its task or its file, or the greatest of the run.

    A tool that weaves along its rows has the mean of the run in process, so that it travels at the feed of its task.
    """
    start, first, last = between
    is_on = path.task.feed is not None and rows.process is not None and bool(rows.process[start + first])
    stated = path.task.feed if path.feeds is None else float(path.feeds[(first + last) // 2])
    if is_on and stated is not None and np.isfinite(stated) and path.task.weave is None:
        return stated
    steps = np.linalg.norm(np.diff(path.X_PT[first : last + 1, :3, 3], axis=0), axis=1)
    times = np.diff(times_of(rows)[start + first : start + last + 1])
    if is_on and path.task.weave is not None:
        return max(round(float(steps.sum() / times.sum()) / FEED_STEP) * FEED_STEP, SLOWEST)
    return max(float(np.ceil(float(np.max(steps / times)) / FEED_STEP - 1e-6)) * FEED_STEP, SLOWEST)


def _cuts(path: ToolPath, pieces: Sequence[Piece]) -> Iterator[float]:
    """Share of the shorter neighbouring piece within which each inner row may be rounded, by bisection.

    A corner of two lines is cut by as much less as its ends are nearer to it, one of arcs that meet smoothly by the
    square of that.
    """
    allowed = ROUNDING_SHARE * path.task.tolerance.between[0]
    most_turn = CORNER_SPIN if path.task.is_spin_free else MOST_TURN
    for one, other in pairwise(pieces):
        shorter = min(one.shape.length, other.shape.length)
        low, high = 0.0, LARGEST_SHARE if shorter >= STANDS else 0.0
        share = high
        while high - low > SHARE_STEP:
            corner = corner_cut(one.shape, other.shape, share * shorter)
            is_within = corner.cut <= allowed and corner.swing <= MOST_TURN and corner.turn <= most_turn
            low, high = (share, high) if is_within else (low, share)
            if low == LARGEST_SHARE:
                break
            share = 0.5 * (low + high)
        yield low
