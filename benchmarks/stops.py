"""Random stops of one robot, judged by brute force: ``python benchmarks/stops.py --stops 200 [CELL…]``.

A stop is a robot and an instant. What ``one_stop`` says of it is compared with what is found at many places of the way
that the others still cover: poses from pinocchio, distances from coal, depths from points along the axis of a tool, and
how far a further holder is drawn from its grasp.
"""

import argparse
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import coal
import numpy as np
from coal_shapes import coal_shape

from cellplan import load_cell, solve
from cellplan.certify.free_clocks.free_clocks import MINIMUM_TOL, watched_pairs
from cellplan.certify.run_pairs import scene_of_run
from cellplan.checks.clearance.stops import one_stop
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.stops import StopReport, running_on
from cellplan.model.robot.robot import BASE
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.scene.kinematics.pinocchio_model import CombinedModel, LinkState
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

CELLS: Final = tuple(
    f"cells/{name}.yaml" for name in ("four_controllers", "load_sharing", "turntable", "rail", "multimove", "in_turn")
)
PLACES: Final = 41  # of the way that another robot still covers
POINTS: Final = 400  # along the axis of a tool
ALONG: Final = 9  # places of that way at which a depth is taken
REACTION, BRAKE = 0.1, 0.2  # [s] of robots whose cell states none
EXACT: Final = 2e-4  # [m] a distance of the program is no farther below the truth


@dataclass(frozen=True, eq=False)
class Case:
    """A solved cell with one phase of its motion."""

    cell: Cell
    scene: Scene
    schedule: Schedule
    q: Mapping[str, Array]


def cases(path: Path) -> Iterator[Case]:
    """The phases of a cell, solved without its controllers: what they cost at their worst is not asked for here."""
    cell = load_cell(path)
    bare = replace(cell, robots=tuple(replace(robot, control=None) for robot in cell.robots), controllers={})
    solution = solve(replace(bare, checks=cell.checks.changed(stop=None)))
    for run in solution.runs:
        scene = scene_of_run(run.scene, [task.task.name for task in run.schedule.tasks])
        scene = replace(scene, cell=stopping(scene.cell, cell))
        yield Case(scene.cell, scene, run.schedule, run.report.q)


def stopping(cell: Cell, stated: Cell) -> Cell:
    """A cell with the controllers of another one; where that does not state how robots stop, they stop alike."""
    controllers = dict(stated.controllers)
    control = {robot.name: robot.control or RobotControlEntry(id=robot.name) for robot in stated.robots}
    for value in control.values():
        controllers.setdefault(value.id, ControllerEntry(kind="other"))
    robots = tuple(replace(robot, control=control[robot.name]) for robot in cell.robots)
    cell = replace(cell, robots=robots, controllers=controllers)
    if running_on(cell):
        return cell
    alike = {
        name: controller.changed(reaction_ms=1e3 * REACTION, brake_s=BRAKE) for name, controller in controllers.items()
    }
    return replace(cell, controllers=alike)


class Brute:
    """Distances and depths at single places."""

    def __init__(self, case: Case) -> None:
        """Take the bodies of the scene into coal, and the robots into pinocchio."""
        self.case, self._model = case, CombinedModel(case.cell)
        self._shapes = [coal_shape(body.shape) for body in case.scene.bodies]
        solids = {index: shape for index, shape in enumerate(self._shapes) if shape is not None}  # no half-spaces
        for shape in solids.values():
            shape.computeLocalAABB()
        self._centres = {index: np.array(shape.aabb_center) for index, shape in solids.items()}
        self._radii = {index: float(shape.aabb_radius) for index, shape in solids.items()}
        self._pairs: dict[tuple[str, str], list[tuple[int, int]]] = {}

    def placed(self, times: Mapping[str, float]) -> Array:
        """Stacked positions while every robot is at a time of its own."""
        rows = self.case.schedule.times
        parts = [
            [np.interp(times[robot.name], rows, column) for column in self.case.q[robot.name].T]
            for robot in self.case.cell.robots
        ]
        return np.concatenate(parts)

    def distance(self, first: str, second: str, times: Mapping[str, float]) -> float:
        """Smallest distance in [m] of the bodies of two robots, without tools at work on the part."""
        state, nearest = self._model.links(self.placed(times)), np.inf
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        placed: dict[int, tuple[coal.Transform3s, Array]] = {}
        for ends in self._ends(first, second):
            for index in ends:
                if index not in placed:
                    placed[index] = self._pose(index, state)
            (one, c), (other, d) = (placed[index] for index in ends)
            if np.linalg.norm(c - d) - self._radii[ends[0]] - self._radii[ends[1]] >= nearest:
                continue
            result.clear()
            shapes = [self._shapes[index] for index in ends]
            nearest = min(nearest, coal.distance(shapes[0], one, shapes[1], other, request, result))
        return max(0.0, float(nearest))

    def _ends(self, first: str, second: str) -> list[tuple[int, int]]:
        """Bodies of the pairs of two robots that keep a distance."""
        if (first, second) not in self._pairs:
            scene = self.case.scene
            pairs = [scene.pairs[row] for row in watched_pairs(scene, first, second).rows.tolist()]
            self._pairs[first, second] = [(pair.first, pair.second) for pair in pairs if pair.rule is Rule.CLEARANCE]
        return self._pairs[first, second]

    def _pose(self, index: int, state: LinkState) -> tuple[coal.Transform3s, Array]:
        """Pose of a body of the scene, and the centre of a ball round it."""
        body, cell = self.case.scene.bodies[index], self.case.cell
        X = body.X_BS
        if body.robot is not None:
            link = self._model.first_link[cell.index(body.robot)] + body.link
            X = (state.D[link] if body.link != BASE else cell.robot(body.robot).X_WB) @ body.X_BS
        return coal.Transform3s(X[:3, :3], X[:3, 3]), X[:3, :3] @ self._centres[index] + X[:3, 3]

    def axis_depth(self, robot: str, times: Mapping[str, float]) -> float:
        """Length in [m] of a tool's axis from where it first enters the part to its tip."""
        cell = self.case.cell
        state = self._model.state(self.placed(times))
        X_PT = inverse(state.X_WP[None]) @ state.X_WT[[cell.index(robot)]]
        X_ST = (inverse(cell.part.X_PS) @ X_PT)[0]
        tool = cell.robot(robot).tool.X_FT
        length = max(float(tool[:3, 3] @ tool[:3, 2]), cell.checks.contact_zone_mm.si)
        shape, ball = coal_shape(cell.part.shape), coal_shape(Sphere(1e-9))
        along = np.linspace(0.0, length, POINTS)
        for back in along[::-1]:
            point = X_ST[:3, 3] - back * X_ST[:3, 2]
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            here = coal.Transform3s(np.eye(3), point)
            if coal.distance(shape, coal.Transform3s(), ball, here, request, result) <= 0.0:
                return float(back)
        return 0.0

    def depth_of(self, robot: str, times: Mapping[str, float]) -> float:
        """How far in [m] the tool of a further holder is from its grasp, along what the grasp ties."""
        cell = self.case.cell
        grasp = next(closure for closure in cell.closures if closure.robot == robot)
        state = self._model.state(self.placed(times))
        at = (inverse(state.X_WP[None])[0] @ state.X_WT[cell.index(robot)])[:3, 3]
        tied = [axis for axis in range(3) if axis in grasp.axes]
        return float(np.linalg.norm((at - grasp.X_PT[:3, 3])[tied]))


@dataclass(frozen=True, slots=True)
class Difference:
    """What a stop says against brute force, in [m].

    Attributes:
        above: By how much a proved distance is above.
        below: By how much a measured distance is below.
        shallow: By how much a depth is below that of the axis.
        grip: By how much a grip is drawn farther by brute force.
    """

    above: float = -np.inf
    below: float = -np.inf
    shallow: float = 0.0
    grip: float = 0.0

    def worst(self, other: "Difference") -> "Difference":
        """The larger ones of two."""
        names = ("above", "below", "shallow", "grip")
        return Difference(**{name: max(getattr(self, name), getattr(other, name)) for name in names})


def compared(case: Case, brute: Brute, rng: np.random.Generator) -> Difference:
    """The differences of one random stop."""
    cell, end = case.cell, float(case.schedule.times[-1])
    going = running_on(cell)
    names = [robot.name for robot in cell.robots]
    stopped = names[int(rng.integers(len(names)))]
    at = float(rng.uniform(0.0, end))
    stop = one_stop(case.scene, case.schedule, case.q, robot=stopped, at=at)
    if stop is None:
        raise SystemExit(f"{cell.name}: no controller states how its robots go on")
    result = Difference()
    for pair in stop.distances:
        other = next(name for name in pair.robots if name != stopped)
        last = min(at + going.get(other, 0.0), end)
        truth = min(
            brute.distance(*pair.robots, {name: (t if name == other else at) for name in names})
            for t in np.linspace(at, last, PLACES)
        )
        if np.isfinite(truth):
            result = result.worst(Difference(above=pair.proved - truth, below=truth - pair.distance))
    for depth in stop.depths:
        result = result.worst(Difference(shallow=_shallow(brute, stop, depth.task, (stopped, at))))
    for grip in stop.grips:
        truth = _on_way(brute, stop, grip.robot, (stopped, at), PLACES)
        result = result.worst(
            Difference(grip=max(brute.depth_of(grip.robot, entry) for entry in truth) - grip.distance)
        )
    return result


def _on_way(
    brute: Brute, report: StopReport, robot: str, stop: tuple[str, float], places: int
) -> list[dict[str, float]]:
    """Times of all robots at some places of the way that a robot, or what carries the part, covers after a stop."""
    case, (stopped, at) = brute.case, stop
    carrier, end = case.cell.positioners[0], float(case.schedule.times[-1])
    names = [robot.name for robot in case.cell.robots]
    if stopped not in {robot, carrier}:
        return [dict.fromkeys(names, at)]
    other = carrier if stopped == robot else robot
    last = min(at + report.runs_on.get(other, 0.0), end)
    return [{name: (t if name == other else at) for name in names} for t in np.linspace(at, last, places).tolist()]


def _shallow(brute: Brute, report: StopReport, task: str, stop: tuple[str, float]) -> float:
    """By how much the depth of a task lies below that of the tool's axis in [m]; zero where the stop is of others."""
    robot = brute.case.cell.task(task).robot
    if stop[0] not in {robot, brute.case.cell.positioners[0]}:
        return 0.0
    truth = max(brute.axis_depth(robot, times) for times in _on_way(brute, report, robot, stop, ALONG))
    return truth - next(depth.depth for depth in report.depths if depth.task == task)


def main() -> None:
    """Print a line for each phase of each cell."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cells", nargs="*", default=CELLS)
    parser.add_argument("--stops", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=np.inf, help="of processor time, at most for each phase")
    arguments = parser.parse_args()
    head = ("above mm", "below mm", "shallow mm", "grip mm")
    print(f"{'cell':36}{'stops':>6}" + "".join(f"{name:>12}" for name in head) + f"{'CPU ms':>8}", flush=True)
    for path in arguments.cells:
        for place, case in enumerate(cases(Path(path))):
            brute, rng, worst = Brute(case), np.random.default_rng(place), Difference()
            begin, done, spent = time.process_time(), 0, 0.0
            while done < arguments.stops and spent < arguments.seconds:
                worst, done = worst.worst(compared(case, brute, rng)), done + 1
                spent = time.process_time() - begin
            values = "".join(f"{1e3 * entry:12.3f}" for entry in (worst.above, worst.below, worst.shallow, worst.grip))
            print(f"{path + ' ' + str(place):36}{done:6}{values}{1e3 * spent / done:8.0f}", flush=True)
    print(
        "above: proved distance over brute force, to be no more than 0; below: measured distance under it, up to "
        f"{1e3 * (MINIMUM_TOL + EXACT):.1f}; shallow: depth under that of a tool's axis; grip: under brute force"
    )


if __name__ == "__main__":
    main()
