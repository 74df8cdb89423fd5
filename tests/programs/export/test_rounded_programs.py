"""RAPID programs in step whose rows are rounded: the tools on the part, computed densely from the text of the files."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from cellplan import load_cell, open_gate, solve, write_run
from cellplan.model.cell.cell import Cell
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.prepare import prepare
from cellplan.programs.export.program import export_program
from cellplan.programs.export.stored import read_stored_export
from cellplan.programs.export.verify_export import verify_export
from cellplan.programs.export.written import judged, read_files
from cellplan.scene.kinematics.screw_chain import ScrewChain

RING = 60.0  # [mm] radius of the desired paths, in planes of constant x on the part
SIDE = 150.0  # [mm] x of these planes
DEMAND = 0.3  # [mm]
MOVE = re.compile(
    r"Move(?:AbsJ|ExtJ) \[\[([^\]]*)\],\[([^\]]*)\]\](?:\\ID:=\d+)?,\w+(?:\\T:=([\d.]+))?,(\w+)", re.ASCII
)
Read = tuple[np.ndarray, np.ndarray, list[list[float] | None]]


def moves_of(text: str, *, is_arm: bool) -> Read:
    """Joints in [rad], times in [s] and zones of all rows of a module."""
    zones = {
        zone[1]: [float(number) for number in zone[2].split(",")]
        for zone in re.finditer(r"zonedata (\w+) := \[FALSE,([^\]]*)\]", text)
    }
    moves = list(MOVE.finditer(text))
    numbers = [move[1 if is_arm else 2].replace(",9E9", "").split(",") for move in moves]
    times = np.cumsum([float(move[3] or 0.0) for move in moves])
    return np.radians(np.array(numbers, dtype=float)), times, [zones.get(move[4]) for move in moves]


def share(chain: ScrewChain, q: np.ndarray, other: np.ndarray, zone: list[float], *, is_arm: bool) -> float:
    """Share of a segment at which its zone begins, at most half."""
    shares = np.linspace(0.0, 0.5, 1001)
    if is_arm:
        tips = chain.tool_poses(q + shares[:, None] * (other - q))[:, :3, 3]
        beyond = 1e3 * np.linalg.norm(tips - tips[0], axis=1) > zone[0]
    else:
        beyond = np.degrees(shares * np.abs(other - q).max()) > zone[5]
    return float(shares[np.argmax(beyond)]) if np.any(beyond) else 0.5


def played(chain: ScrewChain, read: Read, row: int, at: np.ndarray, *, is_arm: bool) -> np.ndarray:
    """Joints at times beside a row: straight, and on a parabola within its zone, shape (M, n)."""
    q, times, zones = read
    v = np.diff(q[row - 1 : row + 2], axis=0) / np.diff(times[row - 1 : row + 2])[:, None]
    zone, by = zones[row], at - times[row]
    path: np.ndarray = q[row] + by[:, None] * np.where(by[:, None] < 0.0, v[0], v[1])
    if zone is None:
        return path
    before, after = (
        share(chain, q[row], q[other], zone, is_arm=is_arm) * abs(times[other] - times[row])
        for other in (row - 1, row + 1)
    )
    s = np.linspace(0.0, 1.0, 2001)
    time = -((1.0 - s) ** 2) * before + s**2 * after
    corner = q[row] - ((1.0 - s) ** 2 * before)[:, None] * v[0] + (s**2 * after)[:, None] * v[1]
    inside = (by > -before) & (by < after)
    path[inside] = np.stack([np.interp(by[inside], time, column) for column in corner.T], axis=1)
    return path


def largest_error(cell: Cell, files: dict[str, str]) -> float:
    """Largest distance of a tool from its ring on the part in [mm], over all corners."""
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    reads = {name: moves_of(files[f"{name}.mod"], is_arm=name != "positioner") for name in chains}
    times, largest = reads["left"][1], 0.0
    for row in range(1, len(times) - 1):
        at = np.linspace(0.5 * (times[row - 1] + times[row]), 0.5 * (times[row] + times[row + 1]), 41)
        X = {
            name: chain.tool_poses(played(chain, reads[name], row, at, is_arm=name != "positioner"))
            for name, chain in chains.items()
        }
        X_PW = np.linalg.inv(X["positioner"] @ cell.part.X_CP)
        for name in ("left", "right"):
            p = 1e3 * (X_PW @ X[name])[:, :3, 3]
            off = np.hypot(np.hypot(p[:, 1], p[:, 2]) - RING, np.abs(p[:, 0]) - SIDE)
            largest = max(largest, float(off.max()))
    return largest


@pytest.mark.slow
def test_tools_keep_their_tolerance_on_the_part_at_rounded_rows(cells: Path, tmp_path: Path) -> None:
    """Two arms and a positioner: nearly all rows are rounded, in process, and each within its share."""
    path = cells / "multimove.yaml"
    write_run(solve(load_cell(path)), tmp_path / "run")
    run = open_gate(tmp_path / "run", cell=path)

    names = export_program(run, tmp_path / "rapid", form="rapid")

    record = json.loads((tmp_path / "rapid" / "export.json").read_text(encoding="utf-8"))
    files = {name: (tmp_path / "rapid" / name).read_text(encoding="utf-8") for name in names}
    assert record["blend"] > 0.0
    assert record["rounded"]["rows"] > 0.9 * record["rounded"]["of"]
    corner = max(corner["largest"] for corner in record["rounded"]["corners"] if corner["unit"] == "mm")
    straight = max(
        deviation["largest"]
        for deviation in record["deviations"]
        if "tool" in deviation["of"] and deviation["unit"] == "mm"
    )
    result = largest_error(run.cell, files)
    assert result <= DEMAND
    assert result <= straight + corner
    assert "rounded within" in " ".join(files["left.mod"].replace("\n  !", " ").split())
    assert verify_export(read_stored_export(tmp_path / "rapid"), run).record == record


def off_the_circle(scene_cell: Cell, q: np.ndarray, holder: np.ndarray) -> np.ndarray:
    """Distance of a tool from its circle on the end of the part in [mm]: 60 mm round x, at 150 mm, shape (M,)."""
    chains = {name: ScrewChain(scene_cell.robot(name)) for name in ("kuka", "reis")}
    X_WP = chains["reis"].tool_poses(holder[None]) @ scene_cell.part.X_CP
    p = 1e3 * (np.linalg.inv(X_WP) @ chains["kuka"].tool_poses(q))[:, :3, 3]
    off: np.ndarray = np.hypot(np.hypot(p[:, 1], p[:, 2]) - RING, p[:, 0] - SIDE)
    return off


@pytest.mark.slow
def test_a_robot_that_works_on_a_part_at_rest_stops_at_few_rows(cells: Path, tmp_path: Path) -> None:
    """Points of all triangles at rows in process are within the tolerance, and most of what is proved is needed."""
    path = cells / "in_turn.yaml"
    write_run(solve(load_cell(path)), tmp_path / "run")
    run = open_gate(tmp_path / "run", cell=path)

    prepared = prepare(run, DIALECTS["krl"], Choice())

    (read,) = read_files(prepared, DIALECTS["krl"].render(prepared.job))
    written, rows = prepared.job.programs[0].robots["kuka"], read.robots["kuka"]
    assert np.count_nonzero(rows.rounding) > 0.9 * len(rows)
    (tables,) = run.programs.values()
    rng, worst = np.random.default_rng(0), 0.0
    for row in np.flatnonzero(written.process[1:-1] & written.process[:-2]) + 1:
        back, on = np.sort(rng.uniform(0.0, 1.0, (2, 100)), axis=0)
        back, on = np.append(back, 0.5), np.append(1.0 - on, 0.5)  # the middle of the chord too
        offsets = rows.rounding[row] * (rows.q[[row - 1, row + 1]] - rows.q[row])
        holder = np.array([np.interp(written.times[row], tables["reis"].times, c) for c in tables["reis"].q.T])
        off = off_the_circle(run.cell, rows.q[row] + back[:, None] * offsets[0] + on[:, None] * offsets[1], holder)
        worst = max(worst, float(off.max()))
    judgement = judged(run, prepared, (read,))
    proved = max(corner.largest for corner in judgement.corners if corner.unit == "mm")
    assert worst <= 0.1
    assert 0.7 * proved <= worst <= proved + 1e-3
