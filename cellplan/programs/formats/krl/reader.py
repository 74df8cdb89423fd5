"""Strict reader of KUKA programs: the written subset and harmless variants of it, nothing else."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isnan
from typing import Final

import numpy as np

from cellplan.model.report.exported import ExportFrame, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.handshake import HandshakeStep, handshake_steps, lowering_step
from cellplan.programs.elements.joints import from_numbers, unit_of
from cellplan.programs.elements.pages import read_programs
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.krl.axes import order_of_axes
from cellplan.programs.formats.krl.text import WHOLE, KrlModule, read_module

MOST_ADVANCE: Final = 5  # motions that a controller can read ahead
_SETUP: Final = ("INITMOV", "ADVANCE", "TOOL", "BASE")  # what is set once before the first motion


def read_krl(
    frame: ExportFrame, files: Mapping[str, str], paths: Mapping[tuple[str | None, str], str]
) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: positions and marks; these programs state neither times nor process.

    ``paths``: path of each main module without its ending, by program and robot. An ``InputError`` has file and line.
    """
    return read_programs(frame, files, paths, lambda *program: tuple(_rows(*program)), ending=".src")


def _rows(frame: ExportFrame, robot: str, left: dict[str, str], path: str) -> Iterator[RobotRows]:
    """Rows of the model from the numbers of the points; takes the files of one robot out of those that are left."""
    player = _played(frame, robot, left, path)
    numbers, first = np.array(player.rows, dtype=np.float64), 0
    for name in unit_of(frame.cell, robot):
        order = order_of_axes(frame, name)
        written = np.zeros((len(numbers), len(order)))
        written[:, order] = numbers[:, first : first + len(order)]
        first += len(order)
        yield RobotRows(
            robot=name,
            q=from_numbers(frame.robot(name), written),
            marks=tuple(player.marks),
            rounding=np.array(player.rounding) / WHOLE,
            speeds=np.array(player.speeds),
        )


def _played(frame: ExportFrame, robot: str, left: dict[str, str], path: str) -> "_KrlPlayer":
    """A main module and its pages, from begin to end; takes their files out of those that are left."""
    main = read_module(left, path)
    player = _KrlPlayer(frame=frame, robot=robot, path=path)
    for statement in main.statements:
        if statement.kind == "CALL":
            page = read_module(left, player.called(main, statement))
            if page.externals:
                raise next(iter(page.externals.values())).error("no declaration in a page", "one")
            player.begin(page)
            for inner in page.statements:
                player.play(page, inner)
            player.finish(page)
        else:
            player.play(main, statement)
    _refuse_other_declarations(main, player)
    if player.calls == 0:
        player.finish(main)
    if player.lowered and not player.marks:
        raise player.lowered.error("a handshake at a row, as its output is lowered", "none")
    return player


def _refuse_other_declarations(main: KrlModule, player: "_KrlPlayer") -> None:
    """Make sure that what is declared is called, and that a main module of pages has no points."""
    calls = {f"{main.name}_{number:03d}" for number in range(1, player.calls + 1)}
    for declared, line in main.externals.items():
        if declared not in calls:
            raise line.error("declarations of pages that are called", declared)
    if player.calls and main.points:
        raise next(iter(main.lines.values())).error("no point in a program of pages", "one")
    player.require_setup(main.end)


@dataclass(slots=True, kw_only=True)
class _KrlPlayer:
    """Follows a program statement by statement."""

    frame: ExportFrame  # which robots
    robot: str
    path: str  # path of the main module without its ending
    rows: list[Sequence[float]] = field(default_factory=list)  # values of all components of each row
    marks: list[int] = field(default_factory=list)  # rows with a handshake
    calls: int = 0  # number of pages that were called
    settings: set[str] = field(default_factory=set)  # what was set before the first motion
    speed: float = 0.0  # of the joints from here on in [%]; 0 before it is set
    speeds: list[float] = field(default_factory=list)  # of each row
    rounded: bool = False  # whether the last row is rounded
    rounding: list[int] = field(default_factory=list)  # how far each row is, in [%]; 0 for a stop
    share: int = 0  # how far rows are from here on, in [%]; 0 before it is set
    step: int = 0  # number of instructions of a handshake that were met
    lowered: Statement | None = None  # where its output was lowered before the first motion
    names: list[str] | None = None  # points of the module that are still to come

    def play(self, module: KrlModule, statement: Statement) -> None:
        """Follow one statement."""
        if self.step and statement.kind not in {"OUT", "WAIT"}:
            raise statement.error(f"the rest of the handshake ({self._expected()})")
        if statement.kind in {"OUT", "WAIT"}:
            self._signal(module, statement)
        elif statement.kind == "PTP":
            self._move(module, statement)
        elif statement.kind == "VEL_PTP":
            self.speed = float(statement.words[0] or 0)
            if not 0.0 < self.speed <= 100.0:
                raise statement.error("a speed above 0 and up to 100")
        elif statement.kind == "APO":
            self.share = _share(statement)
        else:
            self._set(module, statement)

    def called(self, main: KrlModule, statement: Statement) -> str:
        """Path of the page that a call is for."""
        expected = f"{main.name}_{self.calls + 1:03d}"
        if (self.rows and not self.calls) or self.step:
            raise statement.error("no call in a program with motions of its own")
        if statement.words[0] != expected:
            raise statement.error(f"{expected}()")
        self.require_setup(statement)
        self.calls += 1
        return f"{self.path}_{self.calls:03d}"

    def require_setup(self, at: Statement) -> None:
        """Refuse a motion before everything is set that motions need."""
        missing = [kind for kind in _SETUP if kind not in self.settings]
        if missing:
            raise at.error(f"{missing[0]} to be set before the first motion", "none")

    def begin(self, module: KrlModule) -> None:
        """Begin with the points of a module."""
        self.names = list(module.points)[::-1]

    def finish(self, module: KrlModule) -> None:
        """Make sure that a module with motions ends in order."""
        if self.step:
            raise module.end.error(f"the rest of the handshake ({self._expected()})", "the end")
        if self.names is None or not module.points:
            raise module.end.error("at least one motion", "none")
        if self.names:
            raise module.lines[self.names[-1]].error("points that are used", self.names[-1].upper())
        if self.rounded:
            raise module.end.error("an exact stop at the last row", "C_PTP")

    def _set(self, module: KrlModule, statement: Statement) -> None:
        """What is set once, before the first motion."""
        value = statement.words[0] if statement.words else None
        if self.rows or module.path != self.path:
            raise statement.error("settings before the first motion")
        if statement.kind in self.settings:
            raise statement.error("each setting once")
        expected = None
        if statement.kind in {"TOOL", "BASE"}:
            number = self._stated(statement.kind)
            if int(value or 0) != number:
                data = f"{statement.kind}_DATA[{number}]" if number else "$NULLFRAME"
                expected = f"${statement.kind}={data} as the cell states it"
        elif statement.kind == "ADVANCE" and int(value or 0) > MOST_ADVANCE:
            expected = f"a number from 0 to {MOST_ADVANCE}"
        if expected:
            raise statement.error(expected)
        self.settings.add(statement.kind)

    def _stated(self, kind: str) -> int:
        """Number of the tool or of the base on the controller, 0 for none."""
        control = self.frame.robot(self.robot).control
        if control is None:
            return 0
        return (control.tool_number if kind == "TOOL" else control.base_number) or 0

    def _move(self, module: KrlModule, statement: Statement) -> None:
        """A motion to the next point of the module."""
        self.require_setup(statement)
        if not self.speed:
            raise statement.error("a speed before the first motion")
        if self.calls and module.path == self.path:
            raise statement.error("no motion in a program that calls pages")
        if self.names is None:
            self.begin(module)
        name = str(statement.words[0]).lower()
        if name not in module.points:
            raise statement.error(f"a point of {module.path}.dat")
        if not self.names or self.names[-1] != name:
            order = self.names[-1].upper() if self.names else "no further motion"
            raise statement.error(f"points in their order, each once ({order})")
        self.rounded = statement.words[1] is not None
        if self.rounded and not self.share:
            raise statement.error("$APO.CPTP to be set before C_PTP")
        self.names.pop()
        self.rounding.append(self.share if self.rounded else 0)
        self.speeds.append(self.speed)
        self.rows.append(self._values(module, name))

    def _values(self, module: KrlModule, name: str) -> Sequence[float]:
        """Components of a point, as many as the robot has axes; unused external ones have to be at zero."""
        values = module.points[name]
        count = sum(len(order_of_axes(self.frame, robot)) for robot in unit_of(self.frame.cell, self.robot))
        if any(map(isnan, values[:count])) or any(value != 0.0 and not isnan(value) for value in values[count:]):
            expected = f"values for the {count} axes of the robot and for no other"
            raise module.lines[name].error(expected, name.upper())
        return values[:count]

    def _signal(self, module: KrlModule, statement: Statement) -> None:
        """An instruction of a handshake."""
        waits = self.frame.promise is not Promise.SYNCHRONISED
        expected, row = handshake_steps(self.frame, self.robot) if waits else (), len(self.rows) - 1
        if expected and not self.lowered:
            first = lowering_step(self.frame, self.robot)
            if row >= 0 or self.calls or _step(statement) != first:
                raise statement.error(f"$OUT[{first.signal}]=FALSE before the first motion")
            self.lowered = statement
            return
        is_main = self.calls > 0 and module.path == self.path
        if not expected or row < 0 or self.rounded or is_main or row in self.marks:
            raise statement.error("signals only once after an exact stop at a mark")
        if _step(statement) != expected[self.step]:
            raise statement.error(f"the handshake of the cell ({self._expected()})")
        self.step = (self.step + 1) % len(expected)
        if self.step == 0:
            self.marks.append(row)

    def _expected(self) -> str:
        """The next instruction of a handshake."""
        step = handshake_steps(self.frame, self.robot)[self.step]
        state = "TRUE" if step.is_on else "FALSE"
        return f"WAIT FOR $IN[{step.signal}]=={state}" if step.waits else f"$OUT[{step.signal}]={state}"


def _share(statement: Statement) -> int:
    """How far the rows that follow are rounded, in [%]."""
    share = int(statement.words[0] or 0)
    if not 1 <= share <= 100:
        raise statement.error("a share of 1 to 100")
    return share


def _step(statement: Statement) -> HandshakeStep:
    """A signal statement as a step of a handshake."""
    words = statement.words
    if statement.kind == "OUT":
        return HandshakeStep(False, str(int(words[0] or 0)), str(words[1]).upper() == "TRUE")
    is_on = words[0] is None and str(words[3] or "TRUE").upper() == "TRUE"
    return HandshakeStep(True, str(int(words[1] or words[2] or 0)), is_on)
