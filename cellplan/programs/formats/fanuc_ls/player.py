"""A TP program followed statement by statement, its pages and programs of seams in the places of their calls."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.units import MM
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.fanuc_ls.groups import MotionGroup, TpProgram, seam_name
from cellplan.programs.formats.fanuc_ls.seams import COORD, MOST_FEED, MOST_REGION
from cellplan.programs.formats.fanuc_ls.text import TpFile, TpPoint, read_file

MOST_MS: Final = 32_000  # [ms] of a motion
MILLISECONDS: Final = {"msec": 1.0, "sec": 1000.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class TpMotion:
    """A motion that a program makes, and the statements behind it."""

    statement: Statement
    points: tuple[TpPoint, ...] = ()  # its point, and before it that through which an arc leads
    duration: float = 0.0  # [ms]; 0 where none is stated
    speed: float = math.nan  # of a motion of joints in [%]; NaN where none is stated
    feed: float | None = None  # of the tool in [m/s], NaN for that of the weld data; None for a motion of joints
    region: float = 0.0  # of its corner in [mm]
    is_passed: bool = False  # whether a motion of joints ends in CNT
    suffix: str = ""
    task: str | None = None  # in whose seam it is
    behind: list[Statement] = field(default_factory=list)


@dataclass(slots=True, kw_only=True)
class TpPlayer:
    """Follows a program."""

    frame: ExportFrame
    program: TpProgram
    motions: list[TpMotion] = field(default_factory=list)
    before: list[Statement] = field(default_factory=list)  # statements before the first motion
    settings: set[tuple[str, int]] = field(default_factory=set)  # frames that are selected, by group
    passes: dict[str, int] = field(default_factory=dict)  # how often the seam of each task was passed
    pages: int = 0  # that were called
    unused: dict[int, TpPoint] = field(default_factory=dict)  # points of the file that are still to come
    is_fresh: bool = True  # whether frames may be selected: no motion of the file came before
    task: str | None = None  # whose seam is passed

    @property
    def in_step(self) -> bool:
        """Whether groups move in step."""
        return self.frame.promise is Promise.SYNCHRONISED

    def play_all(self, left: dict[str, str]) -> None:
        """Follow the main program; all files are taken out of those that are left."""
        main = self._opened(left, self.program.name)
        for statement in main.statements:
            name = f"{self.program.name}_{self.pages + 1:03d}"
            if statement.kind == "CALL" and statement.words[0] == name and not self.unused:
                if self.motions and not self.pages:
                    raise statement.error("no call of a page in a program with motions of its own")
                self.pages += 1
                page = self._opened(left, name)
                for inner in page.statements:
                    self._play(inner, left)
                self._close(page)
            elif self.pages:
                raise statement.error("nothing but calls of pages behind the first one")
            else:
                self._play(statement, left)
        self._close(main)
        if not self.motions:
            raise main.end.error("at least one motion", "none")

    def _opened(self, left: dict[str, str], name: str) -> TpFile:
        """A file whose points are those of the groups."""
        file, groups = read_file(left, name), {group.number for group in self.program.groups}
        if file.groups != groups:
            listed = ", ".join(map(str, sorted(groups)))
            raise file.head.error(f"DEFAULT_GROUP of motion group {listed}", ", ".join(map(str, sorted(file.groups))))
        for point in file.points.values():
            if set(point.poses) != groups:
                raise point.statement.error(f"GP{', GP'.join(map(str, sorted(groups)))}, and no other group")
        self.unused, self.is_fresh = dict(file.points), True
        return file

    def _play(self, statement: Statement, left: dict[str, str]) -> None:
        """Follow one statement."""
        task = self._called(statement)
        if statement.kind in {"J", "L", "C"}:
            self._move(statement)
        elif statement.kind in {"UFRAME", "UTOOL"}:
            self._select(statement)
        elif task is not None:
            self._seam(statement, task, left)
        elif (self.in_step or statement.kind == "CALL") and self.task is None:
            raise statement.error("motions, the selection of frames, and calls of pages and seams in their order")
        elif self.motions and (self.motions[-1].is_passed or self.motions[-1].region):
            raise statement.error("FINE before it", f"{statement.text} behind CNT or CR")
        else:
            (self.motions[-1].behind if self.motions else self.before).append(statement)

    def _called(self, statement: Statement) -> str | None:
        """Task of the seam that a statement calls."""
        if statement.kind != "CALL" or self.task is not None:
            return None
        names = {seam_name(self.program, task, 1 + self.passes.get(task, 0)): task for task in self.program.seams}
        return names.get(str(statement.words[0]))

    def _seam(self, statement: Statement, task: str, left: dict[str, str]) -> None:
        """The program of a seam, in the place of its call."""
        if self.motions and self.motions[-1].is_passed:
            raise statement.error("FINE before a seam", "CNT")
        rest, first = self.unused, len(self.motions)
        self.task, self.settings, self.passes[task] = task, set(), 1 + self.passes.get(task, 0)
        file = self._opened(left, str(statement.words[0]))
        for inner in file.statements:
            self._play(inner, left)
        self._close(file)
        if len(self.motions) < first + 2:
            raise file.end.error("a point at which the seam is entered, and a line or an arc", "/END")
        self.unused, self.task, self.settings, self.is_fresh = rest, None, set(), True

    def _select(self, statement: Statement) -> None:
        """A frame of a group, before the first motion of a file or behind a seam."""
        number, value = int(statement.words[0] or 1), int(statement.words[1] or 0)
        group = next((group for group in self.program.groups if group.number == number), None)
        key = (statement.kind, number)
        if group is None or key in self.settings or not self.is_fresh:
            raise statement.error("the frames of each group, each once before the first motion")
        stated = self._base(group) if statement.kind == "UFRAME" else group.tool
        if value != stated:
            raise statement.error(f"{statement.kind}_NUM={stated} as the cell states it")
        self.settings.add(key)

    def _base(self, group: MotionGroup) -> int:
        """Number of the user frame of a group: that of the station in a seam, unless groups move in step."""
        if self.task is None or self.in_step:
            return group.base
        return self.frame.station(group.robot.name, self.task).number or group.base

    def _move(self, statement: Statement) -> None:
        """A motion to a point of the file, on an arc through one more, that were not used before."""
        is_joint, groups = statement.kind == "J", self.program.groups
        if len(self.settings) < 2 * len(groups):
            raise statement.error("UFRAME_NUM and UTOOL_NUM of each group before the first motion")
        if is_joint is not (self.is_fresh or self.task is None):
            raise statement.error("J outside of seams and at their first point, L and C behind it")
        names, motion = _motion(statement, is_timed=self.in_step and bool(self.motions))
        if self.in_step and not is_joint:
            coordinated, _, rest = motion.suffix.partition(" ")
            if coordinated != COORD:
                raise statement.error(f"{COORD} behind a line or an arc of groups in step")
            motion = replace(motion, suffix=rest.strip())
        points = tuple(point for number, _ in names if (point := self.unused.pop(number, None)) is not None)
        if len(points) < len(names):
            raise statement.error("points of this file, each once")
        for point, (number, name) in zip(points, names, strict=True):
            if name not in {"", point.name}:
                raise statement.error(f"P[{number}] with the name of the point, '{point.name}', or with none", name)
            for group in groups:
                _require_pose(point, group, self._base(group), is_joint=is_joint or self.in_step)
        self.motions.append(replace(motion, points=points, task=self.task))
        self.is_fresh = False

    def _close(self, file: TpFile) -> None:
        """Make sure that a file ends in order."""
        for number, point in self.unused.items():
            raise point.statement.error("points that are used", f"P[{number}]")
        if self.motions and (self.motions[-1].is_passed or self.motions[-1].region):
            raise file.end.error("FINE at the last point", "CNT or CR")


def _motion(statement: Statement, *, is_timed: bool) -> tuple[list[tuple[int, str]], TpMotion]:
    """Numbers and names of the points of a motion, and how it leads there."""
    if statement.kind != "J":
        *points, speed, ending, suffix = statement.words
        region = 0.0 if ending == "FINE" else float(str(ending).removeprefix("CR"))
        feed = math.nan if speed is None else float(speed) / MM
        if region > MOST_REGION or not (math.isnan(feed) or 0.0 < MM * feed <= MOST_FEED):
            raise statement.error(f"a speed up to {MOST_FEED:g} mm/sec, and FINE or CR0 to CR{MOST_REGION}")
        motion = TpMotion(statement=statement, feed=feed, region=region, suffix=suffix or "")
        return _names(points), motion
    point, speed, unit, ending, suffix = statement.words
    if (unit in MILLISECONDS) is not is_timed:
        raise statement.error("a duration in sec or msec" if is_timed else "a speed in %", f"{speed}{unit}")
    value = float(str(speed)) * MILLISECONDS.get(str(unit), 1.0)
    if not (0.0 < value <= MOST_MS if is_timed else value in range(1, 101)):
        raise statement.error(f"1 to {MOST_MS} ms" if is_timed else "a whole speed of 1 to 100 %", f"{speed}{unit}")
    if ending != "FINE" and int(str(ending).removeprefix("CNT")) > 100:
        raise statement.error("FINE, or CNT0 to CNT100", ending)
    motion = TpMotion(statement=statement, is_passed=ending != "FINE", suffix=suffix or "")
    return _names([point]), replace(motion, duration=value) if is_timed else replace(motion, speed=value)


def _names(points: Sequence[str | None]) -> list[tuple[int, str]]:
    """Numbers of points with their names, which are empty where only the number stands."""
    return [(int(number), name) for number, _, name in (str(point).partition(":") for point in points)]


def _require_pose(point: TpPoint, group: MotionGroup, base: int, *, is_joint: bool) -> None:
    """A point is stated as its motion needs it, in the frames that are selected."""
    pose = point.poses[group.number]
    if (pose.base, pose.tool) != (base, group.tool):
        raise point.statement.error(f"UF : {base}, UT : {group.tool} of GP{group.number}")
    expected = group.axes if is_joint else group.pose_axes
    if list(pose.axes.items()) != list(expected.items()) or bool(pose.configuration) is is_joint:
        axes = ", ".join(f"{name} in {unit}" for name, unit in expected.items())
        raise point.statement.error(f"{'' if is_joint else 'CONFIG, '}{axes} of GP{group.number}, and no other axis")
