"""Strict reader of VAL3 projects: the written subset and harmless variants of it, nothing else."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportFrame, ProgramRows, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.handshake import HandshakeStep, handshake_steps, lowering_step
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.elements.pages import read_programs
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.val3.code import Loop, Node, read_code
from cellplan.programs.formats.val3.data import Data, read_data
from cellplan.programs.formats.val3.names import START, STOP, link
from cellplan.programs.formats.val3.xml import PARAMETER_SPACE, PROGRAM_SPACE, PROJECT_SPACE, TYPE, Val3Element, parse
from cellplan.programs.formats.zones import tool_shares

MOST_STEPS: Final = 1_000_000  # statements that loops may unroll to


def read_val3(
    frame: ExportFrame, files: Mapping[str, str], paths: Mapping[tuple[str | None, str], str]
) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: positions, marks, zones; they state neither times nor process.

    A project has its folder by program and robot. An ``InputError`` has file and line.
    """
    return read_programs(frame, files, paths, _rows)


def _rows(frame: ExportFrame, robot: str, left: dict[str, str], path: str) -> tuple[RobotRows]:
    """Rows of one robot; takes the files of its project out of those that are left."""
    player = _Val3Player(frame=frame, robot=robot, project=read_project(left, path))
    player.play_all()
    placed = frame.robot(robot)
    q = from_numbers(placed, np.array(player.rows, dtype=np.float64).reshape(-1, 6))
    rounding = tool_shares(placed, q, np.array(player.zones) / MM)
    return (RobotRows(robot=robot, q=q, marks=tuple(player.marks), rounding=rounding, speeds=np.array(player.speeds)),)


class _Val3Program(NamedTuple):
    """A program of a project."""

    code: Sequence[Node]  # its statements
    end: Statement  # its ``end``


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadProject:
    """What the files of a project hold."""

    path: str  # its folder
    data: Mapping[str, Data]  # its data by name
    programs: Mapping[str, _Val3Program]  # its programs by name


def read_project(left: dict[str, str], path: str, libraries: Sequence[str] = ()) -> ReadProject:
    """Read a project that uses some libraries; takes its files out of those that are left."""
    file = f"{path}/{path.rpartition('/')[2]}.pjx"
    listed, data_file = _listed(parse(_taken(left, file), file, "Project", PROJECT_SPACE), path, libraries)
    data = read_data(_taken(left, data_file), data_file)
    programs = {name: _program(left, f"{path}/{name}.pgx", name, data) for name in listed}
    return ReadProject(path=path, data=data, programs=programs)


def _taken(left: dict[str, str], file: str) -> str:
    """Text of a file that was not read yet."""
    if file not in left:
        raise InputError(f"{file}: expected a file, got none")
    return left.pop(file)


def _listed(project: Val3Element, path: str, libraries: Sequence[str]) -> tuple[list[str], str]:
    """Names of the programs that a project lists, and path of its data."""
    project.require()
    project.only("Parameters", "Programs", "Database", "Libraries", "Types")
    parameters = project.one("Parameters")
    parameters.require(needed=("version", "stackSize", "millimeterUnit"))
    if parameters.attributes["millimeterUnit"] != "true":
        raise parameters.error("millimetres", parameters.attributes["millimeterUnit"])
    used: list[str] = []
    for child in project.children:
        if child.name in {"Libraries", "Types"}:
            child.require()
            for library in child.only(*["Library"] * (child.name == "Libraries")):
                library.require(needed=("alias", "path"))
                if library.attributes["alias"] != library.attributes["path"]:
                    raise library.error("a library by the name of its project", library.attributes["path"])
                used.append(library.attributes["alias"])
    if used != list(libraries):
        raise project.error(f"the libraries {', '.join(libraries) or 'none'}", ", ".join(used) or "none")
    listed = project.one("Programs")
    names = [_file_name(entry, ".pgx") for entry in listed.only("Program")]
    for name in (START, STOP, *names):
        if names.count(name) != 1:
            raise listed.error(f"{name}.pgx once", f"{names.count(name)} of them")
    database = project.one("Database")
    entries = database.only("Data")
    file_name = path.rpartition("/")[2]
    if [_file_name(entry, ".dtx") for entry in entries] != [file_name]:
        raise database.error(f"{file_name}.dtx alone", f"{len(entries)} of them")
    return names, f"{path}/{file_name}.dtx"


def _file_name(entry: Val3Element, ending: str) -> str:
    """Name of a listed file without its ending."""
    entry.require(needed=("file",))
    match = re.fullmatch(r"([A-Za-z]\w{0,14})" + re.escape(ending), entry.attributes["file"], re.ASCII)
    if match is None:
        raise entry.error(f"a name of less than 16 characters that ends in {ending}", entry.attributes["file"])
    return match[1]


def _program(left: dict[str, str], file: str, name: str, data: Mapping[str, Data]) -> _Val3Program:
    """Read a program."""
    root = parse(_taken(left, file), file, "Programs", PROGRAM_SPACE)
    root.require()
    root.only("Program")
    program = root.one("Program")
    program.require(needed=("name",), allowed=("access",))
    if program.attributes["name"] != name or program.attributes.get("access") not in {None, "public", "private"}:
        raise program.error(f"the program {name}, public or private", " ".join(program.attributes.values()))
    counters = {name for name, datum in data.items() if datum.kind == "num"}
    for child in program.children:
        if (child.space, child.name) == (PARAMETER_SPACE, "Parameters"):
            child.require()
            child.only()
        elif (child.space, child.name) == (PROGRAM_SPACE, "Locals"):
            counters |= {_local(local) for local in child.only("Local")}
        elif (child.space, child.name) != (PROGRAM_SPACE, "Code"):
            raise child.error("Parameters, Locals or Code", child.name)
    code = program.one("Code")
    code.require()
    if code.children or program.text.strip():
        raise code.error("text alone", "an element")
    return _Val3Program(*read_code(code, counters))


def _local(local: Val3Element) -> str:
    """Name of a local number, which counts a loop."""
    local.require(needed=("name", "type", TYPE, "size"))
    if local.attributes["type"] != "num" or local.attributes[TYPE] != "array" or local.attributes["size"] != "1":
        raise local.error("one number", local.attributes["type"])
    return local.attributes["name"]


@dataclass(slots=True, kw_only=True)
class _Val3Player:
    """Follows the programs of a project statement by statement."""

    frame: ExportFrame  # which robots
    robot: str
    project: ReadProject
    rows: list[Sequence[float]] = field(default_factory=list)  # joint positions of the controller in each row
    zones: list[float] = field(default_factory=list)  # of the tool in [mm], by row; 0 for a stop
    speeds: list[float] = field(default_factory=list)  # of the joints in [%], by row
    marks: list[int] = field(default_factory=list)  # rows with a handshake
    calls: list[str] = field(default_factory=list)  # programs that were called
    used: dict[str, int] = field(default_factory=dict)  # number of values that were moved to, by the name of their data
    stands: bool = True  # whether the robot has come to a stop after its last motion
    is_exact: bool = True  # whether the last motion ends in its row
    step: int = 0  # number of instructions of a handshake that were met
    lowered: Statement | None = None  # where its output was lowered before the first motion
    steps: int = 0  # number of statements that were done

    def play_all(self) -> None:
        """Follow ``start`` and what it calls, and make sure that all that the project holds was used."""
        for data in self.project.data.values():
            if data.kind == "pointRx":
                raise data.error("data of motions of the joints", data.kind)
        start, stop = (self.project.programs[name] for name in (START, STOP))
        for node in stop.code:
            if _statement(node).kind != "RESET":
                raise _statement(node).error("resetMotion() alone in stop")
        self._play(start, start.code, {})
        if not self.rows or not self.stands or self.step:
            missing = "at least one motion" if not self.rows else "the rest of the handshake"
            raise start.end.error("waitEndMove()" if not self.stands else missing, "the end")
        if self.lowered and not self.marks:
            raise self.lowered.error("a handshake at a row, as its output is lowered", "none")
        for name in self.project.programs:
            if name not in {START, STOP, *self.calls}:
                raise InputError(f"{self.project.path}/{name}.pgx: expected a program that start calls, got another")
        for name, data in self.project.data.items():
            if data.kind == "jointRx" and self.used.get(name, 0) != data.size:
                raise data.error("motions to all of its values", f"{self.used.get(name, 0)} of {data.size}")

    def _play(self, program: _Val3Program, nodes: Sequence[Node], counters: Mapping[str, int]) -> None:
        """Follow statements."""
        for node in nodes:
            statement = _statement(node)
            self.steps += 1
            if self.steps > MOST_STEPS:
                raise statement.error(f"at most {MOST_STEPS} statements to be done")
            if self.step and statement.kind not in {"SET", "WAIT"}:
                rest = _shown(handshake_steps(self.frame, self.robot)[self.step])
                raise statement.error(f"the rest of the handshake ({rest})")
            if isinstance(node, Loop):
                for value in node.values:
                    self._play(program, node.body, {**counters, node.counter: value})
            elif statement.kind == "MOVE":
                self._move(program, statement, counters)
            elif statement.kind == "STAND":
                self._stand(statement)
            elif statement.kind == "CALL":
                self._call(program, statement)
            elif statement.kind in {"LINE", "ARC", "DELAY", "LIBRARY"}:
                raise statement.error("motions of the joints, and signals")
            elif statement.kind == "RESET":
                raise statement.error("resetMotion() in stop alone")
            else:
                self._signal(statement)

    def _stand(self, node: Statement) -> None:
        """A wait for the end of all motions."""
        if not self.is_exact:
            raise node.error("an exact stop before it (blend off)")
        self.stands = True

    def _call(self, program: _Val3Program, node: Statement) -> None:
        """A call of a page."""
        name = str(node.words[0])
        if program is not self.project.programs[START] or name in {START, STOP, *self.calls}:
            raise node.error("each page called once by start")
        if name not in self.project.programs:
            raise node.error("a program of the project")
        if self.rows and not self.calls:
            raise node.error("no call in a program with motions of its own")
        self.calls.append(name)
        page = self.project.programs[name]
        before = len(self.rows)
        self._play(page, page.code, {})
        if len(self.rows) == before or self.step or not self.is_exact:
            raise page.end.error("motions, the last of which ends in an exact stop", "the end")

    def _move(self, program: _Val3Program, node: Statement, counters: Mapping[str, int]) -> None:
        """A motion to the next value of its data."""
        if self.calls and program is self.project.programs[START]:
            raise node.error("no motion in a program that calls pages")
        joints, _, descriptor = (
            self._value(node, counters, place, kind) for place, kind in enumerate(("jointRx", "tool", "mdesc"))
        )
        name, index = str(node.words[0]), _index(node, counters, 0)
        if index != self.used.get(name, 0):
            raise node.error(f"{name}[{self.used.get(name, 0)}]: all values in order")
        self.used[name] = index + 1
        self.rows.append([float(joints.get(f"j{axis}", "0")) for axis in range(1, 7)])
        zone = max(float(descriptor.get(side, "0")) for side in ("leave", "reach"))
        self.is_exact = descriptor.get("blend", "off") == "off"
        if not self.is_exact and (descriptor["blend"] != "joint" or not zone > 0.0):
            raise node.error("a blend of joints with leave or reach, or off")
        self.zones.append(0.0 if self.is_exact else zone)
        self.speeds.append(float(descriptor.get("vel", "100")))
        self.stands = False

    def _value(self, node: Statement, counters: Mapping[str, int], place: int, kind: str) -> Mapping[str, str]:
        """The value that an argument of a motion names."""
        name, index = str(node.words[2 * place]), _index(node, counters, place)
        data = self.project.data.get(name)
        if data is None or data.kind != kind:
            raise node.error(f"data of the type {kind}", name)
        if index is None or not 0 <= index < data.size:
            raise node.error(f"an index of {name} from 0 to {data.size - 1}")
        return data.values[index]

    def _signal(self, node: Statement) -> None:
        """An instruction of a handshake."""
        expected, row = handshake_steps(self.frame, self.robot), len(self.rows) - 1
        is_first = bool(expected) and not self.lowered and row < 0 and not self.calls
        if not is_first and (not expected or row < 0 or not self.stands or row in self.marks):
            raise node.error("signals only once after waitEndMove() at a mark")
        name, is_on = str(node.words[0]), node.words[1] == "true"
        data = self.project.data.get(name)
        if data is None or data.kind != "dio":
            raise node.error("data of the type dio", name)
        if not is_first and not self.lowered:
            first = lowering_step(self.frame, self.robot).signal
            raise node.error(f"{first}=false before the first motion")
        step = lowering_step(self.frame, self.robot) if is_first else expected[self.step]
        stated = (step.waits, step.is_on, link(step.signal, is_input=step.waits))
        if (node.kind == "WAIT", is_on, data.values[0].get("link")) != stated:
            raise node.error(f"the handshake of the cell ({_shown(step)})")
        if is_first:
            self.lowered = node
            return
        self.step = (self.step + 1) % len(expected)
        if self.step == 0:
            self.marks.append(row)


def _shown(step: HandshakeStep) -> str:
    """An instruction of a handshake in messages."""
    state = "true" if step.is_on else "false"
    return f"wait for {step.signal}=={state}" if step.waits else f"{step.signal}={state}"


def _statement(node: Node) -> Statement:
    """A statement, or that with which a loop begins."""
    return node.head if isinstance(node, Loop) else node


def _index(node: Statement, counters: Mapping[str, int], place: int) -> int | None:
    """Value of the index of an argument, 0 without one; None for a name that no loop counts."""
    index = node.words[2 * place + 1] or "0"
    return int(index) if index.isdecimal() else counters.get(index)
