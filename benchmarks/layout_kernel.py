"""The kernel of the layout search beside what it takes the place of: ``python benchmarks/layout_kernel.py``.

One run measures motions against the accurate mode, derivatives against differences, moved scenes against scenes built
anew, near pairs against every pair, and the yes or no of the certificate against its smallest distances. Processor
times are medians; on a machine that others use only the ratios mean something.
"""

import json
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np
from options import benchmark_options
from reference_job import CELL
from screening import candidates_near, job
from sections import Goal, Section, digits, table

from cellplan.certify.certify import certify
from cellplan.geometry.transforms import Array, pose, rotation_exp
from cellplan.planning.layout_screening import Candidates, Screening, screen_layouts
from cellplan.scene.collision.distance import measure
from cellplan.scene.scene import Scene
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.figures import MotionFigures
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import Motions, run, run_near
from cellplan.search.kernel.screws import Directions

NODES: Final = 97
COUNT: Final = 256  # [-] candidates run at once
COMPARED: Final = 64  # [-] of them that are resolved by the accurate mode as well
STEP: Final = 1e-5  # [m] and [rad] of the differences
WITHIN: Final = 0.08  # [m] of the near pairs
KEYS: Final = 9  # [-] configurations at which they are asked for
FINE: Final = 1e-7  # [m] and [rad] accuracy of what motions are compared with


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One comparison; processor times in [s].

    Attributes:
        name: What is compared.
        kernel_s: Time of the kernel.
        other_s: Time of what it takes the place of.
        agrees: How well the two agree, in words.
        is_met: Whether that is well enough.
    """

    name: str
    kernel_s: float
    other_s: float
    agrees: str
    is_met: bool


class Bench:
    """The reference cell and candidates for it."""

    def __init__(self, rounds: int) -> None:
        """Prepare them."""
        self._rounds = rounds
        self.cell, self.schedule = job()
        self.moving = [robot.name for robot in self.cell.robots]
        self.job = Job.of(self.cell, self.schedule, moving=self.moving, nodes=NODES)
        near = candidates_near(self.cell, COUNT)
        self.layouts = Layouts(X_WB=near.X_WB, X_FT=near.X_FT, start=near.start, weights=np.ones_like(near.start))
        self.scene = Scene.from_cell(self.cell)
        self.motion = run(self.job, self.layouts.of_places(slice(0, 1)))

    def seconds(self, call: Callable[[], object], *, times: int = 1) -> float:
        """Median processor time of a call, after one that does not count."""
        call()
        results = []
        for _ in range(self._rounds):
            begin = time.process_time()
            for _ in range(times):
                call()
            results.append((time.process_time() - begin) / times)
        return statistics.median(results)

    def run(self) -> Figure:
        """Motions against the accurate mode."""
        few, layouts = slice(0, COMPARED), self.layouts
        candidates = Candidates(X_WB=layouts.X_WB[few], X_FT=layouts.X_FT[few], start=layouts.start[few])

        def accurate() -> Screening:
            return screen_layouts(self.cell, self.schedule, candidates, moving=self.moving, accuracy=FINE)

        exact, motions = accurate(), run(self.job, layouts.of_places(few))
        held, figures = exact.is_followed & motions.is_followed, MotionFigures.of(self.job, motions)
        fastest, expected = figures.speeds.value[held].max(axis=1), exact.speed_ratios[held].max(axis=1)
        nodes = (np.abs(motions.qd[held]) / self.job.limits.velocity).max(axis=(1, 2))
        ratio, at_nodes = float(np.abs(fastest / expected - 1.0).max()), float(np.abs(nodes / expected - 1.0).max())
        margin = float(np.degrees(np.abs(figures.margins[held] - exact.margins[held]).max()))
        return Figure(
            name=f"motion of one of {COUNT} candidates, {NODES} nodes; accurate mode",
            kernel_s=self.seconds(lambda: run(self.job, layouts)) / COUNT,
            other_s=self.seconds(accurate) / COMPARED,
            agrees=f"{held.sum()} of {COMPARED}: fastest joint {100 * ratio:.2f} % (at nodes {100 * at_nodes:.2f} %), "
            f"margins {margin:.3f}°",
            is_met=at_nodes <= 0.005 and margin <= 0.1,
        )

    def run_near(self) -> Figure:
        """All nodes at once against node after node, for one candidate."""
        alone = self.layouts.of_places(slice(0, 1))
        given = self.motion.q + 1e-3

        def near() -> Motions:
            return run_near(self.job, alone, given)

        error = float(np.abs(near().q - self.motion.q).max())
        return Figure(
            name="motion of one candidate near a known one; node after node",
            kernel_s=self.seconds(near),
            other_s=self.seconds(lambda: run(self.job, alone)),
            agrees=f"{np.degrees(error):.3f}°",
            is_met=error <= np.radians(0.1),
        )

    def differentiate(self) -> Figure:
        """Exact derivatives against central differences of the run."""
        alone, directions = self.layouts.of_places(slice(0, 1)), _directions(self.job)
        q, qd = np.ascontiguousarray(self.motion.q[0]), np.ascontiguousarray(self.motion.qd[0])

        def exact() -> tuple[Array, Array]:
            derivatives = differentiate(self.job, alone, q, qd, directions)
            return derivatives.q, derivatives.qd

        def differences() -> tuple[Array, Array]:
            both = run(self.job, _displaced(alone, directions))
            p = directions.count
            q, qd = ((part[:p] - part[p:]) / (2.0 * STEP) for part in (both.q, both.qd))
            return np.moveaxis(q, 0, -1), np.moveaxis(qd, 0, -1)

        pairs = zip(exact(), differences(), strict=True)
        errors = [float(np.linalg.norm(a - b) / np.linalg.norm(b)) for a, b in pairs]
        return Figure(
            name=f"{directions.count} derivatives at {NODES} nodes; central differences",
            kernel_s=self.seconds(exact, times=5),
            other_s=self.seconds(differences),
            agrees=f"joints {100 * errors[0]:.2f} %, speeds {100 * errors[1]:.2f} %",
            is_met=max(errors) <= 0.005,
        )

    def moved(self) -> Figure:
        """Scenes with bases elsewhere against scenes built anew."""
        bases = {robot.name: pose((0.05, 0.02, 0.0)) @ robot.X_WB for robot in self.cell.robots}
        moved = self.scene.moved(bases)
        built = Scene.from_cell(moved.cell)
        q = self._keys()
        apart = np.abs(moved.near(q, WITHIN).distances - built.near(q, WITHIN).distances).max(initial=0.0)
        return Figure(
            name="scene with all bases moved; built anew",
            kernel_s=self.seconds(lambda: self.scene.moved(bases), times=20),
            other_s=self.seconds(lambda: Scene.from_cell(moved.cell)),
            agrees=f"distances to {1e3 * apart:.0e} mm",
            is_met=bool(apart <= 1e-6),
        )

    def near(self) -> Figure:
        """Near pairs against every pair."""
        q, scene = self._keys(), self.scene
        near = scene.near(q, WITHIN)

        poses, exact = scene.body_poses(q), dict[tuple[int, int], float]()
        begin = time.process_time()
        for row, (i, j) in zip(scene.solid_rows.tolist(), scene.solid_pairs.tolist(), strict=True):
            for k in range(len(q)):
                exact[row, k] = measure(scene.engine, (i, j), poses, sample=k).bound
        every_s = time.process_time() - begin
        solids = [
            (row, k, d)
            for row, k, d in zip(near.rows.tolist(), near.samples.tolist(), near.distances.tolist(), strict=True)
            if (row, k) in exact
        ]
        above = max(d - exact[row, k] for row, k, d in solids)
        is_missed = len(solids) < sum(d < WITHIN - 1e-4 for d in exact.values())
        return Figure(
            name=f"pairs within {1e3 * WITHIN:g} mm at {KEYS} configurations; every pair",
            kernel_s=self.seconds(lambda: scene.near(q, WITHIN), times=5),
            other_s=every_s,
            agrees=f"{len(near.rows)} pairs, at most {1e3 * above:.2f} mm above the proved distance",
            is_met=bool(above <= 1e-4) and not is_missed,
        )

    def certify(self) -> Figure:
        """Yes or no against the smallest distances."""
        times, t = self.job.times, np.arange(0.0, float(self.job.times[-1]) + 5e-4, 1e-3)
        q = np.stack([np.interp(t, times, column) for column in self.motion.q[0].T], axis=1)
        verdict = certify(self.scene, q, with_minimum=False).is_met
        return Figure(
            name=f"yes or no of the certificate, {len(t)} samples; smallest distances",
            kernel_s=self.seconds(lambda: certify(self.scene, q, with_minimum=False)),
            other_s=self.seconds(lambda: certify(self.scene, q)),
            agrees=f"both say {'yes' if verdict else 'no'}",
            is_met=verdict == certify(self.scene, q).is_met,
        )

    def _keys(self) -> Array:
        """Some configurations of the motion, shape (KEYS, nq)."""
        return np.ascontiguousarray(self.motion.q[0][:: (NODES - 1) // (KEYS - 1)])


def _directions(layout_job: Job) -> Directions:
    """26 variables: x, y, z, yaw of the operators' bases, five of the positioner's joints, three of each tool."""
    result, place = Directions.none(layout_job, 26), iter(range(26))
    for robot in range(1, 4):
        for axis in (0, 1, 2, 5):
            result.base[robot, axis, next(place)] = 1.0
        for axis in (0, 2, 4):
            result.tool[robot, axis, next(place)] = 1.0
    for joint in range(1, 6):
        result.start[joint, next(place)] = 1.0
    return result


def _displaced(layout: Layouts, directions: Directions) -> Layouts:
    """A layout moved along each direction, then against each."""
    p = directions.count
    signs = np.repeat([STEP, -STEP], p)
    X_WB, X_FT = (np.tile(X, (2 * p, 1, 1, 1)) for X in (layout.X_WB, layout.X_FT))
    for X, twists in ((X_WB, directions.base), (X_FT, directions.tool)):
        moved = np.moveaxis(np.concatenate([twists, twists], axis=2) * signs, 2, 0)
        X[..., :3, :3] = rotation_exp(moved[..., 3:]) @ X[..., :3, :3]
        X[..., :3, 3] += moved[..., :3]
    start = layout.start + (np.concatenate([directions.start, directions.start], axis=1) * signs).T
    return Layouts(X_WB=X_WB, X_FT=X_FT, start=start, weights=np.tile(layout.weights, (2 * p, 1)))


def measure_all(rounds: int) -> list[Figure]:
    """All comparisons."""
    bench = Bench(rounds)
    results = []
    for compare in (bench.run, bench.run_near, bench.differentiate, bench.moved, bench.near, bench.certify):
        results.append(compare())
        print(f"layout kernel: {results[-1].name}", file=sys.stderr)
    return results


def section(figures: list[Figure], rounds: int) -> Section:
    """The figures as a section of the page."""
    rows = []
    for figure in figures:
        seconds = (f"{1e3 * figure.kernel_s:.2f} ms", f"{1e3 * figure.other_s:.1f} ms")
        rows.append((figure.name, *seconds, digits(figure.other_s / figure.kernel_s)))
    return Section(
        title="Kernel of the layout search",
        lines=[
            f"The reference cell ({CELL.name}). Medians of {rounds} runs after one that does not count, on one thread.",
            "",
            *table(("what; beside what", "kernel, CPU", "beside, CPU", "×"), rows),
        ],
        goals=[Goal(text=figure.name.split(";")[0], measured=figure.agrees, met=figure.is_met) for figure in figures],
    )


def main() -> None:
    """Measure and print."""
    options = benchmark_options("The kernel of the layout search beside what it replaces.", what="calls", rounds=5)
    figures = measure_all(options.rounds)
    if options.json:
        print(json.dumps([asdict(figure) for figure in figures], indent=1, default=bool))
    else:
        print(section(figures, options.rounds).text())


if __name__ == "__main__":
    main()
