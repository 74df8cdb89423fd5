"""A program format of your own: one file of rows per robot, read back and verified before it is written.

A format is a ``Dialect`` among ``DIALECTS``: a function that renders a job, an independent reader of the text, which
knows the cell and the names of robots and programs but no row, and what the format can promise. ``export_program``
makes every check again on what the reader returns.
"""

from pathlib import Path

import numpy as np

from cellplan import export_program, load_cell, open_gate, solve, write_run
from cellplan.errors import InputError
from cellplan.model.report.exported import ProgramRows, Promise, RobotRows
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.text import comment, fixed

CELL = Path(__file__).resolve().parent / "plate.yaml"
RUN, PROGRAMS = Path("outputs/examples/run"), Path("outputs/examples/rows")
DECIMALS = 9  # of a second, and of a degree: this example is for revolute joints of one program


def render(job):
    """One file per robot: what is promised as comments, then time in [s] and joint positions in [deg], a row a line."""
    head = [line for note in job.notes for line in comment(note, "#")]
    (program,) = job.programs
    return {f"{name}.rows": "\n".join([*head, *lines(program.robots[name])]) + "\n" for name in job.frame.robots}


def lines(rows):
    """The rows of a robot as text."""
    numbers = np.column_stack([rows.times, np.rad2deg(rows.q)])
    return [" ".join(fixed(number, DECIMALS) for number in row) for row in numbers]


def read(frame, files):
    """The rows that the files hold."""
    return (ProgramRows(name=None, robots={name: own_rows(frame, files, name) for name in frame.robots}),)


def own_rows(frame, files, name):
    """The rows of one robot, with the file and the line of what is wrong."""
    programs = []
    for number, line in enumerate(files[f"{name}.rows"].splitlines(), start=1):
        if line.startswith("#"):
            continue
        try:
            programs.append([float(field) for field in line.split(" ")])
        except ValueError:
            raise InputError(f"{name}.rows:{number}: expected numbers, got {line[:40]!r}") from None
        if len(programs[-1]) != 1 + len(frame.robot(name).model.joints):
            raise InputError(f"{name}.rows:{number}: expected a time and all joints, got {len(programs[-1])} numbers")
    numbers = np.array(programs)
    return RobotRows(robot=name, times=numbers[:, 0].copy(), q=np.deg2rad(numbers[:, 1:]))


DIALECTS["rows"] = Dialect(
    name="rows",
    title="lines of numbers",
    render=render,
    read=read,
    decimals=DECIMALS,
    promises=(Promise.TIMED,),
)
cell = load_cell(CELL)
write_run(solve(cell), RUN)
print("written:", *export_program(open_gate(RUN), PROGRAMS, form="rows"))
