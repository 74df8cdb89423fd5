"""What is exported: rows of joint positions as a target holds them, and what may be promised of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot


class Promise(StrEnum):
    """What holds when controllers play the programs."""

    TIMED = "timed"
    SYNCHRONISED = "synchronised"
    PACED = "paced"
    SEQUENCE_ONLY = "sequence only"

    @property
    def waits(self) -> bool:
        """Whether robots share no clock: they wait for one another at marks."""
        return self in {Promise.PACED, Promise.SEQUENCE_ONLY}


class Interpolation(StrEnum):
    """How a target moves its joints from one row to the next."""

    LINEAR = "linear"
    CUBIC = "cubic"


class Moves(StrEnum):
    """How a program moves a tool where it works: by its joints, or straight and on circles in a frame of the part."""

    JOINTS = "joints"
    LINEAR = "linear"
    AUTO = "auto"  # linear where it can be


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Station:
    """A frame in which tools of a robot work.

    Attributes:
        tasks: Names of the tasks, in the order of work.
        number: Its number on the controller; None where none is stated.
        holder: Name of the robot of the same controller whose flange moves it; None for a fixed frame.
        X: The part in the base of the controller, or in the flange of the holder as the controller has it, in [m]; None
            where another controller moves the part while the tool works, so that no frame has it.
        X_W: A fixed frame in the world in [m]; None for any other.
    """

    tasks: tuple[str, ...]
    number: int | None = None
    holder: str | None = None
    X: Array | None = None
    X_W: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Seam:
    """Rows of a robot that its tool passes on lines and arcs in the frame of a part that rests."""

    task: str  # name of the task
    first: int  # the row at which it is entered, stated as joints
    last: int  # its last row, stated as a pose of the tool as all between


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotRows:
    """Rows of one robot in a program."""

    robot: str  # name of the robot
    q: Array  # joint positions of the model in [rad] or [m], shape (N, n)
    # times of the rows in [s], from 0, shape (N,); None in what was read from a format that states none
    times: Array | None = None
    qd: Array | None = None  # joint velocities in [rad/s] or [m/s], shape (N, n); None where the format has none
    # whether its tool is in process from each row to the next, shape (N,); None where a format states none
    process: NDArray[np.bool_] | None = None
    # rows at which it waits for the other robots, in their order; as many for every robot of a program
    marks: tuple[int, ...] = ()
    stops: tuple[int, ...] = ()  # rows at which its tool stops on its path
    # share of the shorter neighbouring segment within which the target rounds each row, 0 for a stop, at most 0.5,
    # shape (N,). None stands for the share of the job in rows to be written, and for a format that states none in rows
    # that were read.
    rounding: Array | None = None
    # its tool tip in the part frame in [m], shape (N, 4, 4), where a row is stated as a target on the part; NaN in all
    # other rows, None where there is no such row. In what was read, ``q`` is NaN in these rows but for external axes.
    X_PT: Array | None = None
    # configuration of the arm that was read with each of these targets, shape (N, 4), as the format counts it; None
    # where none was read
    configuration: NDArray[np.int_] | None = None
    # stretches of rows that are passed on lines and arcs at a stated speed of the tool; empty for rows without any
    seams: tuple[Seam, ...] = ()
    # speed of the tool in [m/s] on the way to each row of a seam, shape (N,); NaN in all other rows, None without any
    feeds: Array | None = None
    # rows through which an arc leads to the next row, shape (N,); None for rows without any
    middles: NDArray[np.bool_] | None = None
    # time in [s] of the motion to each row as a file of single motions states it, shape (N,); NaN where it states none
    durations: Array | None = None
    # speed of the joints on the way to each row as a file states it, shape (N,), see ``Dialect.speeds``; NaN where it
    # states none
    speeds: Array | None = None
    # how far the robot may be from the even motion of its joints in each step, shape (N - 1, 4 + n): the tool on the
    # part and its tip in the world, in [m] and [rad] each, then the joints; None for a target that moves them evenly
    tube: Array | None = None

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.q)

    @property
    def on_seam(self) -> NDArray[np.bool_]:
        """Rows to which a line or an arc leads, shape (N,)."""
        flags = np.zeros(len(self.q), dtype=bool)
        for seam in self.seams:
            flags[seam.first + 1 : seam.last + 1] = True
        return flags


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramRows:
    """One program: what is played from begin to end."""

    name: str | None  # name of the program among several, that of its task; None for the only one
    robots: Mapping[str, RobotRows]  # rows by robot, in the order of the cell


@dataclass(frozen=True, slots=True, kw_only=True)
class ExportFrame:
    """All that a reader of exported files may know besides the files: no row of the program."""

    cell: Cell  # the cell, its starts filled in
    robots: tuple[str, ...]  # names of the robots that are exported, in the order of the cell
    programs: tuple[str | None, ...]  # names of the programs, in their order
    promise: Promise  # what is promised
    moves: Moves = Moves.JOINTS  # how tools move where they work
    split: int | None = None  # most rows of a file or of a routine; None for the limit of the format
    stations: Mapping[str, tuple[Station, ...]] = field(default_factory=dict)  # of robots with seams, by robot

    def robot(self, name: str) -> Robot:
        """A robot of the cell."""
        return self.cell.robot(name)

    @property
    def has_part_targets(self) -> bool:
        """Whether rows of robots that move in step are stated as poses of their tools on the part."""
        return self.moves is Moves.LINEAR and self.promise is Promise.SYNCHRONISED

    def station(self, robot: str, task: str) -> Station:
        """The frame in which a robot works on a task; its place among ``stations`` is its name in files."""
        return next(station for station in self.stations[robot] if task in station.tasks)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExportJob:
    """What a format writes."""

    frame: ExportFrame  # which robots and programs
    programs: tuple[ProgramRows, ...]  # rows of the programs, in their order
    # lines for the head of every file: promise, allowed skew, deviations, digest of the run; without the sign of a
    # comment, of any characters
    notes: tuple[str, ...] = ()
    # largest share of the shorter neighbouring segment, 0 to 0.5, within which a target may round rows; 0 for a stop at
    # each row. Which rows these are: ``export.corners``. Rows may state less for each of them.
    blend: float = 0.0
