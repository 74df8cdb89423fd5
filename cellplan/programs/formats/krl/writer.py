"""KUKA KRL: a module of a .src and a .dat file for each arm, one PTP motion to each row, pages as subprograms."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import floor
from typing import Final

import numpy as np

from cellplan.errors import raise_findings, refusals
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, Moves, ProgramRows, Promise
from cellplan.programs.elements.corners import LARGEST_SHARE, moves, row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import unit_of
from cellplan.programs.elements.paced import moves_of
from cellplan.programs.elements.pages import (
    PagedProgram,
    paged,
    percentages,
    program_paths,
    require_rows,
    shares_as_written,
)
from cellplan.programs.elements.text import comment, joined, point_stems
from cellplan.programs.formats.krl.axes import demands, order_of_axes, played_robots
from cellplan.programs.formats.krl.poses import components, status_and_turn
from cellplan.programs.formats.krl.reader import read_krl
from cellplan.programs.formats.krl.seams import (
    DATA,
    LONGEST_ROUTINE,
    MODES,
    SeamWriter,
    krl_events,
    routine_names,
    signal_text,
    tool_text,
)
from cellplan.programs.formats.krl.seams_reader import read_seams
from cellplan.programs.formats.krl.text import MODULES, POINT, WHOLE

DECIMALS: Final = 5
PAGE: Final = 1000  # rows; public programs are split at 1400 to 2500 lines
ADVANCE: Final = 3  # motions that are read ahead: the default of the controller
HEADER: Final = ("&ACCESS RVP", "&REL 1")
LINE_END: Final = "\r\n"


def render_krl(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``<robot>.src`` and ``.dat``, or ``<robot>/<program>.src`` and ``.dat``.

    ``InputError`` for a robot without a KUKA controller, that is no arm of six axes with at most six others before it,
    lacks a signal, or has a position that cannot be written with the decimals.
    """
    raise_findings(refusals(*demands(job.frame, int)))
    paths, files = _paths(job.frame), dict[str, str]()
    by_name = {program.name: program for program in job.programs}
    for (name, robot), path in paths.items():
        require_rows(job, by_name[name])
        program = _moved_together(job, by_name[name], unit_of(job.frame.cell, robot), path)
        files |= _with_seams(job, by_name[name], program) if KRL.has_seams(job.frame) else _modules(program)
    return files


def _paths(frame: ExportFrame) -> dict[tuple[str | None, str], str]:
    """Path of each program without an ending, by its name and robot."""
    return program_paths(played_robots(frame), KRL, MODULES)


def _with_seams(job: ExportJob, program: ProgramRows, part: PagedProgram) -> dict[str, str]:
    """The files of a robot with seams."""
    path, robot = part.path, part.placed.name
    names = routine_names(job.frame, robot, part.name)
    seams = SeamWriter(
        frame=job.frame,
        program=part,
        moves=moves_of(job, program, krl_events(job.frame, robot)),
        names=names,
        stems=point_stems(names, longest=LONGEST_ROUTINE, others=(part.name,), data=DATA),
    )
    routines = seams.routines()
    head = [line for note in part.notes for line in comment(note, ";")]
    setup = ["BAS(#INITMOV,0)", f"$ADVANCE={ADVANCE}", *MODES, f"$TOOL={tool_text(part.placed)}", "$BASE=$NULLFRAME"]
    source = [*HEADER, f"DEF {part.name}()", *head, *setup, *routines.pop(""), "END"]
    for name, statements in routines.items():
        source += ["", f"DEF {name}()", *statements, "END"]
    data = [*HEADER, f"DEFDAT {part.name}", *head, *seams.points(), "ENDDAT"]
    return {f"{path}.src": joined(source, line_end=LINE_END), f"{path}.dat": joined(data, line_end=LINE_END)}


def _moved_together(job: ExportJob, program: ProgramRows, robots: Sequence[str], path: str) -> PagedProgram:
    """What is written of an arm, and of positioners that move in step: each row is a point of all their axes."""
    parts = [paged(job, KRL, program, robot, path) for robot in robots]
    numbers = np.hstack([part.numbers[:, order_of_axes(job.frame, part.placed.name)] for part in parts])
    if len(parts) == 1:
        return replace(parts[0], numbers=numbers)
    shares = row_shares(job, program)
    whole = np.minimum.reduce(
        [np.where(np.any(moves(part.rows), axis=0), shares[part.placed.name], LARGEST_SHARE) for part in parts]
    )
    return replace(
        parts[0],
        notes=list(dict.fromkeys(chain.from_iterable(part.notes for part in parts))),
        numbers=numbers,
        decimals=max(part.decimals for part in parts),
        speeds=np.max([part.speeds for part in parts], axis=0).tolist(),
        shares=shares_as_written(whole, numbers, parts[0].pages),
    )


def _modules(program: PagedProgram) -> dict[str, str]:
    """The module of a program, or its main module and those of its pages; numbers are in the order of a point."""
    setup = _setup(program)
    if len(program.pages) == 1:
        return _module(program, program.path, [*setup, *_moves(program, program.pages[0])], program.pages[0])
    calls = [f"{program.name}{ending}()" for ending in program.endings]
    files = _module(program, program.path, [*setup, *calls], range(0), calls)
    for ending, page in zip(program.endings, program.pages, strict=True):
        files |= _module(program, f"{program.path}{ending}", _moves(program, page), page)
    return files


def _setup(program: PagedProgram) -> list[str]:
    """What is set before the first motion."""
    return [*frames_set(program.placed), *map(signal_text, program.first)]


def frames_set(placed: Robot) -> list[str]:
    """Advance, tool and base of a robot. Targets are joint positions: neither moves them."""
    control = placed.control
    tool, base = (None, None) if control is None else (control.tool_number, control.base_number)
    return [
        "BAS(#INITMOV,0)",
        f"$ADVANCE={ADVANCE}",
        f"$TOOL={f'TOOL_DATA[{tool}]' if tool else '$NULLFRAME'}",
        f"$BASE={f'BASE_DATA[{base}]' if base else '$NULLFRAME'}",
    ]


def _moves(program: PagedProgram, page: range) -> list[str]:
    """The motions of a page, each with its speed and rounding where these change, and the handshakes after them."""
    lines, marks, speed, rounding = list[str](), set(program.rows.marks), None, None
    for row in page:
        if program.speeds[row] != speed:
            speed = program.speeds[row]
            lines.append(f"BAS(#VEL_PTP,{speed})")
        share = min(floor(WHOLE * float(program.shares[row]) + 1e-9), 100)  # counts in halves of a motion, in [%]
        if share not in {0, rounding}:
            rounding = share
            lines.append(f"$APO.CPTP={rounding}")
        lines.append(f"PTP {POINT}{row + 1}{' C_PTP' if share else ''}")
        if row in marks:
            lines += [signal_text(step) for step in program.steps]
    return lines


def _module(
    program: PagedProgram, path: str, statements: Sequence[str], page: range, calls: Sequence[str] = ()
) -> dict[str, str]:
    """Both files of a module; points are declared in the order of their rows."""
    name, head = path.rpartition("/")[2], [line for note in program.notes for line in comment(note, ";")]
    source = [*HEADER, f"DEF {name}()", *head, *(f"EXT {call}" for call in calls), *statements, "END"]
    numbers = program.numbers[page.start : page.stop].tolist()
    points = [
        f"DECL E6AXIS {POINT}{row + 1}={{{components(values, program.decimals)}}}"
        for row, values in zip(page, numbers, strict=True)
    ]
    data = [*HEADER, f"DEFDAT {name}", *head, *points, "ENDDAT"]
    return {f"{path}.src": joined(source, line_end=LINE_END), f"{path}.dat": joined(data, line_end=LINE_END)}


def _read(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """What the files say, by the reader of lines and arcs where there may be some."""
    return (read_seams if KRL.has_seams(frame) else read_krl)(frame, files, _paths(frame))


KRL: Final[Dialect] = Dialect(
    name="krl",
    title="KUKA KRL: a .src and a .dat file for each robot",
    render=render_krl,
    read=_read,
    decimals=DECIMALS,
    promises=(Promise.SYNCHRONISED, Promise.PACED, Promise.SEQUENCE_ONLY),
    moves=tuple(Moves),
    configuration=status_and_turn,
    speeds=percentages,
    most_arms=1,
    has_seams_in_step=True,
    kinds=frozenset({"kuka"}),
    is_thinned=True,
    is_rounded=True,
    split=PAGE,
    demands=demands,
)
