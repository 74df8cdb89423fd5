"""What is exported: rows of joint positions as a target holds them, and what may be promised of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot


class Promise(StrEnum):
    """What holds when controllers play the programs."""

    TIMED = "timed"
    SYNCHRONISED = "synchronised"
    SEQUENCE_ONLY = "sequence only"


class Interpolation(StrEnum):
    """How a target moves its joints from one row to the next."""

    LINEAR = "linear"
    CUBIC = "cubic"


class Targets(StrEnum):
    """What a row of a program states."""

    JOINTS = "joints"
    PART = "part"


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

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.q)


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
    targets: Targets = Targets.JOINTS  # what rows state
    split: int | None = None  # most rows of a file or of a routine; None for the limit of the format

    def robot(self, name: str) -> Robot:
        """A robot of the cell."""
        return self.cell.robot(name)


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
