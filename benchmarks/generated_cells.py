"""Cells with many robots round one large part: ``python benchmarks/generated_cells.py 32 -o cell.yaml``.

A positioner carries a round plate like a waiter's tray. The other robots stand evenly on a ring round it, and each
works downwards on a patch of its own at the rim: circles, rectangles and rhombi in turn. The ring and the plate grow
with the number of robots. Start postures are computed with the program's own inverse kinematics, or left to its search.
"""

import argparse
import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cellplan import Cell, Robot, load_cell
from cellplan.model.task.task import Task
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import part_pose
from cellplan.planning.start.inverse_kinematics import reaching_configurations, within_limits
from cellplan.scene.kinematics.screw_chain import ScrewChain

FEWEST, MOST = 2, 60  # [-] robots, the positioner among them; the plate of more would be larger than a part may be
PITCH: Final = 1.1  # [m] between neighbouring bases along the ring
SMALLEST_RING: Final = 1.8  # [m] radius of the ring: the positioner's foot stands inside it
REACH: Final = 0.85  # [m] from a robot's base axis to the middle of its patch
RIM: Final = 0.25  # [m] of plate outside the middle of a patch
THICKNESS: Final = 0.1  # [m] of the plate
TRAY: Final = (0.0, -20.0, 20.0, 0.0, -90.0, 0.0)  # [deg] start of the positioner: its flange looks up
FLANGE: Final = (1.461387, 0.618893)  # [m] how far out and how high that puts its flange
STAND: Final = 0.25  # [m] from the flange to the plate
START_DECIMALS: Final = 9  # of a degree: below what moves a tool by a nanometre


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A bundled robot as an operator.

    Attributes:
        model: Its name.
        below: How far its base stands below the upper face of the plate in [m].
        ready: A configuration in [deg] near to working downwards with the elbow up.
    """

    model: str
    below: float
    ready: tuple[float, ...]


ARMS: Final = (
    Arm(model="kuka_kr6", below=0.9, ready=(0.0, -15.0, 25.0, 0.0, 80.0, 0.0)),
    Arm(model="abb_irb1600", below=0.7, ready=(0.0, 5.0, 15.0, 0.0, 70.0, 0.0)),
    Arm(model="staubli_rx90l", below=0.6, ready=(0.0, 5.0, 85.0, 0.0, 90.0, 0.0)),
)
SHAPES: Final = ("circle", "rectangle", "rhombus")


def cell_with(robots: int, *, duration_s: float = 4.0, step_s: float = 0.001, searches: bool = False) -> str:
    """A cell file with so many robots round one part.

    Args:
        robots: How many robots, the positioner among them, 2 to 60.
        duration_s: Length of the motion in [s].
        step_s: Time between two samples in [s].
        searches: Whether the start postures of the operators are left to the search of the program.

    Raises:
        ValueError: The number of robots is out of range.
    """
    if not FEWEST <= robots <= MOST:
        raise ValueError(f"expected {FEWEST} to {MOST} robots, got {robots}")
    clock = f"duration_s: {duration_s:g}, step_s: {step_s:g}"
    draft = _text(robots - 1, {}, clock)
    if searches:
        return draft
    with tempfile.TemporaryDirectory(prefix="cellplan-generated-") as folder:
        path = Path(folder) / "cell.yaml"
        path.write_text(draft, encoding="utf-8")
        starts = _starts(load_cell(path))
    return _text(robots - 1, starts, clock)


def _text(operators: int, starts: dict[str, str], clock: str) -> str:
    """The cell file; operators without a start are left to the search."""
    ring = max(SMALLEST_RING, operators * PITCH / (2.0 * math.pi))
    top = FLANGE[1] + STAND + THICKNESS
    angles = [2.0 * math.pi * (k + 0.5 * (operators % 2 == 0)) / operators for k in range(operators)]
    lines = [
        f"# {operators} robots round a plate that one more carries; made by benchmarks/generated_cells.py.",
        "cellplan: 1",
        f"name: ring-of-{operators + 1}",
        "robots:",
        "  tray:",
        "    model: reis_rv20_16",
        f"    base: {{xyz_mm: [{_mm(-FLANGE[0])}, 0, 0]}}",
        f"    tool: {_tool(STAND, radius=0.03)}",
        f"    start_deg: [{', '.join(f'{angle:g}' for angle in TRAY)}]",
    ]
    for k, angle in enumerate(angles):
        lines += _robot(k, angle, ring=ring, top=top, start=starts.get(f"r{k + 1}", "auto"))
    lines += [
        "part:",
        f"  geometry: {{cylinder: {{radius_mm: {_mm(ring - REACH + RIM)}, length_mm: {_mm(THICKNESS)}}}}}",
        f"  held_by: [{{robot: tray, at: {{xyz_mm: [0, 0, {_mm(-0.5 * THICKNESS)}]}}}}]",
        "tasks:",
    ]
    for k, angle in enumerate(angles):
        lines += _task(k, angle, at=ring - REACH)
    lines += [
        "environment:",
        "  floor: {plane: {z_mm: 0}}",
        f"motion: {{mode: simultaneous, {clock}, time_law: quintic, corners: stop}}",
        "checks: {clearance_mm: 5}",
    ]
    return "\n".join(lines) + "\n"


def _robot(k: int, angle: float, *, ring: float, top: float, start: str) -> list[str]:
    """Lines of one operator, which faces the middle of the plate."""
    arm = ARMS[k % len(ARMS)]
    place = ", ".join(_mm(value) for value in (ring * math.cos(angle), ring * math.sin(angle), top - arm.below))
    return [
        f"  r{k + 1}:",
        f"    model: {arm.model}",
        f"    base: {{xyz_mm: [{place}], rpy_deg: [0, 0, {math.degrees(angle) - 180.0:.6f}]}}",
        f"    tool: {_tool(0.15, radius=0.012)}",
        f"    start_deg: {start}",
    ]


def _task(k: int, angle: float, *, at: float) -> list[str]:
    """Lines of one task: a closed path on the upper face, next to its robot."""
    turn = f"angle_deg: {math.degrees(angle):.6f}"
    center = f"center_mm: [{_mm(at * math.cos(angle))}, {_mm(at * math.sin(angle))}]"
    shapes = {
        "circle": f"circle: {{radius_mm: 80, plane: xy, {center}}}",
        "rectangle": f"rectangle: {{sides_mm: [130, 110], plane: xy, {center}, {turn}}}",
        "rhombus": f"rhombus: {{diagonals_mm: [180, 140], plane: xy, {center}, {turn}}}",
    }[SHAPES[(k // len(ARMS) + k) % len(SHAPES)]]
    return [
        f"  t{k + 1}:",
        f"    robot: r{k + 1}",
        f"    path: {{{shapes}, project: +z}}",
        "    tool_axis: normal",
        f"    tool_x: [{math.cos(angle):.9f}, {math.sin(angle):.9f}, 0]",
        "    tolerance: {position_mm: 0.1, orientation_deg: 0.01}",
    ]


def _tool(length: float, *, radius: float) -> str:
    """A straight round tool of a length and radius in [m]."""
    shape = f"cylinder: {{radius_mm: {_mm(radius)}, length_mm: {_mm(length)}}}"
    return f"{{xyz_mm: [0, 0, {_mm(length)}], geometry: {{{shape}}}}}"


def _mm(value: float) -> str:
    """A length in [m] as the file has it."""
    return f"{1e3 * value:.6f}".rstrip("0").rstrip(".")


def _starts(cell: Cell) -> dict[str, str]:
    """Start posture of every operator, as the file has it."""
    X_WP = part_pose(cell, cell.robot(cell.positioners[0]).start)
    starts = {}
    for arm, task in zip(ARMS * len(cell.tasks), cell.tasks, strict=False):
        q = _start(cell, cell.robot(task.robot), task, X_WP=X_WP, ready=np.radians(arm.ready))
        starts[task.robot] = f"[{', '.join(f'{angle:.{START_DECIMALS}f}' for angle in np.degrees(q))}]"
    return starts


def _start(cell: Cell, robot: Robot, task: Task, *, X_WP: np.ndarray, ready: np.ndarray) -> np.ndarray:
    """The configuration on the start of a task that is found from a configuration ready for work."""
    X_PT = build_toolpath(task, cell.part).X_PT_start
    result = within_limits(
        robot.model, reaching_configurations(ScrewChain(robot), task, X_PT, X_WP=X_WP, seeds=ready[None])
    )
    if not len(result):
        raise ValueError(f"{robot.name}: the start of its task was not reached")
    return result[0]


def main() -> None:
    """Write a cell file."""
    parser = argparse.ArgumentParser(description="Write a cell with many robots round one part.")
    parser.add_argument("robots", type=int, help=f"robots, the positioner among them: {FEWEST} to {MOST}")
    parser.add_argument("-o", "--output", type=Path, required=True, help="cell file to write")
    parser.add_argument("--duration", type=float, default=4.0, help="length of the motion in s (default: 4)")
    parser.add_argument("--step", type=float, default=0.001, help="time between two samples in s (default: 0.001)")
    parser.add_argument("--search", action="store_true", help="leave the start postures to the program's search")
    options = parser.parse_args()
    try:
        text = cell_with(options.robots, duration_s=options.duration, step_s=options.step, searches=options.search)
    except ValueError as error:
        sys.exit(f"{parser.prog}: {error}")
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(text, encoding="utf-8")
    print(f"{options.robots} robots: {options.output}")


if __name__ == "__main__":
    main()
