"""What is fixed to what: bodies that may touch as one holds, carries or stands on the other, and how deep they may.

Only two links of one robot's own file are excused by their design. What the user puts into the cell, a part, a tool, a
base on a floor, is judged: by its depth where touching is its purpose, as any other contact where it is not.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.report.left_out import LeftOutKind
from cellplan.scene.bodies import Kind, SceneBody

MOUNT_DEPTH: Final = 0.002  # [m] by which a tool may reach into the link that its flange, without a body, is part of
MAX_NAMED: Final = 3  # [-] bodies that an error names; the others are counted
MOVING_KINDS: Final = (Kind.LINK, Kind.TOOL, Kind.PART)  # nothing of these stands on another one of them


class Mount(StrEnum):
    """Why two bodies may touch."""

    GRIP = "grip_depth"  # the one holds the part
    STANDING = "standing_depth"  # the one stands on the other
    MOUNT = "mount_depth"  # the one is fixed to a flange that has no body, near the other


@dataclass(frozen=True, slots=True, kw_only=True)
class MountedPair:
    """Two bodies that may touch, and reach into each other by so much."""

    first: int  # index of the one body of the scene
    second: int  # index of the other; a half-space is always the second
    mount: Mount  # why they may touch
    limit: float  # greatest allowed depth in [m]
    accuracy: float = 0.0  # share of the limit in [m] that makes up for what is stated of the accuracy of a link's body
    moves: bool = False  # whether the one moves against the other, so that every configuration of a motion counts


def is_of_one_robot(a: SceneBody, b: SceneBody) -> bool:
    """Whether both are links of one robot, placed against each other by its maker."""
    return a.kind is b.kind is Kind.LINK and a.robot == b.robot


def may_stand_on(a: SceneBody, b: SceneBody) -> bool:
    """Whether two bodies never move and one may stand on the other: a base or a part on something of the cell's own.

    The feet of two robots, and a foot and a part, keep their distance as everything else does. What is mounted on one
    base, such as its pedestal, belongs together.
    """
    if a.robot is not None and a.robot == b.robot:
        return False
    return a.is_at_rest and b.is_at_rest and not (a.kind in MOVING_KINDS and b.kind in MOVING_KINDS)


def is_rigid_with_flange(body: SceneBody, cell: Cell) -> bool:
    """Whether a body is a flange, or fixed to one: a tool, a gripper of the robot's file that cannot move."""
    if body.robot is None or body.kind is Kind.PART:
        return False
    return body.link == cell.robot(body.robot).model.flange_link


def works_like_a_tool(body: SceneBody, cell: Cell) -> bool:
    """Whether a body may touch the part near the tool tip while its robot works: a tool's, or a gripper's."""
    if body.kind is not Kind.LINK or body.robot is None:
        return body.kind is Kind.TOOL
    names = cell.robot(body.robot).gripper
    return body.name.removeprefix(f"{body.robot}/") in names and is_rigid_with_flange(body, cell)


def grasp_of(a: SceneBody, b: SceneBody, cell: Cell) -> Grasp | None:
    """The grasp that two bodies belong to: the part, and a body that a holder grips with."""
    held = _held_with_part(a, b, cell)
    return None if held is None or _keeps_away(*held) else held[1]


def keeps_out_of_grip(a: SceneBody, b: SceneBody, cell: Cell) -> bool:
    """Whether two bodies are the part, and one that is rigid with the flange of a holder but is not to grip."""
    held = _held_with_part(a, b, cell)
    return held is not None and _keeps_away(*held)


def _held_with_part(a: SceneBody, b: SceneBody, cell: Cell) -> tuple[SceneBody, Grasp] | None:
    """A body that is rigid with the flange of a holder and its grasp, when the other one is the part."""
    if Kind.PART not in (a.kind, b.kind):
        return None
    other = a if b.kind is Kind.PART else b
    held = (grasp for grasp in cell.part.held_by if grasp.robot == other.robot)
    grasp = next(held, None) if is_rigid_with_flange(other, cell) else None
    return None if grasp is None else (other, grasp)


def _keeps_away(body: SceneBody, grasp: Grasp) -> bool:
    """Whether a body is none of those that the grasp names."""
    return grasp.bodies is not None and body.name not in grasp.bodies


def left_out_kind(a: SceneBody, b: SceneBody) -> LeftOutKind | None:
    """Kind of a pair that is not watched by its mounting; None for two links of one robot's own file."""
    if is_of_one_robot(a, b):
        return None
    if may_stand_on(a, b):
        return LeftOutKind.STANDING
    return LeftOutKind.GRIP if Kind.PART in (a.kind, b.kind) else LeftOutKind.MOUNTED


def mounted_pair(a: SceneBody, b: SceneBody, ends: tuple[int, int], cell: Cell) -> MountedPair | None:
    """The depth allowed for two bodies of which one holds the part or stands on the other; None for all others."""
    first, second = ends
    if may_stand_on(a, b):
        return MountedPair(first=first, second=second, mount=Mount.STANDING, limit=cell.checks.standing_depth_mm.si)
    grasp = grasp_of(a, b, cell)
    if grasp is None:
        return None
    accuracy = max((body.accuracy or 0.0) if body.kind is Kind.LINK else 0.0 for body in (a, b))
    return MountedPair(
        first=first,
        second=second,
        mount=Mount.GRIP,
        limit=grasp.depth + accuracy,
        accuracy=accuracy,
        moves=len(grasp.axes) < 6,
    )


def refuse_wrong_mounting(cell: Cell, bodies: Sequence[SceneBody], faults: Sequence[tuple[int, Sequence[int]]]) -> None:
    """Refuse a cell in which what the user mounted touches links of its own robot in every configuration."""
    for mounted, links in faults:
        body, others = bodies[mounted], [bodies[link].name for link in links]
        outside = [bodies[link].name for link in links if keeps_out_of_grip(body, bodies[link], cell)]
        if outside:
            raise _outside_grip(cell, str(bodies[links[0]].robot), outside)
        more = len(others) - MAX_NAMED
        named = ", ".join(others[:MAX_NAMED])
        if more > 0:
            named += f" and {more} more {'body' if more == 1 else 'bodies'}"
        robot = str(bodies[links[0]].robot)
        where = cell.origin.at(_key(cell, body, robot))
        what, question = _words(body)
        beyond = {Kind.ATTACHMENT: "its own", Kind.PEDESTAL: "its foot"}.get(body.kind, "its flange")
        raise InputError(
            f"{where}: expected {what} clear of the links of '{robot}' beyond {beyond}, got one that touches {named} "
            f"in every configuration: {question} If contact is permitted, name the pairs under checks.exclude"
        )


def _outside_grip(cell: Cell, robot: str, names: Sequence[str]) -> InputError:
    """A part that touches what is rigid with the flange of its holder, but is not to grip it."""
    number = [grasp.robot for grasp in cell.part.held_by].index(robot)
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    where = cell.origin.at(f"part.held_by[{number}].grip_bodies")
    return InputError(
        f"{where}: expected a part clear of all bodies of '{robot}' that are not named, got one that touches "
        f"{', '.join(names[:MAX_NAMED])}{more}: is the grasp right, and the gripper open far enough? If they are to "
        "grip, name them"
    )


def _key(cell: Cell, body: SceneBody, robot: str) -> str:
    """Where in the cell file a body is mounted."""
    if body.kind is Kind.PART:
        number = [grasp.robot for grasp in cell.part.held_by].index(robot)
        return f"part.held_by[{number}].at"
    if body.kind is Kind.TOOL:
        number = int(body.name.rpartition("_")[2]) - 1 if body.name != f"{robot}/tool" else 0
        tool = _tool_as_written(cell, robot)
        if tool.get("geometry") is None:
            return f"robots.{robot}.tool.bodies[{number}]"
        return f"robots.{robot}.tool.bodies[{number - 1}]" if number else f"robots.{robot}.tool.geometry"
    if body.kind is Kind.PEDESTAL:
        return f"robots.{robot}.{body.name.rpartition('/')[2]}"
    number = [f"{robot}/{attachment.name}" for attachment in cell.robot(robot).attachments].index(body.name)
    return f"robots.{robot}.attachments[{number}]"


def _tool_as_written(cell: Cell, robot: str) -> Mapping[str, object]:
    """The tool of a robot as the file gives it."""
    values: object = cell.origin.document
    for key in ("robots", robot, "tool"):
        values = values.get(key) if isinstance(values, Mapping) else None
    return values if isinstance(values, Mapping) else {}


def _words(body: SceneBody) -> tuple[str, str]:
    """What is mounted, and the question that leads to the mistake."""
    if body.kind is Kind.PART:
        return "a part", "is the grasp the right way round?"
    if body.kind is Kind.TOOL:
        return "a body of the tool", "is it in front of the flange, along its z axis?"
    if body.kind is Kind.PEDESTAL:
        return "what it is mounted on", "is it too wide, or does the robot reach below its base?"
    return "an attachment", "is it on the right link, and placed in the frame that 'at' is given in?"
