"""Concave beside convex: what it takes to certify a body that is not convex, beside a convex one of like size.

An arm moves for 400 samples of 10 ms among one mesh. Where it is not convex, the rod that the arm carries is inside it:
in a tube, in an open channel, in a bowl with bumps; or the arm carries the channel itself, round a post. Beside each of
these stands the same cell with a convex mesh of the same number of triangles and about the same size. Each pair of
cells is checked in turns.
"""

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from sections import Goal, table

from cellplan import load_cell
from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.shapes import Cylinder, Mesh
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Obstacle
from cellplan.model.motion.motion import Schedule
from cellplan.model.robot.robot import Body
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

SAMPLES: Final = 400  # [-] of 10 ms
SWING: Final = np.array([0.012, 0.01, 0.01, 0.04, 0.04, 0.12])  # [rad] how far each joint swings to either side
START: Final = (0.0, 0.0, 0.0, 0.0, 30.0, 0.0)  # [deg]
GOAL: Final = 10.0  # [-] times the processor time of the convex one
CELL: Final = """
cellplan: 1
name: one-arm
robots:
  arm: {{model: kuka_kr6, start_deg: {start}, tool: {{xyz_mm: [0, 0, 400], geometry: {tool}}}}}
part: {{geometry: {{box: {{size_mm: [100, 100, 100]}}}}, at: {{xyz_mm: [-3000, 0, 900]}}}}
tasks: {{any: {{robot: arm, path: {{circle: {{radius_mm: 30, plane: yz}}, project: +x}}}}}}  # left out below
motion: {{mode: simultaneous, duration_s: 4, step_s: 0.01}}
checks: {{clearance_mm: 5}}
"""
ROD: Final = "{cylinder: {radius_mm: 10, length_mm: 400}}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A mesh that is not convex, and where it is.

    Attributes:
        name: Name in the table.
        mesh: The mesh.
        at: Its middle seen from the tool tip in [m], z along the tool.
        is_carried: Whether the arm carries it, round a post that stands in its middle.
    """

    name: str
    mesh: Mesh
    at: tuple[float, float, float]
    is_carried: bool = False


def cases() -> Sequence[Case]:
    """All of them."""
    return (
        Case(name="rod in a tube", mesh=tube(0.09, 0.1, 0.2, sides=48), at=(0.0, 0.0, -0.1)),
        Case(name="rod in a finely meshed tube", mesh=tube(0.09, 0.1, 0.2, sides=400), at=(0.0, 0.0, -0.1)),
        Case(name="rod in a channel", mesh=channel(0.16, 0.2, 0.01, slices=12), at=(0.0, 0.0, -0.1)),
        Case(name="rod in a bowl with bumps", mesh=bowl(0.12, 0.01, sides=24, rings=10), at=(0.0, 0.0, -0.03)),
        Case(
            name="channel round a post, carried",
            mesh=channel(0.16, 0.2, 0.01, slices=12),
            at=(0.0, 0.0, -0.1),
            is_carried=True,
        ),
    )


def measured(folder: Path, *, rounds: int) -> list[dict[str, Any]]:
    """Processor times of all cases and their ratios, medians of some rounds; cells are written into a folder."""
    results = []
    for case in cases():
        rod = rod_of(0.08, 0.2, sides=len(case.mesh.faces) // 4)
        away = (0.0, case.at[1] + 0.19, case.at[2])
        both = (case, replace(case, mesh=rod, at=away))
        seconds: tuple[list[float], list[float]] = ([], [])
        smallest = [np.nan, np.nan]
        for _ in range(rounds):
            for place, one in enumerate(both):
                taken, smallest[place] = checked(*cell_of(folder, one))
                seconds[place].append(taken)
        concave, convex = (statistics.median(second) for second in seconds)
        results.append(
            {
                "case": case.name,
                "triangles": len(case.mesh.faces),
                "concave_cpu_s": concave,
                "convex_cpu_s": convex,
                "ratio": concave / convex,
                "concave_mm": 1e3 * smallest[0],
                "convex_mm": 1e3 * smallest[1],
            }
        )
    return results


def lines_of(result: Sequence[dict[str, Any]]) -> list[str]:
    """The figures in Markdown."""
    head = ("case", "triangles", "not convex", "convex", "ratio", "smallest distances")
    rows = [
        (
            one["case"],
            str(one["triangles"]),
            f"{one['concave_cpu_s']:.3f} s",
            f"{one['convex_cpu_s']:.3f} s",
            f"{one['ratio']:.1f}",
            f"{one['concave_mm']:.1f} mm, {one['convex_mm']:.1f} mm",
        )
        for one in result
    ]
    return [
        "A body that is not convex beside a convex one of as many triangles and about the same size: processor time of "
        f"the whole check of one arm and {SAMPLES} samples of 10 ms.",
        "",
        *table(head, rows),
    ]


def goal_of(result: Sequence[dict[str, Any]]) -> Goal:
    """No case costs too many times what a convex body does."""
    worst = max(float(one["ratio"]) for one in result)
    return Goal(
        text=f"a body that is not convex takes at most {GOAL:g} times the processor time of a convex one",
        measured=f"{worst:.1f}",
        met=worst <= GOAL,
    )


def cell_of(folder: Path, case: Case) -> tuple[Cell, Array]:
    """The cell of a case and the joint positions of its program."""
    path = folder / "one_arm.yaml"
    path.write_text(CELL.format(start=list(START), tool=ROD), encoding="utf-8")
    cell = load_cell(path)
    robot, start = cell.robots[0], np.radians(START)
    X_WT = ScrewChain(robot).tool_poses(start[None])[0]
    X_TS = np.eye(4)
    X_TS[:3, 3] = case.at
    if case.is_carried:
        post = Cylinder(0.01, 0.6)
        X_TP = np.eye(4)
        X_TP[2, 3] = 0.2
        held = Body(name="held", link=robot.model.flange_link, shape=case.mesh, X_BS=robot.tool.X_FT @ X_TS)
        cell = replace(cell, robots=(replace(robot, tool=replace(robot.tool, bodies=(held,))),))
        thing = Obstacle(name="post", shape=post, X_WS=X_WT @ X_TP)
    else:
        thing = Obstacle(name="mesh", shape=case.mesh, X_WS=X_WT @ X_TS)
    rng = np.random.default_rng(3)
    rate, phase = rng.uniform(1.0, 3.0, len(start)), rng.uniform(0.0, 2.0 * np.pi, len(start))
    times = 0.01 * np.arange(SAMPLES)[:, None]
    q = start + SWING * (np.sin(rate * times + phase) - np.sin(phase))
    return replace(cell, tasks=(), obstacles=(thing,)), q


def checked(cell: Cell, q: Array) -> tuple[float, float]:
    """Processor time of the check in [s], without building the scene, and the smallest distance in [m] round the arm.

    Raises:
        RuntimeError: Bodies touch or the distance is not certified: times would mean nothing.
    """
    scene = Scene.from_cell(cell)
    begin = time.process_time()
    report, checks = check_clearance(scene, Schedule(times=0.01 * np.arange(len(q)), tasks=()), q)
    seconds = time.process_time() - begin
    if not all(check.passed for check in checks):
        raise RuntimeError(next(check.message for check in checks if not check.passed))
    return seconds, min(one.minimum for kind, one in report.minima.items() if kind == "environment" and one.minimum)


def tube(inner: float, outer: float, length: float, *, sides: int) -> Mesh:
    """A tube along z, open at both ends; lengths in [m]."""
    half = 0.5 * length
    return _turned([(inner, -half), (inner, half), (outer, half), (outer, -half)], sides)


def rod_of(radius: float, length: float, *, sides: int) -> Mesh:
    """A prism along z with its ends closed by triangles round their middles; four triangles for each side."""
    half = 0.5 * length
    ring = _ring(sides)
    vertices = np.concatenate([np.column_stack([radius * ring, np.full(sides, z)]) for z in (-half, half)])
    vertices = np.concatenate([vertices, [[0.0, 0.0, -half], [0.0, 0.0, half]]])
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = [
        (k, after, sides + after),
        (k, sides + after, sides + k),
        (after, k, low),
        (sides + k, sides + after, high),
    ]
    return _mesh(vertices, np.concatenate([np.column_stack(corners) for corners in faces]))


def channel(width: float, length: float, wall: float, *, slices: int) -> Mesh:
    """A channel along z, open toward y; lengths in [m]."""
    w = 0.5 * width
    inner = w - wall
    outline = np.array([(-w, -w), (w, -w), (w, w), (inner, w), (inner, -inner), (-inner, -inner), (-inner, w), (-w, w)])
    count = len(outline)
    places = np.linspace(-0.5 * length, 0.5 * length, slices)
    vertices = np.concatenate([np.column_stack([outline, np.full(count, z)]) for z in places])
    k, after = np.arange(count), (np.arange(count) + 1) % count
    faces = []
    for low in range(0, count * (slices - 1), count):
        high = low + count
        faces += [
            np.column_stack([low + k, low + after, high + after]),
            np.column_stack([low + k, high + after, high + k]),
        ]
    end = np.array([(0, 1, 4), (0, 4, 5), (1, 2, 3), (1, 3, 4), (0, 5, 6), (0, 6, 7)])
    faces += [end[:, ::-1], end + count * (slices - 1)]
    return _mesh(vertices, np.concatenate(faces))


def bowl(radius: float, wall: float, *, sides: int, rings: int) -> Mesh:
    """A bowl with bumps, open toward -z: no stretch of it is flat."""
    angles = np.linspace(0.5 * np.pi, 0.02, rings)
    inside = [(radius * np.sin(a), radius * np.cos(a)) for a in angles]
    outside = [((radius + wall) * np.sin(a), (radius + wall) * np.cos(a)) for a in angles[::-1]]
    mesh = _turned([*outside, *inside], sides)
    about, along = np.arctan2(mesh.vertices[:, 1], mesh.vertices[:, 0]), mesh.vertices[:, 2] / radius
    return _mesh(mesh.vertices * (1.0 + 0.05 * np.sin(5.0 * about) * np.sin(7.0 * along))[:, None], mesh.faces)


def _turned(outline: Sequence[tuple[float, float]], sides: int) -> Mesh:
    """A closed outline of radii and heights, turned round z."""
    ring = _ring(sides)
    vertices = np.concatenate([np.column_stack([r * ring, np.full(sides, z)]) for r, z in outline])
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    faces = []
    for place in range(len(outline)):
        a, b = place * sides, (place + 1) % len(outline) * sides
        faces += [np.column_stack([a + after, a + k, b + k]), np.column_stack([a + after, b + k, b + after])]
    return _mesh(vertices, np.concatenate(faces))


def _ring(sides: int) -> Array:
    """Corners of a regular polygon in the unit circle, shape (sides, 2)."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(turn), np.sin(turn)])


def _mesh(vertices: Array, faces: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> Mesh:
    """A closed mesh."""
    return Mesh(vertices=vertices, faces=faces, source="benchmark", is_closed=True)
