"""Dialect: what a program format is, and the one signature that all formats share."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, Interpolation, Moves, ProgramRows, Promise, RobotRows
from cellplan.model.settings.controllers import KindName
from cellplan.programs.elements.joints import Axes

SHARES: Final = (0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.0)  # [-] of a segment, the largest first
Render = Callable[[ExportJob], dict[str, str]]
Read = Callable[[ExportFrame, Mapping[str, str]], tuple[ProgramRows, ...]]
# the rows of its longest program are counted, which takes the time to read them, where it is called
Demands = Callable[[ExportFrame, Callable[[], int]], Iterator[Callable[[], object]]]


def no_demands(_frame: ExportFrame, _rows: Callable[[], int]) -> Iterator[Callable[[], object]]:
    """Those of a format that needs nothing of the cell."""
    return iter(())


@dataclass(frozen=True, slots=True, kw_only=True)
class Dialect:
    """A program format."""

    name: str  # name of the format
    title: str  # what it is, in a few words, for help and reports
    render: Render  # text of every file of a job, by its path in the folder of the export
    # what a reader of its own finds in these files: the rows of each program, in the order of the frame. It knows no
    # row beforehand. Raises ``InputError`` with file and line where a text is not such a file.
    read: Read
    # of a degree, radian or millimetre in these files. Where ``kinds`` is not empty, so that the format is the language
    # of a controller, a robot may state its own.
    decimals: int
    promises: tuple[Promise, ...]  # what the format can hold, the best first
    interpolation: Interpolation = Interpolation.LINEAR  # how its target moves the joints between two rows
    kinds: frozenset[KindName] = field(default_factory=frozenset)  # controllers that play it; empty for any
    at_cycle: bool = False  # whether rows lie on the cycle of the controller
    # whether rows may be left out, as the target moves evenly between those that are written; not those that lie on the
    # cycle of the controller
    is_thinned: bool = False
    # whether its files round rows within a share of their segments; not those on the cycle either
    is_rounded: bool = False
    shares: tuple[float, ...] = SHARES  # of its segments within which a row may be rounded, the largest first, 0 last
    # distance from a corner in [m] below which files state none within which it is rounded
    smallest_zone: float = 0.0
    sets_steps: bool = False  # whether its programs set a step register at their marks, see ``elements.escapes``
    lags: bool = False  # whether the target follows with a latency, which must be stated before ``timed`` is promised
    most_arms: int | None = None  # arms that its programs can move in step; None for any number
    split: int | None = None  # most rows of a file or routine; None for no limit
    shortest_time: float = 0.0  # shortest time in [s] between two rows that targets are known to keep; 0 for no limit
    is_proved: bool = False  # whether that time is documented by the maker, not only known from practice
    has_part_targets: bool = False  # whether rows can be poses of tools on the part while robots move in step
    has_seams_in_step: bool = False  # or whether the tool of the only arm then moves on lines and arcs in its frame
    has_joint_seams: bool = False  # whether points of these are stated as joints of all robots
    frame_numbers: tuple[int, int] | None = None  # smallest and largest of the frames that paced programs need
    repeats_seams: bool = False  # whether its programs may pass a seam more than once
    moves: tuple[Moves, ...] = (Moves.JOINTS,)  # how its programs can move tools where they work
    # configuration of arms as its targets state it, for joints in [rad] or [m], shape (N, n) to (N, k); an
    # ``InputError`` for an arm that has none. None where targets state none.
    configuration: Callable[[Robot, Array], NDArray[np.int_]] | None = None
    # speed of joints on the way to each row of a robot as files state it, shape (N,); None where they state none
    speeds: Callable[[Robot, RobotRows], Array] | None = None
    # what its programs need of the cell, as calls that raise ``InputError`` where it is not there; all of them are made
    # before anything is computed
    demands: Demands = no_demands

    def states_poses(self, frame: ExportFrame) -> bool:
        """Whether rows of robots in step are stated as poses of their tools on the part, one by one."""
        return self.has_part_targets and frame.has_part_targets

    def has_seams(self, frame: ExportFrame) -> bool:
        """Whether tools move on lines and arcs in an export."""
        in_step = frame.promise is Promise.SYNCHRONISED and frame.moves is not Moves.JOINTS
        return frame.promise is Promise.PACED or (in_step and self.has_lines_of(map(frame.robot, frame.robots)))

    def has_lines_of(self, robots: Iterable[Robot]) -> bool:
        """Whether tools move on lines and arcs where these robots move in step."""
        return self.has_seams_in_step and sum(bool(Axes.of(robot).arm) for robot in robots) == 1
