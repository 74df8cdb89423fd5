"""Escape programs in VAL3: a project beside the main one, whose step register it finds as data of a library."""

import re
from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Final

from cellplan.errors import InputError
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.escapes import SPEED, EscapeForm, EscapeProgram, register_of
from cellplan.programs.elements.joints import Angle, to_numbers
from cellplan.programs.elements.pages import program_paths
from cellplan.programs.elements.text import comment, fixed
from cellplan.programs.elements.timed_rows import decimals_of
from cellplan.programs.formats.val3.names import DATA, MOVE, NAME, PROJECTS, START, STOP, TOOL, WORDS
from cellplan.programs.formats.val3.project_text import array_lines, data_text, index_text, program_text
from cellplan.programs.formats.val3.seams import signal_data, tool_values, val3_events
from cellplan.programs.formats.val3.writer import POSE_DECIMALS, VAL3, descriptor
from cellplan.programs.formats.val3.xml import PARAMETER_SPACE

ENDING: Final = "_esc"  # of the name of a project
ROWS, HOMEWARD, HERE, STEP = "jEsc", "jHome", "jHere", "nStep"
NUMBERS: Final = ("nRow", "nAt", "nSquare", "nShare", "nMissed", "nGap")
STAY: Final = "call noWay()"


def render_escape(program: EscapeProgram) -> dict[str, str]:
    """The project of the escape program of a robot, its ``start`` first."""
    frame, robot, main = program.frame, program.robot, _path(program.frame, program.robot)
    name = main + ENDING
    heads = [line for note in program.notes for line in comment(note, "//", forbidden="]")]
    start = [*heads, "resetMotion()", *VAL3_ESCAPE.before(program)]
    start += [f"{STEP}={main}:{program.register}", f"if {STEP}<0", STAY]
    start += [line for step in program.steps for line in VAL3_ESCAPE.calls(program, step)]
    start += ["else", STAY, "endIf"]
    endless = ['popUpMsg("no way home from here")', "while true", "delay(1)", "endWhile"]
    programs = {
        START: program_text(START, start),
        "back": program_text("back", [*_back()], _declared(("nFirst", "nLast", "nOff"), NUMBERS)),
        "go": program_text("go", [*_moves("nFirst to nLast", HOMEWARD)], _declared(("nFirst", "nLast"), ("nRow",))),
        "noWay": program_text("noWay", endless),
        STOP: program_text(STOP, ["resetMotion()"]),
    }
    for call, lines in VAL3_ESCAPE.waits(frame, robot):
        routine = call.removeprefix("call ").removesuffix("()")
        programs[routine] = program_text(routine, lines)
    texts = {f"{routine}.pgx": text for routine, text in programs.items()}
    texts |= {f"{name}.dtx": _data(program)}
    texts |= {f"{name}.pjx": index_text(name, sorted(f"{it}.pgx" for it in programs), libraries=[main])}
    return {f"{name}/{file}": text for file, text in texts.items()}


def _data(program: EscapeProgram) -> str:
    """Signals, rows, and what motions need."""
    robot = program.frame.robot(program.robot)
    decimals = decimals_of(robot, VAL3.decimals)
    signals = signal_data(program.frame, program.robot).items()
    arrays = [array_lines(name, "dio", [{"link": target}]) for name, target in signals]
    for table, q in ((ROWS, program.rows), (HOMEWARD, program.homeward)):
        rows = to_numbers(robot, q, decimals=decimals).tolist()
        values = [{f"j{axis}": fixed(value, decimals) for axis, value in enumerate(row, start=1)} for row in rows]
        arrays.append(array_lines(table, "jointRx", values))
    arrays += [array_lines(HERE, "jointRx", [{}]), array_lines(STEP, "num", [{"value": "0"}])]
    arrays.append(array_lines(MOVE, "mdesc", [descriptor(SPEED, 0)]))
    arrays.append(array_lines(TOOL, "tool", [tool_values(robot, POSE_DECIMALS)]))
    return data_text((), chain.from_iterable(arrays))


def _declared(parameters: Iterable[str], numbers: Iterable[str]) -> list[str]:
    """Declarations of the numbers that a program is called with, and of its own."""
    return [
        f'    <Parameters xmlns="{PARAMETER_SPACE}">',
        *(f'      <Parameter name="{name}" type="num" xsi:type="element"/>' for name in parameters),
        *("    </Parameters>", "    <Locals>"),
        *(f'      <Local name="{name}" type="num" xsi:type="array" size="1"/>' for name in numbers),
        "    </Locals>",
    ]


def _moves(span: str, table: str) -> Iterator[str]:
    """Motions along rows of a table."""
    yield from (f"for nRow={span}", f"movej({table}[nRow-1],{TOOL}[0],{MOVE}[0])", "waitEndMove()", "endFor")


def _back() -> Iterator[str]:
    """The code that finds the first of the rows between which the robot stands, and goes back from it."""
    along = [f"({ROWS}[nRow].j{axis}-{ROWS}[nRow-1].j{axis})" for axis in range(1, 7)]
    gaps = [f"({HERE}.j{axis}-{ROWS}[nRow-1].j{axis})" for axis in range(1, 7)]
    yield from (f"{HERE}=herej()", "nAt=0", "for nRow=nLast-1 to nFirst step -1", "nSquare=0.000000001", "nShare=0")
    yield from (f"nSquare=nSquare+{a}*{a}" for a in along)
    yield from (f"nShare=nShare+{h}*{a}" for h, a in zip(gaps, along, strict=True))
    yield from ("nShare=nShare/nSquare", "if nShare<0", "nShare=0", "endIf", "if nShare>1", "nShare=1", "endIf")
    yield "nMissed=0"
    for h, a in zip(gaps, along, strict=True):
        yield from (f"nGap={h}-nShare*{a}", "nMissed=nMissed+nGap*nGap")
    yield from ("if nMissed<=nOff*nOff", "nAt=nRow", "endIf", "endFor", "if nAt==0", STAY, "endIf")
    yield from _moves("nAt to nFirst step -1", ROWS)


def _path(frame: ExportFrame, robot: str) -> str:
    """Folder and name of the main project."""
    return program_paths(frame, VAL3, PROJECTS)[frame.programs[0], robot]


def _sources(frame: ExportFrame, robot: str) -> str:
    """Files of the main project that hold programs and data."""
    return re.escape(_path(frame, robot)) + r"/\w+\.(pgx|dtx)"


def _require(frame: ExportFrame, robot: str) -> None:
    """Refuse a register that is no name of data, and signals with names of data of an escape project."""
    register, signals = register_of(frame, robot), signal_data(frame, robot)
    key, taken = f"robots.{robot}.controller", {ROWS, HOMEWARD, HERE, STEP, *NUMBERS, "nFirst", "nLast", "nOff"}
    reserved = {word.lower() for word in (*WORDS, *signals)}
    is_name = re.fullmatch(rf"[A-Za-z]\w{{0,{NAME - 1}}}", register, re.ASCII)
    if not is_name or register.lower() in reserved or re.fullmatch(DATA, register):
        raise InputError(f"{key}.step_register: expected a name of at most {NAME} characters, got '{register}'")
    if same := taken & set(signals):
        raise InputError(f"{key}.handshake: expected other names than those of rows and numbers, got '{min(same)}'")


def _numbers(_robot: Robot, text: str) -> list[float]:
    """Numbers of a row."""
    return [float(number) for number in re.findall(r'"(-?[0-9.]+)"', text)]


VAL3_ESCAPE: Final = EscapeForm(
    sign="//",
    case=f"elseIf {STEP}=={{number}}",
    back="call back({first},{last},{off})",
    go="call go({first},{last})",
    meet="call meet()",
    agree=("call even()", "call odd()"),
    pause="delay(1)",
    register="{name}={value}",
    tables=(f'"{ROWS}"', f'"{HOMEWARD}"'),
    row=r'<Value key="[0-9]+" (j1=.*)/>',
    numbers=_numbers,
    angle=Angle.DEGREES,
    events=val3_events,
    sources=_sources,
    render=render_escape,
    require=_require,
    program=_path,
    scope="{program}:",
    declaration=("<Datas>", '<Data name="{name}" access="public" xsi:type="array" type="num" size="1"/>'),
)
