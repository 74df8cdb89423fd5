"""Tools along seams: distances of tips of rods from the seam, and of tools from the walls beside it."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.outlines import reaches
from cellplan.geometry.shapes import Solid
from cellplan.geometry.transforms import inverse
from cellplan.measures.tool_errors import relative_to_task_frame
from cellplan.model.cell.cell import Cell, RobotRows, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check
from cellplan.model.task.clocked_path import seam_at
from cellplan.model.units import MM
from cellplan.scene.kinematics.screw_chain import Chains


def check_seam_distances(cell: Cell, schedule: Schedule, chains: Chains, q: RobotRows, X_WP: Array) -> Iterator[Check]:
    """Whether tips of rods are where their tasks have them beside their seams, and tools clear of the walls.

    The walls count for rods, and for other tools where a task demands a distance from them.

    Args:
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    paths = {path.task.name: path for path in schedule.paths}
    for scheduled in schedule.tasks:
        task, path = scheduled.task, paths.get(scheduled.task.name)
        tool = cell.robot(task.robot).tool
        solids = tool_solids(tool, is_demanded=task.seam is not None and task.seam.rod_clearance is not None)
        on_path = (schedule.times >= scheduled.begin) & (schedule.times <= scheduled.end)
        line = None if path is None else seam_at(path, scheduled.travelled[on_path])
        if not solids or line is None or not np.any(on_path):
            continue
        X_WT = chains[task.robot].tool_poses(q[task.robot])
        X_PT, times = relative_to_task_frame(task, X_WT, X_WP)[on_path], schedule.times[on_path]
        if tool.rod is not None:
            yield tip_check(scheduled, line, X_PT, desired=scheduled.X_PT[on_path], times=times)
        yield wall_check(scheduled, wall_distances(solids, line, X_PT), times)


def tool_solids(tool: Tool, *, is_demanded: bool) -> list[tuple[Solid, Array]]:
    """Solids of a tool that are to be clear of walls, with their poses X_TS: its rod, or all where that is demanded."""
    bodies = tool.bodies if tool.rod is None else tool.rod.bodies()[-1:]
    X_TF = inverse(tool.X_FT)
    return [(body.shape, X_TF @ body.X_BS) for body in bodies] if tool.rod is not None or is_demanded else []


def wall_distances(solids: Sequence[tuple[Solid, Array]], line: SeamLine, X_PT: Array) -> dict[str, Array]:
    """Distance of a tool from the plane of each wall through the seam in [m], shape (N,), negative inside.

    Args:
        solids: Solids of the tool with their poses X_TS, shape (4, 4) each.
        line: The seam beside it.
        X_PT: Poses of the tool on the part, shape (N, 4, 4).
    """

    def from_wall(normals: Array, shape: Solid, X_PS: Array) -> Array:
        inward = -np.einsum("nji,nj->ni", X_PS[:, :3, :3], normals)
        return np.asarray(np.sum((X_PS[:, :3, 3] - line.points) * normals, axis=1) - reaches(shape, inward))

    return {
        name: np.min([from_wall(normals, shape, X_PT @ X_TS) for shape, X_TS in solids], axis=0)
        for name, normals in line.walls.items()
    }


def tip_check(scheduled: TaskSchedule, line: SeamLine, X_PT: Array, *, desired: Array, times: Array) -> Check:
    """The greatest distance of a tip from its seam against that which its task has, with its tolerance."""
    task = scheduled.task
    distances, demanded = (np.linalg.norm(X[:, :3, 3] - line.points, axis=1) for X in (X_PT, desired))
    most = float(demanded.max()) + task.tolerance.position_mm.si
    worst = int(np.argmax(distances))
    value, at_s = float(distances[worst]), float(times[worst])
    message = (
        f"tip of task '{task.name}': {MM * distances.min():.3f} to {MM * value:.3f} mm from its seam, farthest at "
        f"{at_s:.3f} s, at most {MM * most:.4g} mm by its standoff, pass and weave, and its tolerance"
    )
    return Check(
        "seam_distance", task.name, value <= most, message, value=MM * value, limit=MM * most, unit="mm", at_s=at_s
    )


def wall_check(scheduled: TaskSchedule, distances: Mapping[str, Array], times: Array) -> Check:
    """The smallest distance of a tool from the walls against what its task demands, less its tolerance."""
    task = scheduled.task
    least = (task.seam.rod_clearance if task.seam is not None else None) or 0.0
    name = min(distances, key=lambda wall: float(distances[wall].min()))
    worst = int(np.argmin(distances[name]))
    value, at_s = float(distances[name][worst]), float(times[worst])
    others = ", ".join(f"'{wall}' {MM * it.min():.3f} mm" for wall, it in distances.items() if wall != name)
    message = (
        f"tool of task '{task.name}': {MM * value:.3f} mm from the wall '{name}' at {at_s:.3f} s"
        f"{f', from {others}' if others else ''}, at least {MM * least:g} mm is demanded"
    )
    passed = value >= least - task.tolerance.position_mm.si
    message += "" if passed else "; give it a stick-out or a standoff, another work angle, or a slimmer tool"
    return Check("wall_distance", task.name, passed, message, value=MM * value, limit=MM * least, unit="mm", at_s=at_s)
