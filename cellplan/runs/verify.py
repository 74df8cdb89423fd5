"""Verify joint tables against their cell, without planning anything."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from cellplan.cache import without_cache
from cellplan.checks.verify import verify as verify_tables
from cellplan.errors import InputError
from cellplan.files.input.findings import listed
from cellplan.files.run.clock_table import parse_clock
from cellplan.files.run.joint_tables import parse_table
from cellplan.files.run.stored import CLOCK
from cellplan.model.cell.cell import Cell, Timing
from cellplan.model.motion.motion import JointTable
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Report
from cellplan.runs.plan.demanded import DemandedProgram
from cellplan.runs.plan.program import ProgramClock, moved_while_holding, off_given_path


def verify(
    cell: Cell, tables: Mapping[str, str], *, task: str | None = None, clock: str = "", progress: Progress = silent
) -> Report:
    """Recompute tool errors, joint limits and clearance from the text of joint tables.

    Args:
        cell: The cell the tables were made for.
        tables: Text of one joint table per robot, by robot name.
        task: Name of the only task that was worked on, or of the phase to verify where the program has several; the
            report counts time from the start of that phase.
        clock: Text of the clock of the program, ``tables/clock.csv``: for its nominal times where the cell has another
            ``motion.timing`` than ``as_written``, and for the rows of transfer moves of a program from home to home.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: A table is missing, unreadable, or does not fit the cell; there is no such task; a robot moves that
            holds still in this phase.
    """
    parsed = [parse_table(text, f"tables/{name}.csv") for name, text in tables.items()]
    is_whole = cell.program.is_home_to_home or any(table.gaps for table in parsed)
    demanded = DemandedProgram.of(cell, only=None if is_whole else task)
    place = _place(demanded, task)
    program = _on_clock(cell, demanded, clock)
    _refuse_other_rows(program, parsed)
    phase, schedule = program.plan.program[place], program.schedules[place]
    columns = program.cut(parsed, place)
    for table in columns:
        if table.robot in phase.roles and moved_while_holding(phase, table.robot, table.q) is not None:
            raise InputError(
                f"table of '{table.robot}': expected no motion in the phase '{phase.name}': it holds still"
            )
    for robot, joints in ((cell.robot(table.robot), table.q) for table in columns if table.robot in phase.roles):
        if off_given_path(phase, robot, program.sigma, joints) is not None:
            raise InputError(f"table of '{robot.name}': expected the joints of robots.{robot.name}.path, got others")
    with without_cache():  # a proof rests on the cell itself
        report = verify_tables(
            demanded.scenes(cell)[place], schedule, columns, moving=phase.moving, idle=phase.idle, progress=progress
        )
    return replace(report, phases=program.timed_phases)


def _place(demanded: DemandedProgram, task: str | None) -> int:
    """Number of the phase to verify among those of the program."""
    names = demanded.labels
    if len(names) == 1:
        return 0
    if task not in names:
        got = "none" if task is None else f"'{task}'"
        raise InputError(f"task: this cell has one phase per task: expected one of {listed(names)}, got {got}")
    return names.index(task)


def _on_clock(cell: Cell, demanded: DemandedProgram, clock: str) -> ProgramClock:
    """The demanded program on its clock; the text of the stored one is needed where the cell leaves times open."""
    file = f"tables/{CLOCK}.csv"
    if clock:
        return demanded.clock(cell, parse_clock(clock, file), file=file)
    if cell.motion.timing is not Timing.AS_WRITTEN:
        raise InputError(f"clock: expected the text of {file}, as motion.timing is {cell.motion.timing}, got nothing")
    if demanded.stages:
        raise InputError(f"clock: expected the text of {file}, as the program goes from home to home, got nothing")
    return ProgramClock.from_cell(cell, demanded.plan)


def _refuse_other_rows(clock: ProgramClock, tables: list[JointTable]) -> None:
    """Refuse tables whose times or gaps are not those of the program."""
    for table in tables:
        if not np.array_equal(table.times, clock.times):
            raise InputError(f"table of '{table.robot}': its times differ from those of the program")
        if table.gaps != clock.gaps:
            raise InputError(f"table of '{table.robot}': its interruptions differ from those of the program")
