"""KUKA KRL: a module of a .src and a .dat file for each robot, one PTP motion to each row, pages as subprograms."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from math import floor
from typing import Final

import numpy as np

from cellplan.errors import raise_findings, refusals
from cellplan.export.corners import row_shares
from cellplan.export.dialect import Dialect
from cellplan.export.handshake import HandshakeStep, handshake_steps, lowering_step
from cellplan.export.head import head_notes
from cellplan.export.joints import to_numbers
from cellplan.export.krl.names import AXES, EXTERNAL, POINT, WHOLE, module_paths, require_numbers
from cellplan.export.krl.reader import read_krl
from cellplan.export.pages import is_rounded, pages_of, percentages, render_programs, require_six_axes, robots_of
from cellplan.export.text import comment, fixed, joined
from cellplan.export.timed_rows import decimals_of
from cellplan.geometry.transforms import Array
from cellplan.model.exported import ExportFrame, ExportJob, ProgramRows, Promise, RobotRows

DECIMALS: Final = 5
PAGE: Final = 1000  # rows; public programs are split at 1400 to 2500 lines
ADVANCE: Final = 3  # motions that are read ahead: the default of the controller
HEADER: Final = ("&ACCESS RVP", "&REL 1")
LINE_END: Final = "\r\n"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _KrlProgram:
    """What is written of one robot in one program."""

    path: str  # path of the main module without its ending
    head: Sequence[str]  # comment lines
    rows: RobotRows
    numbers: Array  # values of all components of the points, shape (N, 12)
    decimals: int  # of these
    speeds: Sequence[int]  # share of the top speed with which each row is approached in [%]
    rounding: Sequence[int]  # value of ``$APO.CPTP`` with which each row is rounded in [%], 0 for a stop
    steps: Sequence[HandshakeStep]  # instructions at a mark
    pages: Sequence[range]  # rows of each page


def render_krl(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``<robot>.src`` and ``.dat``, or ``<robot>/<program>.src`` and ``.dat``.

    Raises:
        InputError: A robot cannot be written: it has no KUKA controller, is no arm of six axes with at most six others
            before it, lacks a signal, or a position cannot be written with the decimals.
    """
    paths = module_paths(job.frame, KRL)
    raise_findings(refusals(*_demands(job.frame, 0)))
    return render_programs(job, paths, lambda program, rows, path: _files(job, _program(job, program, rows, path)))


def _demands(frame: ExportFrame, _rows: int) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell."""
    for robot in robots_of(frame, KRL):
        yield partial(require_numbers, frame, robot)
        yield partial(require_six_axes, frame.robot(robot), external=EXTERNAL, what="KRL")


def _program(job: ExportJob, program: ProgramRows, rows: RobotRows, path: str) -> _KrlProgram:
    """All that the files of one robot in one program are made of."""
    placed = job.frame.robot(rows.robot)
    decimals = decimals_of(placed, DECIMALS)
    axes = require_six_axes(placed, external=EXTERNAL, what="KRL")
    written = to_numbers(placed, rows.q, decimals=decimals)
    numbers = np.zeros((len(rows), len(AXES)))
    numbers[:, :6] = written[:, axes.arm]
    numbers[:, 6 : 6 + len(axes.external)] = written[:, axes.external]
    pages = pages_of(len(rows), job.frame, KRL)
    return _KrlProgram(
        path=path,
        head=[line for note in head_notes(job, rows.robot) for line in comment(note, ";")],
        rows=rows,
        numbers=numbers,
        decimals=decimals,
        speeds=percentages(placed, rows),
        rounding=_rounding(row_shares(job, program)[rows.robot] * is_rounded(job, program, rows.robot, numbers, pages)),
        steps=handshake_steps(job.frame, rows.robot) if rows.marks else (),
        pages=pages,
    )


def _rounding(shares: Array) -> list[int]:
    """Values of ``$APO.CPTP`` in [%], 0 to 100, for shares of a motion: it counts in halves of one."""
    return [min(floor(WHOLE * share + 1e-9), 100) for share in shares.tolist()]


def _files(job: ExportJob, program: _KrlProgram) -> dict[str, str]:
    """The module of a program, or its main module and those of its pages."""
    setup = _setup(job, program)
    if len(program.pages) == 1:
        moves = _moves(program, program.pages[0])
        return _module(program, program.path, [*setup, *moves], program.pages[0])
    modules = [f"{program.path}_{number:03d}" for number in range(1, len(program.pages) + 1)]
    calls = [f"{module.rpartition('/')[2]}()" for module in modules]
    files = _module(program, program.path, [*setup, *calls], range(0), calls)
    for module, page in zip(modules, program.pages, strict=True):
        files |= _module(program, module, _moves(program, page), page)
    return files


def _setup(job: ExportJob, program: _KrlProgram) -> list[str]:
    """What is set before the first motion. Targets are joint positions: neither tool nor base moves them."""
    control = job.frame.robot(program.rows.robot).control
    tool, base = (None, None) if control is None else (control.tool_number, control.base_number)
    lines = [
        "BAS(#INITMOV,0)",
        f"$ADVANCE={ADVANCE}",
        f"$TOOL={f'TOOL_DATA[{tool}]' if tool else '$NULLFRAME'}",
        f"$BASE={f'BASE_DATA[{base}]' if base else '$NULLFRAME'}",
    ]
    if program.steps:
        lines.append(_instruction(lowering_step(job.frame, program.rows.robot)))
    return lines


def _moves(program: _KrlProgram, page: range) -> list[str]:
    """The motions of a page, each with its speed and rounding where these change, and the handshakes after them."""
    lines, marks, speed, rounding = list[str](), set(program.rows.marks), None, None
    for row in page:
        if program.speeds[row] != speed:
            speed = program.speeds[row]
            lines.append(f"BAS(#VEL_PTP,{speed})")
        if program.rounding[row] and program.rounding[row] != rounding:
            rounding = program.rounding[row]
            lines.append(f"$APO.CPTP={rounding}")
        lines.append(f"PTP {POINT}{row + 1}{' C_PTP' if program.rounding[row] else ''}")
        if row in marks:
            lines += [_instruction(step) for step in program.steps]
    return lines


def _instruction(step: HandshakeStep) -> str:
    """One step of a handshake. Both kinds stop the advance run: they are done when the robot stands at the row."""
    if step.waits:
        return f"WAIT FOR {'' if step.is_on else 'NOT '}$IN[{step.signal}]"
    return f"$OUT[{step.signal}]={'TRUE' if step.is_on else 'FALSE'}"


def _module(
    program: _KrlProgram, path: str, statements: Sequence[str], page: range, calls: Sequence[str] = ()
) -> dict[str, str]:
    """Both files of a module; points are declared in the order of their rows."""
    name = path.rpartition("/")[2]
    source = [*HEADER, f"DEF {name}()", *program.head, *(f"EXT {call}" for call in calls), *statements, "END"]
    points = [
        f"DECL E6AXIS {POINT}{row + 1}={{{_components(program.numbers[row].tolist(), program.decimals)}}}"
        for row in page
    ]
    data = [*HEADER, f"DEFDAT {name}", *program.head, *points, "ENDDAT"]
    return {f"{path}.src": joined(source, line_end=LINE_END), f"{path}.dat": joined(data, line_end=LINE_END)}


def _components(values: Sequence[float], decimals: int) -> str:
    """Components of a point: all axes of the arm, then all external ones, unused ones at zero."""
    return ",".join(f"{axis} {fixed(value, decimals)}" for axis, value in zip(AXES, values, strict=True))


KRL: Final[Dialect] = Dialect(
    name="krl",
    title="KUKA KRL: a .src and a .dat file for each robot",
    render=render_krl,
    read=lambda frame, files: read_krl(frame, files, module_paths(frame, KRL)),
    decimals=DECIMALS,
    promises=(Promise.SEQUENCE_ONLY,),
    kinds=frozenset({"kuka"}),
    is_thinned=True,
    is_rounded=True,
    split=PAGE,
    demands=_demands,
)
