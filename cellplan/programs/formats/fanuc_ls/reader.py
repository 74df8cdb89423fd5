"""Strict reader of TP programs: the written subset and harmless variants of it, nothing else."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.report.exported import ExportFrame, ProgramRows, Promise, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.conventions import CONVENTIONS
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.frames import carried_poses, part_pose
from cellplan.programs.elements.joints import Axes, from_numbers
from cellplan.programs.elements.paced import ENDS, Events, ReadMove, Which, rows_of_moves, shorter_lengths
from cellplan.programs.formats.fanuc_ls.groups import KIND, MotionGroup, TpProgram
from cellplan.programs.formats.fanuc_ls.player import MILLISECONDS, TpMotion, TpPlayer
from cellplan.programs.formats.fanuc_ls.poses import read_configuration
from cellplan.programs.formats.fanuc_ls.seams import TRIGGER, WELD_SPEED, speed_is_held, tp_events
from cellplan.programs.formats.fanuc_ls.text import TpPoint

ARM: Final = 6  # numbers of a pose, as many as of the joints of an arm


def read_fanuc_ls(
    frame: ExportFrame, files: Mapping[str, str], programs: Sequence[TpProgram]
) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: positions, marks, seams, and times of groups that move in step.

    An ``InputError`` has file and line.
    """
    left = dict(files)
    rows: dict[str | None, dict[str, RobotRows]] = {name: {} for name in frame.programs}
    for program in programs:
        player = TpPlayer(frame=frame, program=program)
        player.play_all(left)
        if not player.in_step:
            read = {group.robot.name: _waiting(player, group) for group in program.groups}
        elif any(motion.task for motion in player.motions):
            read = _with_seams_in_step(player)
        else:
            read = {group.robot.name: _in_step(player, group) for group in program.groups}
        rows[program.program] |= read
        if len({len(one.marks) for one in rows[program.program].values()}) > 1:
            raise InputError(f"{program.name}.ls: expected as many marks as the programs of the other robots have")
    if left:
        raise InputError(f"{min(left)}: expected no such file in this export")
    return tuple(
        ProgramRows(name=name, robots={robot: of_robot[robot] for robot in frame.robots if robot in of_robot})
        for name, of_robot in rows.items()
    )


def _joints(group: MotionGroup, point: TpPoint) -> Array:
    """Joints of a group at a point in [rad] or [m], shape (n,); NaN for an arm whose pose is stated."""
    pose = point.poses[group.number]
    numbers = np.empty_like(values := np.array(pose.values))
    numbers[list(group.order)] = values
    q: Array = from_numbers(group.robot, numbers[None])[0]
    if pose.configuration:
        q[list(Axes.of(group.robot).arm)] = np.nan
    return q


def _on_part(player: TpPlayer, group: MotionGroup, motion: TpMotion, point: TpPoint) -> Array:
    """Pose of the tool of a group at a point of a seam, in the frame of the part, shape (4, 4)."""
    if point.poses[group.number].configuration or motion.task is None:
        return CONVENTIONS[KIND].pose(np.array(point.poses[group.number].values[:ARM]))
    q = {one.robot.name: _joints(one, point)[None] for one in player.program.groups}
    X_WT = group.robot.X_WB @ carried_poses(group.robot, q[group.robot.name], group.robot.tool.X_FT)
    X_PT: Array = inverse(part_pose(player.frame, group.robot.name, motion.task, q)) @ X_WT
    return X_PT[0]


def _with_seams_in_step(player: TpPlayer) -> dict[str, RobotRows]:
    """Rows of an arm with its seams, and of the groups that move in step with it."""
    arm = next((group for group in player.program.groups if Axes.of(group.robot).arm), player.program.groups[0])
    rows = {arm.robot.name: _waiting(player, arm)}
    for group in player.program.groups:
        q = np.array([_joints(group, point) for motion in player.motions for point in motion.points])
        others = RobotRows(robot=group.robot.name, q=q, rounding=rows[arm.robot.name].rounding)
        rows.setdefault(group.robot.name, others)
    return rows


def _in_step(player: TpPlayer, group: MotionGroup) -> RobotRows:
    """Rows of one of the groups that move in step, with their times."""
    motions = player.motions
    for motion in motions:
        if motion.suffix:
            raise motion.statement.error("no such ending of a motion here", motion.suffix)
    return RobotRows(
        robot=group.robot.name,
        q=np.array([_joints(group, motion.points[-1]) for motion in motions]),
        times=np.cumsum([motion.duration for motion in motions]) / MILLISECONDS["sec"],
        rounding=np.where([motion.is_passed for motion in motions], LARGEST_SHARE, 0.0),
        speeds=np.array([motion.speed for motion in motions]),
    )


def _waiting(player: TpPlayer, group: MotionGroup) -> RobotRows:
    """Rows of a robot that waits for others, with its marks and seams."""
    events, moves, is_on = tp_events(player.frame, group.robot.name), list[ReadMove](), False
    for motion in player.motions:
        move = _read_move(player, events, group, motion, in_process=is_on)
        moves.append(move)
        switches = events.read(motion.task, [statement.text for statement in motion.behind], move.process)
        if move.process is not None:
            is_on = move.process == "on"
        elif switches is not None:
            is_on = (is_on and not switches.off) or switches.on
    moves = list(_within_halves(moves))
    between = [player.before, *(motion.behind for motion in player.motions)]
    texts = [[one.text for one in statements] for statements in between]
    begin = (*player.before, player.motions[0].statement)[0].refuse
    rows = rows_of_moves(events, moves, texts, begin=begin)
    return replace(rows, process=None) if player.frame.promise is Promise.SEQUENCE_ONLY else rows


def _within_halves(moves: Sequence[ReadMove]) -> Iterator[ReadMove]:
    """Moves whose corners begin no earlier than in the middle of the shorter one of both lines or arcs."""
    places = [[pose[:3, 3] for pose in move.poses] or [np.full(3, np.nan)] for move in moves]
    lengths = iter(shorter_lengths(np.array([p for points in places for p in points])).tolist())
    for move, points in zip(moves, places, strict=True):
        half = LARGEST_SHARE * [next(lengths) for _ in points][-1]
        yield replace(move, zone=min(move.zone, half)) if half > 0.0 else move


def _read_move(player: TpPlayer, events: Events, group: MotionGroup, motion: TpMotion, *, in_process: bool) -> ReadMove:
    """A motion as it was found; what stands behind it is refused where it stands."""
    at, points = (*motion.behind, motion.statement)[0], motion.points if motion.feed is not None else ()
    stated = [pose.configuration for point in points if (pose := point.poses[group.number]).configuration]
    feed = motion.feed
    if feed is not None and np.isnan(feed):
        if motion.task is None or not speed_is_held(events, motion.task, in_process=in_process):
            raise motion.statement.error("the speed of the tool in mm/sec", WELD_SPEED)
        feed = events.frame.cell.task(motion.task).feed
    return ReadMove(
        refuse=at.refuse,
        task=motion.task,
        q=np.array([_joints(group, point) for point in motion.points]) if points else _joints(group, motion.points[-1]),
        poses=tuple(_on_part(player, group, motion, point) for point in points),
        configurations=tuple(map(read_configuration, stated)) or None,
        feed=np.nan if feed is None else feed,
        zone=motion.region / MM,
        share=LARGEST_SHARE if motion.is_passed else 0.0,
        process=_process(events, motion),
        speed=motion.speed,
        duration=motion.duration / MILLISECONDS["sec"] or np.nan,
    )


def _process(events: Events, motion: TpMotion) -> Which | None:
    """Whether the suffix of a motion begins or ends the process; lines that belong to it stand behind the motion."""
    if motion.suffix.startswith(TRIGGER):
        task = None if motion.feed is None else motion.task
        return events.triggered(task, [motion.suffix], motion.statement.refuse)
    for on, which in ENDS if motion.suffix else ():
        if events.form and motion.task is not None and events.form.suffix(on, motion.task) == motion.suffix:
            return which
    if motion.suffix:
        raise motion.statement.error("no such ending of a motion here", motion.suffix)
    return None
