"""SVG figures: what is read back from the picture is what was to be shown, at its place on the axes."""

import numpy as np
import pytest
from builders.svg_figures import panels, texts
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cellplan.report.plots.figure import (
    Figure,
    LegendKey,
    Limit,
    Note,
    PlotAxis,
    PlotCurve,
    PlotMark,
    PlotPanel,
    line,
    value_axis,
)
from cellplan.report.plots.palette import ON_DARK
from cellplan.report.plots.placing import placed
from cellplan.report.plots.svg import FINE, THINNING_TOL, inline_svg, svg_text

TIMES = np.linspace(0.0, 2.0, 4001)
X = PlotAxis(low=0.0, high=2.0, label="time in s", unit="s", is_time=True)
HEADROOM = 1.0 + THINNING_TOL  # [-] coordinates: rounding of a point, and how far a thinned curve may lie beside it


def svg_of(*items: object, y: PlotAxis, x: PlotAxis = X):
    return panels(svg_text(Figure(title="t", x=x, panels=[PlotPanel(title="p", y=y, items=items)])))[0]


def test_curves_limits_and_marks_lie_where_their_values_are() -> None:
    values = 3.0 * np.sin(7.0 * TIMES)
    limits = Limit(2.5, "2.5"), Limit(-2.0, is_upper=False)
    panel = svg_of(*limits, PlotCurve("sine", TIMES, values), PlotMark(0.25, 1.5), y=value_axis(-3.0, 3.0, unit="mm"))

    fine = panel.resolution[1]
    assert panel.limits == pytest.approx([2.5, -2.0], abs=fine)
    low, high = value_axis(-3.0, 3.0).low, value_axis(-3.0, 3.0).high
    assert panel.forbidden == [pytest.approx((2.5, high), abs=fine), pytest.approx((low, -2.0), abs=fine)]
    assert panel.marks == [pytest.approx((0.25, 1.5), abs=fine)]
    at, shown = panel.curves["sine"].T
    assert np.abs(np.interp(TIMES, at, shown) - values).max() <= HEADROOM * fine + np.ptp(values) * panel.resolution[0]
    assert len(at) < 200


def test_a_logarithmic_scale_shows_ratios_and_ends_at_its_lower_edge() -> None:
    axis = PlotAxis(low=1e-6, high=0.3, unit="mm", is_log=True)
    values = np.where(TIMES < 1.0, 2e-4 * np.exp(TIMES), 0.0)

    panel = svg_of(Limit(0.1, "tolerance"), PlotCurve("error", TIMES, values), y=axis)

    decade = np.log(10.0) * panel.resolution[1]
    assert panel.limits == pytest.approx([0.1], rel=decade)
    at, shown = panel.curves["error"].T
    early = TIMES < 0.99
    result = 10.0 ** np.interp(TIMES[early], at, np.log10(shown))
    assert np.abs(np.log(result / values[early])).max() <= HEADROOM * decade + panel.resolution[0]
    assert shown[at > 1.01] == pytest.approx(1e-6, rel=decade)
    height = np.log10(axis.high / axis.low)
    assert float(axis.share(1e-3) - axis.share(1e-4)) == pytest.approx(1.0 / height)


@given(arrays(float, st.integers(3, 2000), elements=st.floats(-50.0, 50.0)))
def test_a_thinned_curve_lies_within_a_tenth_of_a_point_of_every_kept_peak(values: np.ndarray) -> None:
    x = PlotAxis(low=0.0, high=float(len(values) - 1), label="sample")
    y = value_axis(-50.0, 50.0)

    panel = svg_of(PlotCurve("c", np.arange(float(len(values))), values), y=y, x=x)

    shown = panel.curves["c"][:, 1]
    assert shown.max() == pytest.approx(values.max(), abs=HEADROOM * panel.resolution[1])
    assert shown.min() == pytest.approx(values.min(), abs=HEADROOM * panel.resolution[1])


def test_a_gap_stays_a_gap() -> None:
    values = np.where((TIMES > 0.5) & (TIMES < 1.0), np.nan, 1.0)

    text = svg_text(
        Figure(
            title="t", x=X, panels=[PlotPanel(title="p", y=value_axis(0.0, 2.0), items=[PlotCurve("c", TIMES, values)])]
        )
    )

    path = text.split('data-name="c" d="')[1].split('"')[0]
    assert path.count("M") == 2
    assert "data-name" not in svg_text(
        Figure(title="t", x=X, panels=[PlotPanel(title="p", y=X, items=[PlotCurve("c", TIMES, np.nan * TIMES)])])
    )


def test_a_plane_is_to_scale_whatever_its_sides_are() -> None:
    square = line([[0, 0], [100, 0], [100, 100], [0, 100]], colour="#000000", width=1.0)
    for across, up in ((300.0, 200.0), (150.0, 900.0)):
        x, y = PlotAxis(low=-50.0, high=across - 50.0, label="x"), PlotAxis(low=-20.0, high=up - 20.0, label="y")
        figure = Figure(title="t", x=x, panels=[PlotPanel(title="", y=y, items=[square])], is_plane=True)

        panel = panels(svg_text(figure))[0]

        assert panel.resolution[0] == pytest.approx(panel.resolution[1], rel=1e-3)
        corners = np.array([[0, 0], [100, 0], [100, 100], [0, 100]])
        assert np.abs(panel.curves[""] - corners).max() <= panel.resolution[0]


def test_every_word_of_names_stays_a_word() -> None:
    name = '"><script>alert(1)</script>&amp;'
    panel = PlotPanel(
        title=name,
        note=name,
        y=PlotAxis(low=0.0, high=1.0, unit=name),
        items=[PlotCurve(name, TIMES, 0.5 * TIMES), Note(1.0, 0.5, name), Limit(0.7, name)],
        keys=[LegendKey(name, "#000000")],
    )
    figure = Figure(
        title=name, x=PlotAxis(low=0.0, high=2.0, label=name), panels=[panel], legend=[LegendKey(name)], text=name
    )

    text = svg_text(figure)

    assert "<script" not in text
    assert texts(text).count(name) == 8
    assert list(panels(text)[0].curves) == [name]


def test_a_picture_says_what_it_shows_and_reads_on_dark_pages() -> None:
    panel = PlotPanel(title="A1, in deg", note="margin 3.0", y=X, items=[])

    text = svg_text(Figure(title="joints", x=X, panels=[panel]))

    assert "<title>joints</title>" in text
    assert "<desc>A1, in deg: margin 3.0. Along: time in s.</desc>" in text
    assert 'role="img" class="figure"' in text
    used = {piece[:7] for key in ("fill", "stroke") for piece in text.split(f' {key}="')[1:] if piece[0] == "#"}
    assert used <= set(ON_DARK)
    assert "<style>" not in inline_svg(text)
    assert inline_svg(text).count("<text") == text.count("<text")


def test_coordinates_are_hundredths_of_points() -> None:
    panel = svg_of(y=value_axis(0.0, 1.0))
    figure = svg_text(Figure(title="t", x=X, panels=[PlotPanel(title="p", y=X, items=[])]))
    width = float(figure.split('data-size="')[1].split(" ")[0])

    assert panel.resolution[0] == pytest.approx(2.0 / (FINE * width))


def test_a_note_beside_a_long_title_is_written_smaller_than_one_beside_a_short_title() -> None:
    axis = value_axis(0.0, 1.0)
    sizes = []
    for title in ("speed", "their manipulability, in 10⁻⁶"):
        panel = PlotPanel(title=title, y=axis, items=(), note="smallest 3.9 at 0.81 s")
        figure = Figure(title="t", x=X, panels=[panel] * 3, columns=3)
        sizes.append(next(word.size for box in placed(figure).panels for word in box.words if word.kind == "note"))

    assert sizes[1] < sizes[0] == 7.5
