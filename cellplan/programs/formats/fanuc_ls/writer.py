"""TP programs: one for each robot, one for each of its seams, or one that moves all groups of a controller in step."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from typing import Final

import numpy as np

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.geometry.arrays import Flags
from cellplan.model.report.exported import ExportJob, Moves, ProgramRows, Promise, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.corners import LARGEST_SHARE, row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.head import head_notes
from cellplan.programs.elements.paced import moves_of
from cellplan.programs.elements.pages import SLOW, PagedProgram, paged, pages_of, percentages, robots_of
from cellplan.programs.elements.text import comment
from cellplan.programs.elements.timed_rows import shared_clock
from cellplan.programs.formats.fanuc_ls.groups import FRAMES, KIND, TpProgram, demands, seam_name, tp_programs
from cellplan.programs.formats.fanuc_ls.output import TpText, frames, instruction, joint_pose
from cellplan.programs.formats.fanuc_ls.player import MOST_MS
from cellplan.programs.formats.fanuc_ls.poses import configuration
from cellplan.programs.formats.fanuc_ls.reader import read_fanuc_ls
from cellplan.programs.formats.fanuc_ls.seams import SeamRows, tp_events, write_seam
from cellplan.programs.formats.fanuc_ls.text import REMARK

DECIMALS: Final = 4
PAGE: Final = 999  # rows, or seams: public programs have as many points
MS: Final = 1000  # [ms/s]
SHARES: Final = (LARGEST_SHARE, 0.0)  # CNT100 and FINE: nothing states how far smaller values of CNT round


def render_fanuc_ls(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``ROBOT.ls``, or that of the controller where it moves robots in step."""
    robots_of(job.frame, FANUC_LS)
    raise_findings(refusals(*demands(job.frame)))
    rows_of = {program.name: program for program in job.programs}
    texts = chain.from_iterable(
        _texts(job, program, rows_of[program.program]) for program in tp_programs(job.frame, FANUC_LS)
    )
    return {f"{text.name}.ls": text.rendered(job.frame.cell.name) for text in texts}


def _texts(job: ExportJob, program: TpProgram, rows: ProgramRows) -> list[TpText]:
    """The program, or the main program and its pages, each with those of its seams behind it."""
    groups, name = program.groups, program.name
    parts = [paged(job, FANUC_LS, rows, group.robot.name, name) for group in groups]
    lead = next((part for part in parts if part.rows.seams), parts[0])
    stretches = _stretches(lead.rows)
    first = replace(lead, pages=pages_of(len(stretches), job.frame, FANUC_LS))
    times = _durations(rows, parts) if job.frame.promise is Promise.SYNCHRONISED else None
    speeds = times or [f"{speed}%" for speed in first.speeds]
    notes = dict.fromkeys(chain.from_iterable(head_notes(job, group.robot.name) for group in groups))
    head = [line for note in notes for line in comment(note.replace(";", ","), "!", longest=REMARK - 1)]
    setup = [*chain.from_iterable(frames(group) for group in groups), *map(instruction, first.first)]
    texts = list[TpText]()
    if len(first.pages) > 1:
        calls = [f"CALL {name}{ending}" for ending in first.endings]
        texts.append(TpText(name, groups, [*head, *setup, *calls]))
        setup = []
    seams = _seam_programs(
        job, program, rows, SeamRows(job.frame, parts, speeds, row_shares(job, rows)[lead.placed.name])
    )
    passed = _passed(job, rows, parts, [stretches[page[-1]][-1] for page in first.pages])
    for ending, page in zip(first.endings, first.pages, strict=True):
        text = TpText(f"{name}{ending}", groups, [*head, *setup])
        texts.append(text)
        for row, *_ in stretches[page.start : page.stop]:
            if row in seams:
                texts.append(seams[row])
                text.instructions += [f"CALL {seams[row].name}", *chain.from_iterable(map(frames, groups))]
                continue
            poses = [
                joint_pose(group, part.numbers[row], part.decimals) for group, part in zip(groups, parts, strict=True)
            ]
            text.move(f"J {{}} {speeds[row]} {'CNT100' if passed[row] else 'FINE'}", poses)
            text.instructions += [instruction(step) for step in first.steps if row in first.rows.marks]
    return texts


def _seam_programs(job: ExportJob, program: TpProgram, rows: ProgramRows, of_seams: SeamRows) -> dict[int, TpText]:
    """The programs of the seams of a robot by the row at which each is entered."""
    texts, passes = dict[int, TpText](), dict[str, int]()
    if not any(part.rows.seams for part in of_seams.parts):
        return texts
    part = of_seams.part
    moves = moves_of(job, rows, tp_events(job.frame, part.placed.name))
    for seam in part.rows.seams:
        passes[seam.task] = passes.get(seam.task, 0) + 1
        texts[seam.first] = TpText(seam_name(program, seam.task, passes[seam.task]), program.groups, [])
        inside = [move for move in moves if seam.first <= move.row <= seam.last]
        write_seam(texts[seam.first], of_seams, seam, inside)
    return texts


def _stretches(rows: RobotRows) -> list[range]:
    """Single rows, and the rows of each seam together."""
    seams = {seam.first: seam.last for seam in rows.seams}
    stretches, row = list[range](), 0
    while row < len(rows):
        stretches.append(range(row, seams.get(row, row) + 1))
        row = stretches[-1].stop
    return stretches


def _durations(rows: ProgramRows, parts: Sequence[PagedProgram]) -> list[str]:
    """How each row is approached in step: the first one slowly, all others in whole milliseconds.

    What is rounded adds up only where seams, which have no times, are between.
    """
    clock = shared_clock(rows, [part.placed.name for part in parts])
    on_seam = np.any([part.rows.on_seam for part in parts], axis=0)
    steps = np.rint(MS * np.diff(clock)) if np.any(on_seam) else np.diff(np.rint(MS * clock))
    by_joints = steps[~on_seam[1:]]
    if not np.all((by_joints > 0) & (by_joints <= MOST_MS)):
        got = f"{by_joints.min():.0f} to {by_joints.max():.0f}"
        raise InputError(f"{FANUC_LS.name}: expected rows 1 to {MOST_MS} ms apart, got {got}")
    return [f"{SLOW}%", *(f"{step:.0f}msec" for step in steps)]


def _passed(job: ExportJob, rows: ProgramRows, parts: Sequence[PagedProgram], ends: Sequence[int]) -> Flags:
    """Rows that no group stops at, shape (N,): as far as all of them may be rounded by half of their segments.

    Ends of pages are stops, rows that stand on a neighbour as they are written, and rows before a seam.
    """
    shares = row_shares(job, rows)
    passed: Flags = np.logical_and.reduce([shares[part.placed.name] >= LARGEST_SHARE for part in parts])
    moved = np.any(np.concatenate([np.diff(part.numbers, axis=0) for part in parts], axis=1) != 0.0, axis=1)
    passed[[*ends, *(max(seam.first - 1, 0) for part in parts for seam in part.rows.seams)]] = False
    passed[1:] &= moved
    passed[:-1] &= moved
    return passed


FANUC_LS: Final[Dialect] = Dialect(
    name="fanuc_ls",
    title="FANUC TP programs as text, motion groups in step",
    render=render_fanuc_ls,
    read=lambda frame, files: read_fanuc_ls(frame, files, tp_programs(frame, FANUC_LS)),
    decimals=DECIMALS,
    promises=(Promise.SYNCHRONISED, Promise.PACED, Promise.SEQUENCE_ONLY),
    kinds=frozenset({KIND}),
    is_thinned=True,
    is_rounded=True,
    shares=SHARES,
    smallest_zone=1.0 / MM,
    split=PAGE,
    moves=tuple(Moves),
    repeats_seams=True,
    configuration=configuration,
    has_seams_in_step=True,
    has_joint_seams=True,
    frame_numbers=(1, FRAMES[1]),
    speeds=percentages,
    demands=demands,
)
