"""Paced programs: moves and what stands between them, as the writers and readers of all languages share them.

A program is a row of moves. At a row, after the move to it, a process may go off, robots may wait for one another, and
a process may go on. What is written for these follows from the cell alone: a reader needs to compare texts only.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product, zip_longest
from typing import Final, Literal, NamedTuple, NoReturn

import numpy as np

from cellplan.errors import InputError, LineRefusedError
from cellplan.geometry.transforms import Array
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, RobotRows, Seam
from cellplan.model.units import MM
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.elements.handshake import HandshakeStep, first_steps, handshake_steps
from cellplan.programs.elements.process import ProcessForm, switches_in_motion

Which = Literal["on", "inner", "off"]
Refuse = Callable[[str, str | None], NoReturn]  # raises that something is expected, and what is there instead
NO_SHAPE: Final = 1e-7  # [m] moves that are shorter are not rounded


class Switches(NamedTuple):
    """What happens at a row."""

    off: bool = False  # the process goes off
    waits: bool = False  # robots wait for one another
    on: bool = False  # the process goes on


NOTHING: Final = Switches()
ENDS: Final[tuple[tuple[bool, Which], ...]] = ((True, "on"), (False, "off"))
EVERY_SWITCH: Final = tuple(Switches(*flags) for flags in product((False, True), repeat=3))


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A move to a row."""

    row: int
    seam: Seam | None = None  # the seam that it belongs to; None for a move of joints between seams
    middle: int | None = None  # the row through which an arc leads
    is_tool: bool = False  # whether it moves the tool on a line or an arc, and not the joints evenly
    feed: float = np.nan  # speed of the tool in [m/s]
    zone: float = 0.0  # distance of the tool from the row in [m] within which it is rounded; 0 for a stop
    share: float = 0.0  # share of the shorter neighbouring segment for a move of joints, likewise
    process: Which | None = None  # whether its process goes on or off at its end, or stays on over it
    switches: Switches = NOTHING
    triggers: tuple[str, ...] = ()  # what it says of outputs that it switches ahead


@dataclass(frozen=True, slots=True, kw_only=True)
class Events:
    """What stands between the moves of a robot.

    Attributes:
        frame: What is exported.
        robot: Name of the robot.
        signal: Text of an instruction of a handshake.
        wait: Text of a wait of some seconds.
        plain: A text without what does not count, as a reader compares it.
        cure: What helps where no zone rounds a corner as little as it must be.
        trigger: What a motion says of an output that it switches some seconds ahead, which is a statement.
        setup: What is set up for these before the first move.
    """

    frame: ExportFrame
    robot: str
    signal: Callable[[HandshakeStep], str]
    wait: Callable[[float], str]
    plain: Callable[[str], str] = str.strip
    cure: str = "allow more (tolerance)"
    trigger: Callable[[float, str], str] = lambda _lead, statement: statement
    setup: tuple[str, ...] = ()

    @property
    def form(self) -> ProcessForm | None:
        """How its controller begins and ends a process; None where it is not stated."""
        control = self.frame.robot(self.robot).control
        return None if control is None else ProcessForm.of(self.frame.cell.controllers[control.id])

    def texts(self, task: str | None, switches: Switches) -> tuple[str, ...]:
        """Statements after the move to a row of a task; the process waits for delays that its data do not hold."""
        texts: list[str] = []
        form = self.form
        if task is not None and form is not None:
            entry = self.frame.cell.task(task)
            on_delay, off_delay = (0.0, 0.0) if entry.process is None else (entry.process.on_delay_s, entry.off_delay)
            if switches.off:
                texts += [] if form.holds_delay or not off_delay else [self.wait(off_delay)]
                texts += form.lines(False, task)
                texts += [self.wait(entry.dwell)] if entry.dwell else []
        if switches.waits:
            texts += [self.signal(step) for step in self._steps]
        if switches.on and task is not None and form is not None:
            texts += form.lines(True, task)
            texts += [] if form.holds_delay or not on_delay else [self.wait(on_delay)]
        return tuple(texts)

    def before(self, has_marks: bool) -> tuple[str, ...]:
        """Statements before the first move: the output of the robot is lowered where it waits for others."""
        first = first_steps(self.frame, self.robot) if has_marks and self._steps else []
        return (*self.setup, *map(self.signal, first))

    @property
    def _steps(self) -> tuple[HandshakeStep, ...]:
        """Instructions at a mark; none where robots move in step."""
        return handshake_steps(self.frame, self.robot) if self.frame.promise.waits else ()

    def triggers(self, task: str, on: bool) -> tuple[str, ...]:
        """What the motion to the first or last point of a task says of the outputs that it switches ahead."""
        form = self.form
        texts = () if form is None else form.lines(on, task, ahead=True)
        return tuple(self.trigger(form.entry.lead(on=on), text) for text in texts if form is not None)

    def triggered(self, task: str | None, texts: Sequence[str], refuse: Refuse) -> Which | None:
        """Which end of the process of a task a line or an arc has by what it says of outputs, if anything."""
        stated = tuple(map(self.plain, texts))
        for on, which in ENDS:
            if stated and task is not None and stated == tuple(map(self.plain, self.triggers(task, on))):
                return which
        if stated:
            refuse("outputs that are switched ahead as the cell states them, with a line or an arc of a task", texts[0])
        return None

    def knows(self, task: str | None, text: str) -> bool:
        """Whether a statement is one that may stand between moves of a task, or before the first one."""
        texts = {text for switches in EVERY_SWITCH for text in self.texts(task, switches)}
        return self.plain(text) in map(self.plain, texts | {*self.before(True)})

    def read(self, task: str | None, texts: Sequence[str], process: Which | None) -> Switches | None:
        """What some statements after a move mean, of whose process it may say something itself; None if nothing."""
        stated = tuple(map(self.plain, texts))
        said = [(on, which) for on, which in ENDS if self._is_on_motion(task, on)]
        for switches in EVERY_SWITCH:
            is_as_said = all((switches.on if on else switches.off) is (process == which) for on, which in said)
            if is_as_said and tuple(map(self.plain, self.texts(task, switches))) == stated:
                return switches
        return None

    def moves_on(self, task: str | None, on: bool) -> bool:
        """Whether the tool goes on where the process of a task begins, or ends."""
        return task is not None and switches_in_motion(self.frame.cell, task, on=on)

    def _is_on_motion(self, task: str | None, on: bool) -> bool:
        """Whether the motion to the first or last point of a task itself says that its process begins or ends."""
        form = self.form
        if form is None or task is None:
            return False
        return form.is_move or bool(form.suffix(on, task) or form.entry.lead(on=on))


def moves_of(job: ExportJob, program: ProgramRows, events: Events) -> tuple[Move, ...]:
    """The moves of a robot in a program, in their order.

    ``LineRefusedError`` where a corner in process would have to be a stop, which ends an arc.
    """
    rows, shares = program.robots[events.robot], row_shares(job, program)[events.robot]
    on_seam, has_process = rows.on_seam, events.form is not None
    lengths = _lengths(rows)
    moves, middle = [], None
    for row in range(len(rows)):
        if rows.middles is not None and rows.middles[row]:
            middle = row
            continue
        seam = next((seam for seam in rows.seams if seam.first <= row <= seam.last), None)
        before, after = _process(rows, row - 1 if middle is None else middle - 1), _process(rows, row)
        zone = float(shares[row]) * lengths[row] if on_seam[row] else 0.0
        which: Which | None = None
        if has_process and (before or (after and on_seam[row])):
            which = "on" if not before else "inner" if after else "off"
        is_passed = which == "inner" or (seam is not None and which and events.moves_on(seam.task, which == "on"))
        if is_passed and seam is not None and zone <= 0.0:
            raise LineRefusedError(
                seam.task,
                f": row {row + 1}: a corner in process that no zone within its tolerance rounds would be a stop, which "
                f"ends the process: divide the task there, {events.cure}, or write joints (--moves joints)",
            )
        switches = Switches(off=before and not after, waits=row in rows.marks, on=after and not before)
        moves.append(
            Move(
                row=row,
                seam=seam,
                middle=middle,
                is_tool=bool(on_seam[row]),
                feed=float(rows.feeds[row]) if rows.feeds is not None else np.nan,
                zone=zone,
                share=0.0 if on_seam[row] else float(shares[row]),
                process=which,
                switches=switches,
                triggers=_triggers(events, seam, switches, is_tool=bool(on_seam[row])),
            )
        )
        middle = None
    return tuple(moves)


def _triggers(events: Events, seam: Seam | None, switches: Switches, *, is_tool: bool) -> tuple[str, ...]:
    """What a move says of outputs that it switches ahead; ``LineRefusedError`` where it cannot."""
    form, texts = events.form, list[str]()
    for on, which in ENDS:
        if seam is None or form is None or not form.entry.lead(on=on) or not (switches.on if on else switches.off):
            continue
        if not is_tool or (on and switches.waits):
            why = "robots wait for one another" if is_tool else "no line or arc leads (approach_mm)"
            text = (
                f": {which}_lead_s: no output is switched ahead where its process begins, as {why} there: leave it out"
            )
            raise LineRefusedError(seam.task, text)
        texts += events.triggers(seam.task, on)
    return tuple(texts)


def blocks(moves: Sequence[Move]) -> Iterator[tuple[Seam | None, list[Move]]]:
    """Moves between seams and on each seam, in their order."""
    block: list[Move] = []
    for move in moves:
        if block and move.seam is not block[-1].seam:
            yield block[-1].seam, block
            block = []
        block.append(move)
    yield block[-1].seam, block


def _process(rows: RobotRows, row: int) -> bool:
    """Whether a process is on from a row to the next."""
    return row >= 0 and rows.process is not None and bool(rows.process[row])


def _lengths(rows: RobotRows) -> Array:
    """Length of the shorter one of the two lines or arcs that meet at each row in [m], 0 beside joint moves, (N,)."""
    if rows.X_PT is None:
        return np.zeros(len(rows))
    return shorter_lengths(rows.X_PT[:, :3, 3])


def shorter_lengths(p: Array) -> Array:
    """Chord of the shorter one of the two moves that meet at each row in [m], 0 where one is of joints, shape (N,).

    Positions of the tool on the part are in [m], shape (N, 3), NaN where they are not stated; an arc counts with the
    chord from its intermediate point, which is no longer than the arc.
    """
    chords = np.nan_to_num(np.linalg.norm(np.diff(p, axis=0), axis=1))
    lengths = np.zeros(len(p))
    lengths[1:-1] = np.minimum(chords[:-1], chords[1:])
    return lengths


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReadMove:
    """A move as a reader found it.

    Attributes:
        refuse: Raises the error that something else is expected at its statement.
        task: The task after which the routine is named in which it stands; None for none.
        q: Joints in [rad] or [m], shape (n,), or of each of its poses, shape (k, n); NaN for an arm whose pose is
            stated.
        poses: Its pose, and before it that of the intermediate point of an arc, in the frame of the part; none for a
            move of joints.
        configurations: Configuration of each, as the format counts it; None where it states none.
    """

    refuse: Refuse
    task: str | None
    q: Array
    poses: tuple[Array, ...] = ()
    configurations: tuple[Sequence[int], ...] | None = None
    feed: float = np.nan
    zone: float = 0.0
    share: float = 0.0
    process: Which | None = None
    duration: float = np.nan
    speed: float = np.nan  # of the joints, as ``RobotRows.speeds``


def rows_of_moves(
    events: Events, moves: Sequence[ReadMove], between: Sequence[Sequence[str]], *, begin: Refuse | None = None
) -> RobotRows:
    """Rows of a program that was read: its moves, and the statements before the first and after each of them.

    An ``InputError`` has file and line; ``begin`` raises that of the first statement, where it is not the first move.
    """
    state = _RowsOfMoves(events)
    for move, texts in zip(moves, between[1:], strict=True):
        state.add(move, texts)
    rows = state.finished(moves)
    for needed, got in zip_longest(events.before(bool(rows.marks)), between[0], fillvalue="nothing else"):
        if events.plain(needed) != events.plain(got):
            (begin or moves[0].refuse)(f"before the first move {needed}", got)
    return rows


class _RowsOfMoves:
    """The rows so far."""

    def __init__(self, events: Events) -> None:
        self._events = events
        self._rows: list[tuple[Array, Array, Sequence[int] | None, float, bool]] = []  # q, pose, configuration, feed
        self._zones: list[tuple[float, float]] = []
        self._stated: list[tuple[float, float]] = []  # duration, speed
        self._process: list[bool] = []
        self._marks: list[int] = []
        self._seams: list[Seam] = []

    def add(self, move: ReadMove, texts: Sequence[str]) -> None:
        """A move, and what stands after it."""
        switches = self._events.read(move.task, texts, move.process)
        if switches is None:
            expected = "after this move, statements of its process and of a handshake, as the cell states them"
            move.refuse(expected, texts[0] if texts else "none")
        is_on = bool(self._process) and self._process[-1]
        off, _, on = switches
        if move.process == "inner" and not is_on:
            move.refuse("a process that goes on before", "one that is off")
        form = self._events.form
        if is_on and form is not None and form.is_move and move.process is None:
            move.refuse("a motion with its process, which is on", None)
        if is_on and not off and form is not None and move.zone <= 0.0 and move.share <= 0.0:
            move.refuse("a rounded row, as a stop ends its process", None)
        if (off and not is_on) or (on and is_on):
            move.refuse(f"a process that is {'on' if off else 'off'} before", "the other")
        at_end = [end for end, is_switched in ((False, off), (True, on)) if is_switched]
        is_stop = not all(self._events.moves_on(move.task, end) for end in at_end) or switches.waits or not self._rows
        if is_stop and (move.zone > 0.0 or move.share > 0.0):
            move.refuse("a stop where a process goes on or off, robots wait or a program begins", "a rounded row")
        self._take(move)
        if switches.waits:
            self._marks.append(len(self._rows) - 1)
        self._process[-1] = (is_on and not off) or on

    def _take(self, move: ReadMove) -> None:
        """The rows of a move, one for each of its points."""
        first = len(self._rows)
        is_on = bool(self._process) and self._process[-1]
        if not move.poses:
            self._rows.append((move.q, np.full((4, 4), np.nan), None, np.nan, False))
        joints = np.broadcast_to(move.q, (len(move.poses), move.q.shape[-1]))
        for place, (pose, q) in enumerate(zip(move.poses, joints, strict=True)):
            stated = None if move.configurations is None else move.configurations[place]
            self._rows.append((q, pose, stated, move.feed, place < len(move.poses) - 1))
        count = len(self._rows) - first
        self._zones += [(0.0, 0.0)] * (count - 1) + [(move.zone, move.share)]
        self._stated += [(move.duration, move.speed)] * count
        self._process += [is_on] * count
        if not move.poses:
            return
        if move.task is None or first == 0:
            move.refuse("lines and arcs in a routine named after its task, behind a move of joints", None)
        if self._seams and self._seams[-1].task == move.task and self._seams[-1].last == first - 1:
            first = self._seams.pop().first + 1
        self._seams.append(Seam(task=move.task, first=first - 1, last=len(self._rows) - 1))

    def finished(self, moves: Sequence[ReadMove]) -> RobotRows:
        """All rows."""
        if len(self._rows) < 2:
            raise InputError(f"robot '{self._events.robot}': expected at least two moves, got {len(self._rows)}")
        if self._process[-1]:
            moves[-1].refuse("a process that goes off before the end", "one that is on")
        if any(self._zones[-1]):
            moves[-1].refuse("a stop at the end", "a rounded row")
        q, poses, configurations, feeds, middles = (list(column) for column in zip(*self._rows, strict=True))
        X_PT, is_middle = np.array(poses), np.array(middles)
        zones, shares = (np.array(column) for column in zip(*self._zones, strict=True))
        durations, speeds = (column if np.any(column >= 0.0) else None for column in np.array(self._stated).T)
        lengths = shorter_lengths(X_PT[:, :3, 3])
        rounding = np.where(zones > 0.0, np.minimum(zones / np.maximum(lengths, NO_SHAPE), 1.0), shares)
        stated = next((len(entry) for entry in configurations if entry is not None), 0)
        width = [0] * stated
        return RobotRows(
            robot=self._events.robot,
            q=np.array(q),
            process=None if self._events.form is None else np.array(self._process),
            marks=tuple(self._marks),
            rounding=rounding,
            X_PT=X_PT if self._seams else None,
            configuration=np.array([entry or width for entry in configurations], dtype=int) if stated else None,
            seams=tuple(self._seams),
            feeds=np.array(feeds) if self._seams else None,
            middles=is_middle if self._seams else None,
            durations=durations,
            speeds=speeds,
        )


def feed_text(feed: float) -> str:
    """A speed in [mm/s] with as many decimals as it needs, three at most."""
    text = f"{MM * feed:.3f}".rstrip("0").rstrip(".")
    return text if text not in {"", "0"} else "0.001"
