"""INFORM: a main job for each robot, and a job for each of its seams in a user frame of the part.

All positions are poses of the tool with the configuration of the arm, also those of joint motions, as no model knows
the pulses of an axis. An arc is three motions: to its start, where the tool is already, through a point, and to its
end; between arcs of two circles stands a line to the point where they meet, and an arc that goes on along the circle of
the one before has no start.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError, NotVerifiedError, raise_findings, refusals
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportJob, Moves, ProgramRows, Promise, RobotRows, Seam
from cellplan.programs.elements.conventions import convention_of
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.paced import NO_SHAPE, Events, Move, blocks, moves_of, shorter_lengths
from cellplan.programs.elements.pages import PagedProgram, paged, percentages, robots_of
from cellplan.programs.elements.text import ascii_text, comment, fixed, joined
from cellplan.programs.formats.inform.jobs import (
    FRAMES,
    KIND,
    JobFrame,
    demands,
    inform_events,
    job_names,
    level_radii,
    speed_text,
)
from cellplan.programs.formats.inform.positions import (
    REAR,
    STATED,
    WIDTH,
    are_on_one_circle,
    configuration,
    joints_of,
    tool_pose,
)
from cellplan.programs.formats.inform.reader import read_inform
from cellplan.programs.formats.inform.text import COMMENT, MOST

DECIMALS: Final = 3  # of a millimetre; degrees have one more
SAME_JOINTS: Final = 1e-4  # [rad] within which a pose and a configuration must give the joints that are meant
PASSED: Final = "PL=1"
ARCS: Final = 5  # points of two arcs that meet
SHARES: Final = (LARGEST_SHARE, 0.0)  # PL=1 and PL=0 of joints: how far a level rounds is set at each controller
DATE: Final = "2000/01/01 00:00"  # the same rows give the same bytes
LINE_END: Final = "\r\n"


def render_inform(job: ExportJob) -> dict[str, str]:
    """Text of every file by its path: ``ROBOT.JBI``, and ``TASK.JBI`` for each seam."""
    raise_findings(refusals(*demands(job.frame)))
    mains, _ = job_names(job.frame)
    files: dict[str, str] = {}
    for program in job.programs:
        for robot in robots_of(job.frame, INFORM):
            files |= _RobotWriter.of(job, program, robot, mains[program.name, robot]).files()
    return files


@dataclass(slots=True, kw_only=True, eq=False)
class Job:
    """A job while it is written; ``stated`` is the configuration of its last position."""

    name: str
    frame: JobFrame
    decimals: int
    positions: list[str] = field(default_factory=list)  # with the lines of their configurations
    statements: list[str] = field(default_factory=list)
    count: int = 0  # of its positions
    stated: str = ""

    def position(self, X: Array, numbers: Sequence[int]) -> str:
        """Add a pose in its frame in [m] with a configuration; its name."""
        stated = ",".join(map(str, [*numbers, *[0] * (WIDTH - STATED)]))
        if stated != self.stated:
            self.positions.append(f"///RCONF {stated}")
            self.stated = stated
        pose = convention_of(KIND).numbers(X)
        half = fixed(-180.0, self.decimals + 1)  # a half turn is a positive one, whatever rounding makes of it
        fields = [fixed(number, self.decimals + (place >= 3)) for place, number in enumerate(pose.tolist())]
        fields = [field.removeprefix("-") if field == half else field for field in fields]
        name, self.count = f"C{self.count:05d}", self.count + 1
        self.positions.append(f"{name}={','.join(fields)}")
        return name

    def joints(self, robot: Robot, q: Array, where: str) -> str:
        """Add the pose of a robot from which joints in [rad], shape (6,), are solved again; its name."""
        X_WT, stated = tool_pose(robot, q), configuration(robot, q[None])[0]
        solved = joints_of(robot, X_WT, stated)
        if stated[REAR] or solved is None or np.abs(solved - q).max() > SAME_JOINTS:
            reason = "the wrist is behind axis S" if stated[REAR] else "the wrist is straight, or an axis on an edge"
            raise NotVerifiedError(
                [
                    f"robot '{robot.name}', {where}: pose and configuration do not tell its joints, as "
                    f"{reason}, and INFORM states joints in pulses only: lead the motion elsewhere (home, via)"
                ]
            )
        return self.position(inverse(self.frame.X_WC) @ X_WT, stated.tolist())

    def text(self, remark: str, notes: Sequence[str]) -> str:
        """Its text."""
        frame, heads = self.frame, list[str]()
        if self.count > MOST:
            raise InputError(f"{self.name}.JBI: expected at most {MOST} positions in a job, got {self.count}")
        if self.count:
            user = [] if frame.number is None else [f"///USER {frame.number}"]
            kind = "ROBOT" if frame.number is None else "USER"
            heads = [*user, f"///TOOL {frame.tool}", f"///POSTYPE {kind}", "///RECTAN"]
        lines = ["/JOB", f"//NAME {self.name}", "//POS", f"///NPOS {self.count},0,0,0,0,0", *heads, *self.positions]
        lines += ["//INST", f"///DATE {DATE}", f"///COMM {remark}", "///ATTR SC,RW,RJ", f"///FRAME {frame.name}"]
        lines += [f"///GROUP1 RB{frame.group}", "NOP", *notes, *self.statements, "END"]
        return joined(lines, line_end=LINE_END)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _RobotWriter:
    """The jobs of one robot in a program."""

    job: ExportJob
    part: PagedProgram
    rows: RobotRows
    moves: tuple[Move, ...]
    events: Events
    levels: NDArray[np.int_]  # position level of each row, shape (N,)
    configurations: np.ndarray  # of all rows, shape (N, 6)

    @classmethod
    def of(cls, job: ExportJob, program: ProgramRows, robot: str, name: str) -> "_RobotWriter":
        """Those of a program.

        Lines and arcs take the largest position level that rounds no more than is allowed. Where its distance is not
        known, and for motions of joints, a row is rounded where half of both of its segments may be cut.
        """
        part, radii = paged(job, INFORM, program, robot, name), level_radii(job.frame, robot)
        levels = (part.shares >= LARGEST_SHARE).astype(int)
        rounding = LARGEST_SHARE * levels
        if len(radii) and part.rows.X_PT is not None:
            lengths, on_seam = shorter_lengths(part.rows.X_PT[:, :3, 3]), part.rows.on_seam
            levels = np.where(on_seam, np.searchsorted(radii, part.shares * lengths, side="right"), levels)
            zones = np.append([0.0], radii)[levels] / np.maximum(lengths, NO_SHAPE)
            rounding = np.where(on_seam, zones, rounding)
        rows = replace(part.rows, rounding=rounding)
        events = inform_events(job.frame, robot)
        return cls(
            job=job,
            part=part,
            rows=rows,
            moves=moves_of(job, replace(program, robots={**program.robots, robot: rows}), events),
            events=events,
            levels=levels,
            configurations=configuration(part.placed, rows.q),
        )

    def files(self) -> dict[str, str]:
        """Text of its files."""
        _, names = job_names(self.job.frame)
        robot = self.part.placed
        main = Job(name=self.part.name, frame=JobFrame.of(robot, None), decimals=self._decimals)
        main.statements += self.events.before(bool(self.rows.marks))
        jobs = [main]
        for seam, moves in blocks(self.moves):
            if seam is None:
                self._add(main, None, moves)
                continue
            station = self.job.frame.station(robot.name, seam.task)
            jobs.append(Job(name=names[seam.task], frame=JobFrame.of(robot, station), decimals=self._decimals))
            main.statements.append(f"CALL JOB:{jobs[-1].name}")
            self._add(jobs[-1], seam, moves)
        if len({one.name for one in jobs}) < len(jobs):
            raise InputError(f"robots.{robot.name}: expected one seam of each task, as its job is named after it")
        notes = [line for note in self.part.notes for line in comment(note, "'", forbidden="'", longest=COMMENT - 2)]
        remark = ascii_text(self.job.frame.cell.name)[:COMMENT].strip()
        return {f"{one.name}.JBI": one.text(remark, notes if one is main else []) for one in jobs}

    @property
    def _decimals(self) -> int:
        """Decimals of a millimetre."""
        return self.part.decimals

    def _add(self, job: Job, seam: Seam | None, moves: Sequence[Move]) -> None:
        """Motions of a block, each with what follows it."""
        before: Move | None = None
        for move in moves:
            if move.is_tool and seam and before:
                job.statements += self._tool_motions(job, seam, before, move)
            else:
                job.statements.append(self._joint_motion(job, move))
            job.statements += self.events.texts(None if seam is None else seam.task, move.switches)
            before = move

    def _joint_motion(self, job: Job, move: Move) -> str:
        """A motion of joints, to a pose from which they are solved again."""
        point = job.joints(self.part.placed, self.rows.q[move.row], f"row {move.row + 1}")
        return f"MOVJ {point} VJ={fixed(self.part.speeds[move.row], 2)} {self._level(move)}"

    def _tool_motions(self, job: Job, seam: Seam, before: Move, move: Move) -> Iterator[str]:
        """A line, or the motions of an arc."""
        speed = f"V={speed_text(move.feed, seam.task)}"
        if move.middle is not None and self._goes_on(job, seam, before, move):
            yield f"MOVC {self._point(job, seam, move.middle)} {speed} {PASSED}"
        elif move.middle is not None:
            if before.middle is not None:
                yield f"MOVL {self._point(job, seam, before.row)} {speed} {self._level(before)}"
            yield f"MOVC {self._point(job, seam, before.row)} {speed} {self._level(before)}"
            yield f"MOVC {self._point(job, seam, move.middle)} {speed} {PASSED}"
        kind = "MOVL" if move.middle is None else "MOVC"
        yield f"{kind} {self._point(job, seam, move.row)} {speed} {self._level(move)}"

    def _goes_on(self, job: Job, seam: Seam, before: Move, move: Move) -> bool:
        """Whether an arc goes on along the circle of the one before, with no statement between and as fast."""
        if before.middle is None or before.feed != move.feed or not job.statements[-1].startswith("MOVC"):
            return False
        return are_on_one_circle(
            np.array([self._pose(job, seam, row)[:3, 3] for row in range(move.row - ARCS + 1, move.row + 1)])
        )

    def _level(self, move: Move) -> str:
        """The position level at the end of a motion."""
        return f"PL={self.levels[move.row]}"

    def _point(self, job: Job, seam: Seam, row: int) -> str:
        """The position of a row of a seam."""
        return job.position(self._pose(job, seam, row), self.configurations[row].tolist())

    def _pose(self, job: Job, seam: Seam, row: int) -> Array:
        """The tool at a row of a seam, in the frame of its job."""
        X_PT = self.rows.X_PT
        if row > seam.first and X_PT is not None:
            return X_PT[row]
        return inverse(job.frame.X_WC) @ tool_pose(self.part.placed, self.rows.q[row])


INFORM: Final = Dialect(
    name="inform",
    title="Yaskawa INFORM jobs, lines and arcs in user frames",
    render=render_inform,
    read=read_inform,
    decimals=DECIMALS,
    promises=(Promise.PACED, Promise.SEQUENCE_ONLY),
    kinds=frozenset({KIND}),
    is_thinned=True,
    is_rounded=True,
    shares=SHARES,
    demands=demands,
    moves=tuple(Moves),
    configuration=configuration,
    frame_numbers=FRAMES,
    speeds=percentages,
)
