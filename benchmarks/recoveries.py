"""Recoveries from random stops: ``python benchmarks/recoveries.py cells/four_robots.yaml cells/rail.yaml --stops 200``.

Each recovery that is found is judged by brute force: at random moments of its tables the distances of all pairs that
are watched are taken by coal, the links placed by pinocchio. The certificate uses neither. Pairs that begin nearer than
is demanded may only come apart; all others, and these once they are apart, keep their demand.
"""

import argparse
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import coal
import numpy as np
from coal_shapes import coal_shape

from cellplan.errors import CellplanError
from cellplan.files.cell.load import load_cell
from cellplan.files.run.joint_tables import parse_table
from cellplan.geometry.shapes import Box, Cylinder, HalfSpace, Mesh, Sphere
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.recover import Recovery, recover
from cellplan.jobs.recover.state import RunPlaces
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.robot.robot import BASE
from cellplan.model.units import MM
from cellplan.runs.gate.open_gate import open_gate
from cellplan.runs.solve import solve
from cellplan.runs.write_run import write_run
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

TOLERANCE: Final = 1e-4  # [m] of a distance of coal, and of the first row of a table
MOMENTS: Final = 40  # of each phase of a recovery
FROZEN_WITHIN: Final = 0.1  # [s] of the stop, of a robot that stands at another time
FROZEN_EVERY: Final = 2  # so many stops have a robot that stands at another time


@dataclass(slots=True)
class Judged:
    """What brute force found.

    Attributes:
        smallest: Smallest distance in [m] of a pair that is to keep its demand.
        faults: Pairs that were too near, in words.
    """

    smallest: float = np.inf
    faults: list[str] = field(default_factory=list)


class BruteForce:
    """Distances of the pairs of a scene, by coal and pinocchio."""

    def __init__(self, scene: Scene) -> None:
        """Build coal's shapes."""
        self._scene, self._model = scene, CombinedModel(scene.cell)
        self._index = {robot.name: place for place, robot in enumerate(scene.cell.robots)}
        self._shapes = [None if isinstance(body.shape, HalfSpace) else coal_shape(body.shape) for body in scene.bodies]
        self._spheres = [_sphere(shape) for shape in self._shapes]
        self._pairs = [pair for pair in scene.pairs if pair.rule is Rule.CLEARANCE]

    def near(self, q: Array, within: float) -> dict[tuple[str, str], tuple[float, float]]:
        """Distance and demand in [m] of all pairs nearer than so much beyond their demand, by names."""
        X = self._poses(q)
        results = {}
        for pair in self._pairs:
            first, second = pair.first, pair.second
            if pair.is_ground:
                distance = _height(self._shapes[first], self._scene.bodies[first].shape, X[first], X[second])
            else:
                (c, r), (d, s) = self._spheres[first], self._spheres[second]
                apart = X[first][:3, :3] @ c + X[first][:3, 3] - X[second][:3, :3] @ d - X[second][:3, 3]
                if np.linalg.norm(apart) - r - s > pair.demand + within:
                    continue
                distance = _distance(self._shapes[first], X[first], self._shapes[second], X[second])
                if distance <= 0.0:
                    solids = [self._scene.bodies[entry].shape for entry in (first, second)]
                    distance = _depth_of_ball(solids, (X[first], X[second]), distance)
            if distance < pair.demand + within:
                results[self._scene.names(pair)] = (distance, pair.demand)
        return results

    def _poses(self, q: Array) -> list[Array]:
        """Pose of each body in the world."""
        links, cell = self._model.links(q), self._scene.cell
        poses = []
        for body in self._scene.bodies:
            X = np.eye(4)
            if body.robot is not None and body.link == BASE:
                X = cell.robot(body.robot).X_WB
            elif body.robot is not None:
                X = links.D[self._model.first_link[self._index[body.robot]] + body.link]
            poses.append(X @ body.X_BS)
        return poses


def judged(recovery: Recovery, places: RunPlaces, rng: np.random.Generator, *, moments: int = MOMENTS) -> Judged:
    """Judge the tables of a recovery by brute force, at random moments and at all joins of its phases."""
    result, judgement = Judged(), recovery.judgement
    if judgement is None:
        raise ValueError("expected a recovery that was found")
    tables = [parse_table(recovery.tables[robot.name], robot.name) for robot in recovery.cell.robots]
    times, q = tables[0].times, np.concatenate([table.q for table in tables], axis=1)
    met_from = {pair.names: at for pair, at in judgement.apart}
    stopped = BruteForce(places.scene_while_stopped(recovery.state.lying))
    margin = max((pair.slack for pair, _ in judgement.apart), default=0.0) + TOLERANCE
    largest = {pair.names: pair.begin for pair, _ in judgement.apart}
    back = [BruteForce(places.scene_of_phase(phase.place)) for phase in judgement.phases if phase.place is not None]
    for phase in judgement.phases:
        judge = stopped if phase.place is None else back.pop(0)
        inner = rng.uniform(phase.begin, phase.end, moments)
        for at in np.sort(np.concatenate([[phase.begin, phase.end], inner])).tolist():
            here = np.array([np.interp(at, times, column) for column in q.T])
            for names, (distance, demand) in judge.near(here, 0.05).items():
                opens = met_from.get(names)
                if phase.kind == "retract" and opens is not None and at < opens:
                    if distance < largest[names] - margin:
                        result.faults.append(f"{names} comes nearer: {MM * distance:.3f} mm at {at:.4f} s")
                    largest[names] = max(largest[names], distance)
                    continue
                result.smallest = min(result.smallest, distance)
                if distance < demand - TOLERANCE:
                    result.faults.append(f"{names}: {MM * distance:.3f} mm at {at:.4f} s, demanded {MM * demand:g} mm")
    if float(np.abs(q[0] - recovery.state.q).max()) > TOLERANCE:
        result.faults.append("does not begin in the stopped state")
    return result


def random_stops(run: VerifiedRun, count: int, rng: np.random.Generator) -> list[tuple[float, dict[str, float]]]:
    """Times of stops, and robots that stand at another time beside some of them."""
    motion, cell = run.motion, run.cell
    gaps = [(motion.times[row - 1], motion.times[row]) for row in motion.gaps]
    free = [robot.name for robot in cell.robots if len(cell.positioners) < 2 or robot.name not in cell.positioners]
    end, stops = float(motion.times[-1]), []
    while len(stops) < count:
        at = float(rng.uniform(0.0, end))
        other = float(np.clip(at + rng.uniform(-FROZEN_WITHIN, FROZEN_WITHIN), 0.0, end))
        if any(low < time < high for low, high in gaps for time in (at, other)):
            continue
        is_frozen = len(stops) % FROZEN_EVERY == FROZEN_EVERY - 1
        stops.append((at, {free[int(rng.integers(len(free)))]: other} if is_frozen else {}))
    return stops


def run_of(cell_file: Path, folder: Path) -> VerifiedRun:
    """The verified run of a cell, solved where the folder has none."""
    if not (folder / "manifest.json").is_file():
        write_run(solve(load_cell(cell_file)), folder)
    return open_gate(folder, cell=cell_file)


def measured(cell_file: Path, folder: Path, *, stops: int, seed: int, most: float) -> str:
    """Row of the table: a cell with random stops, no more of them than so many seconds of processor time allow."""
    run, rng = run_of(cell_file, folder), np.random.default_rng(seed)
    places = RunPlaces.of(run)
    seconds, ends, reasons = list[float](), Counter[str](), Counter[str]()
    smallest, faults, first = np.inf, list[str](), time.process_time()
    for at, frozen in random_stops(run, stops, rng):
        begin = time.process_time()
        if seconds and begin - first > most:
            break
        try:
            recovery = recover(run, at=at, frozen=frozen)
        except CellplanError as error:
            seconds.append(time.process_time() - begin)
            reasons[f"{type(error).__name__}: {str(error)[:160]} (at {at:.4f} {frozen})"] += 1
            continue
        seconds.append(time.process_time() - begin)
        if not recovery.succeeded:
            reasons[f"{recovery.reason[:400]} (at {at:.4f} {frozen})"] += 1
            continue
        kinds = {phase.kind for phase in recovery.judgement.phases} if recovery.judgement else set()
        ends["back" if "back" in kinds else "straight off"] += 1
        result = judged(recovery, places, rng)
        smallest = min(smallest, result.smallest)
        faults += [f"at {at:.4f} {frozen}: {fault}" for fault in result.faults]
    lines = [
        f"| {run.cell.name} | {len(seconds)} | {sum(ends.values())} | {ends['straight off']} | {ends['back']} | "
        f"{sum(reasons.values())} | {np.mean(seconds):.1f} | {max(seconds):.1f} | {MM * smallest:.2f} | {len(faults)} |"
    ]
    lines += [f"    fault: {fault}" for fault in faults[:20]]
    lines += [f"    {count} not found: {reason}" for reason, count in reasons.most_common(20)]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure some cells and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells", type=Path, nargs="+")
    parser.add_argument("--stops", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=np.inf, help="of processor time, at most for each cell")
    parser.add_argument("--runs", type=Path, help="folder of solved runs, by the names of the cell files")
    chosen = parser.parse_args(arguments)
    print(
        "| cell | stops | found | straight off | back first | not found | mean CPU s | most CPU s | least mm | faults |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as kept_folder:
        for cell_file in chosen.cells:
            folder = (chosen.runs or Path(kept_folder)) / cell_file.stem
            print(measured(cell_file, folder, stops=chosen.stops, seed=chosen.seed, most=chosen.seconds), flush=True)


def _sphere(shape: coal.CollisionGeometry | None) -> tuple[Array, float]:
    """Centre and radius of a sphere round a shape, in its frame."""
    if shape is None:
        return np.zeros(3), np.inf
    shape.computeLocalAABB()
    return np.array(shape.aabb_center), float(shape.aabb_radius)


def _distance(first: coal.CollisionGeometry, X: Array, second: coal.CollisionGeometry, Y: Array) -> float:
    """Distance in [m], negative where convex shapes overlap."""
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance, request.gjk_max_iterations = 1e-9, 500
    at = (coal.Transform3s(X[:3, :3], X[:3, 3]), coal.Transform3s(Y[:3, :3], Y[:3, 3]))
    return float(coal.distance(first, at[0], second, at[1], request, result))


def _depth_of_ball(solids: Sequence[object], X: tuple[Array, Array], otherwise: float) -> float:
    """Signed distance of a ball and a solid that overlap, in closed form: coal takes other ways out of such a ball."""
    ball, at = solids[0], X[0][:3, 3]
    solid, place = solids[1], X[1]
    if isinstance(solid, Sphere):
        ball, at, solid, place = solid, X[1][:3, 3], solids[0], X[0]
    if not isinstance(ball, Sphere):
        return otherwise
    p = place[:3, :3].T @ (at - place[:3, 3])
    match solid:
        case Box(size):
            return float((np.abs(p) - 0.5 * np.asarray(size)).max()) - ball.radius
        case Cylinder(radius, length):
            return float(max(np.hypot(p[0], p[1]) - radius, abs(p[2]) - 0.5 * length)) - ball.radius
        case _:
            return otherwise


def _height(shape: coal.CollisionGeometry | None, solid: object, X: Array, X_ground: Array) -> float:
    """Height above a half-space in [m]."""
    n, p = X_ground[:3, 2], X_ground[:3, 3]
    if isinstance(solid, Mesh):
        return float(((solid.vertices @ X[:3, :3].T + X[:3, 3] - p) @ n).min())
    return _distance(shape, X, coal.Halfspace(n, float(n @ p)), np.eye(4))


if __name__ == "__main__":
    main()
