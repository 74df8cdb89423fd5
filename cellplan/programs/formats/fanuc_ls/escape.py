"""Escape programs in TP: points of the rows in programs of their own, of which each is copied to a position register.

With the step register n, the registers n + 1 to n + 7 and the position registers n and n + 1, n + 2 are used too.
"""

import re
from collections.abc import Iterator
from typing import Final

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.escapes import SPEED, EscapeForm, EscapeProgram, register_of, require_registers_apart
from cellplan.programs.elements.joints import Angle, to_numbers
from cellplan.programs.elements.text import comment
from cellplan.programs.elements.timed_rows import decimals_of
from cellplan.programs.formats.fanuc_ls.groups import NAMES, MotionGroup, TpProgram, motion_group, tp_programs
from cellplan.programs.formats.fanuc_ls.output import TpText, frames, joint_pose
from cellplan.programs.formats.fanuc_ls.seams import tp_events
from cellplan.programs.formats.fanuc_ls.text import REMARK
from cellplan.programs.formats.fanuc_ls.writer import FANUC_LS, PAGE

LAST: Final = 98  # register: there are 100 position registers
COUNT: Final = 8  # registers of an escape program
LONGEST: Final = NAMES.longest - len("_BACK")  # name of a program to which those of an escape are named


def render_escape(program: EscapeProgram) -> dict[str, str]:
    """The programs of the escape of a robot, that which is started first."""
    frame, group = program.frame, motion_group(program.frame, program.robot)
    name, number = _name(frame, program.robot), int(program.register)
    head = [line for note in program.notes for line in comment(note.replace(";", ","), "!", longest=REMARK - 1)]
    main = [*head, *frames(group), *TP_ESCAPE.before(program)]
    main += [f"IF R[{number}]={step.number},JMP LBL[{step.number}]" for step in program.steps] + [f"CALL {name}_STAY"]
    main += [line for step in program.steps for line in (*TP_ESCAPE.calls(program, step), "END")]
    go = [f"FOR R[{number + 1}]=AR[1] TO AR[2]", *_move(number), "ENDFOR"]
    texts = [
        TpText(f"{name}_ESC", [group], main),
        _with_points(TpText(f"{name}_BACK", [group], [*frames(group), *_back(group, number, name)]), program.rows),
        _with_points(TpText(f"{name}_HOME", [group], [*frames(group), *go]), program.homeward),
        TpText(f"{name}_STAY", [group], ["LBL[1]", "PAUSE", "JMP LBL[1]"]),
    ]
    texts += [TpText(call.split()[1], [group], lines) for call, lines in TP_ESCAPE.waits(frame, program.robot)]
    return {f"{text.name}.ls": text.rendered(frame.cell.name) for text in texts}


def _with_points(text: TpText, q: Array) -> TpText:
    """A program with the points of some rows."""
    (group,) = text.groups
    if len(q) > PAGE:
        raise InputError(
            f"--escape: expected at most {PAGE} rows of '{group.robot.name}' in fanuc_ls, got {len(q)}: leave out more "
            "(--thin-mm, --thin-deg)"
        )
    decimals = decimals_of(group.robot, FANUC_LS.decimals)
    for numbers in to_numbers(group.robot, q, decimals=decimals):
        text.point([joint_pose(group, numbers, decimals)])
    return text


def _move(number: int) -> list[str]:
    """A motion to the point whose number is in the first register behind the step."""
    return [f"PR[{number + 1}]=P[R[{number + 1}]]", f"J PR[{number + 1}] {SPEED}% FINE"]


def _back(group: MotionGroup, number: int, name: str) -> Iterator[str]:
    """The instructions that find the first of the rows between which the robot stands, and go back from it.

    An instruction has one operation.
    """
    row, at, square, share, gap, along, term = (f"R[{number + place}]" for place in range(1, 8))
    of_group = "" if group.number == 1 else f"GP{group.number}:"
    places = [[f"PR[{of_group}{number + k},{axis}]" for k in range(3)] for axis in range(1, len(group.axes) + 1)]
    yield from (f"PR[{number}]=JPOS", f"{at}=0", f"{term}=AR[2]-1", f"FOR {row}={term} DOWNTO AR[1]")
    yield from (f"{term}={row}+1", f"PR[{number + 1}]=P[{row}]", f"PR[{number + 2}]=P[{term}]")
    yield from (f"{square}=.000001", f"{share}=0")
    for here, begin, end in places:
        yield from (f"{along}={end}-{begin}", f"{gap}={here}-{begin}")
        yield from (f"{term}={along}*{along}", f"{square}={square}+{term}")
        yield from (f"{term}={gap}*{along}", f"{share}={share}+{term}")
    yield from (f"{share}={share}/{square}", f"IF ({share}<0) THEN", f"{share}=0", "ENDIF")
    yield from (f"IF ({share}>1) THEN", f"{share}=1", "ENDIF", f"{square}=0")
    for here, begin, end in places:
        yield from (f"{along}={end}-{begin}", f"{along}={along}*{share}", f"{gap}={here}-{begin}")
        yield from (f"{gap}={gap}-{along}", f"{gap}={gap}*{gap}", f"{square}={square}+{gap}")
    yield from (f"{term}=AR[3]*AR[3]", f"IF ({square}<={term}) THEN", f"{at}={row}", "ENDIF", "ENDFOR")
    yield from (f"IF ({at}=0) THEN", f"CALL {name}_STAY", "ENDIF")
    yield from (f"FOR {row}={at} DOWNTO AR[1]", *_move(number), "ENDFOR")


def _program(frame: ExportFrame, robot: str) -> TpProgram:
    """The main program of a robot."""
    return next(it for it in tp_programs(frame, FANUC_LS) if it.groups[0].robot.name == robot)


def _name(frame: ExportFrame, robot: str) -> str:
    """Its name, with which those of the escape begin."""
    return _program(frame, robot).name


def _sources(frame: ExportFrame, robot: str) -> str:
    """Files of a main program, of its pages and of its seams."""
    program = _program(frame, robot)
    seams = "".join(f"|{name}(_[0-9]+)?" for name in program.seams.values())
    return rf"({program.name}(_[0-9]{{3}})?{seams})\.ls"


def _require(frame: ExportFrame, robot: str) -> None:
    """Refuse a register that has no such number, and names to which nothing can be added."""
    register, name = register_of(frame, robot), _name(frame, robot)
    if not register.isdecimal() or not 1 <= int(register) <= LAST:
        key = f"robots.{robot}.controller.step_register"
        raise InputError(f"{key}: expected the number of a register, 1 to {LAST}, got '{register}'")
    require_registers_apart(frame, robot, COUNT)
    if len(name) > LONGEST:
        raise InputError(f"robots.{robot}: expected a name of at most {LONGEST} characters for --escape, got '{name}'")


def _plain(line: str) -> str:
    """Statement of a line without its number and the sign that ends it."""
    return re.sub(r"^\s*[0-9]*:|\s*;?\s*$", "", line).strip()


def _numbered(text: str) -> str:
    """A program whose lines are counted once more."""
    lines, number = list[str](), 0
    for line in text.split("\n"):
        begin = re.match(r" *[0-9]+:", line)
        number += begin is not None
        lines.append(line if begin is None else f"{number:4d}:{line[begin.end() :]}")
    return re.sub(r"(?m)^LINE_COUNT\s*=\s*[0-9]+", f"LINE_COUNT = {number}", "\n".join(lines))


def _numbers(_robot: Robot, text: str) -> list[float]:
    """Numbers of some axes."""
    return [float(number) for number in re.findall(r"= (-?[0-9.]+)", text)]


TP_ESCAPE: Final = EscapeForm(
    sign="!",
    case="LBL[{number}:STEP]",
    back="CALL {program}_BACK({first},{last},{off})",
    go="CALL {program}_HOME({first},{last})",
    meet="CALL {program}_MEET",
    agree=("CALL {program}_EVEN", "CALL {program}_ODD"),
    pause="WAIT 1.00(sec)",
    register="R[{name}]={value}",
    tables=("DOWNTO AR[1]", "TO AR[2]"),
    row=r"((?:[JE][1-9] = -?[0-9.]+ (?:deg|mm),? ?)+)",
    numbers=_numbers,
    angle=Angle.DEGREES,
    events=tp_events,
    sources=_sources,
    render=render_escape,
    require=_require,
    program=_name,
    plain=_plain,
    line="0:  {} ;",
    layout=_numbered,
    following="R[{name}]+1",
)
