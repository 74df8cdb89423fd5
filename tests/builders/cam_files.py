"""Files of CAM, and a cell that mills with them."""

import math
from pathlib import Path

import numpy as np

from cellplan.files.cell.paths.settings import CamSettings
from cellplan.geometry.transforms import Array

APT_HEAD = "PARTNO/DOME\nUNITS/MM\nMULTAX/ON\nFEDRAT/600,MMPM\n"
GCODE_HEAD = "%\nO100 (DOME)\nG21 G90 G17\nF600\n"


def settings(source: str = "part.apt", **values: object) -> CamSettings:
    """A frame of the file that is that of the part; arcs within 0.01 mm."""
    usual = {"X_PF": np.eye(4), "transfer": 0.25, "rounding": 1e-5, "stop_angle": math.radians(20.0), "chord": 1e-5}
    return CamSettings(source=source, **{**usual, **values})  # type: ignore[arg-type]


def written(folder: Path, text: str, name: str = "part.apt") -> Path:
    """A file with some text."""
    path = folder / name
    path.write_text(text, encoding="utf-8", newline="\n")
    return path


def dome(radius: float, half: float, lines: int) -> Array:
    """Points in [mm] of a raster on a dome round the origin, line by line to and fro, shape (lines, lines, 3)."""
    x = np.linspace(-half, half, lines)
    u, v = np.meshgrid(x, x)
    u[1::2] = u[1::2, ::-1]
    return np.stack([u, v, np.sqrt(radius**2 - u**2 - v**2)], axis=2)


def dome_apt(points: Array, feeds: tuple[float, ...], *, rapid_every: int, lift: float) -> str:
    """A raster in APT: a feed in [mm/min] for each line in turn, and a rapid over the dome after some of the lines."""
    text = [APT_HEAD]
    for number, line in enumerate(points):
        for k, p in enumerate(line):
            axis = p / np.linalg.norm(p)
            if k == 0 and number and number % rapid_every == 0:
                before = points[number - 1, -1]
                lifted = [at * (1.0 + lift / np.linalg.norm(at)) for at in (before, p)]
                text += [*(f"RAPID\n{goto(at, at / np.linalg.norm(at))}" for at in lifted), "RAPID\n"]
            text.append(goto(p, axis))
            if k == 0:
                text.append(f"FEDRAT/{feeds[number % len(feeds)]:g},MMPM\n")
    return "".join([*text, "SPINDL/OFF\nFINI\n"])


def goto(p: Array, axis: Array) -> str:
    """One statement, on two lines."""
    return f"GOTO/{p[0]:.4f},{p[1]:.4f},{p[2]:.4f},$\n  {axis[0]:.7f},{axis[1]:.7f},{axis[2]:.7f}\n"


def as_gcode(apt: str) -> str:
    """The same moves as G-code."""
    text = [GCODE_HEAD]
    move, feed = "G1", ""
    for statement in apt.replace("$\n", "").splitlines():
        word, _, rest = statement.partition("/")
        if word == "RAPID":
            move = "G0"
        elif word == "FEDRAT":
            feed = f" F{rest.split(',')[0]}"
        elif word == "GOTO":
            values = [value.strip() for value in rest.split(",")]
            text.append(f"{move} {' '.join(map(''.join, zip('XYZIJK', values, strict=True)))}{feed}\n")
            move, feed = ("G0" if len(text) == 1 else "G1"), ""
    text[1] = text[1].replace("G1", "G0")
    return "".join([*text, "M30\n"])


def milling_cell(path: str, *, more: str = "", step_s: float = 0.004) -> str:
    """A cell in which one arm follows a path on a ball that lies still."""
    return f"""\
cellplan: 1
name: milling
robots:
  arm:
    model: kuka_kr16_2
    tool: {{xyz_mm: [0, 0, 200], geometry: {{capsule: {{radius_mm: 5, length_mm: 200}}}}}}
part:
  geometry: {{sphere: {{radius_mm: 200}}}}
  at: {{xyz_mm: [1100, 0, 700]}}
tasks:
  mill:
    robot: arm
    path: {path}
    free: [spin]
{more}motion: {{mode: part_at_rest, step_s: {step_s:g}}}
"""
