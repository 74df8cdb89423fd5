"""URScript with seams: movel and movec at a stated speed in a frame of the part, a routine for each seam.

Tool, frames and points are declared with names: ``j_12`` for joints, ``NAME_2`` for poses of the routine ``NAME``.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import floor
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.conventions import CONVENTIONS
from cellplan.programs.elements.frames import on_flange
from cellplan.programs.elements.paced import Events, Move, blocks
from cellplan.programs.elements.text import fixed, safe_names
from cellplan.programs.formats.urscript.rows import (
    BLEND_SHARE,
    BLEND_TICK,
    SMALLEST_BLEND,
    move_acceleration,
    move_speeds,
)
from cellplan.programs.formats.urscript.text import (
    LONGEST_NAME,
    RESERVED,
    approach_call,
    function_names,
    signal_lines,
)
from cellplan.programs.formats.zones import shares_off_seams, tool_zones

TOOL_ACCELERATION: Final = 1.2  # [m/s^2] of lines and arcs: that of the language
SPEED_DECIMALS: Final = 6  # of a metre in a second
RADIUS_DECIMALS: Final = 6  # of a metre
POSE_DECIMALS: Final = 9  # of a metre and of a radian
UR: Final = CONVENTIONS["ur"]
PART: Final = "part_"  # and the number of the station, from 1
DATA: Final = rf"(?:j|page|{PART.rstrip('_')})_[0-9]+"


def urscript_events(frame: ExportFrame, robot: str) -> Events:
    """What stands between the moves of a robot; a wait for a signal is one text of three lines."""
    return Events(
        frame=frame,
        robot=robot,
        signal=lambda step: "\n".join(signal_lines(step)),
        wait=lambda seconds: f"sleep({fixed(seconds, 3)})",
        plain=lambda text: "".join(text.split()),
    )


def routine_names(frame: ExportFrame, robot: str) -> dict[str, str]:
    """Name of the routine of each task of a robot."""
    tasks = [task.name for task in frame.cell.tasks if task.robot == robot]
    form = urscript_events(frame, robot).form
    reserved = {*RESERVED, *function_names(frame).values(), *(form.routines if form else ())}
    return safe_names(tasks, longest=LONGEST_NAME, reserved=reserved, data=DATA)


def pose_text(X: Array) -> str:
    """A pose ``p[x, y, z, rx, ry, rz]`` in metres with a rotation vector, of one in [m], shape (4, 4)."""
    numbers = UR.numbers(X) / np.array([MM] * 3 + [1.0] * 3)
    return f"p[{', '.join(fixed(number, POSE_DECIMALS) for number in numbers.tolist())}]"


def frame_lines(frame: ExportFrame, robot: Robot) -> list[str]:
    """The tool, and the frames of the part, as the cell has them."""
    lines = [f"set_tcp({pose_text(on_flange(robot, robot.tool.X_FT))})"]
    for number, station in enumerate(frame.stations.get(robot.name, ()), start=1):
        if station.X is not None and station.holder is None:
            lines.append(f"{PART}{number} = {pose_text(station.X)}")
    return lines


def part_name(frame: ExportFrame, robot: str, task: str) -> str:
    """Name of the frame in which a robot works on a task."""
    return f"{PART}{frame.stations[robot].index(frame.station(robot, task)) + 1}"


def joint_radii(robot: Robot, moves: Sequence[Move], rows: RobotRows) -> Array:
    """Radius of each row of joints in [m], shape (N,); rows beside a seam are stops."""
    shares = shares_off_seams(moves, rows)
    radii = np.floor(BLEND_SHARE * tool_zones(robot, rows.q, shares) / BLEND_TICK) * BLEND_TICK
    return np.where(radii >= SMALLEST_BLEND, radii, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeamWriter:
    """The lines of a robot in a program."""

    frame: ExportFrame
    robot: Robot
    rows: RobotRows
    moves: Sequence[Move]
    names: Mapping[str, str]  # of the routine of each task
    stems: Mapping[str, str]  # with which names of its points begin

    def point(self, row: int) -> str:
        """Name of the point of a row."""
        seam = next((seam for seam in self.rows.seams if seam.first < row <= seam.last), None)
        return f"j_{row + 1}" if seam is None else f"{self.stems[seam.task]}_{row - seam.first}"

    def lines(self, joints: Sequence[str]) -> list[str]:
        """Declarations, routines and what calls them; ``joints`` are those of each row as they are written."""
        on_seam, poses = self.rows.on_seam, self.rows.X_PT
        lines = frame_lines(self.frame, self.robot)
        for row, text in enumerate(joints):
            lines.append(f"{self.point(row)} = {text if poses is None or not on_seam[row] else pose_text(poses[row])}")
        events = urscript_events(self.frame, self.robot.name)
        main = [line for text in events.before(bool(self.rows.marks)) for line in text.split("\n")]
        for seam, moves in blocks(self.moves):
            if seam is None:
                main += self._block(events, None, moves)
                continue
            name = self.names[seam.task]
            lines += [f"def {name}():", *(f"  {line}" for line in self._block(events, seam.task, moves)), "end"]
            main.append(f"{name}()")
        return [*lines, *main]

    def _block(self, events: Events, task: str | None, moves: Sequence[Move]) -> Iterator[str]:
        """The moves of a routine, and what stands after each."""
        speeds, radii = move_speeds(self.robot, self.rows), joint_radii(self.robot, self.moves, self.rows)
        acceleration = f"a={move_acceleration(self.robot):.3f}"
        for move in moves:
            if move.is_tool and task is not None:
                yield self._tool_move(move, task)
            else:
                call = approach_call() if move.row == 0 else f"{acceleration}, v={speeds[move.row]:.3f}"
                radius = f", r={radii[move.row]:.4f}" if radii[move.row] > 0.0 else ""
                yield f"movej({self.point(move.row)}, {call}{radius})"
            for text in events.texts(task, move.switches):
                yield from text.split("\n")

    def _tool_move(self, move: Move, task: str) -> str:
        """A line or an arc of the tool."""
        part = part_name(self.frame, self.robot.name, task)
        radius = floor(move.zone * 10**RADIUS_DECIMALS) / 10**RADIUS_DECIMALS
        rows = [move.row] if move.middle is None else [move.middle, move.row]
        points = ", ".join(f"pose_trans({part}, {self.point(row)})" for row in rows)
        call = f"a={TOOL_ACCELERATION:.3f}, v={fixed(move.feed, SPEED_DECIMALS)}, r={fixed(radius, RADIUS_DECIMALS)}"
        return f"movel({points}, {call})" if move.middle is None else f"movec({points}, {call}, mode=0)"
