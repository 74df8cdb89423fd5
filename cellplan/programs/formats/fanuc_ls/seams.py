"""Programs of seams: entered by joints, then lines and arcs of the tool in the user frame of its station."""

from collections.abc import Sequence
from math import ceil
from typing import Final

from cellplan.errors import InputError, LineRefusedError
from cellplan.geometry.arrays import Array
from cellplan.model.report.exported import ExportFrame, Seam
from cellplan.model.units import MM
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.paced import Events, Move
from cellplan.programs.elements.pages import PagedProgram
from cellplan.programs.elements.text import comment, fixed, safe_names
from cellplan.programs.formats.fanuc_ls.output import TpText, frames, instruction, joint_pose, tool_pose
from cellplan.programs.formats.fanuc_ls.poses import configuration, configuration_text
from cellplan.programs.formats.fanuc_ls.text import COMMENT, REMARK

MOST_REGION: Final = 1000  # [mm] of a corner region
MOST_FEED: Final = 2000.0  # [mm/s]
WELD_SPEED: Final = "WELD_SPEED"
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
    """Whether the data of the process hold the speed of a motion."""
    return in_process and events.form is not None and events.form.feed_in(task) is not None


def write_seam(
    text: TpText, frame: ExportFrame, part: PagedProgram, seam: Seam, moves: Sequence[Move], *, shares: Array
) -> None:
    """Write the program of a seam from its moves, of which the first is one of joints.

    ``shares`` are those of the shorter line or arc within which the rows of the robot may be rounded, shape (N,).
    """
    robot, group = part.placed.name, text.groups[0]
    events, task = tp_events(frame, robot), frame.cell.task(seam.task)
    number = frame.station(robot, task.name).number or group.base
    names = [one.name for one in frame.cell.tasks if one.robot == robot]
    name = safe_names(names, longest=COMMENT - len("_999"))[task.name]
    notes = [f"task {task.name}"]
    if speed_is_held(events, task.name, in_process=True) and events.form is not None:
        notes.append(f"if {events.form.feed_in(task.name)} holds {MM * (task.feed or 0.0):g} mm/s")
    text.instructions += [line for note in notes for line in comment(note.replace(";", ","), "!", longest=REMARK - 1)]
    text.instructions += frames(group, number)
    configs = [configuration_text(row) for row in configuration(part.placed, part.rows.q)]
    for move in moves:
        if move.is_tool and part.rows.X_PT is not None:
            rows = [move.row] if move.middle is None else [move.middle, move.row]
            poses = [tool_pose(group, part, row, part.rows.X_PT[row], base=number, config=configs[row]) for row in rows]
            points = "\n".join(
                text.point([pose], f"{name}_{row - seam.first}") for row, pose in zip(rows, poses, strict=True)
            )
            speed, ending = _feed(events, task.name, move), _ending(move, shares[move.row])
            motion = " ".join(["L" if move.middle is None else "C", points, speed, ending, *move.triggers])
        else:
            point = text.point([joint_pose(group, part.numbers[move.row], part.decimals, number)])
            motion = f"J {point} {part.speeds[move.row]}% FINE"
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
