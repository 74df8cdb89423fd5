"""Escape programs in KRL: a module of a .src and a .dat file beside the main one, which declares the step register."""

import re
from typing import Final

from cellplan.errors import InputError
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.escapes import SPEED, EscapeForm, EscapeProgram, register_of
from cellplan.programs.elements.joints import Angle, Axes, to_numbers
from cellplan.programs.elements.pages import program_paths
from cellplan.programs.elements.text import joined
from cellplan.programs.elements.timed_rows import decimals_of
from cellplan.programs.formats.krl.poses import components
from cellplan.programs.formats.krl.seams import krl_events
from cellplan.programs.formats.krl.text import AXES, MODULES, NAME
from cellplan.programs.formats.krl.writer import HEADER, KRL, LINE_END, frames_set

ENDING: Final = "_esc"  # of the name of a module
ROWS, HOMEWARD = "XR", "XH"


def render_escape(program: EscapeProgram) -> dict[str, str]:
    """Both files of the escape program of a robot."""
    path = program_paths(program.frame, KRL, MODULES)[None, program.robot] + ENDING
    placed = program.frame.robot(program.robot)
    name, axes, notes = path.rpartition("/")[2], Axes.of(placed), [f"; {note}".rstrip() for note in program.notes]
    order, decimals = [*axes.arm, *axes.external], decimals_of(placed, KRL.decimals)
    data = [*HEADER, f"DEFDAT {name} PUBLIC", *notes, f"DECL GLOBAL INT {program.register}=0"]
    for table, q in ((ROWS, program.rows), (HOMEWARD, program.homeward)):
        numbers = to_numbers(placed, q, decimals=decimals)[:, order].tolist()
        data.append(f"DECL E6AXIS {table}[{len(q)}]")
        data += [f"{table}[{row}]={{{components(values, decimals)}}}" for row, values in enumerate(numbers, start=1)]
    source = [*HEADER, f"DEF {name}()", *notes, *frames_set(placed)]
    source += [*KRL_ESCAPE.before(program), f"BAS(#VEL_PTP,{SPEED})"]
    source += [f"SWITCH {program.register}"]
    source += [line for step in program.steps for line in KRL_ESCAPE.calls(program, step)]
    source += ["DEFAULT", "NOWAY()", "ENDSWITCH", "END", *_back(AXES[: len(order)]), *_GO]
    for call, lines in KRL_ESCAPE.waits(program.frame, program.robot):
        source += [f"DEF {call}", *lines, "END"]
    texts = {f"{path}.src": source, f"{path}.dat": [*data, "ENDDAT"]}
    return {file: joined(text, line_end=LINE_END) for file, text in texts.items()}


def _back(axes: tuple[str, ...]) -> list[str]:
    """The routine that finds the first of the rows between which the robot stands, and goes back from it."""
    along = [f"({ROWS}[ROW+1].{axis}-{ROWS}[ROW].{axis})" for axis in axes]
    here = [f"(HERE.{axis}-{ROWS}[ROW].{axis})" for axis in axes]
    return [
        "DEF BACK(FIRST:IN,LAST:IN,OFF:IN)",
        "DECL INT FIRST,LAST,ROW,AT",
        "DECL REAL OFF,SQUARE,SHARE,MISSED,GAP",
        "DECL E6AXIS HERE",
        "HERE=$AXIS_ACT",
        "AT=0",
        "FOR ROW=LAST-1 TO FIRST STEP -1",
        "SQUARE=0.000000001",
        "SHARE=0",
        *(f"SQUARE=SQUARE+{a}*{a}" for a in along),
        *(f"SHARE=SHARE+{h}*{a}" for h, a in zip(here, along, strict=True)),
        "SHARE=SHARE/SQUARE",
        *("IF SHARE<0 THEN", "SHARE=0", "ENDIF", "IF SHARE>1 THEN", "SHARE=1", "ENDIF"),
        "MISSED=0",
        *(line for h, a in zip(here, along, strict=True) for line in (f"GAP={h}-SHARE*{a}", "MISSED=MISSED+GAP*GAP")),
        *("IF MISSED<=OFF*OFF THEN", "AT=ROW", "ENDIF", "ENDFOR"),
        *("IF AT==0 THEN", "NOWAY()", "ENDIF"),
        *("FOR ROW=AT TO FIRST STEP -1", f"PTP {ROWS}[ROW]", "ENDFOR", "END"),
    ]


_GO: Final = (
    *("DEF GO(FIRST:IN,LAST:IN)", "DECL INT FIRST,LAST,ROW"),
    *("FOR ROW=FIRST TO LAST", f"PTP {HOMEWARD}[ROW]", "ENDFOR", "END"),
    *("DEF NOWAY()", "LOOP", "HALT", "ENDLOOP", "END"),  # nothing follows, whatever is pressed
)


def _numbers(robot: Robot, text: str) -> list[float]:
    """Numbers of a row that belong to joints."""
    return [float(number) for number in re.findall(r"[AE][1-6] (-?[0-9.]+)", text)][: len(robot.model.joints)]


def _sources(frame: ExportFrame, robot: str) -> str:
    """Files of a main program with motions."""
    return re.escape(program_paths(frame, KRL, MODULES)[frame.programs[0], robot]) + r"(_[0-9]{3})?\.src"


def _require(frame: ExportFrame, robot: str) -> None:
    """Refuse a register that is no name of KRL."""
    name = register_of(frame, robot)
    if not re.fullmatch(rf"[A-Za-z]\w{{0,{NAME - 1}}}", name, re.ASCII) or name.upper() in MODULES.reserved:
        raise InputError(
            f"robots.{robot}.controller.step_register: expected a name of at most {NAME} characters, got '{name}'"
        )


KRL_ESCAPE: Final = EscapeForm(
    sign=";",
    case="CASE {number}",
    back="BACK({first},{last},{off})",
    go="GO({first},{last})",
    meet="MEET()",
    agree=("EVEN()", "ODD()"),
    pause="WAIT SEC 1",
    register="{name}={value}",
    tables=(f"{ROWS}[", f"{HOMEWARD}["),
    row=r"X[RH]\[[0-9]+\]=\{(.*)\}",
    numbers=_numbers,
    angle=Angle.DEGREES,
    events=krl_events,
    sources=_sources,
    render=render_escape,
    require=_require,
)
