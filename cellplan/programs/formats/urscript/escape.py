"""Escape programs in URScript: a program beside the main one; the step is in an integer output register."""

from typing import Final

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.escapes import EscapeForm, EscapeProgram, register_of
from cellplan.programs.elements.joints import Angle, to_numbers
from cellplan.programs.elements.text import fixed, joined
from cellplan.programs.formats.urscript.seams import urscript_events
from cellplan.programs.formats.urscript.text import (
    ENDING,
    approach_call,
    decimals_of_urscript,
    function_names,
)

TABLES: Final = ("escape_rows", "homeward")
REGISTERS: Final = 48  # integer output registers
NOWHERE: Final = ("def no_way():", "  while True:", "    halt", "  end", "end")


def render_escape(program: EscapeProgram) -> dict[str, str]:
    """The escape program of a robot."""
    frame, robot = program.frame, program.robot
    rows, homeward = (_table(frame, robot, *it) for it in zip(TABLES, (program.rows, program.homeward), strict=True))
    body = [*NOWHERE, *rows, *homeward, *_BACK, *_moves(TABLES[0], "at", "row >= first", "row - 1")]
    body += ["def go(first, last):", *_moves(TABLES[1], "first", "row <= last", "row + 1")]
    for call, lines in URSCRIPT_ESCAPE.waits(frame, robot):
        body += [f"def {call}:", *(f"  {line}" for line in lines), "end"]
    body += [*URSCRIPT_ESCAPE.before(program), f"step = read_output_integer_register({program.register})"]
    body += ["if step < 0:", "  no_way()"]
    body += [line for step in program.steps for line in URSCRIPT_ESCAPE.calls(program, step)]
    body += ["else:", "  no_way()", "end"]
    head = [*(f"# {note}".rstrip() for note in program.notes), f"def {function_names(frame)[None, robot]}_escape():"]
    return {f"{robot}_escape{ENDING}": joined([*head, *(f"  {line}" for line in body), "end"])}


def _table(frame: ExportFrame, robot: str, name: str, q: Array) -> list[str]:
    """A function that gives one of some rows."""
    placed, lines = frame.robot(robot), [f"def {name}(row):"]
    decimals = decimals_of_urscript(frame, placed)
    for row, values in enumerate(to_numbers(placed, q, decimals=decimals, angle=Angle.RADIANS).tolist(), start=1):
        numbers = ", ".join(fixed(value, decimals) for value in values)
        lines += [f"  if row == {row}:", f"    return [{numbers}]", "  end"]
    return [*lines, "  no_way()", "end"]


def _moves(table: str, begin: str, condition: str, following: str) -> list[str]:
    """The rest of a routine: moves along rows of a table."""
    move = f"    movej({table}(row), {approach_call()})"
    return [f"  row = {begin}", f"  while {condition}:", move, f"    row = {following}", "  end", "end"]


_BACK: Final = (
    *("def back(first, last, off):", "  here = get_actual_joint_positions()", "  at = 0", "  row = last - 1"),
    *("  while row >= first:", "    begin = escape_rows(row)", "    next = escape_rows(row + 1)"),
    *("    square = 0.000000001", "    share = 0", "    axis = 0", "    while axis < 6:"),
    *("      along = next[axis] - begin[axis]", "      square = square + along * along"),
    *("      share = share + (here[axis] - begin[axis]) * along", "      axis = axis + 1", "    end"),
    *("    share = share / square", "    if share < 0:", "      share = 0", "    end", "    if share > 1:"),
    *("      share = 1", "    end", "    missed = 0", "    axis = 0", "    while axis < 6:"),
    *("      gap = here[axis] - begin[axis] - share * (next[axis] - begin[axis])", "      missed = missed + gap * gap"),
    *("      axis = axis + 1", "    end", "    if missed <= off * off:", "      at = row", "    end"),
    *("    row = row - 1", "  end", "  if at == 0:", "    no_way()", "  end"),
)


def _numbers(_robot: Robot, text: str) -> list[float]:
    """Numbers of a row."""
    return [float(number) for number in text.split(", ")]


def _sources(_frame: ExportFrame, robot: str) -> str:
    """The file of a main program."""
    return f"{robot}{ENDING}".replace(".", r"\.")


def _require(frame: ExportFrame, robot: str) -> None:
    """Refuse a register that is no number, and routines of rows, which stand before the first instruction."""
    register = register_of(frame, robot)
    if not register.isdecimal() or int(register) >= REGISTERS:
        key = f"robots.{robot}.controller.step_register"
        raise InputError(f"{key}: expected an integer output register, 0 to {REGISTERS - 1}, got '{register}'")
    if frame.split is not None:
        raise InputError(f"--split: expected none with --escape in urscript, got {frame.split}")


URSCRIPT_ESCAPE: Final = EscapeForm(
    sign="#",
    case="elif step == {number}:",
    back="back({first}, {last}, {off})",
    go="go({first}, {last})",
    meet="meet()",
    agree=("even()", "odd()"),
    pause="sleep(1.0)",
    register="write_output_integer_register({name}, {value})",
    tables=(f"def {TABLES[0]}(", f"def {TABLES[1]}("),
    row=r"return \[(.*)\]",
    numbers=_numbers,
    angle=Angle.RADIANS,
    events=urscript_events,
    sources=_sources,
    render=render_escape,
    require=_require,
    following="read_output_integer_register({name}) + 1",
)
