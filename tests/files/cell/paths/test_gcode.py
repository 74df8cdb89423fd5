"""G-code is read as it is meant: lines, arcs within their chord, feeds, units, steps and tool vectors."""

from pathlib import Path

import numpy as np
import pytest
from builders.cam_files import GCODE_HEAD, settings, written

from cellplan.files.cell.paths.gcode import read_gcode
from cellplan.model.task.task import ProgrammedPath


@pytest.fixture
def read(tmp_path: Path):
    def read_text(text: str, **values: object) -> tuple[ProgrammedPath, str]:
        return read_gcode(written(tmp_path, text, "part.nc"), settings("part.nc", **values))

    return read_text


def test_lines_go_to_their_ends_at_their_feeds(read) -> None:
    path, remark = read(
        f"{GCODE_HEAD}N10 G0 X0 Y0 Z50 (above)\nG1 Z0\nX10.5 F1200 ; faster\ng1y-2.\nM5\nG0 Z50\nM30\n%\n"
    )

    assert path.points.tolist() == [[0.0, 0.0, 0.05], [0.0, 0.0, 0.0], [0.0105, 0.0, 0.0], [0.0105, -0.002, 0.0]]
    assert path.speeds.tolist() == [0.01, 0.02, 0.02]
    assert path.lines == (5, 6, 7, 8)
    assert remark == "part.nc: not part of the path: M5 (1), moves before the first feed and after the last (1)"


def test_steps_at_g91_lead_to_the_points_of_g90(read) -> None:
    at_once, _ = read(f"{GCODE_HEAD}G0 X1 Y2 Z3\nG1 X4\nY6 Z5\nG2 X8 Y2 I2 J-2\n")
    in_steps, _ = read(f"{GCODE_HEAD}G0 X1 Y2 Z3\nG91 G1 X3\nY4 Z2\nG2 X4 Y-4 I2 J-2\n")

    assert np.abs(at_once.points - in_steps.points).max() < 1e-15


def test_inches_scale_points_centres_radii_and_feeds(read) -> None:
    text = "G0 X0 Y0 Z0\nG1 X2\nG3 X4 Y2 I0 J2\nG2 X6 Y4 R2\n"
    mm, _ = read(f"{GCODE_HEAD}{text}", chord=1e-5)
    inches, _ = read(f"{GCODE_HEAD.replace('G21', 'G20')}{text}", chord=25.4e-5)

    assert inches.points == pytest.approx(25.4 * mm.points, rel=1e-12)
    assert inches.speeds == pytest.approx(25.4 * mm.speeds, rel=1e-12)


def test_tool_vectors_hold_until_the_next_and_point_out_of_the_part(read) -> None:
    path, _ = read(f"{GCODE_HEAD}G0 X0 Y0 Z0 I0 J0 K2\nG1 X1\nX2 I1 J0 K1\nG3 X4 Y2 I0 J2\n")

    slanted = -np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    assert path.axes[:2].tolist() == [[0.0, 0.0, -1.0], [0.0, 0.0, -1.0]]
    assert np.abs(path.axes[2:] - slanted).max() < 1e-15


@pytest.mark.parametrize(("plane", "order"), [("G17", (0, 1, 2)), ("G18", (2, 0, 1)), ("G19", (1, 2, 0))])
@pytest.mark.parametrize("code", ["G2", "G3"])
def test_arcs_lie_on_their_circle_and_turn_the_right_way_in_every_plane(read, plane: str, order, code: str) -> None:
    """A quarter of the circle round 10, 0 from 0, 0, with a rise of 4 mm."""
    first, second, across = ("XYZ"[k] for k in order)
    to = 10.0 if code == "G2" else -10.0
    centre = f"{'IJK'[order[0]]}10"
    text = f"{GCODE_HEAD}{plane} G0 X0 Y0 Z0\n{code} {first}10 {second}{to:g} {across}4 {centre}\n"
    path, _ = read(text)

    p = 1e3 * path.points[:, list(order)]
    assert np.abs(np.hypot(p[:, 0] - 10.0, p[:, 1]) - 10.0).max() < 1e-12
    turned = np.unwrap(np.arctan2(p[:, 1], p[:, 0] - 10.0))
    assert turned[-1] - turned[0] == pytest.approx(-0.5 * np.pi if code == "G2" else 0.5 * np.pi)
    assert p[:, 2] == pytest.approx(np.linspace(0.0, 4.0, len(p)))


@pytest.mark.parametrize("chord", [1e-3, 1e-5, 1e-6])
def test_sides_of_an_arc_are_within_the_chord_and_not_far_below_it(read, chord: float) -> None:
    path, _ = read(f"{GCODE_HEAD}G0 X0 Y0 Z0\nG3 X0 Y0 I50\n", chord=chord)

    middles = 0.5 * (path.points[1:] + path.points[:-1]) - [0.05, 0.0, 0.0]
    sags = 0.05 - np.linalg.norm(middles, axis=1)
    assert sags.max() <= chord * (1.0 + 1e-9)
    assert sags.max() > 0.2 * min(chord, 0.05 * (1.0 - np.cos(np.deg2rad(5.0))))
    assert path.points[-1].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("radius", "length"), [("R10", 0.5 * np.pi), ("R-10", 1.5 * np.pi)])
def test_a_negative_radius_is_the_longer_arc(read, radius: str, length: float) -> None:
    path, _ = read(f"{GCODE_HEAD}G0 X0 Y0 Z0\nG2 X10 Y10 {radius}\n", chord=1e-7)

    total = np.linalg.norm(np.diff(path.points, axis=0), axis=1).sum()
    assert total == pytest.approx(0.01 * length, rel=1e-4)


def test_codes_that_move_nothing_are_counted(read) -> None:
    _, remark = read(f"{GCODE_HEAD}T1 M6\nG54 G43 H1\nS8000 M3\nG4 P2\nG0 X0 Y0 Z0\nG1 X1\nM30\n")

    codes = "G4 (1), G43 (1), G54 (1), H (1), M3 (1), M6 (1), P (1), S (1), T (1)"
    assert remark == f"part.nc: not part of the path: {codes}"
