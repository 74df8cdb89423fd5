"""What it takes to certify the clearance of a program: ``python benchmarks/clearance.py --help``.

Four real arms with a part, a floor and fixtures swing about each other for 4000 samples of 1 ms. Their mesh
descriptions are not part of the project; without them the bundled arms take their place. Printed are the pairs, the
questions asked of the collision engine, processor time, and how much longer it would take to ask for every pair at
every sample: that is measured on a random part of all questions and scaled up. A body that is not convex stands
beside a convex one of like size in ``concave``; both are checked in turns.
"""

import argparse
import json
import statistics
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import concave
import numpy as np
from sections import Goal, Section, table

from cellplan import load_cell
from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import ClearanceReport
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

ROOT = Path(__file__).resolve().parent.parent
ROBOTS = ROOT.parent / "shared" / "robots"
REAL = ("kuka_kr16_2", "abb_irb1600_8_145", "staubli_rx160", "kuka_kr5_arc")
BUNDLED = ("reis_rv20_16", "abb_irb1600", "staubli_rx90l", "kuka_kr6")
HOMES = ((0, -80, 90, 0, 30, 0), (0, 0, 0, 0, 30, 0), (0, 0, 90, 0, 30, 0), (0, -80, 80, 0, 40, 0))
BUNDLED_HOMES = ((0, -62, 104, 0, -42, 0), (0, 0, 0, 0, 30, 0), (0, -40, 90, 0, 30, 0), (0, 0, 0, 0, 30, 0))
SWING = np.radians([12.0, 6.0, 6.0, 20.0, 20.0, 30.0])  # [rad] how far each joint swings to either side
MARGIN = 0.005  # [m] demanded
BRUTE = 3000  # [-] questions of the brute-force search that are asked
GOAL_S, GOAL_QUERIES = 2.0, 2000  # processor time in [s] and distance queries that are to be enough
SAMPLES = 4000  # [-] of the program
CELL = """
cellplan: 1
name: four-arms
robots:
  holder: {{model: {0}, base: {{xyz_mm: [0, 0, 600]}}, start_deg: {homes[0]}, tool: {{xyz_mm: [0, 0, 80], {grip}}}}}
  left: {{model: {1}, base: {{xyz_mm: [1300, 1500, 300], rpy_deg: [0, 0, -100]}}, start_deg: {homes[1]}, {tool}}}
  front: {{model: {2}, base: {{xyz_mm: [2900, 0, 300], rpy_deg: [0, 0, 180]}}, start_deg: {homes[2]}, {tool}}}
  right: {{model: {3}, base: {{xyz_mm: [1300, -1500, 300], rpy_deg: [0, 0, 100]}}, start_deg: {homes[3]}, {tool}}}
part:
  geometry: {{cylinder: {{radius_mm: 150, length_mm: 400, axis: x}}}}
  held_by: [{{robot: holder, at: {{xyz_mm: [-200, 0, 0], rpy_deg: [0, 90, 0]}}}}]
tasks: {{any: {{robot: left, path: {{circle: {{radius_mm: 30, plane: yz}}, project: +x}}}}}}  # left out below
environment:
  floor: {{plane: {{z_mm: 0}}}}
  holder_pedestal: {{cylinder: {{radius_mm: 250, length_mm: 560, axis: z}}, at: {{xyz_mm: [0, 0, 280]}}}}
  left_pedestal: {{box: {{size_mm: [500, 500, 260]}}, at: {{xyz_mm: [1300, 1500, 130]}}}}
  front_pedestal: {{box: {{size_mm: [500, 500, 260]}}, at: {{xyz_mm: [2900, 0, 130]}}}}
  right_pedestal: {{box: {{size_mm: [500, 500, 260]}}, at: {{xyz_mm: [1300, -1500, 130]}}}}
  post_1: {{cylinder: {{radius_mm: 40, length_mm: 2500, axis: z}}, at: {{xyz_mm: [2400, 1600, 1250]}}}}
  post_2: {{cylinder: {{radius_mm: 40, length_mm: 2500, axis: z}}, at: {{xyz_mm: [2400, -1600, 1250]}}}}
  bin: {{box: {{size_mm: [400, 300, 200]}}, at: {{xyz_mm: [1300, 0, 100]}}}}
motion: {{mode: simultaneous, duration_s: 4, step_s: 0.001}}
checks: {{clearance_mm: {margin}}}
"""


def build(folder: Path, *, is_bundled: bool) -> tuple[Cell, str]:
    """The cell, and a word on its arms; the file is written into a folder."""
    real = not is_bundled and all((ROBOTS / name).is_dir() for name in REAL)
    models = [str(ROBOTS / name / f"{name}.urdf") for name in REAL] if real else list(BUNDLED)
    tool = "tool: {xyz_mm: [0, 0, 150], geometry: {cylinder: {radius_mm: 15, length_mm: 150}}}"
    grip = "geometry: {box: {size_mm: [120, 60, 80]}}"
    homes = [list(home) for home in (HOMES if real else BUNDLED_HOMES)]
    path = folder / "four_arms.yaml"
    text = CELL.format(*models, homes=homes, tool=tool, grip=grip, margin=1e3 * MARGIN)
    path.write_text(text, encoding="utf-8")
    cell = load_cell(path, allow_dirs=[ROBOTS] if real else [])
    return replace(
        cell, tasks=()
    ), "real arms with meshes" if real else "bundled arms (no ../shared/robots on this machine)"


def program(cell: Cell, samples: int) -> tuple[Schedule, Array]:
    """Each joint swings about its start posture with a period and a phase of its own."""
    times = 1e-3 * np.arange(samples, dtype=np.float64)
    rng = np.random.default_rng(0)
    columns = []
    for robot in cell.robots:
        start = robot.start if robot.start is not None else np.zeros(len(robot.model.joints))
        phase, rate = rng.uniform(0.0, 2.0 * np.pi, len(start)), rng.uniform(1.0, 2.5, len(start))
        columns.append(start + SWING[: len(start)] * np.sin(rate * times[:, None] + phase))
    return Schedule(times=times, tasks=()), np.concatenate(columns, axis=1)


def certify(cell: Cell, schedule: Schedule, q: Array, *, rounds: int) -> tuple[Scene, ClearanceReport, float]:
    """The whole check of clearance; median processor time in [s], without building the scene."""
    seconds = []
    for _ in range(rounds):
        scene = Scene.from_cell(cell)  # anew: it remembers what it was asked
        begin = time.process_time()
        report, _ = check_clearance(scene, schedule, q)
        seconds.append(time.process_time() - begin)
    return scene, report, statistics.median(seconds)


def brute_force(scene: Scene, q: Array, count: int) -> tuple[dict[str, float], float]:
    """Smallest distance of each class among random pairs and samples, and processor time in [s] for all of them."""
    rng = np.random.default_rng(1)
    rows = [row for row in scene.solid_rows.tolist() if scene.pairs[row].rule is Rule.CLEARANCE]
    ends = {row: (int(a), int(b)) for row, (a, b) in zip(scene.solid_rows.tolist(), scene.solid_pairs, strict=True)}
    samples = rng.choice(len(q), size=20, replace=False)
    poses, engine = scene.body_poses(q[samples]), Engine(scene.engine.bodies)
    smallest: dict[str, float] = {}
    chosen = rng.choice(rows, size=count)
    begin = time.process_time()
    for number, row in enumerate(chosen.tolist()):
        sample = number % len(samples)
        hit = engine.touch(*ends[row], poses, sample=sample)
        distance = 0.0 if hit else engine.surface_distance(*ends[row], poses, sample=sample)
        kind = str(scene.pairs[row].clearance_class)
        smallest[kind] = min(smallest.get(kind, np.inf), distance)
    taken = time.process_time() - begin
    for row in rows:  # each pair once more, proved: the classes' own minima are among them
        reading = measure(engine, ends[row], poses, sample=0)
        kind = str(scene.pairs[row].clearance_class)
        smallest[kind] = min(smallest.get(kind, np.inf), reading.bound)
    return smallest, taken * len(rows) * len(q) / count


def record(cell: Cell, arms: str, samples: int, *, rounds: int) -> dict[str, Any]:
    """All figures."""
    schedule, q = program(cell, samples)
    scene, report, seconds = certify(cell, schedule, q, rounds=rounds)
    smallest, brute_s = brute_force(scene, q, BRUTE)
    minima: dict[str, dict[str, Any]] = {
        str(kind): {"minimum_mm": 1e3 * value.minimum, "certified": value.certified, "at_s": value.at_s}
        for kind, value in report.minima.items()
        if value.minimum is not None
    }
    agrees = all(1e-3 * value["minimum_mm"] <= smallest.get(kind, np.inf) + 1e-9 for kind, value in minima.items())
    return {
        "arms": arms,
        "bodies": len(scene.bodies),
        "pairs": report.pair_count,
        "samples": samples,
        "decision_at_5_mm": "free" if all(m["minimum_mm"] >= 1e3 * MARGIN for m in minima.values()) else "not free",
        "minima": minima,
        "distance_queries": report.distance_queries,
        "contact_queries": report.contact_queries,
        "cut_steps": report.cut_steps,
        "cpu_s": seconds,
        "brute_force_cpu_s": brute_s,
        "ratio": brute_s / seconds,
        "brute_force_finds_nothing_nearer": agrees,
    }


def section(figures: dict[str, Any], rounds: int) -> Section:
    """The figures as a section of the page."""
    rows = [
        (
            kind,
            f"{value['minimum_mm']:.1f} mm",
            f"{value['at_s']:.3f} s",
            "certified" if value["certified"] else "not certified",
        )
        for kind, value in figures["minima"].items()
    ]
    agrees = "nothing nearer" if figures["brute_force_finds_nothing_nearer"] else "**something nearer**"
    return Section(
        title="Certified clearance, beside brute force",
        lines=[
            f"Four {figures['arms']} with a part, a floor and fixtures swing about each other: {figures['bodies']} "
            f"bodies, {figures['pairs']} pairs, {figures['samples']} samples of 1 ms and all that lies between. "
            f"Decision at {1e3 * MARGIN:g} mm: {figures['decision_at_5_mm']}.",
            "",
            *table(("class", "smallest distance", "at", "proof"), rows),
            "",
            f"Asked: {figures['distance_queries']} distances and {figures['contact_queries']} contacts, with "
            f"{figures['cut_steps']} steps cut finer, in {figures['cpu_s']:.2f} s of processor time (median of "
            f"{rounds}). Brute force, every pair at every sample, would take {figures['brute_force_cpu_s']:.0f} s "
            f"(scaled up from {BRUTE} questions), {figures['ratio']:.0f} times as long, without a word on what lies "
            f"between; it finds {agrees}.",
            "",
            *concave.lines_of(figures["concave"]),
        ],
        goals=[
            Goal(
                text=f"at most {GOAL_S:g} s of processor time",
                measured=f"{figures['cpu_s']:.2f} s",
                met=figures["cpu_s"] <= GOAL_S,
            ),
            Goal(
                text=f"at most {GOAL_QUERIES} distance queries",
                measured=str(figures["distance_queries"]),
                met=figures["distance_queries"] <= GOAL_QUERIES,
            ),
            concave.goal_of(figures["concave"]),
        ],
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="Measure what it takes to certify the clearance of four arms.")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="samples of 1 ms (default: 4000)")
    parser.add_argument("--rounds", type=int, default=1, help="checks; the median is shown (default: 1)")
    parser.add_argument("--bundled", action="store_true", help="take the bundled arms even if the real ones are there")
    parser.add_argument("--json", action="store_true", help="print one JSON object instead of lines")
    options = parser.parse_args()
    if options.samples < 2:
        parser.error("--samples: expected at least 2")
    if options.rounds < 1:
        parser.error("--rounds: expected at least 1")
    with tempfile.TemporaryDirectory(prefix="cellplan-bench-") as folder:
        cell, arms = build(Path(folder), is_bundled=options.bundled)
        figures = record(cell, arms, options.samples, rounds=options.rounds)
        figures["concave"] = concave.measured(Path(folder), rounds=options.rounds)
    print(json.dumps(figures, indent=1) if options.json else section(figures, options.rounds).text())


if __name__ == "__main__":
    main()
