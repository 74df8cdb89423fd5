"""Assumptions behind the numbers of a report: accuracy of link bodies, payloads, values that were not stated."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.geometry.mesh.load import open_edges
from cellplan.geometry.shapes import Mesh, Shape, support
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.report import Standoff
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.payload import LoadUse
from cellplan.model.robot.robot import RobotModel
from cellplan.model.robot.torque import RobotTorques
from cellplan.model.units import MM
from cellplan.report.record.common import Number, number
from cellplan.report.record.sections.forces import unstated_forces
from cellplan.report.record.sections.payload import LoadRecord, loads_record, unjudged_loads
from cellplan.report.record.sections.torques import unjudged_torques

IN_FRONT: Final = 0.005  # [m] by which a link's own body must stick out of the flange to be a tool: a disc does not
UNKNOWN = "joint positions count from the model's zero, taken as the controller's; not confirmed"
SAME = "joint positions count from the model's zero, which is the controller's"
OTHER = "joint positions count from the model's zero; on the controller "


class BodiesRecord(TypedDict):
    """Accuracy of the link bodies of a robot."""

    accuracy_mm: Annotated[Number, "largest distance by which the real arm exceeds its link bodies"]
    source: Annotated[str, "source of that value"]
    own_accuracy_mm: Annotated[dict[str, Number], "by body: values of bodies that differ"]


class ZeroRecord(TypedDict):
    """From which zero the joint positions of a robot count."""

    line: Annotated[str, "the zero as one line of text"]
    is_stated: Annotated[bool, "whether the counting of the controller is known"]
    controller: Annotated[dict[str, str], "by joint that the controller counts otherwise: its position there"]
    source: Annotated[str, "source of that"]


class RestsOnRecord(TypedDict):
    """Assumptions behind the numbers."""

    bodies: Annotated[
        dict[str, BodiesRecord], "by robot, and for the part if it comes from a STEP file: accuracy of its bodies"
    ]
    body_accuracy: Annotated[str, "`report`, or `add`: the accuracy of both bodies is added to the required clearance"]
    payload: Annotated[dict[str, LoadRecord], "by robot: load and rated load"]
    zero: Annotated[dict[str, ZeroRecord], "by robot: the zero that its joint positions count from"]
    lines: Annotated[list[str], "one line on each value that was not stated and therefore not judged"]


def rests_on_record(
    cell: Cell, loads: Sequence[LoadUse], tips: Sequence[Standoff] = (), torques: Sequence[RobotTorques] = ()
) -> RestsOnRecord:
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
            *unstated_forces(cell),
            *unjudged_torques(torques),
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
    """Accuracy of the link bodies of each robot and of the part from a STEP file, each with its source."""
    record: dict[str, BodiesRecord] = {}
    for robot in cell.robots:
        stated, bodies = robot.model.body_accuracy, [body for body in robot.model.bodies if body.accuracy is not None]
        if robot.model.bodies:
            record[robot.name] = {
                "accuracy_mm": None if stated is None else number(stated.accuracy_mm),
                "source": "not stated" if stated is None else stated.source,
                "own_accuracy_mm": {body.name: number(MM * (body.accuracy or 0.0)) for body in bodies},
            }
    if cell.part.accuracy > 0.0:
        source = "deviation of its mesh from its STEP file"
        record["part"] = {"accuracy_mm": number(MM * cell.part.accuracy), "source": source, "own_accuracy_mm": {}}
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


class OpenSurfaceRecord(TypedDict):
    """A body whose mesh is not closed."""

    body: Annotated[str, "the body"]
    key: Annotated[str, "key of the cell that names it"]
    mesh: Annotated[str, "file of the mesh"]
    open_edges: Annotated[int, "number of open edges"]
    has_inside: Annotated[
        bool, "whether points with a winding number above one half count as inside (links), or none do (`open: true`)"
    ]


def open_surfaces_record(cell: Cell) -> list[OpenSurfaceRecord]:
    """Each body whose mesh is not closed, with the key that names it, and whether it has an inside nevertheless."""
    return [
        {"body": body, "key": key, "mesh": shape.source, "open_edges": open_edges(shape), "has_inside": shape.is_leaky}
        for body, key, shape in _bodies(cell)
        if isinstance(shape, Mesh) and not shape.is_closed
    ]


def _bodies(cell: Cell) -> Iterator[tuple[str, str, Shape]]:
    """Name of each body, its key in the cell, and its shape."""
    for robot in cell.robots:
        key = f"robots.{robot.name}"
        for link in robot.model.bodies:
            yield f"{robot.name}/{link.name}", f"{key}.model", link.shape
        yield from _tool_bodies(robot, f"{key}.tool")
    for thing in cell.obstacles:
        yield thing.name, f"environment.{thing.name}", thing.shape


def _tool_bodies(robot: Robot, key: str) -> Iterator[tuple[str, str, Shape]]:
    """Solids of a tool with their names in reports."""
    for place, body in enumerate(robot.tool.bodies, start=1):
        yield f"{robot.name}/tool" if place == 1 else f"{robot.name}/tool_{place}", key, body.shape


def zero_record(model: RobotModel) -> ZeroRecord:
    """The zero of one robot."""
    zero = model.controller
    return {
        "line": zero_text(model),
        "is_stated": zero is not None,
        "controller": {} if zero is None else _terms(model, zero),
        "source": "not stated" if zero is None else zero.source,
    }


def zero_text(model: RobotModel) -> str:
    """From which zero the joint positions of a robot count, and those of its controller, as one line."""
    zero = model.controller
    if zero is None:
        return UNKNOWN
    if zero.is_identity:
        return SAME
    return OTHER + ", ".join(f"{joint} = {term}" for joint, term in _terms(model, zero).items())


def _terms(model: RobotModel, zero: ControllerZero) -> dict[str, str]:
    """Position on the controller by joint, for the joints that it counts otherwise: ``model - 90 deg``."""
    terms = {}
    for index, joint in enumerate(model.joints):
        unit, scale = joint.display_unit
        text = "-model" if zero.sign[index] < 0.0 else "model"
        text += _signed(scale * float(zero.zero[index]), f" {unit}")
        for other, factor in zip(model.joint_names, zero.coupling[index], strict=True):
            text += _signed(float(factor), f" {other}")
        if text != "model":
            terms[joint.name] = text
    return terms


def _signed(value: float, what: str) -> str:
    """A term of a sum; nothing for zero."""
    return f" {'-' if value < 0.0 else '+'} {abs(value):.9g}{what}" if value else ""
