"""Paths on a roller: the cylinder of the four robots and the tasks that other tests lay on it."""

from typing import Any

import numpy as np

from cellplan.geometry.shapes import Cylinder, Solid
from cellplan.geometry.transforms import Array, pose, rotation_vector
from cellplan.model.cell.cell import Cell, Mode, MotionSettings, Part
from cellplan.model.origin import Origin
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.task.task import (
    CirclePath,
    PathSpec,
    PlaneName,
    PolygonPath,
    SampledPath,
    Task,
    TimeLaw,
    TimeLawKind,
    ToleranceEntry,
)
from cellplan.model.task.toolpath import Toolpath

EX, EY, EZ = np.eye(3)
ORIGIN = Origin(file="cell.yaml", lines={"tasks.ring": 9, "tasks.ring.path": 14, "motion.corners": 30})
CYLINDER = Cylinder(0.25, 0.5)
ALONG_X = pose(rpy=[0.0, np.pi / 2.0, 0.0])
PLANES = {PlaneName.XY: (EX, EY), PlaneName.YZ: (EY, EZ), PlaneName.XZ: (EX, EZ)}


def part_of(shape: Solid, X_PS: Array | None = None) -> Part:
    return Part(shape=shape, X_PS=np.eye(4) if X_PS is None else X_PS, held_by=(), X_WP=np.eye(4))


ROLLER = part_of(CYLINDER, ALONG_X)


def task_on(path: PathSpec, **words: Any) -> Task:
    plain: dict[str, Any] = {
        "name": "ring",
        "robot": "kuka",
        "project": None,
        "plane_offset": 0.0,
        "tool_axis": None,
        "tool_x": EX,
        "turn": 0.0,
        "axes": (0, 1, 2, 3, 4, 5),
        "is_spin_free": False,
        "tolerance": ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1e-4)),
        "start": 0.0,
        "duration": None,
        "feed": None,
        "time_law": TimeLaw(kind=TimeLawKind.QUINTIC),
        "blend": None,
        "origin": ORIGIN,
    }
    return Task(path=path, **(plain | words))


def clocked(*tasks: Task, duration: float | None = 4.0, step: float = 0.001, origin: Origin = ORIGIN) -> Cell:
    return Cell(
        name="cell",
        robots=(),
        part=ROLLER,
        tasks=tasks,
        obstacles=(),
        motion=MotionSettings(mode=Mode.SIMULTANEOUS, duration=duration, step=step),
        solver=SolverEntry(integrator="euler", method="weighted_pseudo_inverse", gain_per_s=500.0),
        checks=ChecksEntry(),
        origin=origin,
        inputs={},
    )


def circle(
    radius: float = 0.1, plane: PlaneName = PlaneName.XY, center: tuple[float, float] = (0.0, 0.0)
) -> CirclePath:
    return CirclePath(plane=plane, center=center, radius=radius)


def sampled(points: Any, **words: Any) -> SampledPath:
    plain: dict[str, Any] = {"source": "weld.csv", "axes": None, "rotations": None, "is_smooth": False}
    return SampledPath(points=np.asarray(points, dtype=float), **({**plain, "is_closed": False} | words))


RHOMBUS = PolygonPath(plane=PlaneName.YZ, corners=((0.175, 0), (0, 0.1), (-0.175, 0), (0, -0.1)), is_closed=True)
RECTANGLE = PolygonPath(
    plane=PlaneName.XZ,
    corners=((0.175, 0.125), (-0.175, 0.125), (-0.175, -0.125), (0.175, -0.125)),
    is_closed=True,
)
ON_ROLLER = {
    "circle": task_on(circle(), project=EZ),
    "rhombus": task_on(RHOMBUS, project=EX, tool_x=EZ),
    "rectangle": task_on(RECTANGLE, project=-EY),
}


def residual_of_twists(path: Toolpath) -> float:
    """Largest difference between twists and central differences of poses, in [m/m] and [rad/m]."""
    worst = 0.0
    for piece in path.pieces:
        h = 1e-5 * piece.length
        s = np.linspace(0.01, 0.99, 151) * piece.length
        above, below = piece.poses(s + h), piece.poses(s - h)
        linear = (above - below)[:, :3, 3] / (2.0 * h)
        angular = rotation_vector(above[:, :3, :3] @ np.swapaxes(below[:, :3, :3], 1, 2)) / (2.0 * h)
        worst = max(worst, np.abs(np.hstack([linear, angular]) - piece.twists_per_length(s)).max())
    return worst
