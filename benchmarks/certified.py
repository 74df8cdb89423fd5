"""Certified clearance against brute force: ``python benchmarks/certified.py``, ``--cells 3`` for a quick look.

Random cells of two arms each, which swing beside a part, a post, and a tube that one of them works in and that is not
convex. The smallest distance of each class is certified, and searched by another engine (coal): every pair at ten
times in every step, then ever closer round the smallest one found. A certified distance above what was found would be
wrong; one below it by more than 0.1 mm would not be exact.
"""

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import coal
import numpy as np
from coal_shapes import coal_shape

from cellplan import load_cell
from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Obstacle
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

ROBOTS: Final = Path(__file__).resolve().parent.parent.parent / "shared" / "robots"
REAL: Final = ("kuka_kr16_2", "abb_irb1600_8_145", "staubli_rx160", "kuka_kr5_arc")
BUNDLED: Final = ("reis_rv20_16", "abb_irb1600", "staubli_rx90l", "kuka_kr6")
STEPS: Final = 60  # [-] of each program, 10 ms apart
SWING: Final = 0.2  # [rad] to either side
FINE: Final = 10  # [-] times of each step at which brute force measures
ROUNDS: Final = 6  # [-] ever closer looks round the smallest distance found, each five times as fine
EXACT: Final = 1e-4  # [m] promised
ROUNDING: Final = 1e-6  # [m] room for the other engine's own rounding
CELL: Final = """
cellplan: 1
name: random
robots:
  one: {{model: {0}, base: {{xyz_mm: [0, 0, 0]}}, start_deg: {2}, {tool}}}
  two: {{model: {1}, base: {{xyz_mm: [{x:.0f}, {y:.0f}, 0], rpy_deg: [0, 0, {yaw:.0f}]}}, start_deg: {3}, {tool}}}
part: {{geometry: {{box: {{size_mm: [200, 200, 200]}}}}, at: {{xyz_mm: [{px:.0f}, {py:.0f}, 900]}}}}
tasks: {{any: {{robot: two, path: {{circle: {{radius_mm: 30, plane: yz}}, project: +x}}}}}}  # left out below
environment:
  post: {{cylinder: {{radius_mm: 40, length_mm: 2000, axis: z}}, at: {{xyz_mm: [{px:.0f}, {ny:.0f}, 1000]}}}}
motion: {{mode: simultaneous, duration_s: 4, step_s: 0.01}}
checks: {{clearance_mm: 1}}
"""
TOOL: Final = "tool: {xyz_mm: [0, 0, 150], geometry: {cylinder: {radius_mm: 15, length_mm: 150}}}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """One class of one cell: certified and found distance in [m], and whether the certified one is said to be exact."""

    kind: ClearanceClass
    certified: float
    searched: float
    is_exact: bool

    @property
    def is_right(self) -> bool:
        """Whether the certified distance is not above the truth, and near it where it says so."""
        return self.certified <= self.searched + ROUNDING and (
            not self.is_exact or self.searched - self.certified <= EXACT + ROUNDING
        )


def random_cell(folder: Path, seed: int, *, has_meshes: bool = False) -> tuple[Cell, Array]:
    """A cell of two arms and things round them, and the joint positions of a program."""
    rng = np.random.default_rng(seed)
    real = has_meshes and all((ROBOTS / name).is_dir() for name in REAL)
    names = rng.choice(REAL if real else BUNDLED, size=2)
    models = [str(ROBOTS / name / f"{name}.urdf") if real else str(name) for name in names]
    starts = [np.round(rng.uniform(-40.0, 40.0, 6), 1).tolist() for _ in range(2)]
    places = {"x": rng.uniform(1300, 1900), "y": rng.uniform(-300, 300), "yaw": rng.uniform(120, 240)}
    places |= {"px": rng.uniform(500, 900), "py": rng.uniform(700, 1000), "ny": -rng.uniform(700, 1000)}
    path = folder / f"random_{seed}.yaml"
    path.write_text(CELL.format(*models, *starts, tool=TOOL, **places), encoding="utf-8")
    cell = load_cell(path, allow_dirs=[ROBOTS] if real else [])
    X_WS = ScrewChain(cell.robots[0]).tool_poses(np.radians(starts[:1]))[0]
    things = (*cell.obstacles, Obstacle(name="tube", shape=tube(0.35, 0.37, 0.3), X_WS=X_WS))
    cell = replace(cell, tasks=(), obstacles=things)
    start = np.radians(np.concatenate(starts))
    lower, upper = (np.concatenate([getattr(robot.model, end) for robot in cell.robots]) for end in ("lower", "upper"))
    rate, phase = rng.uniform(1.0, 4.0, len(start)), rng.uniform(0.0, 2.0 * np.pi, len(start))
    swing = SWING * (np.sin(rate * 0.01 * np.arange(STEPS + 1)[:, None] + phase) - np.sin(phase))
    return cell, np.clip(start + swing, lower, upper)


def tube(inner: float, outer: float, length: float, sides: int = 32) -> Mesh:
    """A tube along z, open at both ends."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    rings = [(inner, -0.5), (inner, 0.5), (outer, 0.5), (outer, -0.5)]
    vertices = np.concatenate(
        [np.column_stack([r * np.cos(turn), r * np.sin(turn), np.full(sides, z * length)]) for r, z in rings]
    )
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = []
    for ring in range(4):
        a, b = ring * sides, (ring + 1) % 4 * sides
        faces += [np.column_stack([a + after, a + k, b + k]), np.column_stack([a + after, b + k, b + after])]
    return Mesh(vertices=vertices, faces=np.concatenate(faces), source="tube", is_closed=True)


def compare(cell: Cell, q: Array) -> list[Compared]:
    """Certified distances beside those that brute force finds, of all classes in which nothing touches."""
    scene = Scene.from_cell(cell)
    report, _ = check_clearance(scene, Schedule(times=0.01 * np.arange(len(q)), tasks=()), q)
    result = brute_force(scene, q)
    return [
        Compared(kind=kind, certified=minimum.minimum, searched=result[kind], is_exact=minimum.exact)
        for kind, minimum in report.minima.items()
        if minimum.minimum is not None and minimum.certified and kind in result
    ]


def brute_force(scene: Scene, q: Array) -> dict[ClearanceClass, float]:
    """Smallest distance of each class in [m], by another engine, at many times; zero where bodies touch."""
    shapes = [coal_shape(body.shape) for body in scene.engine.bodies]
    times = np.linspace(0.0, len(q) - 1.0, FINE * (len(q) - 1) + 1)
    poses = scene.body_poses(_between(q, times))
    smallest: dict[ClearanceClass, float] = {}
    for row, (first, second) in zip(scene.solid_rows.tolist(), scene.solid_pairs.tolist(), strict=True):
        pair = scene.pairs[row]
        if pair.rule is not Rule.CLEARANCE:
            continue
        known = smallest.get(pair.clearance_class, np.inf)
        gaps = _sphere_gaps(scene, poses, (first, second))
        near = np.flatnonzero(gaps < known)
        for k in near[np.argsort(gaps[near], kind="stable")].tolist():
            if gaps[k] >= known:
                break
            distance = _distance(shapes, poses, (first, second), k)
            if distance < known:
                known = _closer(scene, q, shapes, (first, second), at=float(times[k]), distance=distance)
        smallest[pair.clearance_class] = known
    return smallest


def _closer(
    scene: Scene, q: Array, shapes: Sequence[Any], pair: tuple[int, int], *, at: float, distance: float
) -> float:
    """The smallest distance of a pair near an instant, by ever finer steps."""
    width = 1.0 / FINE
    for _ in range(ROUNDS):
        times = np.clip(at + width * np.linspace(-1.0, 1.0, 11), 0.0, len(q) - 1.0)
        poses = scene.pair_poses(pair, _between(q, times))
        result = [_distance(shapes, poses, pair, k) for k in range(len(times))]
        best = int(np.argmin(result))
        at, distance, width = float(times[best]), min(distance, result[best]), 0.2 * width
    return distance


def _between(q: Array, times: Array) -> Array:
    """Joint positions at times counted in samples; joints move evenly between these."""
    before = np.minimum(times.astype(int), len(q) - 2)
    share = (times - before)[:, None]
    positions: Array = (1.0 - share) * q[before] + share * q[before + 1]
    return positions


def _sphere_gaps(scene: Scene, poses: BodyPoses, pair: tuple[int, int]) -> Array:
    """Distance of both bounding spheres in [m], shape (n,)."""
    a, b = (poses.R[index] @ scene.engine.centres[index] + poses.p[index] for index in pair)
    gaps: Array = np.linalg.norm(b - a, axis=1) - scene.engine.radii[list(pair)].sum()
    return gaps


def _distance(shapes: Sequence[Any], poses: BodyPoses, pair: tuple[int, int], sample: int) -> float:
    """Distance of two bodies in [m]; zero when they touch."""
    placed = [coal.Transform3s(poses.R[index, sample], poses.p[index, sample]) for index in pair]
    result = coal.DistanceResult()
    request = coal.DistanceRequest()
    request.gjk_tolerance, request.gjk_max_iterations = 1e-10, 1000
    return max(0.0, float(coal.distance(shapes[pair[0]], placed[0], shapes[pair[1]], placed[1], request, result)))


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(description="Compare certified distances with what brute force finds.")
    parser.add_argument("--cells", type=int, default=10, help="random cells (default: 10)")
    parser.add_argument("--meshes", action="store_true", help="arms with meshes, if they lie beside the checkout; slow")
    options = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory(prefix="cellplan-bench-") as folder:
        for seed in range(options.cells):
            begin = time.process_time()
            cell, q = random_cell(Path(folder), seed, has_meshes=options.meshes)
            for one in compare(cell, q):
                wrong += not one.is_right
                word = "exact" if one.is_exact else "at least"
                verdict = "right" if one.is_right else "WRONG"
                figures = f"{word} {1e3 * one.certified:.3f} mm, found {1e3 * one.searched:.3f} mm"
                print(f"cell {seed} {one.kind}: {figures}: {verdict}", flush=True)
            print(f"cell {seed}: {time.process_time() - begin:.1f} s of processor time")
    print(f"{wrong} of all are wrong")
    raise SystemExit(1 if wrong else 0)


if __name__ == "__main__":
    main()
