"""Nicolato 2007, section 4.2, figures 4.6 and 4.7: an ellipse, 25 times, and whether the joints come back."""

import math
import shutil
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cellplan import load_cell
from reproduction.runs import PAPERS, Array, Curves, Numbers, curves, paper_cell
from reproduction.sheet import Sheet, draw_joints

NAMES = (r"$\theta_1$", r"$\theta_2$", r"$\theta_3$", r"$\theta_4$")
PERIOD, WHOLE, WIDE = 2.0, 50.0, 6.0  # [s] one cycle; all of them; those with wide limits
HELD = 0.5  # [s] long enough to come from the stretched arm to the start of the ellipse
OPEN = np.tile([-180.0, 180.0], (4, 1))  # [deg] limits of the thesis before they are tightened
DECIMALS = 4  # [-] of a degree in the shipped cell
TIGHTENED = PAPERS / "nicolato_ellipse_tightened.yaml"

CELL = """\
cellplan: 1
name: {name}
robots:
  arm:
    model: robots/nicolato_4r.yaml
    start_deg: [{start}]
    limits:
{limits}
part:
  geometry: {{sphere: {{radius_mm: 10}}}}
  at: {{xyz_mm: [0, 0, 0]}}
tasks:
  ellipse:
    robot: arm
    path: {path}
    tool_axis: -z
    axes: [x, y]
{words}    tolerance: {{position_mm: 0.01}}
motion: {{duration_s: {duration:g}, step_s: 0.001}}
acceleration: {{unlimited: the path of the source starts and ends at speed}}
solver: {{method: recursive_search, integrator: euler, search: {{tolerance_mm: 0.01, brakes: true}}}}
"""
HEADER = """\
# Nicolato 2007, section 4.2, figure 4.7: the ellipse of `nicolato_ellipse.yaml` by recursive search within tightened
# limits: the joints come back in every cycle but the first, where the limits take hold.
# Start and limits come from the procedure of the thesis, done by `docs/make_reproduction.py`: start with all joints in
# the middle of their limits, at 0; go to the start of the ellipse; follow it for 6 s within limits of -180 and 180 deg;
# then each joint is limited to where it has been in these 6 s. This cell goes on from there, from 6 s to 50 s.
"""


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One stage of the procedure as a cell: start in [deg], limits in [deg] by joint, path and length in [s]."""

    start: Array
    limits: Array
    duration: float
    path: str = "{csv: {file: paths/nicolato_ellipse.csv, closed: true}}"
    words: str = ""

    def text(self, name: str) -> str:
        """The cell file."""
        limits = "\n".join(
            f"      q{i + 1}: {{lower_deg: {low:.7g}, upper_deg: {up:.7g}}}" for i, (low, up) in enumerate(self.limits)
        )
        start = ", ".join(f"{value:.7g}" for value in self.start)
        return CELL.format(
            name=name, start=start, limits=limits, path=self.path, words=self.words, duration=self.duration
        )


def measure_ellipse() -> Numbers:
    """Pseudo-inverse, the same with `cyclic`, and the recursive search with the limits of the thesis."""
    cell = paper_cell("nicolato_ellipse")
    plain = curves(cell)
    closed = curves(replace(cell, motion=replace(cell.motion, cyclic=True)))
    wide, held = wide_stage()
    TIGHTENED.write_text(tightened(wide), encoding="utf-8")
    tight = curves(paper_cell(TIGHTENED.stem))
    _draw(plain, closed, np.vstack([wide.q[:-1], tight.q]))
    return {
        "pseudo_inverse": _of_one(plain) | {"cycles": len(_drifts(plain))},
        "cyclic": _of_one(closed),
        "wide": _of_one(wide) | {"start_deg": held},
        "tightened": _of_one(tight)
        | {"limits_deg": np.rad2deg(np.stack([wide.q.min(axis=0), wide.q.max(axis=0)], axis=1))},
    }


def wide_stage() -> tuple[Curves, Array]:
    """The first 6 s within wide limits, and the configuration in [deg] in which they begin."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "papers"
        shutil.copytree(PAPERS, folder)
        corner = 100.0 * (1.0 + math.sqrt(3.0))
        rows = [f"{t:g},{corner + (0.0 if t <= HELD else t - HELD):.9f},{corner:.9f},0" for t in np.linspace(0, 1, 41)]
        (folder / "hold.csv").write_text("\n".join(["t_s,x_mm,y_mm,z_mm", *rows]) + "\n", encoding="utf-8")
        hold = Stage(
            start=np.zeros(4), limits=OPEN, duration=1.0, path="{csv: hold.csv}", words=f"    settle_s: {HELD / 2:g}\n"
        )
        (folder / "hold.yaml").write_text(hold.text("hold"), encoding="utf-8")
        held = curves(load_cell(folder / "hold.yaml"))
        start = np.round(np.rad2deg(held.q[np.searchsorted(held.t, HELD / 2)]), DECIMALS)
        stage = Stage(start=start, limits=OPEN, duration=WIDE, words=f"    repeat: {WIDE / PERIOD:g}\n")
        (folder / "wide.yaml").write_text(stage.text("wide"), encoding="utf-8")
        return curves(load_cell(folder / "wide.yaml")), start


def tightened(wide: Curves) -> str:
    """The shipped cell: each joint within its range of the first 6 s, rounded outwards."""
    digit = 10.0**DECIMALS
    q = np.rad2deg(wide.q)
    limits = np.stack([np.floor(digit * q.min(axis=0)), np.ceil(digit * q.max(axis=0))], axis=1) / digit
    left = WHOLE - WIDE
    stage = Stage(
        start=np.round(q[-1], DECIMALS), duration=left, limits=limits, words=f"    repeat: {left / PERIOD:g}\n"
    )
    return HEADER + stage.text("nicolato-ellipse-tightened")


def _drifts(run: Curves) -> Array:
    """Largest drift of any joint in each cycle in [deg], shape (cycles,)."""
    drift = run.report.repeatability
    if drift is None:
        raise ValueError("ellipse: the run has no cycles")
    return np.rad2deg(np.max(np.abs([drift.drift for drift in drift.drifts]), axis=0))


def _of_one(run: Curves) -> Numbers:
    """Drift per cycle, drift over all cycles, and the error of the tool."""
    drifts = _drifts(run)
    return {
        "passed": run.report.passed,
        "error_mm": 1e3 * run.error.max(),
        "drift_deg": drifts.max(),
        "first_drift_deg": drifts[0],
        "later_drift_deg": drifts[1:].max(),
        "last_drift_deg": drifts[-1],
        "in_all_deg": np.abs(np.rad2deg(run.q[-1] - run.q[0])).max(),
    }


def _draw(plain: Curves, closed: Curves, searched: Array) -> None:
    """Positions and speeds for the three, as in figures 4.6 and 4.7."""
    sheet = Sheet(3, 2)
    t, between = plain.t, plain.between
    motions = {
        "pseudo-inverse": plain.q,
        "recursive search, limits tightened at 6 s": searched,
        "pseudo-inverse, cyclic": closed.q,
    }
    for method, q in motions.items():
        draw_joints(sheet.panel(f"joint positions, {method}", "time [s]", "[rad]"), t, q, NAMES)
        speeds = np.diff(q, axis=0) / np.diff(t)[:, None]
        draw_joints(sheet.panel("joint speeds", "time [s]", "[rad/s]"), between, speeds, NAMES)
    sheet.save("nicolato_ellipse")
