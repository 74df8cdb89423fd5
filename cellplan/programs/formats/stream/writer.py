"""Stream: positions at the cycle of a controller, as a client sends them row by row (RSI, EGM, RTDE, stream motion).

Two files per robot: ``<robot>.csv`` with ``k,t_s,A1_deg,…,process``, and ``<robot>.json`` with what a client and the
controller have to know: axes, start, range against the start, peaks of the written numbers. Positions are those that
the controller shows, in degrees and millimetres; the axes of the arm come first.
"""

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import from_numbers, to_numbers
from cellplan.programs.elements.json_tree import dumped, parsed
from cellplan.programs.elements.text import line_error, lines_of, mismatch_error
from cellplan.programs.elements.timed_rows import file_path, require_paths, times_of
from cellplan.programs.formats.stream.record import (
    DECIMALS,
    FREE,
    MICRO,
    stated_controller,
    stream_axes,
    stream_record,
    whole_cycle,
)

REST: Final = 0.1  # [s] of standstill at both ends, as far as whole cycles fill it
OFF_CYCLE: Final = 1e-9  # [s] of rounding in times that are k times a cycle
RESERVED: Final = "export"  # the record of an export has that name


def render_stream(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``<robot>.csv`` and ``<robot>.json``, in a folder of each task.

    ``InputError`` where rows are not on the cycle of the controller, robots end at different times, or something that a
    controller needs is not stated.
    """
    raise_findings(refusals(*_demands(job.frame, int)))
    files = {}
    for program in job.programs:
        for name in job.frame.robots:
            robot = job.frame.robot(name)
            text, quanta = _table(robot, program.robots[name])
            record = stream_record(
                job.frame, program.name, name, quanta=quanta, digest=_digest(text), notes=_notes(job, robot)
            )
            files[file_path(program.name, f"{name}.csv")] = text
            files[file_path(program.name, f"{name}.json")] = dumped(record) + "\n"
        _require_one_end({name: float(times_of(program.robots[name])[-1]) for name in job.frame.robots})
    return files


def _demands(frame: ExportFrame, _rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """What a stream needs of the cell."""
    for name in frame.robots:
        yield partial(_require_name, frame, name)
        yield partial(whole_cycle, frame.robot(name))
        yield partial(stated_controller, frame, frame.robot(name))


def _require_name(frame: ExportFrame, name: str) -> None:
    """Refuse a robot whose record would be that of the export."""
    if frame.programs == (None,) and name.lower() == RESERVED:
        raise InputError(f"robots.{name}: expected another name, as the record of an export is '{name}.json'")


def read_stream(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """Read files back, strictly: rows at rest at both ends, and figures that are those of the rows."""
    endings = (".csv", ".json")
    require_paths(
        files, [file_path(name, robot + end) for name in frame.programs for robot in frame.robots for end in endings]
    )
    programs = []
    for name in frame.programs:
        robots = {robot: _read(frame, name, robot, files=files) for robot in frame.robots}
        _require_one_end_read({file_path(name, f"{robot}.csv"): rows for robot, rows in robots.items()})
        programs.append(ProgramRows(name=name, robots=robots))
    return tuple(programs)


def columns(robot: Robot) -> str:
    """First line of a stream."""
    return ",".join(["k", "t_s", *(axis.column for axis in stream_axes(robot)), "process"])


def _notes(job: ExportJob, robot: Robot) -> list[str]:
    """What is promised, and how the numbers are to be used."""
    return [
        *job.notes,
        f"row k is due at k cycles after the start; robot {robot.name} rests in the first and the last {REST:g} s",
        "correction limits of the controller have to hold lowest_from_start and highest_from_start of every axis",
        "peaks are those of the written numbers, per second, per second squared and per second cubed",
    ]


def _table(robot: Robot, rows: RobotRows) -> tuple[str, NDArray[np.int64]]:
    """Text of a stream, and its positions as whole numbers of the last decimal."""
    cycle, axes = whole_cycle(robot), stream_axes(robot)
    times = times_of(rows)
    late = np.abs(times - np.arange(len(times)) * (cycle / MICRO))
    if np.any(late > OFF_CYCLE + np.spacing(times)):
        raise InputError(f"robot '{robot.name}': expected rows every {cycle / 1000.0:g} ms, got others")
    numbers = to_numbers(robot, rows.q, decimals=DECIMALS)[:, [axis.place for axis in axes]]
    process = np.zeros(len(rows), dtype=bool) if rows.process is None else rows.process
    row = f"%d,%d.%06d,{','.join([f'%.{DECIMALS}f'] * len(axes))},%d"
    lines = [columns(robot)]
    for k, (values, flag) in enumerate(zip(numbers.tolist(), process.tolist(), strict=True)):
        lines.append(row % (k, k * cycle // MICRO, k * cycle % MICRO, *values, flag))
    return "\n".join(lines) + "\n", _quanta(numbers)


def _quanta(numbers: NDArray[np.float64]) -> NDArray[np.int64]:
    """Written numbers as whole numbers of the last decimal."""
    return np.rint(numbers * 10.0**DECIMALS).astype(np.int64)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _require_one_end(ends: Mapping[str, float]) -> None:
    """Make sure that all robots end together."""
    first = next(iter(ends))
    for name, end in ends.items():
        if abs(end - ends[first]) > OFF_CYCLE:
            raise InputError(
                f"robot '{name}': expected its last row at {ends[first]:.6f} s, where '{first}' ends, got {end:.6f} s"
            )


def _require_one_end_read(robot_rows: Mapping[str, RobotRows]) -> None:
    """Make sure that all streams of a program, by their path, end at the same time."""
    first = next(iter(robot_rows))
    ends = {path: float(times_of(rows)[-1]) for path, rows in robot_rows.items()}
    for path, end in ends.items():
        if abs(end - ends[first]) > OFF_CYCLE:
            raise mismatch_error(
                path, len(robot_rows[path]) + 1, f"the end at {ends[first]:.6f} s, as in {first}", f"{end:.6f} s"
            )


def _read(frame: ExportFrame, program: str | None, name: str, *, files: Mapping[str, str]) -> RobotRows:
    """Read the two files of a robot."""
    robot, file, header = frame.robot(name), file_path(program, f"{name}.csv"), file_path(program, f"{name}.json")
    numbers, process = _rows(robot, files[file], file)
    _require_rest(robot, numbers, file)
    quanta = _quanta(numbers)
    expected = stream_record(frame, program, name, quanta=quanta, digest=_digest(files[file]))
    lines_of(files[header], header)
    record = parsed(files[header], header)
    record.require(expected, free=FREE)
    record.members(tuple(expected))["notes"].require_texts()
    q = np.empty_like(numbers)
    q[:, [axis.place for axis in stream_axes(robot)]] = numbers
    times = np.arange(len(q)) * whole_cycle(robot) / MICRO
    return RobotRows(robot=name, q=from_numbers(robot, q), times=times, process=process)


def _rows(robot: Robot, text: str, file: str) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Positions in the order of the columns, shape (N, n), and whether the tool is in process."""
    lines = lines_of(text, file)
    if "\r" in text:
        raise line_error(file, 1, "line breaks without '\\r'", lines[0])
    if not lines or lines[0] != columns(robot):
        raise line_error(file, 1, f"the names '{columns(robot)}'", lines[0] if lines else "")
    cycle, count = whole_cycle(robot), len(stream_axes(robot))
    number = rf"(?!-0\.0+(?:,|$))-?(?:0|[1-9][0-9]{{0,6}})\.[0-9]{{{DECIMALS}}}"
    row = re.compile(rf"((?:{number},){{{count}}})([01])")
    numbers, process = list[list[float]](), list[bool]()
    for k, line in enumerate(lines[1:]):
        head = f"{k},{k * cycle // MICRO}.{k * cycle % MICRO:06d},"
        if not line.startswith(head):
            raise line_error(
                file, k + 2, f"a row that begins with '{head}', {cycle / 1000.0:g} ms after the last", line
            )
        match = row.fullmatch(line, len(head))
        if match is None:
            raise line_error(file, k + 2, f"{count} numbers with {DECIMALS} decimals and 0 or 1", line)
        numbers.append([float(field) for field in match[1].split(",")[:-1]])
        process.append(match[2] == "1")
    if len(numbers) < 2:
        raise mismatch_error(file, len(lines), "two rows or more", str(len(numbers)))
    return np.array(numbers), np.array(process)


def _require_rest(robot: Robot, numbers: NDArray[np.float64], file: str) -> None:
    """Make sure that a stream begins and ends at rest."""
    rest = int(REST * MICRO) // whole_cycle(robot)
    for end, part in ((0, numbers[: rest + 1]), (len(numbers) - 1, numbers[-rest - 1 :][::-1])):
        moving = np.flatnonzero(np.any(part != part[0], axis=1))
        if len(moving):
            line = 2 + abs(end - int(moving[0]))
            where = "first" if end == 0 else "last"
            raise mismatch_error(file, line, f"rest in the {where} {REST:g} s", "other positions")


STREAM: Final[Dialect] = Dialect(
    name="stream",
    title="rows at the cycle of each controller, for RSI, EGM, RTDE and the like",
    render=render_stream,
    read=read_stream,
    decimals=DECIMALS,
    promises=(Promise.TIMED,),
    at_cycle=True,
    demands=_demands,
)
