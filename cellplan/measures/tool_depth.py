"""Depth of tools in the part: how much of each tool is inside the part or beyond it, along the tool's own axis."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.shapes import Mesh
from cellplan.geometry.tool_columns import Columns, body_columns, depths, line_depths
from cellplan.geometry.transforms import Array, inverse
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import ToolDepth
from cellplan.model.task.task import Frame, Task
from cellplan.scene.kinematics.screw_chain import Chains

AXIS: Final = "axis"
AXIS_COMPONENTS: Final = (0, 1, 2, 3, 4)  # of a task: they leave no more than the turn about one axis open
DEPTH_TOL: Final = 1e-6  # [m] tracking errors of a micrometre do not decide about a cut that is as deep as it may be
FINE_STEP: Final = 1e-3  # [m] longer steps of a tool between two rows are subdivided, joints moving linearly
MAX_TIMES: Final = 4000  # times to which long steps are refined; programs of more rows are taken as they are
POSE_COUNT: Final = 400  # poses of a body that are evaluated, beside those round the deepest of them
MESH_POSE_COUNT: Final = 100  # likewise on a mesh, where a line costs fifty times as much
NEAR_WORST_COUNT: Final = 20  # rows evaluated round the deepest pose of a body
RADIUS_FRACTION: Final = 0.5  # [-] of a body's radius that it moves between two poses at which it is evaluated


def tool_depths(cell: Cell, schedule: Schedule, chains: Chains, q: RobotRows) -> tuple[ToolDepth, ...]:
    """The largest depth of the tool of every task on the part, at any time of the program.

    The axis of a tool counts from the tip back to where the flange stands beside it, and its bodies count. The axis is
    evaluated at every row, and between rows that are more than a millimetre apart. Bodies are evaluated whenever the
    tool has moved on by half of a body's radius, so that no spot that a body passes over is left out, and at the rows
    round the deepest of these; a program that is too long for that is cut into even steps of motion.
    """
    return tuple(
        task_depth(cell, scheduled.task, schedule.times, chains=chains, q=q)
        for scheduled in schedule.tasks
        if scheduled.task.relative_to is Frame.PART
    )


def task_depth(cell: Cell, task: Task, times: Array, *, chains: Chains, q: RobotRows) -> ToolDepth:
    """The same of one task on the part, at times in [s], shape (M,), from the positions of its tool and of the part."""
    robot = cell.robot(task.robot)
    fine_times, X_PT = _tool_on_part(cell, task, times, chains=chains, q=q)
    X_ST = inverse(cell.part.X_PS) @ X_PT
    X_FT, bodies, zone = robot.tool.X_FT, robot.bodies_at_work, cell.checks.contact_zone_mm.si
    along = line_depths(X_FT, cell.part.shape, X_ST, zone=zone, is_all=not bodies)
    deepest = [(AXIS, int(np.argmax(along)), float(along.max()))]
    for body in bodies:
        columns = body_columns(body.shape, inverse(X_FT) @ body.X_BS, zone)
        deepest.append((body.name, *_deepest(columns, cell, X_ST)))
    name, row, depth = max(deepest, key=lambda entry: entry[2])
    return ToolDepth(
        task=task.name, robot=task.robot, depth=depth, at_s=float(fine_times[row]), limit=task.tool_depth, body=name
    )


def path_depth(cell: Cell, task: Task, X_PT: Array) -> ToolDepth | None:
    """Depth of a tool's axis on its desired path, before there is a motion.

    None where the task leaves the place or the lean of the axis open: then only the motion says how deep it is.

    Args:
        X_PT: Desired tool poses on the part, shape (N, 4, 4).
    """
    if task.relative_to is not Frame.PART or not set(AXIS_COMPONENTS) <= set(task.axes):
        return None
    robot = cell.robot(task.robot)
    X_ST, zone = inverse(cell.part.X_PS) @ X_PT, cell.checks.contact_zone_mm.si
    along = line_depths(robot.tool.X_FT, cell.part.shape, X_ST, zone=zone, is_all=not robot.bodies_at_work)
    return ToolDepth(
        task=task.name, robot=task.robot, depth=float(along.max()), at_s=None, limit=task.tool_depth, body=AXIS
    )


def tool_axis_depths(cell: Cell, robot: str, X_PT: Array) -> Array:
    """The same of the axis of the tool alone."""
    placed = cell.robot(robot)
    X_ST, zone = inverse(cell.part.X_PS) @ X_PT, cell.checks.contact_zone_mm.si
    return line_depths(placed.tool.X_FT, cell.part.shape, X_ST, zone=zone, is_all=not placed.bodies_at_work)


def tool_depth_at(cell: Cell, robot: str, X_PT: Array) -> Array:
    """Depth in [m] of a robot's tool, axis and bodies, at any poses of it on the part, shape (N, 4, 4), shape (N,)."""
    placed, depth = cell.robot(robot), tool_axis_depths(cell, robot, X_PT)
    X_ST, zone = inverse(cell.part.X_PS) @ X_PT, cell.checks.contact_zone_mm.si
    for body in placed.bodies_at_work:
        columns = body_columns(body.shape, inverse(placed.tool.X_FT) @ body.X_BS, zone)
        if len(columns.line):
            depth = np.maximum(depth, depths(columns, cell.part.shape, X_ST))
    return depth


def tool_reach(cell: Cell, robot: str) -> float:
    """Largest distance in [m] from the tip of what counts of a robot's tool: its axis, and its bodies at work."""
    tool, bodies, zone = cell.robot(robot).tool, cell.robot(robot).bodies_at_work, cell.checks.contact_zone_mm.si
    along = abs(float(tool.X_FT[:3, 3] @ tool.X_FT[:3, 2]))
    columns = (body_columns(body.shape, inverse(tool.X_FT) @ body.X_BS, zone) for body in bodies)
    return max([along, zone, *(column.reach for column in columns)])


def _tool_on_part(cell: Cell, task: Task, times: Array, *, chains: Chains, q: RobotRows) -> tuple[Array, Array]:
    """Times in [s] and tool poses on the part there; long steps are cut, every joint moving linearly in them."""
    movers = {task.robot, *(grasp.robot for grasp in cell.part.held_by[:1])}
    positions = {name: q[name] for name in sorted(movers)}
    X_PT = inverse(part_poses(cell, chains, positions)) @ chains[task.robot].tool_poses(positions[task.robot])
    longest = float(np.linalg.norm(np.diff(X_PT[:, :3, 3], axis=0), axis=1).max(initial=0.0))
    parts = min(int(np.ceil(longest / FINE_STEP)), MAX_TIMES // max(1, len(times) - 1))
    if parts < 2:
        return times, X_PT
    rows = np.arange(parts * (len(times) - 1) + 1) / parts
    whole = np.minimum(rows.astype(np.intp), len(times) - 2)
    share = (rows - whole)[:, None]
    fine = {name: values[whole] + share * (values[whole + 1] - values[whole]) for name, values in positions.items()}
    fine_times = times[whole] + share[:, 0] * (times[whole + 1] - times[whole])
    return fine_times, inverse(part_poses(cell, chains, fine)) @ chains[task.robot].tool_poses(fine[task.robot])


def _deepest(columns: Columns, cell: Cell, X_ST: Array) -> tuple[int, float]:
    """Row and depth in [m] of the deepest pose of a body: even steps of motion first, then the rows round the worst."""
    if not len(columns.line):
        return 0, 0.0
    shape = cell.part.shape
    rows = _even_steps(columns, X_ST, MESH_POSE_COUNT if isinstance(shape, Mesh) else POSE_COUNT)
    deepest = depths(columns, shape, X_ST[rows])
    worst = int(np.argmax(deepest))
    if not deepest[worst] > 0.0:
        return int(rows[worst]), 0.0
    low, high = rows[max(worst - 1, 0)], rows[min(worst + 1, len(rows) - 1)]
    near = np.unique(np.append(np.linspace(low, high, NEAR_WORST_COUNT).astype(np.intp), rows[worst]))
    closer = depths(columns, shape, X_ST[near])
    at = int(np.argmax(closer))
    return int(near[at]), float(closer[at])


def _even_steps(columns: Columns, X_ST: Array, most: int) -> NDArray[np.intp]:
    """Rows between which no point of a body moves by more than half of its radius, or else ``most`` even steps."""
    shift = np.linalg.norm(np.diff(X_ST[:, :3, 3], axis=0), axis=1)
    turned = np.linalg.norm(np.diff(X_ST[:, :3, :3], axis=0), axis=(1, 2))  # chord of the angle, times sqrt(2) at most
    moved = np.append(0.0, np.cumsum(shift + columns.reach * turned))
    step = max(RADIUS_FRACTION * columns.radius, moved[-1] / most, DEPTH_TOL)
    marks = np.append(np.arange(0.0, moved[-1], step), moved[-1])
    return np.unique(np.append(np.searchsorted(moved, marks), len(X_ST) - 1))
