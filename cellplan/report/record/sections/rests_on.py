"""Assumptions behind the numbers of a report: accuracy of link bodies, payloads, values that were not stated."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.geometry.shapes import support
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.report import Standoff
from cellplan.model.robot.payload import LoadUse
from cellplan.model.units import MM
from cellplan.report.record.common import Number, number
from cellplan.report.record.sections.controller import ZeroRecord, zero_record
from cellplan.report.record.sections.payload import LoadRecord, loads_record, unjudged_loads

IN_FRONT: Final = 0.005  # [m] by which a link's own body must stick out of the flange to be a tool: a disc does not


class BodiesRecord(TypedDict):
    """Accuracy of the link bodies of a robot."""

    accuracy_mm: Annotated[Number, "largest distance by which the real arm exceeds its link bodies"]
    source: Annotated[str, "source of that value"]
    own_accuracy_mm: Annotated[dict[str, Number], "by body: values of bodies that differ"]


class RestsOnRecord(TypedDict):
    """Assumptions behind the numbers."""

    bodies: Annotated[dict[str, BodiesRecord], "by robot: accuracy of its link bodies"]
    body_accuracy: Annotated[str, "`report`, or `add`: the accuracy of both bodies is added to the required clearance"]
    payload: Annotated[dict[str, LoadRecord], "by robot: load and rated load"]
    zero: Annotated[dict[str, ZeroRecord], "by robot: the zero that its joint positions count from"]
    lines: Annotated[list[str], "one line on each value that was not stated and therefore not judged"]


def rests_on_record(cell: Cell, loads: Sequence[LoadUse], tips: Sequence[Standoff] = ()) -> RestsOnRecord:
    """Assumptions, and one line on each value that was not stated."""
    return {
        "bodies": bodies_record(cell),
        "body_accuracy": cell.checks.body_accuracy,
        "payload": loads_record(loads),
        "zero": {robot.name: zero_record(robot.model) for robot in cell.robots},
        "lines": [
            *(text for _, text in missing_tools(cell)),
            *unstated_bodies(cell),
            *unjudged_loads(loads),
            *unstated_standoffs(cell, tips),
        ],
    }


def unstated_standoffs(cell: Cell, tips: Sequence[Standoff]) -> list[str]:
    """One line on the tasks without a process whose tips are off the part and that state no distance."""
    off = {tip.task: tip.worst_nearest for tip in tips if tip.is_off}
    silent = [name for name in off if cell.task(name).standoff is None and cell.task(name).process is None]
    words = ", ".join(f"{name} (tip {MM * off[name]:.1f} mm off the part)" for name in silent)
    return [f"standoff_mm of {words} not stated"] if silent else []


def bodies_record(cell: Cell) -> dict[str, BodiesRecord]:
    """Accuracy of the link bodies of each robot and its source; nothing for a robot without bodies."""
    record: dict[str, BodiesRecord] = {}
    for robot in cell.robots:
        stated, bodies = robot.model.body_accuracy, [body for body in robot.model.bodies if body.accuracy is not None]
        if robot.model.bodies:
            record[robot.name] = {
                "accuracy_mm": None if stated is None else number(stated.accuracy_mm),
                "source": "not stated" if stated is None else stated.source,
                "own_accuracy_mm": {body.name: number(MM * (body.accuracy or 0.0)) for body in bodies},
            }
    return record


def unstated_bodies(cell: Cell) -> list[str]:
    """One line on the robots whose bodies have no stated accuracy; none when all are stated."""
    models = {robot.name: robot.model for robot in cell.robots}
    unknown = [name for name, model in models.items() if any(model.accuracy_of(body) is None for body in model.bodies)]
    return [f"accuracy of bodies of {', '.join(unknown)} not stated"] if unknown else []


def missing_tools(cell: Cell) -> Iterator[tuple[str, str]]:
    """A line for each robot whose tool has no body, with the key of the cell that it is about.

    A robot that only holds the part may do so with its flange, as a turntable does.
    """
    at_work = {task.robot for task in cell.tasks}
    holders = {grasp.robot for grasp in cell.part.held_by}
    for robot in cell.robots:
        if robot.tool.bodies or robot.name not in at_work | holders or _has_tool(robot):
            continue
        if not robot.tool.is_bare:
            text = f"the tool of {robot.name} has no body: state tool.geometry or tool.bodies, so that it is checked"
            yield f"robots.{robot.name}.tool", text
        elif robot.name in at_work:
            text = f"{robot.name} works with its bare flange: state tool: {{xyz_mm, geometry}}, so that it is checked"
            yield f"robots.{robot.name}", text


def _has_tool(robot: Robot) -> bool:
    """Whether the robot's own file has something in front of the flange, such as a gripper."""
    X_FB = inverse(robot.model.X_BF)
    reaches = [
        float(X_FS[2, 3] + support(body.shape, X_FS[:3, :3].T @ np.array([0.0, 0.0, 1.0])))
        for body in robot.model.bodies
        if body.link == robot.model.flange_link
        for X_FS in [X_FB @ body.X_BS]
    ]
    return max(reaches, default=0.0) > IN_FRONT
