"""Cutter locations: points, tool axes and feeds as the statements of a file of CAM give them, one after the other."""

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NoReturn

import numpy as np

from cellplan.errors import InputError
from cellplan.files.cell.paths.csv_table import FARTHEST, METRES_PER_MM, MOST_POINTS, SHORTEST_AXIS
from cellplan.files.cell.paths.settings import CamSettings
from cellplan.files.input.files import read_regular_file, utf8_text
from cellplan.files.input.findings import listed, shown
from cellplan.model.settings.entry import FASTEST_MM_S
from cellplan.model.task.task import ProgrammedPath

MOST_BYTES: Final = 30_000_000  # 150 bytes for each of as many points as a path may have
MM_PER_INCH: Final = 25.4
SECONDS_PER_MINUTE: Final = 60.0
SAME_POINT_MM: Final = 1e-3  # points nearer to the one before are that point, written twice with rounding
SAME_AXIS: Final = 1e-6  # [-] tool axes that differ by less are one axis
LONGEST_NUMBER: Final = 40  # characters
UPRIGHT: Final = (0.0, 0.0, 1.0)  # tool axis of a file that has not stated another one
NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
RAPIDS: Final = "moves before the first feed and after the last"
REPEATED: Final = "repeated points"
_LINE: Final = re.compile(r"[^\n]*\n|[^\n]+")
_CONTROL: Final = re.compile(r"[^\t\n\x20-\x7e\x80-\U0010ffff]")
Point = tuple[float, float, float]


@dataclass(slots=True)
class Locations:
    """Where a tool is sent, and how fast; lengths in [mm], speeds in [mm/s]."""

    file: str
    points: list[Point] = field(default_factory=list)
    axes: list[Point] = field(default_factory=list)  # unit vectors from the tip to the spindle
    feeds: list[float | None] = field(default_factory=list)  # of the move to each point; None for a rapid
    lines: list[int] = field(default_factory=list)
    has_axes: bool = False  # whether the file states tool axes
    unused: Counter[str] = field(default_factory=Counter)  # statements that are not part of the path, by their word

    def refuse(self, line: int, text: str) -> NoReturn:
        """Refuse the file for a reason in one of its lines."""
        raise InputError(f"{self.file}:{line}: {text}")

    def move(self, line: int, point: Point, axis: Point, feed: float | None) -> None:
        """Send the tool to a point at a feed, or at rapid; a repeated point is counted, a turn on the spot refused."""
        for value in point:
            if not abs(value) <= FARTHEST:
                self.refuse(
                    line, f"expected coordinates of at most {FARTHEST:g} mm, got {value:.6g}; is the unit right?"
                )
        if self.points and math.dist(point, self.points[-1]) < SAME_POINT_MM:
            if math.dist(axis, self.axes[-1]) > SAME_AXIS:
                self.refuse(
                    line,
                    f"expected another point than that of line {self.lines[-1]}, got the same with another tool axis; "
                    "turn the tool along the way to the point",
                )
            self.unused[REPEATED] += 1
            return
        if len(self.points) >= MOST_POINTS:
            self.refuse(line, f"expected at most {MOST_POINTS} points, got more; cut the file in two")
        self.points.append(point)
        self.axes.append(axis)
        self.feeds.append(feed)
        self.lines.append(line)

    def unit_axis(self, line: int, vector: Point) -> Point:
        """A tool axis of length one."""
        length = math.hypot(*vector)
        if not SHORTEST_AXIS <= length <= 1.0 / SHORTEST_AXIS:
            self.refuse(line, f"expected a tool axis (I, J, K) with a length, got {length:.6g}")
        self.has_axes = True
        x, y, z = vector
        return x / length, y / length, z / length

    def feed(self, line: int, per_minute: float, unit: float) -> float:
        """A feed in [mm/s] of one per minute in a unit of so many [mm]."""
        feed = per_minute * unit / SECONDS_PER_MINUTE
        if not 0.0 < feed <= FASTEST_MM_S:
            self.refuse(line, f"expected a feed above 0 and up to {FASTEST_MM_S:g} mm/s, got {feed:.6g} mm/s")
        return feed

    def path(self, settings: CamSettings) -> ProgrammedPath:
        """The path from the begin of the first move at a feed to the end of the last one."""
        at_feed = [k for k, feed in enumerate(self.feeds) if k > 0 and feed is not None]
        if not at_feed:
            raise InputError(f"{self.file}: expected two points with a move at a feed between them, got none")
        first, last = at_feed[0] - 1, at_feed[-1]
        if left_out := first + len(self.points) - 1 - last:
            self.unused[RAPIDS] += left_out
        chosen = slice(first, last + 1)
        feeds = np.array([settings.transfer if feed is None else feed * METRES_PER_MM for feed in self.feeds[chosen]])
        R, p = settings.X_PF[:3, :3], settings.X_PF[:3, 3]
        return ProgrammedPath(
            source=self.file,
            points=np.array(self.points[chosen]) * METRES_PER_MM @ R.T + p,
            axes=-np.array(self.axes[chosen]) @ R.T if self.has_axes else None,
            rotations=None,
            is_smooth=False,
            is_closed=False,
            lines=tuple(self.lines[chosen]),
            speeds=feeds[1:],
            is_rapid=np.array([feed is None for feed in self.feeds[chosen]])[1:],
            rounding=settings.rounding,
            stop_angle=settings.stop_angle,
        )

    @property
    def remark(self) -> str:
        """What of the file is not part of the path; empty for nothing."""
        counted = [f"{word} ({number})" for word, number in sorted(self.unused.items())]
        return f"{self.file}: not part of the path: {listed(counted)}" if counted else ""


def file_lines(path: Path, file: str) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines of a file, one at a time; ``InputError`` where it is no text of sensible size."""
    text = utf8_text(read_regular_file(path, file=file, limit=MOST_BYTES), file=file).removeprefix("\ufeff")
    for line, match in enumerate(_LINE.finditer(text.replace("\r\n", "\n")), start=1):
        if wrong := _CONTROL.search(match.group()):
            raise InputError(f"{file}:{line}: expected plain text, got control character {ord(wrong.group()):#04x}")
        yield line, match.group().rstrip("\n")


def number(text: str) -> float | None:
    """A number with a decimal point; None for anything else."""
    return float(text) if NUMBER.fullmatch(text) and len(text) <= LONGEST_NUMBER else None


def wrong_number(text: str) -> str:
    """What is wrong with a text that should be a number."""
    return f"expected a number with a decimal point, got {shown(text)}"
