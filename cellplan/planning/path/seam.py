"""Tools along seams: axes that follow the walls beside a path, and the tip's distance from it."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import Interval, by_differences, cubic_fit
from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine, tool_axes, tool_targets
from cellplan.geometry.transforms import cross
from cellplan.model.task.seam import WallPlace
from cellplan.model.task.task import Task
from cellplan.planning.path.curve import PathCurve
from cellplan.planning.path.formatting import in_mm
from cellplan.planning.path.projection import along

STEEPEST_WALL: Final = np.deg2rad(45.0)  # [rad] of a wall to the seam: it would not stand beside it any more
NO_JUMP: Final = 1e-7  # [rad] between the axes on both sides of a corner: rounding of directions in files
FIT: Final = 1e-8  # [m] of a line beside a seam


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeamAxes:
    """Tool axes along a curve by the walls beside it; see `cellplan.geometry.curves.curve.Curve`."""

    curve: PathCurve  # the seam
    task: Task  # its task
    angles: SeamAngles  # how the tool is held

    @property
    def knots(self) -> Array:
        """Those of the seam."""
        return self.curve.curve.knots

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Unit axes into the part and their rates, from three places of the same smooth span."""
        return by_differences(self._axes, self.knots, u, interval)

    def _axes(self, u: Array, interval: Interval) -> Array:
        """The axes alone."""
        return tool_axes(self.line(u, interval), self.angles)

    def line(self, u: Array, interval: Interval) -> SeamLine:
        """The seam at parameters of shape (N,)."""
        p, dp = self.curve.curve.evaluate(u, interval)
        t = dp / np.linalg.norm(dp, axis=1, keepdims=True)
        walls = {name: _normals(curve.evaluate(u, interval)[0]) for name, curve in self.curve.walls.items()}
        upright: dict[str, float] = {}
        for name, wall in self.task.seam.walls.items() if self.task.seam else ():
            if isinstance(wall, WallPlace) and wall is not WallPlace.SURFACE:
                side = -1.0 if self.task.stretch and self.task.stretch.is_reversed else 1.0
                upright[name] = -side if wall is WallPlace.LEFT else side
            elif isinstance(wall, WallPlace):
                walls[name] = self._surface(p, u, interval)
            else:
                walls[name] = np.broadcast_to(wall, p.shape)
        for name, side in upright.items():
            floor = next(iter(walls.values()))
            walls[name] = _normals(side * cross(floor, t))
        return SeamLine(
            source=self.task.name, points=p, tangents=t, behind=np.zeros(len(u)), walls=walls, is_closed=False
        )

    def _surface(self, p: Array, u: Array, interval: Interval) -> Array:
        """Outward normals of the part under a projected path."""
        if self.curve.patch is not None:
            return self.curve.patch.normals(p)
        if self.curve.inward is None:
            raise ValueError("a path that is not projected has no surface under it")
        return -_normals(self.curve.inward.evaluate(u, interval)[0])


@dataclass(frozen=True, slots=True, eq=False)
class _TipCurve:
    """Tips beside a seam; see `cellplan.geometry.curves.curve.Curve`."""

    axes: SeamAxes

    @property
    def knots(self) -> Array:
        """Those of the seam."""
        return self.axes.knots

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives."""
        return by_differences(self._tips, self.knots, u, interval)

    def _tips(self, u: Array, interval: Interval) -> Array:
        """Points alone."""
        return tool_targets(self.axes.line(u, interval), self.axes.angles)[0]


def follow_seam(task: Task, curve: PathCurve, angles: SeamAngles) -> tuple[PathCurve, SeamAxes]:
    """The curve of the tool tip along a seam, and the axes of the tool.

    Raises:
        InputError: A wall does not stand beside the path, or the axis of the tool jumps at a corner.
    """
    axes = SeamAxes(curve=curve, task=task, angles=angles)
    _refuse_steep_walls(task, axes)
    _refuse_jumps(task, axes)
    tip = cubic_fit(_TipCurve(axes), tolerance=FIT) if angles.is_offset else curve.curve
    return replace(curve, curve=tip, seam=axes), axes


def _normals(vectors: Array) -> Array:
    """Unit vectors along others, shape (N, 3)."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _refuse_steep_walls(task: Task, axes: SeamAxes) -> None:
    """Refuse a wall that the seam runs into."""
    u = along(axes.curve.curve)
    line = axes.line(u, (u[0], u[-1]))
    for name, normals in line.walls.items():
        steep = np.abs(np.sum(normals * line.tangents, axis=1))
        k = int(np.argmax(steep))
        if steep[k] > np.sin(STEEPEST_WALL):
            raise InputError(
                f"{task.where(f'path.walls.{name}')}: expected a wall beside the path, but at {in_mm(line.points[k])} "
                f"the path runs into it at {np.rad2deg(np.arcsin(min(steep[k], 1.0))):.3g} deg; give left or right for "
                "a wall that follows the path, or a path of its own to each side"
            )


def _refuse_jumps(task: Task, axes: SeamAxes) -> None:
    """Refuse a corner at which the axis of the tool jumps."""
    stops = axes.curve.stops
    for before, here, after in zip(stops[:-2], stops[1:-1], stops[2:], strict=True):
        u = np.array([here])
        sides = [axes.evaluate(u, interval)[0][0] for interval in ((before, here), (here, after))]
        jump = float(np.arctan2(np.linalg.norm(np.cross(*sides)), sides[0] @ sides[1]))
        if jump > NO_JUMP:
            p = axes.curve.curve.evaluate(u, (before, here))[0][0]
            raise InputError(
                f"{task.where('path')}: expected a tool axis without a jump, but at the corner {in_mm(p)} it would "
                f"turn by {np.rad2deg(jump):.3g} deg at once; round the corner with corners: {{blend_mm: 5}}, or give "
                "each side a path of its own"
            )
