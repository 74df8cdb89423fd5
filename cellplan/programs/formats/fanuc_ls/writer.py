"""TP programs: one for each robot, or one that moves all motion groups of a controller in step."""

import re
from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Final

import numpy as np

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.geometry.arrays import Array, Flags
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise
from cellplan.programs.elements.corners import LARGEST_SHARE, row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.handshake import HandshakeStep
from cellplan.programs.elements.pages import SLOW, PagedProgram, paged, robots_of
from cellplan.programs.elements.text import ascii_text, comment, fixed, joined
from cellplan.programs.elements.timed_rows import shared_clock
from cellplan.programs.formats.fanuc_ls.groups import KIND, MotionGroup, TpProgram, demands, tp_programs
from cellplan.programs.formats.fanuc_ls.reader import MOST_MS, read_fanuc_ls
from cellplan.programs.formats.fanuc_ls.text import COMMENT, REMARK, SLOTS

DECIMALS: Final = 4
PAGE: Final = 999  # rows: public programs have as many points
MS: Final = 1000  # [ms/s]
SHARES: Final = (LARGEST_SHARE, 0.0)  # CNT100 and FINE: how far smaller values of CNT round is stated by no one
MOST_SLOTS: Final = 8
LINE_END: Final = "\r\n"
TASK: Final = (
    "TCD: STACK_SIZE = 0,",
    "TASK_PRIORITY = 50,",
    "TIME_SLICE = 0,",
    "BUSY_LAMP_OFF = 0,",
    "ABORT_REQUEST = 0,",
    "PAUSE_REQUEST = 0;",
)


def render_fanuc_ls(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``ROBOT.ls``, or that of the controller where it moves robots in step."""
    robots_of(job.frame, FANUC_LS)
    raise_findings(refusals(*demands(job.frame)))
    rows_of = {program.name: program for program in job.programs}
    files: dict[str, str] = {}
    for program in tp_programs(job.frame, FANUC_LS):
        files |= _files(job, program, rows_of[program.program])
    return files


def _files(job: ExportJob, program: TpProgram, rows: ProgramRows) -> dict[str, str]:
    """The file of a program, or that of its main program and those of its pages."""
    groups, name = program.groups, program.name
    parts = [paged(job, FANUC_LS, rows, group.robot.name, name) for group in groups]
    first, times = parts[0], _durations(rows, parts) if job.frame.promise is Promise.SYNCHRONISED else None
    notes = dict.fromkeys(chain.from_iterable(part.notes for part in parts))
    head = [line for note in notes for line in comment(note.replace(";", ","), "!", longest=REMARK - 1)]
    setup = [*chain.from_iterable(map(_frames, groups)), *map(_instruction, first.first)]
    speeds = times or [f"{speed}%" for speed in first.speeds]
    passed, files = _passed(job, rows, parts), dict[str, str]()
    if len(first.pages) > 1:
        calls = [f"CALL {name}{ending}" for ending in first.endings]
        files[f"{name}.ls"] = _file(job, name, groups, [*head, *setup, *calls], [])
        setup = []
    for ending, page in zip(first.endings, first.pages, strict=True):
        lines, points = [*head, *setup], list[str]()
        for number, row in enumerate(page, start=1):
            lines.append(f"J P[{number}] {speeds[row]} {'CNT100' if passed[row] else 'FINE'}")
            lines += [_instruction(step) for step in first.steps if row in first.rows.marks]
            points += _point(number, groups, [part.numbers[row] for part in parts], [part.decimals for part in parts])
        files[f"{name}{ending}.ls"] = _file(job, f"{name}{ending}", groups, lines, points)
    return files


def _durations(rows: ProgramRows, parts: Sequence[PagedProgram]) -> list[str]:
    """How each row is approached in step: the first one slowly, all others in whole milliseconds that do not add up."""
    clock = shared_clock(rows, [part.placed.name for part in parts])
    steps = np.diff(np.rint(MS * clock)).astype(int).tolist()
    if not all(0 < step <= MOST_MS for step in steps):
        raise InputError(f"{FANUC_LS.name}: expected rows 1 to {MOST_MS} ms apart, got {min(steps)} to {max(steps)}")
    return [f"{SLOW}%", *(f"{step}msec" for step in steps)]


def _passed(job: ExportJob, rows: ProgramRows, parts: Sequence[PagedProgram]) -> Flags:
    """Rows that no group stops at, shape (N,): as far as all of them may be rounded by half of their segments.

    Ends of pages are stops, and rows that stand on a neighbour as they are written.
    """
    shares = row_shares(job, rows)
    passed: Flags = np.logical_and.reduce([shares[part.placed.name] >= LARGEST_SHARE for part in parts])
    moved = np.any(np.concatenate([np.diff(part.numbers, axis=0) for part in parts], axis=1) != 0.0, axis=1)
    passed[[page[-1] for page in parts[0].pages]] = False
    passed[1:] &= moved
    passed[:-1] &= moved
    return passed


def _frames(group: MotionGroup) -> Iterator[str]:
    """What selects the frames of a group, which must be those of its points. They do not move joint positions."""
    of_group = "" if group.number == 1 else f"[GP{group.number}]"
    yield f"UFRAME_NUM{of_group}={group.base}"
    yield f"UTOOL_NUM{of_group}={group.tool}"


def _instruction(step: HandshakeStep) -> str:
    """One step of a handshake."""
    state = "ON" if step.is_on else "OFF"
    return f"WAIT DI[{step.signal}]={state}" if step.waits else f"DO[{step.signal}]={state}"


def _point(
    number: int, groups: Sequence[MotionGroup], numbers: Sequence[Array], decimals: Sequence[int]
) -> Iterator[str]:
    """A point: axes of each group, three on a line."""
    yield f"P[{number}]{{"
    for group, positions, places in zip(groups, numbers, decimals, strict=True):
        yield f"   GP{group.number}:"
        yield f"    UF : {group.base}, UT : {group.tool},"
        values = positions[list(group.order)].tolist()
        axes = [
            f"{name} = {fixed(value, places)} {unit}"
            for (name, unit), value in zip(group.axes.items(), values, strict=True)
        ]
        lines = [", ".join(axes[first : first + 3]) for first in range(0, len(axes), 3)]
        yield from (f"    {line}{'' if line is lines[-1] else ','}" for line in lines)
    yield "};"


def _file(
    job: ExportJob, name: str, groups: Sequence[MotionGroup], instructions: Sequence[str], points: Sequence[str]
) -> str:
    """Text of one program. It has no dates: the same rows give the same bytes."""
    moved = [group.number for group in groups]
    slots = SLOTS if max(moved) <= SLOTS else MOST_SLOTS
    lines = [
        f"{number:4d}:{'' if instruction.startswith('J ') else '  '}{instruction} ;"
        for number, instruction in enumerate(instructions, start=1)
    ]
    head = [
        f"/PROG {name}",
        "/ATTR",
        "OWNER = MNEDITOR;",
        f'COMMENT = "{re.sub(r"[^A-Za-z0-9 ._-]", "_", ascii_text(job.frame.cell.name))[:COMMENT]}";',
        f"LINE_COUNT = {len(lines)};",
        "PROTECT = READ_WRITE;",
        *TASK,
        f"DEFAULT_GROUP = {','.join('1' if slot in moved else '*' for slot in range(1, slots + 1))};",
        "CONTROL_CODE = 00000000 00000000;",
    ]
    return joined([*head, "/MN", *lines, "/POS", *points, "/END"], line_end=LINE_END)


FANUC_LS: Final[Dialect] = Dialect(
    name="fanuc_ls",
    title="FANUC TP programs as text, motion groups in step",
    render=render_fanuc_ls,
    read=lambda frame, files: read_fanuc_ls(frame, files, tp_programs(frame, FANUC_LS)),
    decimals=DECIMALS,
    promises=(Promise.SYNCHRONISED, Promise.SEQUENCE_ONLY),
    kinds=frozenset({KIND}),
    is_thinned=True,
    is_rounded=True,
    shares=SHARES,
    split=PAGE,
    demands=demands,
)
