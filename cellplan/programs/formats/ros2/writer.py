"""ROS 2: a JointTrajectory per robot as YAML, in radians and metres, with speeds and times since its start.

Positions count from the zero of the model, as ROS drivers count from that of the URDF. Joints are named
``robot/joint``. A controller runs a cubic through points with speeds, so they have to fit the positions; it demands
that the last one rests. A trajectory is split only where all robots rest: each part ends at rest, and the next one
begins at the same point at its own time 0.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, Interpolation, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.head import home_text
from cellplan.programs.elements.joints import LARGEST, Angle, to_numbers
from cellplan.programs.elements.text import comment, fixed, joined
from cellplan.programs.elements.timed_rows import NANO, file_path, nanoseconds, shared_clock, times_of
from cellplan.programs.formats.ros2.names import DECIMALS, SHORTEST, file_name, joint_names, of_model, quoted
from cellplan.programs.formats.ros2.reader import read_ros2

MOST_POINTS: Final = 100_000  # of a message, which then has some ten megabytes
WHEN: Final = "start it when all robots have ended the part before"
REST: Final = 1e-6  # [rad/s] or [m/s] a slower joint rests


def render_ros2(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``<robot>.yaml``, or ``<robot>_1_of_3.yaml`` where ``--split`` is given.

    ``InputError`` where rows have no speeds or do not rest at their ends, a number cannot be written, or robots rest
    nowhere within the largest number of points.
    """
    files = {}
    for program in job.programs:
        clock = shared_clock(program, job.frame.robots)
        velocities = {name: _rest_velocities(program.robots[name]) for name in job.frame.robots}
        parts = _parts(job, clock, velocities)
        for name in job.frame.robots:
            lines = _points(job.frame.robot(name), program.robots[name], velocities[name])
            for number, (first, last) in enumerate(parts, start=1):
                path = file_path(program.name, file_name(name, number, 0 if job.frame.split is None else len(parts)))
                part = f"part {number} of {len(parts)}: it begins and ends at rest; {WHEN}"
                head = [*_head(job, program, name), *([part] if len(parts) > 1 else [])]
                files[path] = _trajectory(job.frame.robot(name), head, clock[first : last + 1], lines[first : last + 1])
    return files


def _rest_velocities(rows: RobotRows) -> Array:
    """Speeds of rows, which must be there and zero at both ends, to rounding; exactly zero there, shape (N, n)."""
    if rows.qd is None:
        raise InputError(f"robot '{rows.robot}': expected rows with speeds, got none")
    qd = rows.qd.copy()
    slopes = np.diff(rows.q, axis=0) / np.diff(times_of(rows))[:, None]
    slopes = np.concatenate([np.zeros((1, qd.shape[1])), slopes, np.zeros((1, qd.shape[1]))])
    for end, change in ((0, slopes[2] - slopes[1]), (-1, slopes[-2] - slopes[-3])):
        moving = np.abs(qd[end]) > np.abs(change) + REST  # a robot that comes to rest slows down between its last rows
        if np.any(moving):
            where = "first" if end == 0 else "last"
            raise InputError(
                f"robot '{rows.robot}': expected rest at its {where} row, as controllers demand it of a trajectory, "
                f"got {float(np.abs(qd[end]).max()):.6f} rad/s or m/s"
            )
        qd[end] = 0.0
    qd[np.all(np.abs(qd) <= REST, axis=1)] = 0.0
    return qd


def _parts(job: ExportJob, clock: Array, velocities: Mapping[str, Array]) -> list[tuple[int, int]]:
    """First and last row of each part: as few parts as hold no more points than a controller takes."""
    count, most = len(clock), job.frame.split
    _require_split(job.frame, count)
    if most is None:
        return [(0, count - 1)]
    rests = np.flatnonzero(np.all([np.all(qd == 0.0, axis=1) for qd in velocities.values()], axis=0)).tolist()
    first, last = max(pairwise(rests), key=lambda stretch: stretch[1] - stretch[0])
    if last - first + 1 > most:
        raise InputError(
            f"--split: expected {last - first + 1} or more, as a trajectory can be split only where all robots rest, "
            f"and they do not from {clock[first]:.3f} s to {clock[last]:.3f} s, got {most}"
        )
    ends = [0]
    while ends[-1] < count - 1:
        ends.append(max(rest for rest in rests if rest <= ends[-1] + most - 1))
    return list(pairwise(ends))


def _require_split(frame: ExportFrame, rows: int) -> None:
    """Refuse more points than controllers are known to take in one trajectory, and parts that are no motion."""
    if frame.split is None and rows > MOST_POINTS:
        raise InputError(f"--split: expected the most points that the controller takes, as the program has {rows}")
    if frame.split is not None and frame.split < SHORTEST:
        raise InputError(f"--split: expected {SHORTEST} points or more, got {frame.split}")


def _demands(frame: ExportFrame, rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """What trajectories need."""
    yield lambda: _require_split(frame, rows())


def _head(job: ExportJob, program: ProgramRows, name: str) -> list[str]:
    """Notes at the head of a file."""
    robot = job.frame.robot(name)
    q = robot.home if robot.home is not None else program.robots[name].q[0]
    home = ", ".join(f"{joint.name} {fixed(value, 6)}" for joint, value in zip(robot.model.joints, q, strict=True))
    return [
        *job.notes,
        f"robot {name}, model {robot.model.name}; radians, metres, seconds",
        "positions count from the zero of the model; the robot description of the driver has to have the same one",
        f"home in these positions: {home}",
        f"home as the controller shows it: {home_text(job, name)}",
    ]


def _trajectory(robot: Robot, head: Sequence[str], clock: Array, points: Sequence[str]) -> str:
    """Text of a file; its last line ends the document, without which it is truncated."""
    begin = round(float(clock[0]) * NANO)
    since = [whole - begin for whole in nanoseconds(clock, robot=robot.name)]
    lines = [line for note in head for line in comment(note, "#")]
    lines.append(f"joint_names: [{', '.join(map(quoted, joint_names(robot)))}]")
    lines.append("points:")
    lines += [
        f"  - {{{point}, time_from_start: {{sec: {whole // NANO}, nanosec: {whole % NANO}}}}}"
        for point, whole in zip(points, since, strict=True)
    ]
    return joined([*lines, "..."])


def _points(robot: Robot, rows: RobotRows, qd: Array) -> list[str]:
    """Positions and speeds of all points."""
    q = to_numbers(of_model(robot), rows.q, decimals=DECIMALS, angle=Angle.RADIANS)
    if not np.all(np.abs(qd) < LARGEST):
        raise InputError(f"robot '{robot.name}': expected speeds below {LARGEST:g}, got one that is too large")
    qd = np.rint(qd * 10.0**DECIMALS) / 10.0**DECIMALS + 0.0
    numbers = ", ".join([f"%.{DECIMALS}f"] * q.shape[1])
    point = f"positions: [{numbers}], velocities: [{numbers}]"
    return [point % tuple(row) for row in np.concatenate([q, qd], axis=1).tolist()]


ROS2: Final[Dialect] = Dialect(
    name="ros2",
    title="ROS 2 JointTrajectory messages as YAML",
    render=render_ros2,
    read=read_ros2,
    decimals=DECIMALS,
    promises=(Promise.TIMED,),
    interpolation=Interpolation.CUBIC,
    split=MOST_POINTS,
    demands=_demands,
)
