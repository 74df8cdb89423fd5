"""Points that are nearly one point are refused with their lines, and the bulge of a smooth curve is stated."""

from pathlib import Path

import numpy as np
import pytest
from builders.roller_paths import EZ, ROLLER, task_on

from cellplan.errors import InputError
from cellplan.files.cell.paths.csv_table import read_toolpath_csv
from cellplan.geometry.curves.curve import chord_lengths, smooth_through, straight_sides
from cellplan.model.task.task import SampledPath, SpacePolylinePath, TimedPath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.path.curve import largest_bulge

WAVE = ((-0.08, -0.05, 0.3), (-0.04, 0.03, 0.3), (0.0, -0.02, 0.3), (0.04, 0.03, 0.3), (0.08, -0.05, 0.3))


def listed(points: object, *, is_smooth: bool = True, is_closed: bool = False) -> SampledPath:
    rows = np.asarray(points, dtype=float)
    return SampledPath(source="p.csv", points=rows, axes=None, rotations=None, is_smooth=is_smooth, is_closed=is_closed)


def ring(count: int, radius: float = 0.07) -> np.ndarray:
    angles = np.arange(count) / count * 2.0 * np.pi
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(count, 0.3)])


def with_point(points: object, place: int, shift: tuple[float, float, float]) -> np.ndarray:
    rows = np.asarray(points, dtype=float)
    return np.insert(rows, place, rows[place - 1] + shift, axis=0)


NEAR = {
    "a micrometre behind": (listed(with_point(WAVE, 3, (-1e-6, 0, 0))), "points 3 and 4 (p.csv, lines 4 and 5)"),
    "a tenth of a millimetre aside": (listed(with_point(WAVE, 2, (0, 1e-4, 0))), "points 2 and 3 (p.csv, lines 3"),
    "at the start": (listed(with_point(WAVE, 1, (1e-6, 0, 0))), "points 1 and 2 (p.csv, lines 2 and 3)"),
    "at the end": (listed(with_point(WAVE, 5, (0, 0, 1e-6))), "points 5 and 6 (p.csv, lines 6 and 7)"),
    "at the closing point": (
        listed(np.vstack([ring(24), ring(24)[0] + (0, 1e-6, 0)]), is_closed=True),
        "points 25 and 1 (p.csv, lines 26 and 2)",
    ),
    "on straight sides": (listed(with_point(WAVE, 3, (1e-6, 0, 0)), is_smooth=False), "points 3 and 4 (p.csv, lines"),
    "in a list of the cell": (
        SpacePolylinePath(points=tuple(map(tuple, with_point(WAVE, 3, (2e-6, 0, 0)).tolist())), is_closed=False),
        "points 3 and 4 are 0.002 mm apart at (0, -20, 300) mm; leave one out",
    ),
}


@pytest.mark.parametrize("name", NEAR)
def test_points_that_are_nearly_one_are_refused_with_their_lines(name: str) -> None:
    path, words = NEAR[name]

    with pytest.raises(InputError) as caught:
        build_toolpath(task_on(path, tool_axis=-EZ), ROLLER)

    assert words in str(caught.value)
    assert str(caught.value).startswith("cell.yaml:")


def test_three_points_within_a_micrometre_are_refused_for_the_bend_they_make() -> None:
    cluster = with_point(with_point(WAVE, 3, (-1e-6, 0, 0)), 4, (0, 1e-6, 0))

    with pytest.raises(InputError, match=r"at point 3 \(p.csv, line 4\), .* would bend by about .* mm; add points"):
        build_toolpath(task_on(listed(cluster), tool_axis=-EZ), ROLLER)


def test_a_turn_on_a_short_side_beside_a_long_one_is_refused_only_where_the_curve_is_smooth() -> None:
    points = ((0.0, 0.0, 0.3), (0.1, 0.0, 0.3), (0.1014, 0.0014, 0.3), (0.1014, 0.0034, 0.3), (0.1014, 0.1, 0.3))

    with pytest.raises(InputError, match=r"at point 2 \(p.csv, line 3\).*turns by 45 deg.*set smooth: false"):
        build_toolpath(task_on(listed(points), tool_axis=-EZ), ROLLER)
    assert build_toolpath(task_on(listed(points, is_smooth=False), tool_axis=-EZ), ROLLER).bulge is None


def test_a_fillet_between_long_sides_is_a_smooth_path() -> None:
    angles = np.linspace(0.0, np.pi / 2.0, 10)
    arc = np.column_stack([0.1 + 0.004 * np.sin(angles), 0.004 - 0.004 * np.cos(angles), np.full(10, 0.3)])
    points = np.vstack([[0.0, 0.0, 0.3], arc, [0.104, 0.1, 0.3]])

    assert build_toolpath(task_on(listed(points), tool_axis=-EZ), ROLLER).length == pytest.approx(0.2023, abs=1e-3)


def test_rows_of_a_trajectory_between_which_no_time_passes_are_refused() -> None:
    times = np.array([0.0, 0.5, 1.0, 1.000001, 1.5, 2.0])
    points = np.vstack([*WAVE[:3], WAVE[2], *WAVE[3:]])
    path = TimedPath(source="p.csv", times=times, points=points, axes=None, rotations=None, is_closed=False)

    with pytest.raises(InputError, match=r"points 3 and 4 \(p.csv, lines 4 and 5\) are 1e-06 s apart, at 1 s"):
        build_toolpath(task_on(path, tool_axis=-EZ), ROLLER)


def test_joined_points_leave_the_curve_without_them(tmp_path: Path) -> None:
    rows = with_point(WAVE, 3, (-1e-6, 0, 0))
    text = "\n".join(",".join(f"{1e3 * value:.6f}" for value in row) for row in rows)
    (tmp_path / "p.csv").write_text("x_mm,y_mm,z_mm\n" + text, encoding="utf-8")

    joined = read_toolpath_csv(tmp_path / "p.csv", is_smooth=True, is_closed=False, join=1e-5)

    path, plain = (build_toolpath(task_on(it, tool_axis=-EZ), ROLLER) for it in (joined, listed(WAVE)))
    assert path.length == pytest.approx(plain.length, rel=1e-12)
    assert np.allclose(path.spread(50), plain.spread(50), atol=1e-12)


def test_the_bulge_of_a_ring_is_its_sagitta() -> None:
    points = np.vstack([ring(72), ring(72)[:1]])
    curve = smooth_through(chord_lengths(points), points, breaks=np.zeros(73, dtype=bool))

    assert largest_bulge(curve) == pytest.approx(0.07 * (1.0 - np.cos(np.pi / 72)), rel=1e-2)
    assert largest_bulge(straight_sides(chord_lengths(points), points)) < 1e-15


def test_the_bulge_of_a_toolpath_is_that_of_dense_sampling() -> None:
    toolpath = build_toolpath(task_on(listed(WAVE), tool_axis=-EZ), ROLLER)
    knots = toolpath.tip.knots
    farthest = 0.0
    for low, high, a, b in zip(knots[:-1], knots[1:], WAVE[:-1], WAVE[1:], strict=True):
        p, _ = toolpath.tip.evaluate(np.linspace(low, high, 2001), (low, high))
        along = (np.asarray(b) - a) / np.linalg.norm(np.asarray(b) - a)
        farthest = max(farthest, float(np.linalg.norm(np.cross(p - a, along), axis=1).max()))

    assert toolpath.bulge == pytest.approx(farthest, rel=1e-2)
