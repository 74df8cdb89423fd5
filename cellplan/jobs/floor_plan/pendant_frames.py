"""The frames that are typed into the pendants of a cell: each as the maker of its controller writes it."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.exported import Station
from cellplan.programs.elements.conventions import Convention, convention_of
from cellplan.programs.elements.frames import controller_base, on_flange
from cellplan.programs.elements.joints import Axes
from cellplan.report.floor_plan.pendants import PlanFrame, PlanPendant

ORIGINS: Final = {"base": "base", "tool_frame": "flange"}  # what is counted from, by key
NO_RUN: Final = "frames of the part follow from a run: solve the cell, and name the folder of the run"


def pendant_frames(cell: Cell, known: Mapping[str, Sequence[Station]] | None) -> tuple[PlanPendant, ...]:
    """Base and tool of every robot, and the part in all poses in which it works on it.

    Args:
        known: The stations of a run, by robot; None without a run.
    """
    return tuple(_of_robot(cell, robot, None if known is None else known.get(robot.name, ())) for robot in cell.robots)


def _of_robot(cell: Cell, robot: Robot, known: Sequence[Station] | None) -> PlanPendant:
    """The frames of one robot."""
    control = robot.control
    entry = None if control is None else cell.controllers.get(control.id)
    convention = convention_of(None if entry is None else entry.kind)
    connected = "no controller stated" if control is None or entry is None else f"{control.id} ({entry.kind})"
    turns = f", {' '.join(convention.labels[3:])} in {convention.unit}" if convention.unit else ""
    return PlanPendant(
        robot=robot.name,
        title=f"{robot.name}, {connected}: {' '.join(convention.labels[:3])} in mm{turns}",
        labels=convention.labels,
        frames=(*_of_robot_itself(cell, robot, convention), *_of_part(cell, robot, convention, known or ())),
        remarks=tuple(_remarks(cell, robot, convention, known)),
    )


def _of_robot_itself(cell: Cell, robot: Robot, convention: Convention) -> Iterator[PlanFrame]:
    """Its base on the floor, and its tool unless it only turns parts."""
    X_WC = controller_base(robot)
    yield PlanFrame(
        name=_origin(robot, "base"), seen_from="floor", numbers=convention.texts(X_WC), purpose="where it stands"
    )
    if _has_tool(cell, robot):
        number = None if robot.control is None else robot.control.tool_number
        yield PlanFrame(
            name=convention.named(convention.tool, number),
            seen_from=_origin(robot, "tool_frame"),
            numbers=convention.texts(on_flange(robot, robot.tool.X_FT)),
            purpose="tip of the tool",
        )


def _has_tool(cell: Cell, robot: Robot) -> bool:
    """Whether it has a tool centre point: it works, or has an arm, and does not only turn parts."""
    return bool(Axes.of(robot).arm) or any(task.robot == robot.name for task in cell.tasks)


def _of_part(cell: Cell, robot: Robot, convention: Convention, known: Sequence[Station]) -> Iterator[PlanFrame]:
    """The part in each pose in which a robot works on it."""
    for station in known:
        holder = None if station.holder is None else cell.robot(station.holder)
        moves = "" if station.X is not None else "moves while the tool works, so that no frame has it: "
        yield PlanFrame(
            name=convention.named(convention.frame, station.number),
            seen_from=_origin(robot, "base") if holder is None else _origin(holder, "tool_frame", f" of {holder.name}"),
            numbers=() if station.X is None else convention.texts(station.X),
            purpose=moves + ", ".join(station.tasks),
            X_W=station.X_W,
        )


def _origin(robot: Robot, key: str, of_robot: str = "") -> str:
    """The base or the flange that a controller counts from; that of the model where the cell does not state it."""
    return f"{ORIGINS[key]}{of_robot}{'' if _states(robot, key) else ' (model)'}"


def _states(robot: Robot, key: str) -> bool:
    """Whether the cell states the base or the flange of a controller."""
    return robot.control is not None and getattr(robot.control, key) is not None


def _remarks(cell: Cell, robot: Robot, convention: Convention, known: Sequence[Station] | None) -> Iterator[str]:
    """What to know of the numbers of a robot."""
    needed = dict.fromkeys((robot.name, key) for key in ORIGINS if key == "base" or _has_tool(cell, robot))
    needed |= dict.fromkeys((station.holder, "tool_frame") for station in known or () if station.holder is not None)
    for name, key in needed:
        if not _states(cell.robot(name), key):
            yield f"robots.{name}.controller.{key} is not stated: (model) counts from the {ORIGINS[key]} of the model"
    if convention.has_numbers and any(station.X is not None and station.number is None for station in known or ()):
        yield f"robots.{robot.name}.controller.frames does not state a number for each frame of the part"
    if known is None and _has_tool(cell, robot):
        yield NO_RUN
