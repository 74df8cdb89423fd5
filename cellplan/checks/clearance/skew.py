"""Allowed skew: how far the clocks of controllers may be apart before a tool error, a depth or a distance is too much.

Robots on one controller share a clock; those without a controller have one of their own. The first robot of a pair
plays its program at time t while the second is at t + s; every figure holds for all t and for all s up to the skew.
Before its first row and after its last one a robot stands there. A robot that stands still all the time is where it is
on every clock: it meets the other one in the configurations of the run, of which the certificate of the run speaks.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.certify.free_clocks.free_shift import ShiftBound, free_shift
from cellplan.certify.lever_arms import LeverArms
from cellplan.checks.tools.skew import ErrorGrowth, Mover, ShiftedTool, ToolTravel
from cellplan.geometry.transforms import Array
from cellplan.measures.tool_depth import tool_reach
from cellplan.model.cell.cell import Cell, RobotRows, stacked_positions
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import ToolDepth
from cellplan.model.report.skew import MOST_SKEW, AllowedSkew, PairSkew, SkewLimit, SkewReport, ToolSkew, clock_groups
from cellplan.model.task.task import Frame
from cellplan.scene.scene import Scene

STAGE = "searching the allowed skew"


def allowed_skew(
    scene: Scene, schedule: Schedule, q: RobotRows, depths: tuple[ToolDepth, ...], *, progress: Progress = silent
) -> SkewReport:
    """How far the clocks of a run may be apart."""
    cell, times = scene.cell, schedule.times
    tools = tuple(_tools(scene, schedule, q, depths))
    moving, pairs = FreeMotion(scene, q), list(_apart(cell))
    allowed = []
    for place, (first, second) in enumerate(pairs):
        progress(STAGE, place / len(pairs))
        limits = [limit for tool in tools if {tool.robot, tool.carrier} == {first, second} for limit in tool.limits()]
        shift = ShiftBound(shift=MOST_SKEW)
        if not (stands_still(q[first]) or stands_still(q[second])):
            shift = free_shift(moving, times, first, second, most=MOST_SKEW)
        at_s = None if shift.at is None else float(np.interp(shift.at[0], np.arange(len(times)), times))
        bodies = "" if shift.bodies is None else " - ".join(shift.bodies)
        limits.append(AllowedSkew(limit=SkewLimit.CLEARANCE, skew=shift.shift, subject=bodies, at_s=at_s))
        allowed.append(PairSkew(first=first, second=second, limits=tuple(limits), stated=_stated(cell, first, second)))
    results = tuple(tool.result(cell, float(times[-1])) for tool in tools)
    return SkewReport(pairs=tuple(allowed), tools=results, groups=clock_groups(cell))


def stands_still(q: Array) -> bool:
    """Whether a robot is in one configuration all the time; positions in [rad] or [m], shape (N, n)."""
    return not np.any(np.ptp(q, axis=0))


def _apart(cell: Cell) -> Iterator[tuple[str, str]]:
    """Pairs of robots that do not share a clock."""
    clock = {name: place for place, group in enumerate(clock_groups(cell)) for name in group}
    for first, second in combinations([robot.name for robot in cell.robots], 2):
        if clock[first] != clock[second]:
            yield first, second


def _stated(cell: Cell, first: str, second: str) -> float | None:
    """Largest difference in [s] of two clocks: each statement holds for all others, so the smaller one does."""
    controls = [cell.robot(name).control for name in (first, second)]
    controllers = [cell.controllers.get(control.id) for control in controls if control is not None]
    stated = [
        controller.skew_ms.si for controller in controllers if controller is not None and controller.skew_ms is not None
    ]
    return min(stated, default=None)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _SkewedTool:
    """One tool on a part that another clock carries."""

    name: str
    robot: str
    carrier: str
    travel: ToolTravel
    depth: ErrorGrowth | None

    def limits(self) -> Iterator[AllowedSkew]:
        """What tolerance and depth allow."""
        skew, at_s = min(self.travel.position.allowed(), self.travel.orientation.allowed(), key=lambda entry: entry[0])
        yield self._limit(SkewLimit.TOOL, skew, at_s)
        if self.depth is not None:
            yield self._limit(SkewLimit.DEPTH, *self.depth.allowed())

    def _limit(self, limit: SkewLimit, skew: float, at_s: float | None) -> AllowedSkew:
        if skew >= MOST_SKEW:
            return AllowedSkew(limit=limit, skew=MOST_SKEW)
        return AllowedSkew(limit=limit, skew=skew, subject=self.name, at_s=at_s)

    def result(self, cell: Cell, duration: float) -> ToolSkew:
        """What the skew costs this tool, at the one that is stated too."""
        stated = _stated(cell, self.robot, self.carrier)
        (by_position, at_position), (by_orientation, at_orientation) = (
            growth.allowed() for growth in (self.travel.position, self.travel.orientation)
        )
        least = min(by_position, by_orientation)
        at_s = at_position if by_position <= by_orientation else at_orientation
        return ToolSkew(
            name=self.name,
            robot=self.robot,
            carrier=self.carrier,
            speed=self.travel.speed,
            by_position=min(by_position, MOST_SKEW),
            by_orientation=min(by_orientation, MOST_SKEW),
            at_s=at_s if least < MOST_SKEW else None,
            position=None if stated is None else self.travel.position.largest(stated),
            orientation=None if stated is None else self.travel.orientation.largest(stated),
            shortest_cycle=None if stated is None else _shortest_cycle(stated, least, duration),
        )


def _shortest_cycle(stated: float, allowed: float, duration: float) -> float:
    """Time in [s] at which a stated skew is allowed: what is allowed grows in proportion to the time."""
    if stated == 0.0 or not np.isfinite(allowed):
        return 0.0
    return float(np.inf) if allowed == 0.0 else duration * stated / allowed


def _tools(scene: Scene, schedule: Schedule, q: RobotRows, depths: tuple[ToolDepth, ...]) -> Iterator[_SkewedTool]:
    """The tools that work on, or hold, a part that another clock carries."""
    cell, times = scene.cell, schedule.times
    if cell.carrier is None:
        return
    carrier, apart = cell.robots[cell.carrier].name, {frozenset(pair) for pair in _apart(cell)}
    stacked = stacked_positions(cell, q)
    arms = LeverArms(scene, stacked)
    steps, by_task = arms.steps(stacked), {depth.task: depth for depth in depths}
    movers = {robot: Mover.of(scene, arms, robot, q=q[robot], steps=steps) for robot in q}
    shifted = partial(ShiftedTool, carrier=movers[carrier], X_CP=cell.part.X_CP)
    stands = stands_still(q[carrier])  # a part at rest is where it is on every clock
    for scheduled in () if stands else schedule.tasks:
        task = scheduled.task
        if task.relative_to is not Frame.PART or {task.robot, carrier} not in apart:
            continue
        limits = task.tolerance.position_mm.si, task.tolerance.orientation_deg.si
        first = task.first_judged(times)
        tool = shifted(relation=task, mover=movers[task.robot], desired=scheduled.X_PT, limits=limits, first=first)
        depth = by_task.get(task.name)
        reach = tool_reach(cell, task.robot)
        deep = None if depth is None else tool.depth_growth(times, depth.depth, depth.limit, reach=reach)
        yield _SkewedTool(name=task.name, robot=task.robot, carrier=carrier, travel=tool.travel(times), depth=deep)
    for grasp in cell.closures:
        if {grasp.robot, carrier} in apart:
            desired = np.broadcast_to(grasp.X_PT, (len(times), 4, 4))
            limits = cell.checks.closure_mm.si, cell.checks.closure_deg.si
            tool = shifted(relation=grasp, mover=movers[grasp.robot], desired=desired, limits=limits)
            yield _SkewedTool(
                name=grasp.name, robot=grasp.robot, carrier=carrier, travel=tool.travel(times), depth=None
            )
