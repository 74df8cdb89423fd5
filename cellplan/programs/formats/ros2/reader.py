"""Reader of ROS 2 trajectories: our own subset of YAML, and what controllers demand of a trajectory."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ProgramRows, RobotRows
from cellplan.programs.elements.joints import Angle, from_numbers
from cellplan.programs.elements.text import line_error, lines_of, mismatch_error, truncated_error
from cellplan.programs.elements.timed_rows import NANO, file_path, require_paths
from cellplan.programs.formats.ros2.names import DECIMALS, ENDING, SHORTEST, file_name, joint_names, of_model, quoted

TICKS: Final = 2.0  # last decimals by which two rounded positions may be wrong together, and one speed besides
_REMARK: Final = r"(?:\s+#.*)?"
_NAMES: Final = re.compile(rf'joint_names:\s+\[\s*(".*")\s*\]\s*{_REMARK}')
_NAME_GAP: Final = re.compile(r'(?<=")\s*,\s*(?=")')
_TIME: Final = r"time_from_start:\s+\{\s*sec:\s+(0|[1-9][0-9]{0,6})\s*,\s*nanosec:\s+(0|[1-9][0-9]*)\s*\}"


@dataclass(slots=True)
class _Part:
    """One file as it is read."""

    file: str  # its name in messages
    table: list[list[float]] = field(default_factory=list)  # positions and speeds as they are written, shape (N, 2 n)
    times: list[int] = field(default_factory=list)  # times in [ns] since its start
    lines: list[int] = field(default_factory=list)  # line of each point, from 1


def read_ros2(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """Read files back, strictly but for spaces, comments and empty lines; an ``InputError`` has file and line.

    Speeds have to fit the positions: each lies among the slopes of the two steps before it and of the two after it,
    or beyond them by no more than they differ. The parts of a split trajectory follow on one another.
    """
    paths = {(name, robot): _paths(frame, files, name, robot) for name in frame.programs for robot in frame.robots}
    require_paths(files, [path for trajectory in paths.values() for path in trajectory])
    programs = []
    for name in frame.programs:
        robots = {robot: _rows(frame.robot(robot), files, paths[name, robot]) for robot in frame.robots}
        _require_one_clock(robots, {robot: paths[name, robot][0] for robot in robots})
        programs.append(ProgramRows(name=name, robots=robots))
    return tuple(programs)


def _paths(frame: ExportFrame, files: Mapping[str, str], program: str | None, robot: str) -> list[str]:
    """Paths of the parts of a robot's trajectory, in their order."""
    if frame.split is None:
        return [file_path(program, file_name(robot, 1, 0))]
    folder = re.escape(file_path(program, ""))
    numbered = re.compile(rf"{folder}{re.escape(robot)}_[1-9][0-9]{{0,5}}_of_([1-9][0-9]{{0,5}}){re.escape(ENDING)}")
    counts = {int(match[1]) for path in files if (match := numbered.fullmatch(path))}
    parts = max(counts, default=1)
    return [file_path(program, file_name(robot, part, parts)) for part in range(1, parts + 1)]


def _require_one_clock(robots: Mapping[str, RobotRows], paths: Mapping[str, str]) -> None:
    """Make sure that all robots of a program have points at the same times."""
    first = next(iter(robots))
    for name, rows in robots.items():
        if not np.array_equal(rows.times, robots[first].times):  # type: ignore[arg-type]
            raise InputError(f"{paths[name]}:1: expected points at the same times as in {paths[first]}, got others")


def _rows(robot: Robot, files: Mapping[str, str], paths: list[str]) -> RobotRows:
    """Rows of a robot, its parts one after the other."""
    table, times = list[list[float]](), list[int]()
    for path in paths:
        part = _part(robot, files[path], path)
        _require_fit(robot, part)
        if table:
            if part.table[0] != table[-1]:
                raise mismatch_error(path, part.lines[0], "the last point of the part before", "another one")
            part.times = [times[-1] + since for since in part.times]
        table += part.table[1 if table else 0 :]
        times += part.times[1 if times else 0 :]
    numbers = np.array(table)
    count = len(robot.model.joints)
    return RobotRows(
        robot=robot.name,
        q=from_numbers(of_model(robot), numbers[:, :count], angle=Angle.RADIANS),
        times=np.array([time / NANO for time in times]),
        qd=numbers[:, count:],
    )


def _part(robot: Robot, text: str, file: str) -> _Part:
    """Read one file."""
    part, point, count = _Part(file), _point_pattern(robot), len(robot.model.joints)
    before = ["names", "points", "rows"]
    indent, ended = "", False
    lines = lines_of(text, file)
    for number, line in enumerate(lines, start=1):
        content = line.strip()
        if not content or content.startswith("#"):
            continue
        if ended:
            raise line_error(file, number, "nothing after '...'", content)
        if before[0] == "names":
            _require_names(robot, line, file, number)
            before.pop(0)
        elif before[0] == "points":
            if not re.fullmatch(rf"points:\s*{_REMARK}", line):
                raise line_error(file, number, "points:", content)
            before.pop(0)
        elif re.fullmatch(rf"\.\.\.\s*{_REMARK}", line):
            ended = True
        else:
            match = point.fullmatch(line)
            if match is None:
                raise line_error(file, number, f"a point of {count} joints with {DECIMALS} decimals", content)
            if part.lines and match[1] != indent:
                raise line_error(file, number, f"{len(indent)} spaces before each point", line)
            indent = match[1]
            _add_point(part, match, number)
    if not ended:
        raise truncated_error(file, len(lines), "'...' at the end")
    if len(part.table) < SHORTEST:
        raise mismatch_error(file, len(lines), f"{SHORTEST} points or more", str(len(part.table)))
    _require_rest(part, count)
    return part


def _require_names(robot: Robot, line: str, file: str, number: int) -> None:
    """Make sure that a line names the joints in their order."""
    expected = [quoted(name) for name in joint_names(robot)]
    match = _NAMES.fullmatch(line)
    if match is None or _NAME_GAP.split(match[1]) != expected:
        raise line_error(file, number, f"joint_names: [{', '.join(expected)}]", line)


def _point_pattern(robot: Robot) -> re.Pattern[str]:
    """A line of one point: indentation, positions, velocities, seconds, nanoseconds."""
    more = len(robot.model.joints) - 1
    number = rf"(?!-0\.0+(?![0-9]))-?(?:0|[1-9][0-9]{{0,6}})\.[0-9]{{{DECIMALS}}}"
    numbers = rf"\[\s*({number}(?:\s*,\s*{number}){{{more}}})\s*\]"
    inner = rf"positions:\s+{numbers}\s*,\s*velocities:\s+{numbers}\s*,\s*{_TIME}"
    return re.compile(rf"( *)-\s+\{{\s*{inner}\s*\}}\s*{_REMARK}")


def _add_point(part: _Part, match: re.Match[str], number: int) -> None:
    """Take one point in."""
    if int(match[5]) >= NANO:
        raise line_error(part.file, number, "less than 1000000000 nanoseconds", match[5])
    time = int(match[4]) * NANO + int(match[5])
    if not part.times and time != 0:
        raise mismatch_error(part.file, number, "the first point at 0", f"{match[4]} s {match[5]} ns")
    if part.times and time <= part.times[-1]:
        raise mismatch_error(
            part.file, number, "a later time than that of the point before", f"{match[4]} s {match[5]} ns"
        )
    part.times.append(time)
    part.table.append([float(text) for text in f"{match[2]},{match[3]}".split(",")])
    part.lines.append(number)


def _require_rest(part: _Part, count: int) -> None:
    """Make sure that the first and the last point rest."""
    for end in (0, -1):
        if any(part.table[end][count:]):
            where = "first" if end == 0 else "last"
            raise mismatch_error(part.file, part.lines[end], f"velocities of zero at the {where} point", "others")


def _require_fit(robot: Robot, part: _Part) -> None:
    """Make sure that speeds fit the positions."""
    count = len(robot.model.joints)
    table, times = np.array(part.table), np.array(part.times) / NANO
    qd, h = table[:, count:], np.diff(times)[:, None]
    slopes = np.diff(table[:, :count], axis=0) / h
    still = np.zeros((2, count))
    around = np.concatenate([still, slopes, still])
    near = np.stack([around[place : place + len(table)] for place in range(4)])
    low, high = near.min(axis=0), near.max(axis=0)
    allowed = (high - low) + _rounding(h, slopes)
    wrong = (qd < low - allowed) | (qd > high + allowed)
    if np.any(wrong):
        row, place = (int(index[0]) for index in np.nonzero(wrong))
        slope = f"{near[1, row, place]:.6f} and {near[2, row, place]:.6f}"
        raise mismatch_error(
            part.file,
            part.lines[row],
            f"a velocity of joint {robot.model.joints[place].name} near the slopes {slope} of the positions",
            f"{qd[row, place]:.6f}",
        )


def _rounding(h: Array, slopes: Array) -> Array:
    """By how much rounding may part speeds and slopes around each row, shape (N, n)."""
    slope_error = (TICKS * 10.0**-DECIMALS + np.abs(slopes) / NANO) / h
    padded = np.concatenate([slope_error[:1], slope_error, slope_error[-1:]])
    return np.maximum(padded[:-1], padded[1:]) + TICKS * 10.0**-DECIMALS
