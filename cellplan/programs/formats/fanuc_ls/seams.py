"""Programs of seams: entered by joints, then lines and arcs of the tool in the user frame of its station.

Where a positioner moves in step, points are the joints of both groups, and the tool moves relative to it (``COORD``).
"""

from collections.abc import Sequence
from itertools import chain
from math import ceil
from typing import Final, NamedTuple

from cellplan.errors import InputError, LineRefusedError
from cellplan.geometry.arrays import Array
from cellplan.model.report.exported import ExportFrame, Seam
from cellplan.model.units import MM
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.paced import Events, Move
from cellplan.programs.elements.pages import PagedProgram
from cellplan.programs.elements.text import comment, fixed, safe_names
from cellplan.programs.formats.fanuc_ls.groups import MotionGroup, require_leader
from cellplan.programs.formats.fanuc_ls.output import TpText, frames, instruction, joint_pose, tool_pose
from cellplan.programs.formats.fanuc_ls.poses import configuration, configuration_text
from cellplan.programs.formats.fanuc_ls.text import COMMENT, REMARK

MOST_REGION: Final = 1000  # [mm] of a corner region
MOST_FEED: Final = 2000.0  # [mm/s]
WELD_SPEED: Final = "WELD_SPEED"
COORD: Final = "COORD"  # a motion of the tool relative to the group that leads
TRIGGER: Final = "TB "  # with which a motion says what it does some time before its end
ALMOST: Final = 1e-9  # [mm] that a region may miss a whole millimetre by


def tp_events(frame: ExportFrame, robot: str) -> Events:
    """What stands between the moves of a robot."""
    return Events(
        frame=frame,
        robot=robot,
        signal=instruction,
        wait=lambda seconds: f"WAIT {fixed(seconds, 2)}(sec)",
        plain=lambda text: "".join(text.split()),
        trigger=lambda lead, text: f"{TRIGGER}{fixed(lead, 2).removeprefix('0')}sec,{text}",
    )


def speed_is_held(events: Events, task: str, *, in_process: bool) -> bool:
    """Whether the data of the process hold the speed of a motion; they have one, not several feeds of a file."""
    has_data = events.form is not None and events.form.feed_in(task) is not None
    return in_process and has_data and events.frame.cell.task(task).has_one_feed


class SeamRows(NamedTuple):
    """What the programs of seams are made of."""

    frame: ExportFrame
    parts: Sequence[PagedProgram]  # of each group
    speeds: Sequence[str]  # with which each row is approached by joints
    shares: Array  # of the shorter line or arc, within which the rows of the arm may be rounded, shape (N,)

    @property
    def part(self) -> PagedProgram:
        """That of the arm."""
        return next(part for part in self.parts if part.rows.seams)

    def joints(self, groups: Sequence[MotionGroup], row: int, base: int | None) -> list[list[str]]:
        """A row as the joints of all groups, in a user frame or each in its own."""
        pairs = zip(groups, self.parts, strict=True)
        return [joint_pose(group, part.numbers[row], part.decimals, base) for group, part in pairs]


def write_seam(text: TpText, rows: SeamRows, seam: Seam, moves: Sequence[Move]) -> None:
    """Write the program of a seam from its moves, of which the first is one of joints."""
    frame, part = rows.frame, rows.part
    robot = part.placed.name
    events, task, in_step = tp_events(frame, robot), frame.cell.task(seam.task), len(text.groups) > 1
    number = None if in_step else frame.station(robot, task.name).number or text.groups[0].base
    names = [one.name for one in frame.cell.tasks if one.robot == robot]
    name = safe_names(names, longest=COMMENT - len("_999"))[task.name]
    notes = [f"task {task.name}"]
    if in_step:
        notes.append(f"COORD: leader GP{require_leader(frame, text.groups, task.name)}")
    if speed_is_held(events, task.name, in_process=True) and events.form is not None:
        notes.append(f"if {events.form.feed_in(task.name)} holds {MM * (task.feed or 0.0):g} mm/s")
    text.instructions += [line for note in notes for line in comment(note.replace(";", ","), "!", longest=REMARK - 1)]
    text.instructions += chain.from_iterable(frames(group, number) for group in text.groups)
    configs = [] if in_step else [configuration_text(row) for row in configuration(part.placed, part.rows.q)]
    for move in moves:
        if move.is_tool and part.rows.X_PT is not None:
            points = []
            for row in [move.row] if move.middle is None else [move.middle, move.row]:
                poses = (
                    rows.joints(text.groups, row, number)
                    if number is None
                    else [tool_pose(text.groups[0], part, row, part.rows.X_PT[row], base=number, config=configs[row])]
                )
                points.append(text.point(poses, f"{name}_{row - seam.first}"))
            speed, ending = _feed(events, task.name, move), _ending(move, rows.shares[move.row])
            options = [COORD] * in_step + [*move.triggers]
            motion = " ".join(["L" if move.middle is None else "C", "\n".join(points), speed, ending, *options])
        else:
            point = text.point(rows.joints(text.groups, move.row, number))
            motion = f"J {point} {rows.speeds[move.row]} FINE"
        suffix = (
            ""
            if events.form is None or move.process not in {"on", "off"}
            else events.form.suffix(move.process == "on", task.name)
        )
        text.instructions += [f"{motion}\n{suffix}".rstrip(), *events.texts(task.name, move.switches)]


def _ending(move: Move, share: float) -> str:
    """How a line or an arc ends: in a stop, or in a corner that begins some whole millimetres before the point.

    None begins before the middle of the shorter line, so that a larger number does no harm where all of it is allowed.
    """
    region = min(ceil(MM * move.zone) if share >= LARGEST_SHARE else int(MM * move.zone + ALMOST), MOST_REGION)
    if region < 1 and move.process == "inner" and move.seam is not None:
        raise LineRefusedError(
            move.seam.task,
            f": row {move.row + 1}: a corner in process may be rounded {MM * move.zone:.2g} mm before its point, less "
            "than a millimetre, and no row of the run is near enough for a point before it: allow more (tolerance), "
            "state a smaller step (motion.step_s), or divide the task there",
        )
    return f"CR{region}" if region else "FINE"


def _feed(events: Events, task: str, move: Move) -> str:
    """Speed of the tool: in [mm/s] with at most one decimal, or that of the data of the process."""
    if speed_is_held(events, task, in_process=move.process in {"inner", "off"}):
        return WELD_SPEED
    feed = MM * move.feed
    if not 0.0 < feed <= MOST_FEED or abs(feed - round(feed, 1)) > 1e-6:
        raise InputError(f"task '{task}': expected a feed up to {MOST_FEED:g} mm/s with one decimal, got {feed:g}")
    return f"{fixed(feed, 0 if abs(feed - round(feed)) < 1e-6 else 1)}mm/sec"
