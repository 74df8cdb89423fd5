"""Reader of RAPID programs: strict, by the rules of MultiMove over all tasks of a program, and by nothing else.

It accepts what is written here and harmless variants of it: other spaces, comments, lower case, statements over several
lines, targets that are declared before, a header of the language version.
"""

import re
from collections.abc import Mapping
from typing import Final, NamedTuple

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportFrame, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.handshake import HandshakeStep, first_steps, handshake_steps, lowering_step
from cellplan.programs.formats.rapid.data import MEETING, RapidData, read_data
from cellplan.programs.formats.rapid.moves import Place, RapidMove, read_move
from cellplan.programs.formats.rapid.paced import PacedReader, signal_text
from cellplan.programs.formats.rapid.rows import rows_of
from cellplan.programs.formats.rapid.text import RapidModule, RapidStatement, read_module
from cellplan.programs.formats.rapid.units import WORDS, PartFrame, RapidUnit, part_frame, rapid_units, works_on_part

_SIGNAL: Final = re.compile(r"(setdo|waitdi) ?(\w+),([01])", re.I)
_SYNC: Final = re.compile(r"(syncmoveon) (\w+),(\w+)|(syncmoveoff) (\w+)", re.I)
_CALL: Final = re.compile(r"\w+")
_PROGRAM: Final = re.compile(
    r'\s*(?:<\?xml version="1\.0" encoding="[\w-]+"\s*\?>)?'
    r"\s*<Program>((?:\s*<Module>[^<>]+</Module>)+)\s*</Program>\s*\n"
)


class _Sync(NamedTuple):
    """A statement that begins or ends synchronised moves: its names in lower case."""

    statement: RapidStatement
    is_on: bool
    ident: str
    tasks: str


class _Task(NamedTuple):
    """What the program of one robot does, in its order."""

    unit: RapidUnit
    data: RapidData
    moves: list[RapidMove]
    syncs: list[_Sync]
    marks: tuple[int, ...]

    @property
    def rows(self) -> RobotRows:
        """The rows of its robot."""
        return rows_of(self.unit, self.moves, self.marks)


def read_rapid(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """The rows of each program that files hold, by the rules of MultiMove; an ``InputError`` has file and line."""
    units, part = rapid_units(frame), part_frame(frame)
    left, programs = dict(files), []
    for name in frame.programs:
        folder = "" if name is None else f"{name}/"
        if frame.promise is Promise.PACED:
            rows = (_read_paced(frame, unit, left, folder) for unit in units)
            programs.append(ProgramRows(name=name, robots={one.robot: one for one in rows}))
            continue
        tasks = [_read_task(frame, unit, left, folder=folder, part=part) for unit in units]
        if frame.promise is Promise.SYNCHRONISED:
            for task in tasks:
                _require_same_moves(tasks[0], task)
        programs.append(ProgramRows(name=name, robots={task.unit.robot.name: task.rows for task in tasks}))
    if left:
        raise InputError(f"{min(left)}: expected files of the programs only, got another one")
    return tuple(programs)


def _read_task(
    frame: ExportFrame, unit: RapidUnit, left: dict[str, str], *, folder: str, part: PartFrame | None
) -> _Task:
    """The program of one robot; its files are taken out of those that are left."""
    modules = _modules_of(unit, left, folder)
    data = read_data(frame, unit, modules, part if works_on_part(frame, unit.robot.name) else None)
    statements = [statement for _, statement in _flat(modules)]
    is_synchronised = frame.promise is Promise.SYNCHRONISED
    moves: list[RapidMove] = []
    syncs: list[_Sync] = []
    marks: list[int] = []
    handshake = () if is_synchronised else handshake_steps(frame, unit.robot.name)
    has_output = not is_synchronised and bool(first_steps(frame, unit.robot.name))
    lowered = has_output and _lowers(frame, unit, statements)
    place, between = int(lowered), False
    while place < len(statements):
        statement = statements[place]
        word = statement.text[:10].lower()
        if word.startswith("move"):
            where = Place(is_first=not moves, is_between=between, is_synchronised=is_synchronised)
            moves.append(read_move(statement, unit, data, where))
            place += 1
        elif word in {"syncmoveon", "syncmoveof"}:
            syncs.append(_sync(statement, data, moves, between=between, synchronised=is_synchronised))
            between, place = syncs[-1].is_on, place + 1
        else:
            if has_output and not lowered:
                statement.refuse(f"SetDO {lowering_step(frame, unit.robot.name).signal},0 before the first move")
            data.require_meeting(statement)
            _handshake(statements[place : place + max(1, len(handshake))], handshake, moves, marks)
            marks.append(len(moves) - 1)
            place += len(handshake)
    if lowered and not marks:
        statements[0].refuse("a handshake at a row, as its output is lowered", "none")
    _require_whole(frame, unit, moves, syncs, end=modules[0][1].ends["main"], between=between)
    return _Task(unit, data, moves, syncs, tuple(marks))


def _read_paced(frame: ExportFrame, unit: RapidUnit, left: dict[str, str], folder: str) -> RobotRows:
    """The rows of one robot with its seams; its files are taken out of those that are left."""
    modules = _modules_of(unit, left, folder)
    return PacedReader(frame, unit, read_data(frame, unit, modules, None)).rows(_flat(modules))


def _modules_of(unit: RapidUnit, left: dict[str, str], folder: str) -> list[tuple[str, RapidModule]]:
    """The modules that the program file of a robot names, the first of which has its name."""
    path = f"{folder}{unit.module}.pgf"
    text = left.pop(path, None)
    if text is None:
        raise InputError(f"{path}: expected the program file of robot '{unit.robot.name}', got none")
    listed = _PROGRAM.fullmatch(text)
    if listed is None:
        raise InputError(f"{path}:1: expected <Program> with the names of its modules")
    modules = []
    for name in re.findall(r"<Module>\s*([^<>]*?)\s*</Module>", listed[1]):
        file = f"{folder}{name}"
        source = left.pop(file, None)
        if source is None:
            raise InputError(f"{path}: expected module {name!r} among the files, once, got none")
        module = read_module(source, file)
        if f"{module.name}.mod".lower() != name.lower():
            raise InputError(f"{file}: expected a module with the name of its file, got {module.name!r}")
        modules.append((file, module))
    if modules[0][1].name.lower() != unit.module.lower():
        raise InputError(f"{path}: expected module {unit.module!r} first, got {modules[0][1].name!r}")
    return modules


def _flat(modules: list[tuple[str, RapidModule]]) -> list[tuple[str, RapidStatement]]:
    """Statements of the main routine with the names of their routines, each page in the place where it is called."""
    routines: dict[str, list[RapidStatement]] = {}
    for _, module in modules:
        for name, statements in module.routines.items():
            if name in routines:
                module.heads[name].refuse("a name that is used once", name)
            routines[name] = statements
    if "main" not in modules[0][1].routines:
        raise InputError(f"{modules[0][0]}: expected PROC main(), got none")
    flat, called = [], {"main"}
    for statement in routines["main"]:
        name = statement.text.lower()
        if not _CALL.fullmatch(name) or name in WORDS:
            flat.append(("main", statement))
        elif name not in routines:
            statement.refuse("the name of a routine that is declared")
        elif name in called:
            statement.refuse("each page called once")
        else:
            called.add(name)
            flat += [(name, inner) for inner in routines[name]]
    for _, module in modules:
        for name, head in module.heads.items():
            if name not in called:
                head.refuse("each page called by main", f"{name}, which is not called")
    return flat


def _sync(
    statement: RapidStatement, data: RapidData, moves: list[RapidMove], *, between: bool, synchronised: bool
) -> _Sync:
    """A statement that begins or ends synchronised moves, behind a stop point."""
    match = _SYNC.fullmatch(statement.text)
    if match is None or not synchronised:
        statement.refuse("SyncMoveOn and SyncMoveOff in synchronised programs" if match is None else "no SyncMoveOn")
    is_on = match[1] is not None
    ident, tasks = (match[2], match[3]) if is_on else (match[5], "")
    if is_on is between or (is_on and len(moves) != 1):
        statement.refuse("SyncMoveOn behind the first move, and one SyncMoveOff behind the last one")
    if not moves or not moves[-1].is_fine:
        statement.refuse("a move that ends in fine before it")
    if not is_on and len(moves) < 2:
        statement.refuse("moves between SyncMoveOn and SyncMoveOff")
    data.require(statement, ident, "syncident")
    if is_on:
        data.require(statement, tasks, "tasks")
    return _Sync(statement, is_on, ident.lower(), tasks.lower())


def _lowers(frame: ExportFrame, unit: RapidUnit, statements: list[RapidStatement]) -> bool:
    """Whether a program begins with the instruction that lowers its output, and with no other one of a handshake."""
    match = _SIGNAL.fullmatch(statements[0].text) if statements else None
    if match is None:
        return False
    first = lowering_step(frame, unit.robot.name)
    if (match[1].lower(), match[2].lower(), match[3]) != ("setdo", first.signal.lower(), "0"):
        statements[0].refuse(f"SetDO {first.signal},0 before the first move")
    return True


def _handshake(
    statements: list[RapidStatement], expected: tuple[HandshakeStep, ...], moves: list[RapidMove], marks: list[int]
) -> None:
    """The instructions of a handshake, behind a stop point, once at a row."""
    for statement, step in zip(statements, expected or (None,), strict=False):
        if not (_SIGNAL.fullmatch(statement.text) or MEETING.fullmatch(statement.text)):
            statement.refuse("a move, a call or a handshake")
        expected_text = "a move" if step is None else signal_text(step).removesuffix(";")
        if statement.text.lower().replace(" ", "") != expected_text.lower().replace(" ", ""):
            statement.refuse(expected_text)
    if len(statements) < len(expected):
        statements[-1].refuse("the whole of a handshake")
    if not moves or not moves[-1].is_fine or len(moves) - 1 in marks:
        statements[0].refuse("a handshake behind a move that ends in fine, once")


def _require_whole(
    frame: ExportFrame,
    unit: RapidUnit,
    moves: list[RapidMove],
    syncs: list[_Sync],
    *,
    end: RapidStatement,
    between: bool,
) -> None:
    """The program of a robot has all it needs."""
    if frame.promise is Promise.SYNCHRONISED and (len(syncs) != 2 or between):
        end.refuse("one SyncMoveOn and one SyncMoveOff before it", f"{len(syncs)} of both")
    if len(moves) < 2:
        end.refuse(f"at least two moves of robot '{unit.robot.name}'", str(len(moves)))
    if not moves[-1].is_fine:
        moves[-1].statement.refuse("fine in the last move")
    seen: set[int] = set()
    for move in moves:
        if move.number is not None and move.number in seen:
            move.statement.refuse("each \\ID once", f"\\ID:={move.number} again")
        seen.add(-1 if move.number is None else move.number)


def _require_same_moves(first: _Task, other: _Task) -> None:
    """Moves that run together have the same number and the same duration; lists and meeting points are the same."""
    for mine, theirs in zip(first.syncs, other.syncs, strict=True):
        if mine.ident != theirs.ident:
            theirs.statement.refuse(f"the syncident '{mine.ident}' of the other tasks", theirs.ident)
        if mine.tasks != theirs.tasks:
            theirs.statement.refuse(f"the list of tasks '{mine.tasks}' of the other tasks", theirs.tasks)
        if mine.is_on and first.data.tasks(mine.tasks) != other.data.tasks(theirs.tasks):
            theirs.statement.refuse("the same list of tasks in all tasks", "another one")
    if len(first.moves) != len(other.moves):
        other.syncs[-1].statement.refuse(
            f"{len(first.moves) - 1} moves before it, as in the other tasks", str(len(other.moves) - 1)
        )
    for name, key in (("\\ID", "number"), ("\\T", "duration")):
        for place, (first_move, other_move) in enumerate(zip(first.moves, other.moves, strict=True)):
            expected, got = getattr(first_move, key), getattr(other_move, key)
            if expected != got:
                other.moves[place].statement.refuse(f"{name}:={expected}, as in the other tasks", str(got))
