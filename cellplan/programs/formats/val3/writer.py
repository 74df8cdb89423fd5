"""VAL3 of Staubli: a project for each robot, whose data hold the rows and whose programs move from one to the next."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from html import escape
from typing import Final, NamedTuple

from cellplan.errors import raise_findings, refusals
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, Promise
from cellplan.model.units import MM
from cellplan.programs.elements.conventions import CONVENTIONS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.frames import on_flange
from cellplan.programs.elements.handshake import HandshakeStep
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.elements.pages import PagedProgram, program_paths, render_programs, require_six_axes
from cellplan.programs.elements.text import comment, fixed, joined
from cellplan.programs.formats.val3.names import (
    BASE,
    FLANGE,
    JOINTS,
    MOVE,
    PROJECTS,
    START,
    STOP,
    TOOL,
    WORLD,
    link,
    require_links,
    signal_names,
)
from cellplan.programs.formats.val3.reader import read_val3
from cellplan.programs.formats.val3.xml import DATA_SPACE, PROGRAM_SPACE, PROJECT_SPACE, TYPE_SPACE
from cellplan.programs.formats.zones import on_scale, tool_zones

DECIMALS: Final = 5
POSE_DECIMALS: Final = 3
PAGE: Final = 1000  # rows
ZONES: Final = tuple(round(10.0 ** (1.7 + place / 10.0)) for place in range(37))  # [um] of a row, 0.05 to 200 mm
VERSION: Final = "s7.10.2"  # of the language, as public projects state it
NO_LIMIT: Final = "99999"  # [mm/s] and [deg/s] of the tool: the axes are what limits
XML: Final = '<?xml version="1.0" encoding="utf-8"?>'


class _Move(NamedTuple):
    """How a row is approached and passed."""

    speed: int  # share of the top speed in [%]
    zone: int  # distance of the tool from the row in [um] within which it is rounded, 0 for a stop


def render_val3(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``<robot>/<robot>.pjx`` and so on, or ``<robot>/<program>/<program>.pjx``.

    ``InputError`` for a robot without a Staubli controller, that is no arm of six axes alone, lacks a signal, or has a
    position that cannot be written with the decimals.
    """
    paths = program_paths(job.frame, VAL3, PROJECTS)
    raise_findings(refusals(*_demands(job.frame, 0)))
    return render_programs(job, VAL3, paths, _files)


def _demands(frame: ExportFrame, _rows: int) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell."""
    for robot in frame.robots:
        yield partial(require_links, frame, robot)
        yield partial(require_six_axes, frame.robot(robot), external=0, what="VAL3")


def _files(project: PagedProgram) -> dict[str, str]:
    """All files of a project."""
    q = from_numbers(project.placed, project.numbers)
    zones = on_scale(1000.0 * MM * tool_zones(project.placed, q, project.shares), ZONES).tolist()
    motions = [_Move(*entry) for entry in zip(project.speeds, zones, strict=True)]
    places = {move: place for place, move in enumerate(dict.fromkeys(motions))}  # of the motion descriptors
    signals = signal_names(project.steps)
    pages = [f"{project.name}{ending}" for ending in project.endings]
    programs = {STOP: _program(STOP, ["resetMotion()"])}
    handshake = [_instruction(step, signals) for step in project.steps]
    moves = [
        _moves(project, page, ending, descriptors=[places[motions[row]] for row in page], handshake=handshake)
        for page, ending in zip(project.pages, project.endings, strict=True)
    ]
    if len(pages) == 1:
        code = moves[0]
    else:
        code = [f"call {page}()" for page in pages]
        programs |= {page: _program(page, page_moves) for page, page_moves in zip(pages, moves, strict=True)}
    heads = [line for note in project.notes for line in comment(note, "//", forbidden="]")]
    first = [_instruction(step, signals) for step in project.first]
    programs[START] = _program(START, [*heads, *first, *code, "waitEndMove()"])
    files = {f"{program}.pgx": text for program, text in sorted(programs.items())}
    data = _data(project, places, signals)
    files = {f"{project.name}.pjx": _index(project, files), f"{project.name}.dtx": data, **files}
    return {f"{project.path}/{file}": text for file, text in files.items()}


def _index(project: PagedProgram, programs: Iterable[str]) -> str:
    """The file that lists programs and data."""
    return joined(
        [
            XML,
            f'<Project xmlns="{PROJECT_SPACE}">',
            *_xml_comments(project.notes),
            f'  <Parameters version="{VERSION}" stackSize="5000" millimeterUnit="true"/>',
            "  <Programs>",
            *(f'    <Program file="{program}"/>' for program in programs),
            "  </Programs>",
            "  <Database>",
            f'    <Data file="{project.name}.dtx"/>',
            "  </Database>",
            "  <Libraries/>",
            "  <Types/>",
            "</Project>",
        ]
    )


def _data(project: PagedProgram, descriptors: Iterable[_Move], signals: Mapping[tuple[bool, str], str]) -> str:
    """The data: signals, rows, motion descriptors, tool and world frame."""
    lines = [
        XML,
        f'<Database xmlns:xsi="{TYPE_SPACE}" xmlns="{DATA_SPACE}">',
        *_xml_comments(project.notes),
        "  <Datas>",
    ]
    lines += _array(WORLD, "frame", [{"fatherId": BASE}])
    for (is_input, signal), name in signals.items():
        lines += _array(name, "dio", [{"link": link(signal, is_input=is_input)}])
    for page, ending in zip(project.pages, project.endings, strict=True):
        lines += _array(f"{JOINTS}{ending}", "jointRx", [_joints(project, row) for row in page])
    lines += _array(MOVE, "mdesc", [_descriptor(move) for move in descriptors])
    lines += _array(TOOL, "tool", [_tool(project.placed)])
    return joined([*lines, "  </Datas>", "</Database>"])


def _array(name: str, kind: str, values: Sequence[Mapping[str, str]]) -> list[str]:
    """One array of data, its size that of its values."""
    rows = [
        f'      <Value key="{key}" {" ".join(f"{item}={_quoted(text)}" for item, text in value.items())}/>'
        for key, value in enumerate(values)
    ]
    head = f'    <Data name="{name}" access="public" xsi:type="array" type="{kind}" size="{len(values)}">'
    return [head, *rows, "    </Data>"]


def _joints(project: PagedProgram, row: int) -> dict[str, str]:
    """A row as the attributes of a jointRx."""
    values = project.numbers[row].tolist()
    return {f"j{axis}": fixed(value, project.decimals) for axis, value in enumerate(values, start=1)}


def _descriptor(move: _Move) -> dict[str, str]:
    """A motion at a share of the top speed that ends in a stop, or is left and reached at one distance from its row."""
    shares = {"accel": "100", "vel": str(move.speed), "decel": "100"}
    size = fixed(move.zone / 1000.0, 3) if move.zone else "0"
    blend = {"blend": "joint" if move.zone else "off", "leave": size, "reach": size}
    return {**shares, "tmax": NO_LIMIT, "rmax": NO_LIMIT, **blend}


def _tool(placed: Robot) -> dict[str, str]:
    """The tool of the cell on the flange of the controller."""
    numbers = CONVENTIONS["staubli"].numbers(on_flange(placed, placed.tool.X_FT)).tolist()
    named = zip(CONVENTIONS["staubli"].labels, numbers, strict=True)
    return {**{item: fixed(value, POSE_DECIMALS) for item, value in named}, "fatherId": FLANGE}


def _moves(
    project: PagedProgram, page: range, ending: str, *, descriptors: Sequence[int], handshake: Sequence[str]
) -> list[str]:
    """The motions of a page by their descriptors, and the handshakes after those to its marks."""
    lines, marks = list[str](), set(project.rows.marks)
    for place, (row, descriptor) in enumerate(zip(page, descriptors, strict=True)):
        lines.append(f"movej({JOINTS}{ending}[{place}],{TOOL}[0],{MOVE}[{descriptor}])")
        if row in marks and handshake:
            lines += ["waitEndMove()", *handshake]
    return lines


def _instruction(step: HandshakeStep, signals: Mapping[tuple[bool, str], str]) -> str:
    """One step of a handshake."""
    name, state = signals[step.waits, step.signal], "true" if step.is_on else "false"
    return f"wait({name}=={state})" if step.waits else f"{name}={state}"


def _program(name: str, code: Sequence[str]) -> str:
    """A program."""
    return joined(
        [
            XML,
            f'<Programs xmlns:xsi="{TYPE_SPACE}" xmlns="{PROGRAM_SPACE}">',
            f'  <Program name="{name}" access="public">',
            "    <Code><![CDATA[begin",
            *(f"  {line}" for line in code),
            "end]]></Code>",
            "  </Program>",
            "</Programs>",
        ]
    )


def _xml_comments(notes: Iterable[str]) -> list[str]:
    """Comments of the notes, which two hyphens would end."""
    apart = (re.sub(r"-(?=-)", "- ", note) for note in notes)
    return [f"  <!--{line} -->" for note in apart for line in comment(note, "")]


def _quoted(text: str) -> str:
    """Text as the value of an attribute."""
    return '"' + escape(text, quote=False).replace('"', "&quot;") + '"'


VAL3: Final[Dialect] = Dialect(
    name="val3",
    title="Staubli VAL3: a project of .pjx, .dtx and .pgx files for each robot",
    render=render_val3,
    read=lambda frame, files: read_val3(frame, files, program_paths(frame, VAL3, PROJECTS)),
    decimals=DECIMALS,
    promises=(Promise.SEQUENCE_ONLY,),
    kinds=frozenset({"staubli"}),
    is_thinned=True,
    is_rounded=True,
    split=PAGE,
    demands=_demands,
)
