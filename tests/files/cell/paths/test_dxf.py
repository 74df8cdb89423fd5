"""Drawings as DXF: lengths in closed form, units, blocks, chains, and what is not used."""

from pathlib import Path

import numpy as np
import pytest
from builders.drawings import CUT, settings, write_drawing, write_text
from ezdxf.math import OCS

from cellplan.errors import InputError
from cellplan.files.cell.paths.dxf import read_drawing
from cellplan.geometry.curves.flat_curves import Contour

GAUSS = np.polynomial.legendre.leggauss(24)


def length_of(contour: Contour) -> float:
    """Length of a contour in [mm] by quadrature of its rates over each smooth span."""
    total = 0.0
    for curve in contour.curves:
        t = curve.parameters(1e-5)
        half = 0.5 * np.abs(np.diff(t))
        places = (0.5 * (t[:-1] + t[1:]))[:, None] + half[:, None] * GAUSS[0]
        rates = np.linalg.norm(curve.rates(places.ravel())[1], axis=1).reshape(places.shape)
        total += float(np.sum(rates * GAUSS[1] * half[:, None]))
    return 1e3 * total


def contours_of(folder: Path, draw, **options) -> list[Contour]:
    return read_drawing(write_drawing(folder, draw, **options), settings()).contours


def test_a_circle_and_its_half_have_their_lengths(tmp_path: Path) -> None:
    def draw(_, space) -> None:
        space.add_circle((3, 4), 10, dxfattribs=CUT)
        space.add_arc((40, 0), 10, 350, 170, dxfattribs=CUT)

    circle, half = contours_of(tmp_path, draw)

    assert circle.is_closed
    assert not half.is_closed
    assert length_of(circle) == pytest.approx(20.0 * np.pi, rel=1e-12)
    assert length_of(half) == pytest.approx(10.0 * np.pi, rel=1e-12)
    turns = np.deg2rad([350, 170])
    np.testing.assert_allclose(1e3 * half.ends, [[40, 0]] + 10.0 * np.stack([np.cos(turns), np.sin(turns)], 1))


def test_bulges_are_arcs_on_both_sides(tmp_path: Path) -> None:
    def draw(_, space) -> None:
        corners = [(0, 0, 1.0), (20, 0, 0.0), (20, 30, -np.tan(np.pi / 8)), (0, 30, 0.0)]
        space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs=CUT)

    (contour,) = contours_of(tmp_path, draw)

    quarter = 0.5 * np.pi * 20.0 / np.sqrt(2.0)  # a chord of 20 mm subtends a right angle
    assert length_of(contour) == pytest.approx(10.0 * np.pi + 30.0 + quarter + 30.0, rel=1e-12)
    bottom, _, top, _ = contour.curves
    middles = [1e3 * curve.rates(np.array([np.mean(curve.span)]))[0][0] for curve in (bottom, top)]
    np.testing.assert_allclose(middles[0], [10, -10], atol=1e-9)  # positive: to the left of travel it turns
    np.testing.assert_allclose(middles[1], [10, 30 - 10 * (np.sqrt(2) - 1)], atol=1e-9)


def test_an_ellipse_has_its_length(tmp_path: Path) -> None:
    def draw(_, space) -> None:
        space.add_ellipse((5, 5), major_axis=(0, 30), ratio=0.4, dxfattribs=CUT)

    (contour,) = contours_of(tmp_path, draw)

    t = 2.0 * np.pi * np.arange(4096) / 4096  # the trapezoidal rule of a periodic function is exact to rounding
    assert length_of(contour) == pytest.approx(
        2.0 * np.pi * np.mean(np.hypot(30 * np.sin(t), 12 * np.cos(t))), rel=1e-9
    )


def test_a_rational_spline_is_the_circle_that_it_stands_for(tmp_path: Path) -> None:
    w = np.sqrt(0.5)

    def draw(_, space) -> None:
        space.add_rational_spline([(10, 0), (10, 10), (0, 10)], [1, w, 1], degree=2, dxfattribs=CUT)

    (contour,) = contours_of(tmp_path, draw)

    points, _ = contour.curves[0].at(contour.curves[0].parameters(1e-5))
    np.testing.assert_allclose(1e3 * np.linalg.norm(points, axis=1), 10.0, rtol=1e-12)
    assert length_of(contour) == pytest.approx(5.0 * np.pi, rel=1e-12)


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_splines_are_those_of_a_second_library(tmp_path: Path, degree: int) -> None:
    points = np.random.default_rng(degree).uniform(-50, 50, (9, 2))
    made = []

    def draw(_, space) -> None:
        made.append(space.add_open_spline(points.tolist(), degree=degree, dxfattribs=CUT).construction_tool())

    (contour,) = contours_of(tmp_path, draw)

    t = np.linspace(0.0, made[0].max_t, 57)
    expected = np.array([tuple(point)[:2] for point in made[0].points(t.tolist())])
    np.testing.assert_allclose(1e3 * contour.curves[0].rates(t)[0], expected, atol=1e-9)


@pytest.mark.parametrize(
    ("unit", "code", "size"), [("inch", 1, 25.4), ("ft", 2, 304.8), ("cm", 5, 10.0), ("m", 6, 1e3)]
)
def test_lengths_have_the_unit_of_the_file_or_of_the_cell(tmp_path: Path, unit: str, code: int, size: float) -> None:
    def draw(_, space) -> None:
        space.add_line((0, 0), (0.3, 0.4), dxfattribs=CUT)

    stated = contours_of(tmp_path, draw, units=code)
    by_cell = read_drawing(write_drawing(tmp_path, draw, units=0), settings(unit=unit)).contours

    assert length_of(stated[0]) == pytest.approx(0.5 * size, rel=1e-12)
    assert length_of(by_cell[0]) == pytest.approx(0.5 * size, rel=1e-12)


def test_a_drawing_without_a_unit_or_with_another_one_is_refused(tmp_path: Path) -> None:
    def draw(_, space) -> None:
        space.add_line((0, 0), (3, 4), dxfattribs=CUT)

    with pytest.raises(
        InputError, match=r"^logo.dxf: expected the unit of lengths \(\$INSUNITS\), got none; give outline"
    ):
        read_drawing(write_drawing(tmp_path, draw, units=0), settings())
    with pytest.raises(
        InputError, match=r"^logo.dxf: expected lengths in mm, as the cell says, got a drawing in inch$"
    ):
        read_drawing(write_drawing(tmp_path, draw, units=1), settings(unit="mm"))
    with pytest.raises(
        InputError, match=r"^logo.dxf: expected lengths in mm, cm, m, inch or ft \(\$INSUNITS\), got the"
    ):
        read_drawing(write_drawing(tmp_path, draw, units=3), settings())


def test_mirrored_entities_lie_where_a_second_library_has_them(tmp_path: Path) -> None:
    down = {**CUT, "extrusion": (0, 0, -1)}
    ends = []

    def draw(_, space) -> None:
        arc = space.add_arc((10, 5), 3, 30, 120, dxfattribs=down)
        bow = space.add_lwpolyline([(30, 0, 0.5), (40, 10, 0.0)], format="xyb", dxfattribs=down)
        middle = next(bow.virtual_entities())
        ends.extend([arc.start_point, arc.end_point, *OCS((0, 0, -1)).points_to_wcs([(30, 0), (40, 10)])])
        angle = np.deg2rad(0.5 * (middle.dxf.start_angle + middle.dxf.end_angle) % 360)
        top = middle.ocs().to_wcs(middle.dxf.center + middle.dxf.radius * np.array([np.cos(angle), np.sin(angle), 0]))
        ends.append(top)

    arc, bow = contours_of(tmp_path, draw)

    expected = np.array([tuple(end)[:2] for end in ends])
    np.testing.assert_allclose(1e3 * arc.ends, expected[:2], atol=1e-9)
    np.testing.assert_allclose(1e3 * bow.ends, expected[2:4], atol=1e-9)
    (curve,) = bow.curves
    np.testing.assert_allclose(1e3 * curve.rates(np.array([np.mean(curve.span)]))[0][0], expected[4], atol=1e-9)


def test_blocks_stand_where_they_are_inserted_and_layer_0_is_that_of_the_reference(tmp_path: Path) -> None:
    def draw(document, space) -> None:
        inner = document.blocks.new("INNER", base_point=(1, 0))
        inner.add_circle((1, 0), 2)
        inner.add_line((5, 5), (6, 6), dxfattribs={"layer": "OTHER"})
        outer = document.blocks.new("OUTER")
        outer.add_blockref("INNER", (10, 0), dxfattribs={"xscale": 2, "yscale": 3, "layer": "CUT"})
        outer.add_blockref("INNER", (50, 0))
        space.add_blockref(
            "OUTER", (0, 100), dxfattribs={"rotation": 90, "layer": "CUT", "column_count": 2, "column_spacing": 200}
        )

    drawing = read_drawing(write_drawing(tmp_path, draw), settings())

    ellipse, circle, *_ = drawing.contours
    t = 2.0 * np.pi * np.arange(512) / 512
    assert length_of(ellipse) == pytest.approx(2.0 * np.pi * np.mean(np.hypot(4 * np.sin(t), 6 * np.cos(t))), rel=1e-9)
    assert length_of(circle) == pytest.approx(4.0 * np.pi, rel=1e-12)
    np.testing.assert_allclose(1e3 * circle.curves[0].centre, [0, 150], atol=1e-9)  # type: ignore[union-attr]
    assert len(drawing.contours) == 4
    assert drawing.remark.endswith("4 contours of 4 entities; not used: entities on other layers (4)")


def test_curves_are_chained_in_the_order_of_the_file_the_way_of_the_first(tmp_path: Path) -> None:
    def draw(_, space) -> None:
        space.add_line((100, 0), (110, 0), dxfattribs=CUT)
        for start, end in (((0, 0), (10, 0)), ((10, 10), (10, 0.004)), ((0, 10), (0, 0)), ((10, 10), (0, 10))):
            space.add_line(start, end, dxfattribs=CUT)
        space.add_line((120, 5), (110, 0), dxfattribs=CUT)

    open_one, square = contours_of(tmp_path, draw)

    np.testing.assert_allclose(1e3 * open_one.ends, [[100, 0], [120, 5]])
    assert square.is_closed
    np.testing.assert_allclose(
        [1e3 * curve.end(0) for curve in square.curves], [[0, 0], [10, 0.004], [10, 10], [0, 10]]
    )


def test_a_layer_that_is_not_there_is_refused_with_those_that_are(tmp_path: Path) -> None:
    def draw(_, space) -> None:
        space.add_line((0, 0), (9, 9), dxfattribs={"layer": "Cut_outside"})
        space.add_text("note", dxfattribs={"layer": "NOTES"})

    file = write_drawing(tmp_path, draw)

    assert len(read_drawing(file, settings("cut_OUTSIDE")).contours) == 1  # as CAD compares names of layers
    with pytest.raises(InputError) as refused:
        read_drawing(file, settings("Cut_outsid"))
    assert str(refused.value) == (
        "logo.dxf: expected curves on the layer 'Cut_outsid', got none, did you mean 'Cut_outside'?; it has entities "
        "on Cut_outside (1), NOTES (1)"
    )


def test_what_is_not_used_is_counted(tmp_path: Path) -> None:
    def draw(document, space) -> None:
        space.add_circle((0, 0), 5, dxfattribs=CUT)
        space.add_line((7, 7), (7, 7), dxfattribs=CUT)
        space.add_text("note", dxfattribs={"layer": "NOTES"})
        document.layout("Layout1").add_circle((0, 0), 3, dxfattribs=CUT)

    remark = read_drawing(write_drawing(tmp_path, draw), settings()).remark

    assert remark.startswith("logo.dxf: layer CUT: 1 contour of 1 entities; not used: curves without a length (1), ")
    assert "entities in paper space (1)" in remark.replace("(2)", "(1)")  # a viewport may be there as well
    assert "entities on other layers (1)" in remark


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2007", "R2018"])
def test_all_versions_of_the_format_are_read(tmp_path: Path, version: str) -> None:
    def draw(_, space) -> None:
        space.add_circle((0, 0), 5, dxfattribs=CUT)
        space.add_polyline2d([(20, 0, 1), (30, 0, 0)], format="xyb", dxfattribs=CUT)

    circle, bow = read_drawing(write_drawing(tmp_path, draw, units=0, version=version), settings(unit="mm")).contours

    assert length_of(circle) == pytest.approx(10.0 * np.pi, rel=1e-12)
    assert length_of(bow) == pytest.approx(5.0 * np.pi, rel=1e-12)


def test_windows_line_ends_and_old_encodings_are_read(tmp_path: Path) -> None:
    text = write_text(tmp_path, "0\nLINE\n8\nKonturen_ä\n10\n0\n20\n0\n11\n3\n21\n4\n").read_text()
    (tmp_path / "logo.dxf").write_bytes(text.replace("\n", "\r\n").encode("cp1252"))

    (contour,) = read_drawing(tmp_path / "logo.dxf", settings("Konturen_ä")).contours

    assert length_of(contour) == pytest.approx(5.0)
