"""A cell whose program has two phases: two arms work on one plate in turns; and edits of its run that are sealed."""

import json
import re
from pathlib import Path

from cellplan.files.input.files import digest
from cellplan.files.run.joint_tables import program_digest

PAIR = """\
cellplan: 1
name: in-turns
robots:
  left:
    model: planar_3r
    tool: {xyz_mm: [0, 0, 60], geometry: {cylinder: {radius_mm: 5, length_mm: 60}}}
    start_deg: [57.681180960824, -53.90672769931, -51.879785265709]
  right:
    model: planar_3r
    base: {xyz_mm: [1400, 0, 0], rpy_deg: [0, 0, 180]}
    tool: {xyz_mm: [0, 0, 60], geometry: {cylinder: {radius_mm: 5, length_mm: 60}}}
    start_deg: [-75.819668859148, 75.876425761142, 67.140200116841]
part:
  geometry: {box: {size_mm: [300, 300, 10]}}
  at: {xyz_mm: [700, 300, -85]}
tasks:
  first: {robot: left, path: {circle: {radius_mm: 100, plane: xy}, project: +z}, tool_axis: normal, axes: [x, y]}
  second: {robot: right, path: {circle: {radius_mm: 100, plane: xy}, project: +z}, tool_axis: normal, axes: [x, y]}
motion: {mode: pairwise, duration_s: 2, step_s: 0.01}
checks: {clearance_mm: 5}
"""
ROBOTS = ("left", "right")


def seal_program(run: Path, robots: tuple[str, ...] = ROBOTS) -> None:
    """Make headers, reports and manifest carry the digests of the rows and files as they are now."""
    texts = {name: (run / "tables" / f"{name}.csv").read_text() for name in robots}
    program = program_digest(texts)
    for path in (run / "tables").iterdir():
        path.write_text(re.sub("# program digest: sha256 .*", f"# program digest: sha256 {program}", path.read_text()))
    for report in run.rglob("report.json"):
        text = re.sub('"program": "[0-9a-f]{64}"', f'"program": "{program}"', report.read_text())
        report.write_text(text)
    manifest = run / "manifest.json"
    record = json.loads(manifest.read_text())
    for name in record["files"]:
        data = (run / name).read_bytes()
        record["files"][name] = {"bytes": len(data), "sha256": digest(data)}
    manifest.write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n")
