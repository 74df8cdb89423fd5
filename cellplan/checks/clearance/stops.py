"""What happens when one robot stops at once, and the others go on, react and brake on their path.

Two robots are then at different places of the program: the one that stopped at t, the other at up to t + R, with the
time R of the program that it covers until it stands. Distances are proved over this band by branch and bound
(``certify.free_clocks``). Depths of tools and distances of grips are searched for: on an even grid of the band, and
then on ever finer ones round the largest value. Where one of two robots stands still all the time the band has no
width: they meet in the configurations of the run only, whichever of them stops.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.certify.free_clocks.free_clocks import ClockRegion, RegionBound, band, certify_regions
from cellplan.certify.run_pairs import scene_of_rows, scene_of_run
from cellplan.checks.clearance.skew import stands_still
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array, inverse
from cellplan.measures.tool_depth import tool_axis_depths, tool_depth_at
from cellplan.measures.tool_errors import errors_on_part, part_poses
from cellplan.model.cell.cell import Cell, Grasp, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Check
from cellplan.model.report.stops import StopDepth, StopDistance, StopGrip, StopInstant, StopReport, running_on
from cellplan.model.task.task import Frame
from cellplan.model.units import MM
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

BAND_PARTS: Final = 40  # rectangles across a band: a stop is followed no more than a fortieth too far
SAMPLES: Final = 241  # of a stop, on the first grid of a search
MESH_SAMPLES: Final = 61  # likewise where the part is a mesh, whose depths take fifty times as long
SHIFTS: Final = 16  # places of the other robot on that grid, to each side
ROUNDS: Final = 4  # finer grids round the largest value
FINER: Final = 9  # places along each side of these
MAX_PIECES: Final = 400  # of a program beside a robot that stands still
BODY_POSES: Final = 240  # of a tool at once at which its bodies count, beside its axis
SAME_PLACE: Final = 1e-9  # [m] values below it are none
_WORDS: Final = {"stop_depth": ("depth", "at most"), "stop_clearance": ("smallest distance", "at least")}
DEPTH_TOL: Final = 1e-6  # [m] as in the check of depths without stops

Figure = Callable[[Array, Array], Array]  # times of one robot and of the other in [s], shape (M,) -> values, shape (M,)


def stop_report(scene: Scene, schedule: Schedule, q: RobotRows, *, progress: Progress = silent) -> StopReport | None:
    """Worst figures of all stops of one robot; None in a cell whose controllers do not state how others go on.

    The others are followed to the end of the rows.
    """
    going = running_on(scene.cell)
    if not going or len(schedule.times) < 2:
        return None
    progress("searching the worst stop", 0.0)
    stops = _Stops(scene, schedule, q, going)
    return stops.report(stops.whole_band)


def one_stop(scene: Scene, schedule: Schedule, q: RobotRows, *, robot: str, at: float) -> StopReport | None:
    """The same for a single stop: of one robot at one instant in [s]."""
    going = running_on(scene.cell)
    if not going:
        return None
    stops = _Stops(scene, schedule, q, going)
    return stops.report(lambda first, second: stops.single(first, second, robot=robot, at=at))


def check_stops(cell: Cell, report: StopReport | None) -> list[Check]:
    """Depth and distance against what the cell demands of stops; none where it demands nothing.

    Args:
        report: What happens at worst; None where it is not known, which fails every demand.
    """
    demand = cell.checks.stop
    if demand is None:
        return []
    limits = {"stop_depth": demand.depth_mm, "stop_clearance": demand.clearance_mm}
    if report is None:
        return [_unknown(name, limit) for name, limit in limits.items() if limit is not None]
    checks = []
    if demand.depth_mm is not None:
        deepest = report.deepest
        depth = 0.0 if deepest is None else deepest.depth
        of = "no tool" if deepest is None else f"tool of task '{deepest.task}'"
        passed, values = depth <= demand.depth_mm.si + DEPTH_TOL, (MM * depth, demand.depth_mm)
        checks.append(_check("stop_depth", passed, values, of, None if deepest is None else deepest.worst))
    if demand.clearance_mm is not None:
        nearest = report.nearest
        distance = np.inf if nearest is None else min(nearest.proved, nearest.distance)
        of = "no two robots" if nearest is None or nearest.bodies is None else " - ".join(nearest.bodies)
        passed, values = distance >= demand.clearance_mm.si, (MM * float(min(distance, 1e6)), demand.clearance_mm)
        checks.append(_check("stop_clearance", passed, values, of, None if nearest is None else nearest.worst))
    return checks


def _unknown(name: str, limit: float) -> Check:
    """A failed check of a demand that cannot be judged."""
    value = np.inf if name == "stop_depth" else 0.0
    text = "not known how other robots go on: the controllers of this cell state neither reaction_ms nor brake_s"
    message = f"{_WORDS[name][0]} at a stop of one robot: {text}; demanded: {_WORDS[name][1]} {limit:g} mm"
    return Check(name, "stop of one robot", False, message, value=value, limit=limit, unit="mm", at_s=None)


def instant_text(instant: StopInstant | None) -> str:
    """When a figure is reached, in words."""
    if instant is None:
        return ""
    late = 1e3 * (instant.path_s - instant.at_s)
    return f"'{instant.stopped}' stops at {instant.at_s:.3f} s, '{instant.going}' goes on by {late:.0f} ms of its path"


def _check(name: str, passed: bool, values: tuple[float, float], of: str, instant: StopInstant | None) -> Check:
    value, limit = values
    what, side = _WORDS[name]
    when = f" when {instant_text(instant)}" if instant is not None else ""
    message = f"{what} at a stop of one robot: {value:.3g} mm ({of}){when}; demanded: {side} {limit:g} mm"
    at_s = None if instant is None else instant.at_s
    return Check(name, "stop of one robot", passed, message, value=value, limit=limit, unit="mm", at_s=at_s)


@dataclass(frozen=True, slots=True)
class _Band:
    """Places of two robots that meet: rectangles of rows, and a grid of times in [s], shape (M,) each."""

    rectangles: Array  # for the certificate, see ``ClockRegion``
    samples: Array  # times of the first robot, or of the second, that a search begins with, in [s], shape (I,)
    low: float  # least lead of the second robot before the first in [s]
    high: float  # greatest one
    spread: float = 0.0  # by how much the samples may move when the search is refined, in [s]
    of_second: bool = False  # whether the samples are those of the second robot

    def times(self, samples: Array, leads: Array) -> tuple[Array, Array]:
        """Times of both robots in [s] for all samples with all leads, shape (I L,) each."""
        sample, lead = (grid.ravel() for grid in np.meshgrid(samples, leads, indexing="ij"))
        return (sample - lead, sample) if self.of_second else (sample, sample + lead)


Bands = Callable[[str, str], "_Band | None"]


def _depths(cell: Cell, robot: str, X_PT: Array) -> Array:
    """Depths of a tool at poses on the part: its bodies count at even ones of many, and where its axis is deepest."""
    if len(X_PT) <= BODY_POSES:
        return tool_depth_at(cell, robot, X_PT)
    depths = tool_axis_depths(cell, robot, X_PT)
    half = BODY_POSES // 2
    some = np.linspace(0, len(X_PT) - 1, half).round().astype(np.intp)
    chosen = np.union1d(some, np.argsort(-depths, kind="stable")[:half])
    depths[chosen] = tool_depth_at(cell, robot, X_PT[chosen])
    return depths


def _without_touching(scene: Scene) -> Scene:
    """The scene without pairs of a part and what works on it or grips it: other figures say what becomes of these."""
    apart = [row for row, pair in enumerate(scene.pairs) if pair.rule not in {Rule.PROCESS, Rule.GRIP}]
    return scene_of_rows(scene, apart)


def _nearest(scene: Scene, q: Array, regions: Sequence[ClockRegion]) -> list[RegionBound]:
    """Distances in some regions: the smallest of all is searched for, the others are proved to be no smaller."""
    bounds = list(certify_regions(scene, q, regions)) if regions else []
    waiting = sorted(range(len(bounds)), key=lambda place: (bounds[place].is_met, bounds[place].proved))
    first = [place for place in waiting if not bounds[place].is_met] or waiting[:1]
    _search(scene, q, regions, places=first, bounds=bounds)
    level = min((bound.distance for bound in bounds), default=np.inf)
    rest = [place for place in waiting if place not in first]
    if not rest or not level > 0.0:
        return bounds
    farther = tuple(
        replace(pair, demand=max(pair.demand, level)) if pair.rule is Rule.CLEARANCE else pair for pair in scene.pairs
    )
    for place, bound in zip(
        rest, certify_regions(replace(scene, pairs=farther), q, [regions[place] for place in rest]), strict=True
    ):
        if bound.is_met:
            bounds[place] = bound
    _search(scene, q, regions, places=[place for place in rest if not bounds[place].proved >= level], bounds=bounds)
    return bounds


def _search(
    scene: Scene, q: Array, regions: Sequence[ClockRegion], *, places: Sequence[int], bounds: list[RegionBound]
) -> None:
    """Search for the smallest distances of some of the regions."""
    if places:
        sharper = certify_regions(scene, q, [regions[place] for place in places], with_minimum=True)
        for place, bound in zip(places, sharper, strict=True):
            bounds[place] = bound


class _Stops:
    """Stops in one motion."""

    def __init__(self, scene: Scene, schedule: Schedule, q: RobotRows, going: Mapping[str, float]) -> None:
        self._scene = _without_touching(scene_of_run(scene, [task.task.name for task in schedule.tasks]))
        self._cell, self._times, self._q, self._going = scene.cell, schedule.times, q, going
        self._tasks = [task.task for task in schedule.tasks if task.task.relative_to is Frame.PART]
        self._standing = {name for name, rows in q.items() if stands_still(rows)}

    def report(self, bands: Bands) -> StopReport:
        """All figures over the bands of two robots, by their names."""
        robots = [robot.name for robot in self._cell.robots]
        pair_bands = {pair: band_ for pair in combinations(robots, 2) if (band_ := bands(*pair)) is not None}
        regions = [ClockRegion(first=a, second=b, rectangles=band.rectangles) for (a, b), band in pair_bands.items()]
        q = np.concatenate([self._q[name] for name in robots], axis=1)
        bounds = _nearest(self._scene, q, regions)
        return StopReport(
            runs_on=dict(self._going),
            depths=tuple(self._depths(bands)),
            distances=tuple(self._distance(bound) for bound in bounds),
            grips=tuple(self._grip(grasp, bands) for grasp in self._cell.closures),
        )

    def whole_band(self, first: str, second: str) -> _Band | None:
        """Either robot stops at any instant."""
        low, high = -self._going.get(first, 0.0), self._going.get(second, 0.0)
        if low == high:
            return None
        end, still = float(self._times[-1]), self._standing & {first, second}
        count = MESH_SAMPLES if isinstance(self._cell.part.shape, Mesh) else SAMPLES
        samples = np.linspace(0.0, end, count)
        if still:
            return _Band(
                _along_one(len(self._times), first in self._standing, second in self._standing),
                samples,
                0.0,
                0.0,
                end / (count - 1),
            )
        return _Band(band(self._times, low, high, parts=BAND_PARTS), samples, low, high, end / (count - 1))

    def single(self, first: str, second: str, *, robot: str, at: float) -> _Band | None:
        """One robot stops at one instant."""
        if robot not in {first, second}:
            return None
        ahead = self._going.get(second if robot == first else first, 0.0)
        row, last = (float(np.interp(t, self._times, np.arange(len(self._times)))) for t in (at, at + ahead))
        sides = [row, row, row, last] if robot == first else [row, last, row, row]
        low, high = (0.0, ahead) if robot == first else (-ahead, 0.0)
        return _Band(np.array([sides]), np.array([at]), low, high, of_second=robot == second)

    def _distance(self, bound: RegionBound) -> StopDistance:
        """What the certificate found of two robots."""
        return StopDistance(
            robots=(bound.first, bound.second),
            distance=bound.distance,
            proved=bound.proved,
            bodies=bound.bodies,
            worst=None
            if bound.at is None
            else self._instant((bound.first, bound.second), self._at(_met(bound, self._standing))),
            is_free=bound.is_met or (bound.distance > 0.0 and bound.proved > 0.0),
        )

    def _at(self, rows: tuple[float, float]) -> tuple[float, float]:
        """Times in [s] of two rows."""
        first, second = np.interp(rows, np.arange(len(self._times)), self._times).tolist()
        return first, second

    @staticmethod
    def _instant(robots: tuple[str, str], times: tuple[float, float]) -> StopInstant:
        """Which of two robots has stopped: the one that is at the earlier time."""
        order = (0, 1) if times[0] <= times[1] else (1, 0)
        stopped, going = order
        return StopInstant(stopped=robots[stopped], going=robots[going], at_s=times[stopped], path_s=times[going])

    def _depths(self, bands: Bands) -> list[StopDepth]:
        """Depth of each tool that works on a part which another robot carries."""
        if self._cell.carrier is None:
            return []
        carrier = self._cell.robots[self._cell.carrier].name
        depths = []
        for task in self._tasks:
            band = bands(carrier, task.robot)
            if band is None or task.robot == carrier:
                continue

            def depth(t_part: Array, t_tool: Array, robot: str = task.robot) -> Array:
                return _depths(self._cell, robot, self._on_part(robot, t_part, t_tool))

            value, times = self._largest(depth, band)
            worst = self._instant((carrier, task.robot), times) if value > SAME_PLACE else None
            depths.append(StopDepth(task=task.name, depth=value, worst=worst))
        return depths

    def _grip(self, grasp: Grasp, bands: Bands) -> StopGrip:
        """How far a further holder is drawn from its grasp, or from the other holder."""
        carrier = self._cell.positioners[0]
        band = bands(carrier, grasp.robot)
        if band is None:
            return StopGrip(robot=grasp.robot, distance=0.0, worst=None)

        def distance(t_part: Array, t_tool: Array) -> Array:
            X_PT = self._on_part(grasp.robot, t_part, t_tool)
            error = errors_on_part(X_PT, grasp.X_PT[None], grasp)
            return np.linalg.norm(error[:, :3], axis=1)

        value, times = self._largest(distance, band)
        worst = self._instant((carrier, grasp.robot), times) if value > SAME_PLACE else None
        return StopGrip(robot=grasp.robot, distance=value, worst=worst)

    def _on_part(self, robot: str, t_part: Array, t_tool: Array) -> Array:
        """Tool poses on the part while both robots are at times of their own, shape (M, 4, 4)."""
        chains = self._scene.chains
        carrier = self._cell.positioners[0]
        X_WP = part_poses(self._cell, chains, {carrier: self._between(carrier, t_part)})
        return inverse(X_WP) @ chains[robot].tool_poses(self._between(robot, t_tool))

    def _between(self, robot: str, times: Array) -> Array:
        """Positions of a robot at times in [s]; joints move linearly between two rows."""
        return np.stack([np.interp(times, self._times, column) for column in self._q[robot].T], axis=1)

    def _largest(self, figure: Figure, band_: _Band) -> tuple[float, tuple[float, float]]:
        """Largest value over a band, and the times in [s] of the two robots there."""
        leads = np.union1d(np.linspace(band_.low, band_.high, 2 * SHIFTS + 1), [0.0])
        samples, spread, step = band_.samples, band_.spread, float(np.diff(leads).max(initial=0.0))
        value, at = -np.inf, (0.0, 0.0)
        for _ in range(1 + ROUNDS):
            t_first, t_second = (np.clip(times, 0.0, self._times[-1]) for times in band_.times(samples, leads))
            values = figure(t_first, t_second)
            best = int(np.argmax(values))
            if values[best] > value:
                value, at = float(values[best]), (float(t_first[best]), float(t_second[best]))
            around = np.linspace(-1.0, 1.0, FINER)
            samples = at[band_.of_second] + spread * around if spread else band_.samples
            leads = np.unique(np.clip(at[1] - at[0] + step * around, band_.low, band_.high))
            spread, step = spread * 2.0 / (FINER - 1), step * 2.0 / (FINER - 1)
        return value, at


def _along_one(count: int, first_stands: bool, second_stands: bool) -> Array:
    """Rectangles of two robots of which one stands still in its first row; both where none moves."""
    edges = np.linspace(0.0, count - 1, 1 + min(count - 1, MAX_PIECES))
    varied, rest = np.column_stack([edges[:-1], edges[1:]]), np.zeros((len(edges) - 1, 2))
    if first_stands and second_stands:
        return np.zeros((1, 4))
    return np.hstack([rest, varied] if first_stands else [varied, rest])


def _met(bound: RegionBound, standing: Collection[str]) -> tuple[float, float]:
    """Rows in which two robots are nearest; one that stands still in its first row is in the row of the other."""
    first, second = (0.0, 0.0) if bound.at is None else bound.at
    if bound.first in standing and first == 0.0:
        first = second
    if bound.second in standing and second == 0.0:
        second = first
    return first, second
