r"""Paced RAPID: lines and arcs of the tool at a stated speed in a work object, a routine for each seam.

Points are declared with names, so that they can be touched up: ``j_12`` for joints, ``NAME_2`` for poses of the routine
``NAME``. A work object is moved by the unit that holds the part where that is one of the same controller, or else fixed
in the base of the controller. Motions without ``\T`` are those on seams.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, pose_from, quaternion_to_rotation
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.handshake import HandshakeStep
from cellplan.programs.elements.paced import (
    ENDS,
    Events,
    Move,
    ReadMove,
    Which,
    blocks,
    feed_text,
    moves_of,
    rows_of_moves,
)
from cellplan.programs.elements.text import fixed, point_stems, safe_names
from cellplan.programs.formats.rapid.data import RapidData
from cellplan.programs.formats.rapid.moves import STOP, TURN, Place, RapidMove, read_move
from cellplan.programs.formats.rapid.rows import UNIT_TOL, rounding, rows_of
from cellplan.programs.formats.rapid.speeds import axis_speeds, turn_speed
from cellplan.programs.formats.rapid.targets import joint_targets, part_targets, work_object_text
from cellplan.programs.formats.rapid.text import Datum, RapidStatement, plain_statement, value_of
from cellplan.programs.formats.rapid.units import (
    LONGEST_NAME,
    RESERVED,
    TASKS,
    ZONES,
    RapidUnit,
    storage,
)
from cellplan.programs.formats.zones import LEAST_SHARE, on_scale

LONGEST_ROUTINE: Final = LONGEST_NAME - 5  # room for the number of a point
DATA: Final = r"(?:j|s|z|w_part|trigg)(?:_\d+)+"  # names of joints, speeds, zones, work objects and triggers
WAIT_DECIMALS: Final = 3
LAST: Final = 1  # [deg/s] by which rounding changes a turn
NEAR: Final = 1.5e-4  # [mm] or [-] rounding of a frame; a quaternion has more decimals
ZONE_TOL: Final = 1e-3  # [mm] or [deg] rounding of a zone
TRIGGER: Final = "trigg"  # data of outputs that are switched ahead, with their number
SLOTS: Final = ("point", "via", "speed", "zone", "tool", "frame")
POSE: Final = re.compile(r"\[\[([^\[\]]*)\],\[([^\[\]]*)\],\[([^\[\]]*)\],\[([^\[\]]*)\]\]")


def rapid_events(frame: ExportFrame, unit: RapidUnit) -> Events:
    """What stands between the moves of a robot."""
    events = Events(
        frame=frame,
        robot=unit.robot.name,
        signal=signal_text,
        wait=lambda seconds: f"WaitTime {fixed(seconds, WAIT_DECIMALS)};",
        plain=lambda text: plain_statement(text.removesuffix(";")).lower(),
        trigger=_trigger,
    )
    tasks = [task.name for task in frame.cell.tasks if task.robot == unit.robot.name]
    data = dict.fromkeys(text for task in tasks for on in (True, False) for text in events.triggers(task, on))
    names = {text: f"{TRIGGER}_{number}" for number, text in enumerate(data, start=1)}
    setup = tuple(f"TriggIO {name},{text};" for text, name in names.items())
    return replace(events, setup=setup, trigger=lambda lead, statement: names[_trigger(lead, statement)])


def _trigger(lead: float, statement: str) -> str:
    """Data of an output that is switched some seconds before the end of a motion."""
    signal, state = re.split(" ?, ?", statement.removesuffix(";").partition(" ")[2])
    return f"{fixed(lead, WAIT_DECIMALS)}\\Time\\DOp:={signal},{state}"


def signal_text(step: HandshakeStep) -> str:
    """One instruction of a handshake."""
    if step.meets:
        return f"WaitSyncTask {step.signal},{TASKS};"
    return f"{'WaitDI' if step.waits else 'SetDO'} {step.signal},{int(step.is_on)};"


def work_object(number: int) -> str:
    """Name of the work object of a station, counted from 0."""
    return f"w_part_{number + 1}"


def routine_names(frame: ExportFrame, unit: RapidUnit) -> dict[str, str]:
    """Name of the routine of each task of a robot."""
    tasks = [task.name for task in frame.cell.tasks if task.robot == unit.robot.name]
    form = rapid_events(frame, unit).form
    reserved = {*RESERVED, *(form.routines if form else ()), unit.module, unit.tool, TRIGGER}
    return safe_names(tasks, longest=LONGEST_ROUTINE, reserved=reserved, data=DATA)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PacedWriter:
    """The declarations and routines of one robot in a program."""

    job: ExportJob
    unit: RapidUnit
    rows: RobotRows
    moves: tuple[Move, ...]
    names: Mapping[str, str]  # of the routine of each task
    stems: Mapping[str, str]  # with which names of its points begin

    @classmethod
    def of(cls, job: ExportJob, program: ProgramRows, unit: RapidUnit) -> "PacedWriter":
        """Those of a program."""
        events, names = rapid_events(job.frame, unit), routine_names(job.frame, unit)
        return cls(
            job=job,
            unit=unit,
            rows=program.robots[unit.robot.name],
            moves=moves_of(job, program, events),
            names=names,
            stems=point_stems(names, longest=LONGEST_ROUTINE, others=(unit.module, unit.tool), data=DATA),
        )

    def point(self, row: int) -> str:
        """Name of the point of a row."""
        seam = next((seam for seam in self.rows.seams if seam.first < row <= seam.last), None)
        return f"j_{row + 1}" if seam is None else f"{self.stems[seam.task]}_{row - seam.first}"

    def data(self) -> Iterator[str]:
        """Declarations of work objects, speeds and points."""
        frame, name = self.job.frame, self.unit.robot.name
        for number, station in enumerate(frame.stations.get(name, ())):
            if station.X is not None:
                yield f"{storage(frame, name)} wobjdata {work_object(number)} := {work_object_text(frame, station)};"
        for number in range(len(rapid_events(frame, self.unit).setup)):
            yield f"VAR triggdata {TRIGGER}_{number + 1};"
        for feed in sorted({feed_text(move.feed) for move in self.moves if move.is_tool}, key=float):
            others = ",".join(map(str, axis_speeds(self.unit, self._turns(feed))))
            yield f"CONST speeddata {speed_name(feed)} := [{feed},{others}];"
        on_seam = self.rows.on_seam
        joints = joint_targets(self.unit, self.rows.q)
        for row in np.flatnonzero(~on_seam).tolist():
            yield f"CONST jointtarget {self.point(row)} := {joints[row]};"
        if self.rows.X_PT is not None:
            poses = part_targets(self.unit, self.rows.q[on_seam], self.rows.X_PT[on_seam])
            for row, target in zip(np.flatnonzero(on_seam).tolist(), poses, strict=True):
                yield f"CONST robtarget {self.point(row)} := {target};"

    def _turns(self, feed: str) -> list[float]:
        """Speeds in [deg/s] of the turn of the tool on lines and arcs at a speed; behind joints it keeps its turn."""
        X = self.rows.X_PT
        moves = [move for move in self.moves if move.is_tool and feed_text(move.feed) == feed]
        spans = [slice((move.middle or move.row) - 1, move.row + 1) for move in moves]
        known = [] if X is None else [X[span] for span in spans if np.all(np.isfinite(X[span.start]))]
        return [turn_speed(list(poses), float(feed) / MM) for poses in known]

    def routines(self, joint_moves: Sequence[str]) -> dict[str, list[str]]:
        """Statements of the main routine and of that of each seam, by name; ``joint_moves`` are those by row."""
        events = rapid_events(self.job.frame, self.unit)
        main = list(events.before(bool(self.rows.marks)))
        routines: dict[str, list[str]] = {"main": main}
        for seam, moves in blocks(self.moves):
            statements = main if seam is None else routines.setdefault(self.names[seam.task], [])
            for move in moves:
                task = None if seam is None else seam.task
                statements += [self._move(move) if move.is_tool else joint_moves[move.row]]
                statements += events.texts(task, move.switches)
            if seam is not None:
                main.append(f"{self.names[seam.task]};")
        return routines

    def zones(self) -> list[int]:
        """Sizes of the zones on seams in [um], 0 for a stop."""
        return [self._zone(move) for move in self.moves if move.is_tool]

    def _zone(self, move: Move) -> int:
        """Size of the zone of a move in [um]."""
        return int(on_scale(np.array([1000.0 * MM * move.zone]), ZONES)[0])

    def _move(self, move: Move) -> str:
        """A line or an arc."""
        seam, size = move.seam, self._zone(move)
        task = "" if seam is None else seam.task
        frame = self.job.frame
        stations = frame.stations[self.unit.robot.name]
        slots = {
            "point": self.point(move.row),
            "via": "" if move.middle is None else self.point(move.middle),
            "speed": speed_name(feed_text(move.feed)),
            "zone": zone_text(size),
            "tool": self.unit.tool,
            "frame": work_object(stations.index(frame.station(self.unit.robot.name, task))),
        }
        form = rapid_events(frame, self.unit).form
        if form is not None and form.is_move and move.process is not None:
            data = form.data(task)
            return form.move(move.process, circular=move.middle is not None, slots={**slots, "data": data})
        return plain_move(slots, is_arc=move.middle is not None, triggers=move.triggers)


def plain_move(slots: Mapping[str, str], *, is_arc: bool, triggers: Sequence[str] = ()) -> str:
    """A line or an arc without a process, which may switch outputs ahead by names of their data."""
    points = f"C {slots['via']},{slots['point']}" if is_arc else f"L {slots['point']}"
    ahead = "".join(f"\\T{number}:={name}" if number > 1 else f",{name}" for number, name in enumerate(triggers, 1))
    verb, rest = "Trigg" if triggers else "Move", f"{slots['zone']},{slots['tool']}\\WObj:={slots['frame']};"
    return f"{verb}{points},{slots['speed']}{ahead},{rest}"


def zone_text(size: int) -> str:
    """A zone of some micrometres, or a stop."""
    return f"z_{size}" if size else "fine"


def speed_name(feed: str) -> str:
    """Name of the speed of a tool in [mm/s]."""
    return f"s_{feed.replace('.', '_')}"


class PacedReader:
    """Follows the statements of one robot, each with the routine in which it stands."""

    def __init__(self, frame: ExportFrame, unit: RapidUnit, data: RapidData) -> None:
        """Take the declarations; those of work objects were compared with the cell."""
        self._frame, self._unit, self._data = frame, unit, data
        self._events = rapid_events(frame, unit)
        self._tasks = {name.lower(): task for task, name in routine_names(frame, unit).items()}
        self._used: set[str] = set()
        self._here: tuple[Array, ...] = ()  # pose at which the last line or arc ended
        self._forms = list(self._move_forms())

    def rows(self, statements: Sequence[tuple[str, RapidStatement]]) -> RobotRows:
        """The rows of all statements with the names of their routines; an ``InputError`` has file and line."""
        moves: list[ReadMove | RapidMove] = []
        tasks: list[str | None] = []
        between: list[list[str]] = [[]]
        for routine, statement in statements:
            task = self._tasks.get(routine)
            is_joint = statement.text.lower().startswith(("moveabsj", "moveextj"))
            place = Place(is_first=not moves, is_between=False, is_synchronised=False)
            move = read_move(statement, self._unit, self._data, place) if is_joint else self._tool_move(statement, task)
            if move is None:
                self._data.require_meeting(statement)
                between[-1].append(statement.text)
                continue
            self._here = move.poses[-1:] if isinstance(move, ReadMove) else ()
            moves.append(move)
            tasks.append(task)
            between.append([])
        return rows_of_moves(self._events, [*self._with_joints(moves, tasks)], between)

    def _with_joints(self, moves: Sequence[ReadMove | RapidMove], tasks: Sequence[str | None]) -> Iterator[ReadMove]:
        """All moves, those of joints with their joints and how they are rounded."""
        joint_moves = [move for move in moves if isinstance(move, RapidMove)]
        joints = iter(rows_of(self._unit, joint_moves, ()).q if joint_moves else ())
        q = np.array([move.q if isinstance(move, ReadMove) else next(joints) for move in moves])
        zones = [move.zone if isinstance(move, RapidMove) else STOP for move in moves]
        shares = rounding(self._unit, zones, q, np.full((len(q), 3), np.nan))
        for move, task, position, share in zip(moves, tasks, q, shares, strict=True):
            if isinstance(move, ReadMove):
                yield move
            else:
                least = LEAST_SHARE if move.zone != STOP else 0.0  # however little, as where nothing follows
                yield ReadMove(
                    refuse=move.statement.refuse,
                    task=task,
                    q=position,
                    share=max(float(share), least),
                    duration=move.duration or np.nan,
                )

    def _move_forms(self) -> Iterator[tuple[re.Pattern[str], Which | None, str | None]]:
        """Patterns of all motions of a tool, with what each does to the process, and of which task."""
        slots = {slot: f"@{slot}@" for slot in SLOTS}
        texts: list[tuple[str, Which | None, str | None]] = [
            (plain_move(slots, is_arc=is_arc), None, None) for is_arc in (False, True)
        ]
        texts += [
            (plain_move(slots, is_arc=is_arc, triggers=triggers), one, task)
            for task in self._tasks.values()
            for on, one in ENDS
            for is_arc in (False, True)
            if (triggers := self._events.triggers(task, on))
        ]
        form = self._events.form
        if form is not None and form.is_move:
            which: tuple[Which, ...] = ("on", "inner", "off")
            texts = [
                (form.move(one, circular=is_arc, slots={**slots, "data": form.data(task)}), one, task)
                for task in self._tasks.values()
                for one in which
                for is_arc in (False, True)
            ] + texts
        for text, one, task in texts:
            pattern = re.escape(self._events.plain(text))
            for slot in SLOTS:
                pattern = pattern.replace(f"@{slot}@", rf"(?P<{slot}>\w+)")
            yield re.compile(pattern), one, task

    def _tool_move(self, statement: RapidStatement, task: str | None) -> ReadMove | None:
        """A line or an arc; None where the statement is none."""
        for pattern, which, of_task in self._forms:
            match = pattern.fullmatch(statement.text.lower())
            if match is None or of_task not in {None, task}:
                continue
            words = match.groupdict()
            if task is None:
                statement.refuse("lines and arcs in the routine of a task")
            self._require_frames(statement, words, task)
            for name in () if which in {None, "inner"} else self._events.triggers(task, which == "on"):
                self._data.require(statement, name, "triggdata")
            speed = self._data.require(statement, words["speed"], "speeddata")
            feed = value_of(speed)[0] / MM
            points = [self._point(statement, words[slot]) for slot in ("via", "point") if words.get(slot)]
            poses = tuple(point[0] for point in points)
            self._require_speeds(speed, turn_speed([*self._here, *poses], feed))
            zone = 0.0 if words["zone"] == "fine" else self._zone(statement, words["zone"])
            q = np.full(len(self._unit.robot.model.joints), np.nan)
            q[list(self._unit.axes.external)] = points[-1][2]
            return ReadMove(
                refuse=statement.refuse,
                task=task,
                q=q,
                poses=poses,
                configurations=tuple(point[1] for point in points),
                feed=feed,
                zone=zone,
                process=which,
            )
        return None

    def _require_speeds(self, speed: Datum, turn: float) -> None:
        """A turn of the tool in [deg/s] and external axes slow no line below the speed of the tool."""
        least = axis_speeds(self._unit, [turn])
        if any(stated < needed - LAST for stated, needed in zip(value_of(speed)[1:], least, strict=True)):
            words = "{} deg/s of the turn, {} mm/s and {} deg/s of external axes".format(*least)
            speed.statement.refuse(f"at least {words}, so that they slow no line", f"{speed.value}")

    def _require_frames(self, statement: RapidStatement, words: Mapping[str, str], task: str) -> None:
        """The motion is in the work object of its task, with the tool of the robot."""
        stations = self._frame.stations[self._unit.robot.name]
        station = self._frame.station(self._unit.robot.name, task)
        for slot, kind, expected in (
            ("frame", "wobjdata", work_object(stations.index(station))),
            ("tool", "tooldata", self._unit.tool),
        ):
            if words[slot] != expected.lower():
                statement.refuse(f"{expected} in a motion of '{task}'", words[slot])
            datum = self._data.require(statement, words[slot], kind)
            if slot == "frame" and datum.storage.upper() != (how := storage(self._frame, self._unit.robot.name)):
                datum.statement.refuse(f"{how} wobjdata, as tasks of a controller share what is PERS", datum.storage)
            if slot == "frame" and not _is_frame(value_of(datum), work_object_text(self._frame, station)):
                datum.statement.refuse(f"{work_object_text(self._frame, station)} as the cell has it")

    def _zone(self, statement: RapidStatement, name: str) -> float:
        """Distance in [m] within which a declared zone rounds; its angles in [deg] are a tenth of it in [mm]."""
        datum = self._data.require(statement, name, "zonedata")
        is_fine, reach, *others = value_of(datum)
        turn = TURN * reach
        if is_fine or np.abs(np.subtract(others, [reach, reach, turn, reach, turn])).max() > ZONE_TOL:
            datum.statement.refuse("a zone that rounds, with one distance and angles of a tenth of it")
        return float(reach) / MM

    def _point(self, statement: RapidStatement, name: str) -> tuple[Array, list[int], Array]:
        """Pose, configuration and external axes of a declared point, each used once."""
        match = POSE.fullmatch(self._data.target(statement, name, is_cartesian=True))
        if match is None or name in self._used:
            statement.refuse("a target [[3],[4],[4],[6]] that is used once", name)
        self._used.add(name)
        place, turn, configuration, external = (
            [float(number) for number in text.split(",")] for text in match.groups()
        )
        if (len(place), len(turn), len(configuration), len(external)) != (3, 4, 4, 6):
            statement.refuse("a target [[3],[4],[4],[6]]", name)
        if abs(np.linalg.norm(turn) - 1.0) > UNIT_TOL:
            statement.refuse("a quaternion of unit length", name)
        X = pose_from(quaternion_to_rotation(np.array(turn)), np.array(place) / MM)
        axes = self._unit.axes.external
        scales = np.array([self._unit.robot.model.joints[axis].display_unit.scale for axis in axes])
        return X, [int(number) for number in configuration], np.array(external[: len(axes)]) / scales


def _is_frame(value: object, expected: str) -> bool:
    """Whether a value is another one but for its last decimals."""
    return _is_near(value, value_of(Datum(RapidStatement("", "", 0), "pers", "wobjdata", "", None, expected)))


def _is_near(one: object, other: object) -> bool:
    """Whether nested lists have equal entries, and numbers that differ by rounding only."""
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and all(map(_is_near, one, other))
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= NEAR
    return one == other
