"""Small cells of two arms that work on a part in the world, each on the controller of a maker: quick to solve."""

from pathlib import Path

from cellplan import load_cell, solve, write_run

CELL = """\
cellplan: 1
name: side-by-side
controllers:
  one: {{kind: {first}, latency_ms: 40}}
  other: {{kind: {second}, latency_ms: 40{tasks}}}
robots:
  left:
    model: kuka_kr6
    base: {{xyz_mm: [0, -1100, 0], rpy_deg: [0, 0, 90]}}
    tool: {{xyz_mm: [0, 0, 150], geometry: {{capsule: {{radius_mm: 12, length_mm: 150}}}}}}
    controller: {{id: one, cycle_ms: 8, decimals: {decimals}, handshake: {{output: 1, inputs: {{right: 2}}}}}}
  right:
    model: abb_irb1600
    base: {{xyz_mm: [0, 1100, 0], rpy_deg: [0, 0, -90]}}
    tool: {{xyz_mm: [0, 0, 150], geometry: {{capsule: {{radius_mm: 12, length_mm: 150}}}}}}
    controller: {{id: other, cycle_ms: 8{task}, handshake: {{output: {output}, inputs: {{left: {entry}}}}}}}
part:
  geometry: {{box: {{size_mm: [600, 300, 200]}}}}
  at: {{xyz_mm: [0, 0, 900]}}
tasks:
  ring:
    robot: left
    path: {{circle: {{radius_mm: 60, plane: xz}}, project: -y}}
    tool_axis: normal
    tolerance: {{position_mm: 1, orientation_deg: 0.5}}
  frame:
    robot: right
    path: {{rectangle: {{sides_mm: [200, 80], plane: xz}}, project: +y}}
    tool_axis: normal
    tolerance: {{position_mm: 1, orientation_deg: 0.5}}
motion: {{mode: part_at_rest, duration_s: 4, step_s: 0.04, corners: stop}}
checks: {{clearance_mm: 5}}
"""
DECIMALS = 5  # that the left robot states: of a degree in KRL and VAL3


def write_cell(file: Path, *, first: str, second: str) -> Path:
    """Write a cell whose arms are on controllers of two kinds; gives its file."""
    is_abb = second == "abb"
    text = CELL.format(
        first=first,
        second=second,
        decimals=DECIMALS,
        tasks=", tasks: {T_ROB1: ROB_1}" if is_abb else "",
        task=", task: T_ROB1" if is_abb else ", tool_number: 1" if second == "yaskawa" else "",
        output="doThere" if is_abb else 1,
        entry="diGo" if is_abb else 2,
    )
    file.write_text(text, encoding="utf-8")
    return file


def solve_into(cell: Path, run: Path) -> None:
    """Solve a cell and write its run folder."""
    write_run(solve(load_cell(cell)), run)
