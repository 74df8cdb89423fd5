"""What stands in a cell, as records of a 3-D page: robots, bodies, part, paths, pairs that are not checked."""

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import rpy_from_rotation
from cellplan.jobs.view.geometries import Geometries
from cellplan.jobs.view.result import point_numbers, pose_numbers
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.mounting import Hanger, Mount, Pedestal, Wedge
from cellplan.model.task.task import Frame, Task
from cellplan.model.units import DEG, MM
from cellplan.planning.path.build import build_toolpath
from cellplan.report.plots.palette import robot_colours
from cellplan.report.record.common import Record, number
from cellplan.scene.bodies import Kind, SceneBody, part_body
from cellplan.scene.scene import Scene

PATH_POINTS: Final = 240  # [-] drawn along a path
FILE_DECIMALS: Final = 6  # of [mm] and [deg] in a cell file


def cell_record(cell: Cell, bodies: Sequence[SceneBody], geometries: Geometries) -> Record:
    """The scene of a cell as far as it is the same whatever moves: what is drawn, and nothing that was found."""
    tasks, faults = task_records(cell)
    return {
        "name": cell.name,
        "facts": [],
        "remarks": faults,
        "passed": None,
        "robots": robot_records(cell),
        "bodies": body_records(cell, bodies, geometries),
        "visuals": visual_records(cell, geometries),
        "part": [place_record(cell, 0.0)],
        "tasks": tasks,
        "motion": {},
        "nearest": {},
        "certified": {"times": [], "distances": []},
        "contacts": [],
        "failures": [],
        "excluded": [],
        "bases": [],
    }


def robot_records(cell: Cell) -> list[Record]:
    """All robots in the order of the cell."""
    colours = robot_colours(cell)
    return [_robot(cell, robot, colours[robot.name]) for robot in cell.robots]


def _robot(cell: Cell, robot: Robot, colour: str) -> Record:
    model = robot.model
    return {
        "name": robot.name,
        "model": model.name,
        "colour": colour,
        "base": pose_numbers(robot.X_WB),
        "column": cell.columns(robot.name).start,
        "joints": [
            {
                "name": joint.name,
                "unit": joint.display_unit.name,
                "scale": joint.display_unit.scale,
                "lower": number(joint.lower),
                "upper": number(joint.upper),
                "velocity": float(joint.velocity),
            }
            for joint in model.joints
        ],
        "axes": [_axis(robot, link) for link in range(len(model.axes))],
        "tip_link": model.flange_link,
        "tip": pose_numbers(model.X_BF @ robot.tool.X_FT),
    }


def _axis(robot: Robot, link: int) -> Record:
    axis, drive = robot.model.axes[link], robot.model.drive(link)
    return {
        "parent": axis.parent,
        "turns": axis.is_revolute,
        "axis": [float(component) for component in axis.axis_B],
        "point": [float(coordinate) for coordinate in axis.point_B],
        "joint": drive.joint,
        "ratio": float(drive.ratio),
        "offset": float(drive.offset),
    }


def body_records(cell: Cell, bodies: Sequence[SceneBody], geometries: Geometries) -> list[Record]:
    """All bodies of a scene in its order."""
    with_visual = {
        robot.name: {visual.link for visual in geometries.visuals_of(cell, robot.name)} for robot in cell.robots
    }
    replaced = {
        f"{robot.name}/{body.name}"
        for robot in cell.robots
        for body in robot.model.bodies
        if body.link_name in with_visual[robot.name]
    }
    geometries.announce([body.shape for body in bodies])
    geometries.announce([visual.shape for robot in with_visual for visual in geometries.visuals[robot]])
    return [
        {
            "name": body.name,
            "kind": str(body.kind),
            "robot": -1 if body.robot is None else cell.index(body.robot),
            "link": body.link,
            "geometry": geometries.place(body.shape),
            "pose": pose_numbers(body.X_BS),
            "accuracy": body.accuracy,
            "replaced": body.kind is Kind.LINK and body.name in replaced,
            "stands": _stands(_mount(cell, body)),
            "outline": _outline(_mount(cell, body)),
        }
        for body in bodies
    ]


def visual_records(cell: Cell, geometries: Geometries) -> list[Record]:
    """What the files of the robots draw of their links."""
    records: list[Record] = []
    for index, robot in enumerate(cell.robots):
        links = {link.name: link for link in robot.model.links}
        for visual in geometries.visuals_of(cell, robot.name):
            if visual.link in links:
                link = links[visual.link]
                place, X_BS = geometries.place(visual.shape), link.X_BL @ visual.X_LS
                records.append({"robot": index, "link": link.index, "geometry": place, "pose": pose_numbers(X_BS)})
    return records


def _mount(cell: Cell, body: SceneBody) -> Mount | None:
    """What a robot stands on or hangs from, if a body is that."""
    return cell.robot(body.robot).pedestal if body.robot and body.kind is Kind.PEDESTAL else None


def _stands(mount: Mount | None) -> dict[str, float]:
    """Where an upright column begins or ends, whatever the height of the base on it."""
    if isinstance(mount, Hanger):
        return {"ceiling": mount.ceiling}
    return {"floor": mount.floor} if isinstance(mount, Pedestal | Wedge) else {}


def _outline(mount: Mount | None) -> list[float]:
    """Corners of a column that is cut off along the plane of the base, seen from above."""
    return point_numbers(np.stack(mount.outline(), axis=1)) if isinstance(mount, Wedge) else []


def place_record(cell: Cell, begin: float) -> Record:
    """What carries the part of a cell, from an instant on."""
    body = part_body(cell, cell.part, *cell.part.held_by[:1])
    X_SP = np.linalg.inv(cell.part.X_PS)
    return {
        "begin": begin,
        "robot": -1 if body.robot is None else cell.index(body.robot),
        "link": body.link,
        "pose": pose_numbers(body.X_BS @ X_SP),
    }


def task_records(cell: Cell) -> tuple[list[Record], list[str]]:
    """All tasks with points along their paths, and why some have none."""
    records, faults = list[Record](), list[str]()
    for task in cell.tasks:
        try:
            points = path_points(cell, task)
        except InputError as error:
            points, fault = np.zeros((0, 3)), str(error)
            faults.append(fault)
        records.append(
            {
                "name": task.name,
                "robot": cell.index(task.robot),
                "in_world": task.relative_to is Frame.WORLD,
                "points": point_numbers(points),
            }
        )
    return records, faults


def path_points(cell: Cell, task: Task) -> Array:
    """Points along the path of a task in [m], shape (N, 3), corners among them, on the part or in the world."""
    toolpath = build_toolpath(task, cell.part)
    if toolpath.is_timed:
        return toolpath.spread(PATH_POINTS)[:, :3, 3]
    lengths = np.unique(np.concatenate([np.linspace(0.0, toolpath.length, PATH_POINTS), toolpath.behind]))
    return toolpath.poses(lengths)[:, :3, 3]


def excluded_records(scene: Scene) -> list[Record]:
    """Pairs of which less than the clearance is demanded, by reason: not watched ones, then those with another rule."""
    by_reason: dict[str, list[list[int]]] = {}
    for exclusion in scene.excluded:
        by_reason.setdefault(exclusion.reason, []).append([exclusion.first, exclusion.second])
    for pair in scene.pairs:
        if pair.reason:
            by_reason.setdefault(pair.reason, []).append([pair.first, pair.second])
    return [{"reason": reason, "pairs": pairs} for reason, pairs in by_reason.items()]


def base_records(cell: Cell) -> list[Record]:
    """The base of each robot in the numbers of the cell file."""
    poses = [robot.X_WB for robot in cell.robots]
    numbers = [(_file_numbers(MM * X[:3, 3]), _file_numbers(DEG * rpy_from_rotation(X[:3, :3]))) for X in poses]
    return [{"robot": index, "xyz_mm": xyz, "rpy_deg": rpy} for index, (xyz, rpy) in enumerate(numbers)]


def _file_numbers(values: Iterable[float]) -> list[float]:
    return [round(float(value), FILE_DECIMALS) + 0.0 for value in values]
