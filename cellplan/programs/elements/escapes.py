"""Escape programs: back along the rows to the last mark, and from there home; what the languages of makers share.

A program sets its step register at each mark, between the two halves of the handshake: no robot leaves a mark before
the registers of all have its number. So they differ by no more than one, and only where all robots stand at a mark.

Before anything moves escape programs find out whether they do: with an even number the leader answers, with an odd
one it asks, and who asks looks first whether another one does. Two that ask at once go on together, but then the leader
looks once more after a pause. Programs of even and of odd numbers wait for one another without end.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, Promise
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.handshake import (
    HandshakeStep,
    handshake_steps,
    lowering_step,
    speakers,
    task_group,
)
from cellplan.programs.elements.joints import Angle, Axes, from_numbers, on_one_controller, unit_of
from cellplan.programs.elements.paced import Events

REGISTER: Final = "cell_step"  # name of a step register where the cell states none
# by kind of controller, its number where registers have no names, with as many digits as it has
NUMBERED: Final = {"fanuc": "81", "ur": "24", "yaskawa": "081"}
SPEED: Final = 10  # [%] of the top speed


class EscapeStep(NamedTuple):
    """What is done where all robots are between two marks; rows count from 1."""

    number: int  # what the step register holds
    first: int  # row of the program at the mark before
    last: int  # row at the mark behind
    off: str  # distance from the rows up to which a robot stands on them, in the units of the program
    legs: tuple[tuple[int, int] | None, ...]  # rows on the way home between two waits; None for a robot that stands


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class EscapeProgram:
    """What the escape program of one robot holds."""

    frame: ExportFrame  # that of its main program
    robot: str
    notes: tuple[str, ...]  # lines of the head, without the sign of a comment
    rows: Array  # of the main program in [rad] or [m], shape (N, n)
    homeward: Array  # of all ways home, likewise; one at least
    steps: tuple[EscapeStep, ...]

    @property
    def register(self) -> str:
        """Name or number of its step register."""
        return register_of(self.frame, self.robot)


@dataclass(frozen=True, slots=True, kw_only=True)
class EscapeForm:
    """How a language writes escape programs, and the step register in main programs."""

    sign: str  # of a comment
    case: str  # statements with their fields in braces, of which any may name the program: where a step begins
    meet: str
    agree: tuple[str, str]  # with an even number and with an odd one
    pause: str  # longer than signals take
    register: str
    angle: Angle
    events: Callable[[ExportFrame, str], Events]  # what stands between the moves of a main program
    sources: Callable[[ExportFrame, str], str]  # pattern of the paths of a main program that hold its marks
    render: Callable[[EscapeProgram], dict[str, str]]
    require: Callable[[ExportFrame, str], None]  # refuses a register that the language does not take
    back: str = ""
    go: str = ""
    tables: tuple[str, str] = ("", "")  # what a line with the start of the rows of the program holds, and of those home
    row: str = ""  # pattern of a line with numbers of a row, which are its only group
    # the numbers: of an arm, then of the axes before it
    numbers: Callable[[Robot, str], Sequence[float]] = lambda _robot, _text: ()
    # what a reader of its own finds, where rows do not stand line by line
    read: Callable[[EscapeProgram, Mapping[str, str]], EscapeProgram] | None = None
    # where no program can tell between which rows an arm stands: start of motions behind a mark, before each of which
    # the register is counted up by a statement, and how much more it holds from mark to mark
    counted: tuple[str, str] = ("", "")
    unit: int = 1
    program: Callable[[ExportFrame, str], str] = lambda _frame, _robot: ""  # what statements name the program
    scope: str = ""  # before the register in escape programs
    # line of a main program behind which the register is declared, and the declaration; empty where none is needed
    declaration: tuple[str, str] = ("", "")
    plain: Callable[[str], str] = str.strip  # statement of a line
    line: str = "{}"  # of a main program, with the statement in braces
    layout: Callable[[str], str] = str  # text of a main program whose lines may be others than before
    following: str = "{name}+1"  # number that follows that in the register

    def calls(self, program: EscapeProgram, step: EscapeStep) -> Iterator[str]:
        """Statements of a step, from its begin. None is known any more as soon as one robot may be on its way home."""
        name = self.program(program.frame, program.robot)
        yield self.case.format(number=step.number)
        yield self.agree[step.number % 2].format(program=name)
        yield self.back.format(first=step.first, last=step.last, off=step.off, program=name)
        yield self.meet.format(program=name)
        yield self.set_register(program, 0)
        for leg in step.legs:
            if leg is not None:
                yield self.go.format(first=leg[0], last=leg[1], program=name)
            yield self.meet.format(program=name)

    def before(self, program: EscapeProgram) -> list[str]:
        """Statements before anything moves: processes end; a robot by itself has one step, and counts in no register.

        Only where its main program counts motions it does.
        """
        frame, robot, process = program.frame, program.robot, self.events(program.frame, program.robot).form
        tasks = [task.name for task in frame.cell.tasks if task.robot == robot]
        off = list[str]()
        if process is not None and frame.promise is Promise.PACED:
            lines = (process.lines(False, task, ahead=ahead) for ahead in (False, True) for task in tasks)
            off = list(dict.fromkeys(chain.from_iterable(lines)))
        if not handshake_steps(frame, robot):
            return off if self.counted[0] else [*off, self.set_register(program, program.steps[0].number)]
        return [*off, *self.lines(frame, robot, [lowering_step(frame, robot)])]

    def set_register(self, program: EscapeProgram, number: int) -> str:
        """The statement of an escape program that sets its register."""
        name = self.program(program.frame, program.robot)
        return f"{self.scope}{self.register}".format(name=program.register, value=number, program=name)

    def lines(self, frame: ExportFrame, robot: str, steps: Sequence[HandshakeStep | None]) -> list[str]:
        """Lines of instructions of a handshake; None for a pause, which is all that a robot by itself does."""
        signal = self.events(frame, robot).signal
        texts = [self.pause if step is None else signal(step) for step in steps or (None,)]
        return [line.strip() for text in texts for line in text.split("\n")]

    def waits(self, frame: ExportFrame, robot: str) -> Iterator[tuple[str, list[str]]]:
        """Routines in which robots wait for one another: statement that calls each, and its lines."""
        name = self.program(frame, robot)
        plans: list[Sequence[HandshakeStep | None]] = [handshake_steps(frame, robot)]
        plans += [agreement_steps(frame, robot, is_odd=is_odd) for is_odd in (False, True)]
        for call, steps in zip((self.meet, *self.agree), plans, strict=True):
            yield call.format(program=name), self.lines(frame, robot, steps)


def agreement_steps(frame: ExportFrame, robot: str, *, is_odd: bool) -> list[HandshakeStep | None]:
    """Instructions by which robots find out whether all have even or all odd numbers; None for a pause.

    None at all for a robot by itself.
    """
    steps, leads = handshake_steps(frame, robot), robot == speakers(frame)[0]
    if not steps:
        return []
    raised, lowered = ([step for step in steps if step.waits and step.is_on is is_on] for is_on in (True, False))
    raising, lowering = (next(s for s in steps if not s.waits and s.is_on is is_on) for is_on in (True, False))
    if is_odd is not leads:
        answers = [*raised, raising, *lowered, lowering]
        return [*answers, *answers, None]
    pause = [None, *lowered] if leads else []
    asks: list[HandshakeStep | None] = [*lowered, *pause, raising, *raised, lowering, *lowered]
    return [*asks, *asks, None]


def register_of(frame: ExportFrame, robot: str) -> str:
    """Name or number of the step register of a robot."""
    control = frame.robot(robot).control
    if control is None:
        return REGISTER
    usual = NUMBERED.get(frame.cell.controllers[control.id].kind, REGISTER)
    stated = usual if control.step_register is None else str(control.step_register)
    return stated.zfill(len(usual)) if usual.startswith("0") else stated


def require_registers_apart(frame: ExportFrame, robot: str, count: int) -> None:
    """Refuse a number that is less than ``count`` from that of a robot of the same controller, as each uses so many."""
    register = register_of(frame, robot)
    for other in frame.robots[: frame.robots.index(robot)]:
        at, is_shared = register_of(frame, other), on_one_controller(frame.robot(robot), frame.robot(other))
        if is_shared and at.isdecimal() and abs(int(at) - int(register)) < count:
            raise InputError(
                f"robots.{robot}.controller.step_register: expected one {count} or more from that of '{other}' on the "
                f"same controller, {at}, as both use as many, got '{register}'"
            )


def with_register(dialect: Dialect, form: EscapeForm) -> Dialect:
    """A format whose programs set their step register at each mark, and whose reader expects just that."""

    def render(job: ExportJob) -> dict[str, str]:
        return _with_steps(form, job.frame, dialect.render(job))

    def read(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
        counted = form.register.replace("{value}", form.following), form.counted[1]
        kinds = form.register, *counted, form.declaration[1]
        statements = [_pattern(statement) for statement in kinds if statement]
        plain, blank = dict[str, str](), dict[str, str]()
        for path, text in files.items():
            lines = text.split("\n")
            is_step = [any(one.fullmatch(form.plain(line)) for one in statements) for line in lines]
            plain[path] = "\n".join(line for line, step in zip(lines, is_step, strict=True) if not step)
            blank[path] = "\n".join(
                line[len(line.rstrip("\r")) :] if step else line for line, step in zip(lines, is_step, strict=True)
            )
        for path, text in _with_steps(form, frame, plain).items():
            require_same(path, text, form.layout(files[path]))
        return dialect.read(frame, blank)

    def demands(frame: ExportFrame, rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
        yield partial(_require_one_program, frame)
        yield from (partial(form.require, frame, robot) for robot in frame.robots)
        yield from dialect.demands(frame, rows)

    return replace(dialect, render=render, read=read, demands=demands, sets_steps=True)


def _require_one_program(frame: ExportFrame) -> None:
    """Refuse cells whose run is not one program, and robots that wait for one another without wires."""
    if frame.programs != (None,):
        raise InputError(f"--escape: expected one program from home to home, got {len(frame.programs)} programs")
    for group in filter(None, (task_group(frame, robot.name) for robot in frame.cell.robots)):
        raise InputError(
            f"robots.{group[0]}.controller.handshake: expected the inputs that {', '.join(map(repr, group[1:]))} set, "
            "as escape programs ask one another by wires, got none"
        )
    for arm, *others in (unit_of(frame.cell, robot.name) for robot in frame.cell.robots):
        if others:
            raise InputError(f"--escape: expected arms that move no positioner, got '{others[0]}' in step with '{arm}'")


def read_escape(form: EscapeForm, expected: EscapeProgram, files: Mapping[str, str]) -> EscapeProgram:
    """What the files of an escape program hold: rows and steps as they stand there, all else as it is written.

    ``InputError`` with file and line for any other statement. Of what is expected only frame and robot are used.
    """
    read = (form.read or partial(_read_lines, form))(expected, files)
    for path, text in form.render(read).items():
        require_same(path, text, files.get(path, ""))
    return read


def _read_lines(form: EscapeForm, expected: EscapeProgram, files: Mapping[str, str]) -> EscapeProgram:
    """What files hold whose rows stand line by line."""
    robot = expected.frame.robot(expected.robot)
    reader, notes = _EscapeReader(form, robot), list[str]()
    for place, (path, text) in enumerate(files.items()):
        for number, line in enumerate(map(form.plain, text.split("\n")), start=1):
            if line.startswith(form.sign):
                notes += [] if place else [line.removeprefix(form.sign).strip()]
                continue
            try:
                reader.take(line)
            except (ValueError, IndexError):
                raise InputError(f"{path}:{number}: expected plain numbers, got {line[:60]!r}") from None
    rows, homeward = (
        from_numbers(robot, np.array(table, dtype=float).reshape(-1, len(reader.order)), angle=form.angle)
        for table in reader.tables
    )
    return replace(expected, notes=tuple(notes), rows=rows, homeward=homeward, steps=tuple(reader.steps))


class _EscapeReader:
    """Rows and steps as they are found line by line.

    Attributes:
        order: Joints in the order in which the numbers of a row stand: those of an arm first.
        tables: Numbers of the rows of the program, and of those home, in the order of the model.
        steps: The steps so far.
    """

    def __init__(self, form: EscapeForm, robot: Robot) -> None:
        """Begin with nothing."""
        self._form, self._robot = form, robot
        self._patterns = [_pattern(statement) for statement in (form.case, form.back, form.go, form.meet)]
        self.order = [*Axes.of(robot).arm, *Axes.of(robot).external]
        self.tables: tuple[list[Sequence[float]], list[Sequence[float]]] = ([], [])
        self.steps: list[EscapeStep] = []
        self._row = list[float]()  # numbers of a row that goes on in the next line
        self._table, self._waits = 0, 0
        self._leg: tuple[int, int] | None = None

    def take(self, line: str) -> None:
        """Take in what a line holds; a ``ValueError`` or ``IndexError`` where its numbers are none."""
        self._table = next((at for at, begin in enumerate(self._form.tables) if begin in line), self._table)
        case, back, go, meet = (pattern.fullmatch(line) for pattern in self._patterns)
        if row := re.fullmatch(self._form.row, line):
            self._row += self._form.numbers(self._robot, row[1])
            if len(self._row) >= len(self.order):
                values = dict(zip(self.order, self._row, strict=True))
                self.tables[self._table].append([values[joint] for joint in range(len(values))])
                self._row = []
        elif self._row:
            raise ValueError(line)
        elif case:
            self.steps.append(EscapeStep(int(case["number"]), 0, 0, "", ()))
            self._waits, self._leg = 0, None
        elif back:
            step = self.steps[-1]._replace(first=int(back["first"]), last=int(back["last"]), off=back["off"])
            self.steps[-1] = step
        elif go:
            self._leg = int(go["first"]), int(go["last"])
        elif meet and self.steps:
            legs = (*self.steps[-1].legs, self._leg) if self._waits else ()
            self.steps[-1] = self.steps[-1]._replace(legs=legs)
            self._waits, self._leg = self._waits + 1, None


def require_same(path: str, expected: str, got: str) -> None:
    """Refuse a text at its first line that is another one."""
    for number, (one, other) in enumerate(zip(expected.split("\n"), [*got.split("\n"), ""], strict=False), start=1):
        if one != other:
            shown = (one, other) if one.strip() == other.strip() else (one.strip(), other.strip())
            raise InputError(f"{path}:{number}: expected {shown[0][:60]!r}, got {shown[1][:60]!r}")
    if expected != got:
        raise InputError(f"{path}: expected {expected.count(chr(10))} lines, got {got.count(chr(10))}")


def _pattern(statement: str) -> re.Pattern[str]:
    """A statement with any names and numbers in its fields."""
    named = re.sub(r"\\{(name|program)\\}", r"\\w+", re.escape(statement.strip()))
    return re.compile(re.sub(r"\\{(\w+)\\}", r"(?P<\1>[0-9.]+)", named))


def _with_steps(form: EscapeForm, frame: ExportFrame, files: Mapping[str, str]) -> dict[str, str]:
    """Files of main programs with their step registers: 0 before the first motion, then the number of each mark.

    In paced programs it is counted up, as routines of seams do not stand in the order in which they are called. A robot
    by itself has a mark at its first row where motions are counted, and no register else.
    """
    result = dict(files)
    for robot in frame.robots if len(frame.cell.robots) > 1 or form.counted[0] else ():
        name, number, sources = register_of(frame, robot), 0, form.sources(frame, robot)
        for path in sorted(path for path in files if re.fullmatch(sources, path)):
            lines, texts = list[str](), files[path].split("\n")
            places = _places(form, frame, robot, [*map(form.plain, texts)])
            for place, line in enumerate(texts):
                if number and form.counted[0] and line.startswith(form.counted[0]):
                    lines.append(form.counted[1].format(name=name) + line[len(line.rstrip("\r")) :])
                lines.append(line)
                if place in places:
                    number += places[place] == 1
                    value = form.following.format(name=name) if frame.promise is Promise.PACED else form.unit * number
                    statement = form.declaration[1] if places[place] == 2 else form.register
                    text = form.line.format(statement.format(name=name, value=value if places[place] else "0"))
                    indent, end = line[: len(line) - len(line.lstrip())], line[len(line.rstrip("\r")) :]
                    lines.append(f"{indent}{text}{end}")
            result[path] = form.layout("\n".join(lines))
    return result


def _places(form: EscapeForm, frame: ExportFrame, robot: str, lines: Sequence[str]) -> dict[int, int]:
    """Lines behind which a statement is added: 0 where a program begins, 1 at a mark, 2 where data are declared."""
    steps = handshake_steps(frame, robot)
    if not steps:
        motion = next((place for place, line in enumerate(lines) if line.startswith(form.counted[0])), 0)
        return {motion - 1: 0, motion: 1}
    whole, half = (form.lines(frame, robot, part) for part in (steps, steps[: len(steps) // 2]))
    first, places, line = form.lines(frame, robot, [lowering_step(frame, robot)]), dict[int, int](), 0
    while line < len(lines):
        if lines[line : line + len(whole)] == whole:
            places[line + len(half) - 1] = 1
            line += len(whole)
            continue
        if lines[line : line + len(first)] == first:
            places[line + len(first) - 1] = 0
        if lines[line] and lines[line] == form.declaration[0]:
            places[line] = 2
        line += 1
    return places
