"""Escape programs in INFORM: a job that goes back from the row that the main job counts, then home.

No job can work out between which of its rows an arm stands, as joints are pulses there, which are in no model. So the
main job counts: the register holds a thousand times its step, and one more from each motion on. An arm on its way to a
row is behind the row before, or still rounds it: it goes to that one first, then back row by row. Before it does, the
tool must be in the box round these motions; where it is not, nothing moves.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import inverse
from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.units import MM
from cellplan.programs.elements.escapes import (
    SPEED,
    EscapeForm,
    EscapeProgram,
    EscapeStep,
    register_of,
    require_registers_apart,
)
from cellplan.programs.elements.joints import Angle
from cellplan.programs.elements.text import ascii_text, comment
from cellplan.programs.elements.timed_rows import decimals_of
from cellplan.programs.formats.inform.jobs import LONGEST_NAME, JobFrame, inform_events, job_names
from cellplan.programs.formats.inform.positions import joints_of, tool_pose
from cellplan.programs.formats.inform.text import COMMENT, read_job
from cellplan.programs.formats.inform.writer import INFORM, Job

UNIT: Final = 1000  # of the register from mark to mark; more rows between two are refused
LAST: Final = 96  # register: controllers have 100 variables
LONGEST: Final = LONGEST_NAME - len("_MEET")  # name of a main job, to which those of an escape are named
COUNT: Final = 4  # variables of an escape program
BOX: Final = 1.0  # [mm] by which a box is larger than what the tool passes
SAMPLES: Final = 33  # places of a motion of joints, between which the tool is off their chord by less than their gap
WORDS: Final = 1000.0  # of a millimetre in the elements of a position variable


def render_escape(program: EscapeProgram) -> dict[str, str]:
    """The jobs of the escape of a robot, that which is started first."""
    frame, robot, name = program.frame, program.frame.robot(program.robot), _name(program.frame, program.robot)
    base, register = JobFrame.of(robot, None), int(program.register)
    job = Job(name=f"{name}_ESC", frame=base, decimals=decimals_of(robot, INFORM.decimals))
    tables = ("row", program.rows), ("row home", program.homeward)
    points = [job.joints(robot, q, f"{what} {row}") for what, table in tables for row, q in enumerate(table, start=1)]
    job.statements += [*INFORM_ESCAPE.before(program), f"GETS PX{program.register} $PX001"]
    job.statements += [f"GETE D{register + axis:03d} P{program.register} ({axis})" for axis in (1, 2, 3)]
    job.statements.append(f"JUMP *STAY IF D{program.register}>={UNIT * (len(program.steps) + 1)}")
    for step in reversed(program.steps):
        job.statements.append(f"JUMP *S{step.number} IF D{program.register}>={UNIT * step.number}")
    job.statements += ["*STAY", "PAUSE", "JUMP *STAY"]
    job.statements += [line for step in program.steps for line in _step(program, step, points)]
    job.statements.append("*DONE")
    jobs = [job]
    for call, lines in INFORM_ESCAPE.waits(frame, program.robot):
        jobs.append(Job(name=call.removeprefix("CALL JOB:"), frame=base, decimals=0, statements=lines))
    notes = [line for note in program.notes for line in comment(note, "'", forbidden="'", longest=COMMENT - 2)]
    remark = ascii_text(frame.cell.name)[:COMMENT].strip()
    return {f"{one.name}.JBI": one.text(remark, notes if one is job else []) for one in jobs}


def _step(program: EscapeProgram, step: EscapeStep, points: Sequence[str]) -> Iterator[str]:
    """Statements of a step: which row the register names, whether the tool is there, back, and home."""
    name, number, count = _name(program.frame, program.robot), step.number, step.last - step.first
    if not 0 < count < UNIT:
        expected = f"expected 1 to {UNIT - 1} motions between two marks, got {count} of '{name}'"
        raise InputError(f"--escape: {expected}: leave out more (--thin-mm, --thin-deg)")
    meet, places = INFORM_ESCAPE.meet.format(program=name), [*points[step.first - 1 : step.last - 1]]
    yield from (INFORM_ESCAPE.case.format(number=number), INFORM_ESCAPE.agree[number % 2].format(program=name))
    begun = range(count + 1)
    yield from (f"JUMP *S{number}R{row} IF D{program.register}={UNIT * number + row}" for row in begun)
    yield "JUMP *STAY"
    for row in begun:
        yield f"*S{number}R{row}"
        yield from _box(program, slice(step.first - 1 + max(row - 2, 0), step.first + row))
        yield f"JUMP *S{number}M{max(row, 1)}"
    for row in begun[:0:-1]:
        yield from (f"*S{number}M{row}", _motion(places[row - 1]))
    yield from (meet, INFORM_ESCAPE.set_register(program, 0))
    for leg in step.legs:
        first, last = leg or (1, 0)
        yield from map(_motion, points[len(program.rows) + first - 1 : len(program.rows) + last])
        yield meet
    yield "JUMP *DONE"


def _box(program: EscapeProgram, rows: slice) -> Iterator[str]:
    """Statements that let nothing move unless the tool is where joints pass some rows."""
    robot, q = program.frame.robot(program.robot), program.rows[rows]
    shares = np.linspace(0.0, max(len(q) - 1, 1), 1 + max(len(q) - 1, 1) * (SAMPLES - 1))
    passed = np.stack([np.interp(shares, np.arange(len(q)), column) for column in q.T], axis=1)
    p = MM * (inverse(JobFrame.of(robot, None).X_WC) @ tool_pose(robot, passed))[:, :3, 3]
    margin = BOX + np.abs(np.diff(p, axis=0)).max(axis=0)
    for axis, (low, high) in enumerate(zip(p.min(axis=0) - margin, p.max(axis=0) + margin, strict=True), start=1):
        variable = f"D{int(program.register) + axis:03d}"
        yield from (f"JUMP *STAY IF {variable}<{round(WORDS * low)}", f"JUMP *STAY IF {variable}>{round(WORDS * high)}")


def _motion(point: str) -> str:
    """A motion of joints to a position, at which it stops."""
    return f"MOVJ {point} VJ={SPEED:.2f} PL=0"


def _read(expected: EscapeProgram, files: Mapping[str, str]) -> EscapeProgram:
    """Rows and steps of the first job; ``InputError`` with file and line where it is none."""
    robot, base = expected.frame.robot(expected.robot), JobFrame.of(expected.frame.robot(expected.robot), None)
    name = _name(expected.frame, expected.robot)
    job, q = read_job(dict(files), f"{name}_ESC", base), []
    for position in job.positions.values():
        joints = joints_of(robot, base.X_WC @ position.X, position.stated)
        if joints is None:
            raise position.statement.error("a position that the arm reaches in its configuration")
        q.append(joints)
    steps, moves, waits = list[EscapeStep](), list[int](), 0
    for statement in job.statements:
        if match := re.fullmatch(r"\*S(\d+)", statement.text):
            steps.append(EscapeStep(int(match[1]), 0, 0, "", ()))
            moves, waits = [], 0
        elif statement.kind == "MOVJ":
            moves.append(int(str(statement.words[0])) + 1)
        elif statement.text == INFORM_ESCAPE.meet.format(program=name) and steps:
            if not waits and not moves:
                raise statement.error("motions back before robots meet", "none")
            legs = (*steps[-1].legs, (moves[0], moves[-1]) if moves else None)
            steps[-1] = (
                steps[-1]._replace(legs=legs) if waits else steps[-1]._replace(first=moves[-1], last=moves[0] + 1)
            )
            moves, waits = [], waits + 1
    count = max((step.last for step in steps), default=0)
    homed = (tuple(leg and (leg[0] - count, leg[1] - count) for leg in step.legs) for step in steps)
    lines = (line.strip() for line in files[f"{name}_ESC.JBI"].split("\n"))
    return EscapeProgram(
        frame=expected.frame,
        robot=expected.robot,
        notes=tuple(line[1:].strip() for line in lines if line.startswith("'")),
        rows=np.reshape(q[:count], (-1, len(robot.model.joints))),
        homeward=np.reshape(q[count:], (-1, len(robot.model.joints))),
        steps=tuple(step._replace(legs=legs) for step, legs in zip(steps, homed, strict=True)),
    )


def _name(frame: ExportFrame, robot: str) -> str:
    """Name of the main job of a robot, with which those of the escape begin."""
    return job_names(frame)[0][frame.programs[0], robot]


def _require(frame: ExportFrame, robot: str) -> None:
    """Refuse what no job counts, a register that has no such number, and names to which nothing can be added."""
    register, name = register_of(frame, robot), _name(frame, robot)
    if frame.promise is Promise.PACED:
        raise InputError("--escape: expected motions of joints with inform, got lines: write joints (--moves joints)")
    if not re.fullmatch(r"[0-9]{1,3}", register) or int(register) > LAST:
        key = f"robots.{robot}.controller.step_register"
        raise InputError(f"{key}: expected the number of a variable D, 0 to {LAST}, got '{register}'")
    require_registers_apart(frame, robot, COUNT)
    if len(name) > LONGEST:
        raise InputError(f"robots.{robot}: expected a name of at most {LONGEST} characters for --escape, got '{name}'")


INFORM_ESCAPE: Final = EscapeForm(
    sign="'",
    case="*S{number}",
    meet="CALL JOB:{program}_MEET",
    agree=("CALL JOB:{program}_EVEN", "CALL JOB:{program}_ODD"),
    pause="TIMER T=1.00",
    register="SET D{name} {value}",
    angle=Angle.DEGREES,
    events=inform_events,
    sources=lambda frame, robot: rf"{_name(frame, robot)}\.JBI",
    render=render_escape,
    require=_require,
    read=_read,
    counted=("MOVJ ", "INC D{name}"),
    unit=UNIT,
    program=_name,
)
