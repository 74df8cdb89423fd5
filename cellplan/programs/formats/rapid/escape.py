"""Escape programs in RAPID: a module beside the main one in the same task, which declares the step register."""

import re
from typing import Final

from cellplan.errors import InputError
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.escapes import EscapeForm, EscapeProgram, register_of
from cellplan.programs.elements.joints import Angle, Axes
from cellplan.programs.elements.text import joined
from cellplan.programs.formats.rapid.paced import rapid_events
from cellplan.programs.formats.rapid.targets import joint_targets
from cellplan.programs.formats.rapid.units import LONGEST_NAME, NAME, WORDS, RapidUnit, rapid_units
from cellplan.programs.formats.rapid.writer import LINE_END

ENDING: Final = "_escape"  # of the name of a module
ROUTINE: Final = "cell_escape"
TABLES: Final = ("escape_rows", "homeward")


def render_escape(program: EscapeProgram) -> dict[str, str]:
    """The module of the escape program of a robot."""
    unit = _unit(program.frame, program.robot)
    lines = [*(f"! {note}".rstrip() for note in program.notes), f"TASK PERS num {program.register} := 0;"]
    lines.append("LOCAL CONST speeddata v_escape := [100,20,100,20];")
    for table, q in zip(TABLES, (program.rows, program.homeward), strict=True):
        targets = joint_targets(unit, q)
        lines.append(f"LOCAL CONST jointtarget {table}{{{len(q)}}} := [")
        lines += [f"  {target}{',' if row < len(q) else ''}" for row, target in enumerate(targets, start=1)] + ["];"]
    calls = [line for step in program.steps for line in RAPID_ESCAPE.calls(program, step)]
    lines += [f"PROC {ROUTINE}()", *(f"  {line}" for line in RAPID_ESCAPE.before(program))]
    lines += [f"  TEST {program.register}", *(f"  {line}" for line in calls), "  DEFAULT:", "    no_way;", "  ENDTEST"]
    lines += ["ENDPROC", *_back(unit), *_moves("go", "num first,num last", "first TO last", TABLES[1], unit), "ENDPROC"]
    for call, body in RAPID_ESCAPE.waits(program.frame, program.robot):
        lines += [f"LOCAL PROC {call[:-1]}()", *(f"  {line}" for line in body), "ENDPROC"]
    lines += ["LOCAL PROC no_way()", '  TPWrite "no way home from here";', "  EXIT;", "ENDPROC"]
    name = unit.module + ENDING
    return {f"{name}.mod": joined([f"MODULE {name}", *(f"  {line}" for line in lines), "ENDMODULE"], line_end=LINE_END)}


def _moves(name: str, parameters: str, span: str, table: str, unit: RapidUnit, body: tuple[str, ...] = ()) -> list[str]:
    """A routine that moves along rows of a table, after what it does before."""
    move, tool = ("MoveAbsJ", f",{unit.tool}") if unit.has_tool else ("MoveExtJ", "")
    return [
        f"LOCAL PROC {name}({parameters})",
        *(f"  {line}" for line in body),
        f"  FOR row FROM {span} DO",
        f"    {move} {table}{{row}},v_escape,fine{tool};",
        "  ENDFOR",
    ]


def _back(unit: RapidUnit) -> list[str]:
    """The routine that finds the first of the rows between which the robot stands, and goes back from it."""
    axes = [f"robax.rax_{axis}" for axis in range(1, 7)] if unit.has_tool else []
    axes += [f"extax.eax_{'abcdef'[place]}" for place in range(len(unit.axes.external))]
    rows = TABLES[0]
    along = [f"({rows}{{row+1}}.{axis}-{rows}{{row}}.{axis})" for axis in axes]
    gaps = [f"(here.{axis}-{rows}{{row}}.{axis})" for axis in axes]
    pairs = list(zip(gaps, along, strict=True))
    body = (
        *("VAR jointtarget here;", "VAR num at := 0;", "VAR num square;", "VAR num share;", "VAR num missed;"),
        *("VAR num gap;", "here := CJointT();", "FOR row FROM last-1 TO first STEP -1 DO"),
        *("  square := 0.000000001;", "  share := 0;"),
        *(f"  square := square+{a}*{a};" for a in along),
        *(f"  share := share+{h}*{a};" for h, a in pairs),
        *("  share := share/square;", "  IF share < 0 THEN", "    share := 0;", "  ENDIF"),
        *("  IF share > 1 THEN", "    share := 1;", "  ENDIF", "  missed := 0;"),
        *(line for h, a in pairs for line in (f"  gap := {h}-share*{a};", "  missed := missed+gap*gap;")),
        *("  IF missed <= off*off THEN", "    at := row;", "  ENDIF", "ENDFOR"),
        *("IF at = 0 THEN", "  no_way;", "ENDIF"),
    )
    return [*_moves("back", "num first,num last,num off", "at TO first STEP -1", rows, unit, body), "ENDPROC"]


def _unit(frame: ExportFrame, robot: str) -> RapidUnit:
    """A robot as RAPID programs it."""
    return next(unit for unit in rapid_units(frame) if unit.robot.name == robot)


def _numbers(robot: Robot, text: str) -> list[float]:
    """Numbers of a target that belong to joints."""
    arm, external = (part.split(",") for part in text.split("],["))
    axes = Axes.of(robot)
    return [float(value) for value in (*(arm if axes.arm else []), *external[: len(axes.external)])]


def _sources(frame: ExportFrame, robot: str) -> str:
    """Modules of a main program with motions, and with what comes before them."""
    return re.escape(_unit(frame, robot).module) + r"(_[0-9]{3}(_[0-9]+)?)?\.mod"


def _require(frame: ExportFrame, robot: str) -> None:
    """Refuse a register that is no name of RAPID."""
    name = register_of(frame, robot)
    if not NAME.fullmatch(name) or name.lower() in WORDS:
        raise InputError(
            f"robots.{robot}.controller.step_register: expected a name of at most {LONGEST_NAME} letters, digits and "
            f"_, got '{name}'"
        )


RAPID_ESCAPE: Final = EscapeForm(
    sign="!",
    case="CASE {number}:",
    back="back {first},{last},{off};",
    go="go {first},{last};",
    meet="meet;",
    agree=("even;", "odd;"),
    pause="WaitTime 1;",
    register="{name} := {value};",
    tables=(f"jointtarget {TABLES[0]}", f"jointtarget {TABLES[1]}"),
    row=r"\[\[([-0-9.,E\]\[]+)\]\],?",
    numbers=_numbers,
    angle=Angle.DEGREES,
    events=lambda frame, robot: rapid_events(frame, _unit(frame, robot)),
    sources=_sources,
    render=render_escape,
    require=_require,
)
