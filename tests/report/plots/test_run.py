"""Plots: every peak survives, limits are drawn, and the bytes depend on the data alone."""

import re
import struct
import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from builders.svg_figures import panels, texts
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cellplan.errors import InputError
from cellplan.model.report.report import Conditioning
from cellplan.report.plots.figure import PlotAxis
from cellplan.report.plots.placing import nice_ticks
from cellplan.report.plots.rendering import pictures, require_formats
from cellplan.report.plots.run import run_figures
from cellplan.report.plots.svg import peak_samples, straightened


def draw_plots(report: Any, *, cell: Any, formats: Any = ()) -> dict[str, bytes]:
    return pictures(run_figures(report, cell=cell), formats)


@pytest.fixture(scope="module")
def files(failed_run: Any) -> dict[str, bytes]:
    return draw_plots(failed_run.report, cell=failed_run.cell)


def test_every_plot_of_the_thesis_is_drawn(files: dict[str, bytes]) -> None:
    names = [f"task_{task}" for task in ("circle", "rhombus", "rectangle")]
    names += [f"{kind}_{robot}" for robot in ("reis", "kuka", "abb", "staubli") for kind in ("positions", "velocities")]
    names = ["margins", "speeds", "clearance", *names, "singularity"]
    assert list(files) == [f"{name}.svg" for name in names]


def test_pictures_are_whole(files: dict[str, bytes]) -> None:
    assert {ET.fromstring(data).tag for data in files.values()} == {"{http://www.w3.org/2000/svg}svg"}  # noqa: S314


def test_limits_are_written_beside_their_lines(files: dict[str, bytes]) -> None:
    words = texts(files["positions_kuka.svg"])
    for limit in ("185", "−185", "100", "−100", "118", "−118"):
        assert limit in words
    assert "B1, in deg" in words
    assert any(word.startswith("outside by 4.9") for word in words)
    assert "156" in texts(files["velocities_kuka.svg"])
    assert any("required 5" in word for word in texts(files["clearance.svg"]))


def with_errors(run: Any, largest: float) -> Any:
    """The panels of the first task with position errors of such a size in [m]."""
    first = run.report.accuracy[0]
    scale = largest / float(np.linalg.norm(first.position_error, axis=1).max())
    accuracy = (replace(first, position_error=scale * first.position_error),)
    report = replace(run.report, accuracy=accuracy, q={}, qd={}, joints=())
    return draw_plots(report, cell=run.cell)["task_circle.svg"]


@pytest.mark.parametrize(
    ("largest", "unit"), [(1e-3, "mm"), (2e-6, "µm"), (4e-9, "nm"), (1e-13, "nm"), (0.0, "mm")], ids=str
)
def test_errors_of_every_size_lie_below_their_tolerance_in_one_picture(
    passed_run: Any, largest: float, unit: str
) -> None:
    """The total on a logarithmic scale in millimetres with its tolerance; by axis in a unit that suits its size."""
    svg = with_errors(passed_run, largest)

    total = panels(svg)[0]
    assert total.title == "position error, total, in mm"
    assert total.limits == pytest.approx([0.1], rel=1e-2)
    assert total.forbidden == [pytest.approx((0.1, 0.3 * max(1.0, largest / 1e-4)), rel=1e-2)]
    shown = total.curves["position error"][:, 1].max()
    assert shown == pytest.approx(max(1e3 * largest, 1e-10 if largest else 1e-4), rel=1e-2)
    assert total.marks[0][1] == pytest.approx(shown, rel=1e-2)
    words = texts(svg)
    assert f"position error by axis, in {unit}" in words
    assert "tolerance 0.1 mm" in words
    assert ("largest 1 at" in " ".join(words)) == (largest > 1e-4)


def test_ripples_below_a_nanometre_look_small(passed_run: Any) -> None:
    panel = panels(with_errors(passed_run, 1e-13))[1]

    assert max(float(np.abs(curve[:, 1]).max()) for curve in panel.curves.values()) < 0.01
    assert {"−1", "1"} <= set(texts(with_errors(passed_run, 1e-13)))


def test_margins_and_speeds_are_shares_of_the_limits_of_each_joint(failed_run: Any, files: dict[str, bytes]) -> None:
    """Closed form: the worst margin of a joint in its report is the lowest point of its curve."""
    margins, speeds = panels(files["margins.svg"]), panels(files["speeds.svg"])
    assert [panel.title for panel in margins] == [panel.title for panel in speeds] == list(failed_run.report.q)
    for near, quick, robot in zip(margins, speeds, failed_run.report.q, strict=True):
        uses = [use for use in failed_run.report.joints if use.robot == robot]
        assert (near.limits, quick.limits) == (pytest.approx([0.0], abs=0.05), pytest.approx([100.0], abs=0.05))
        for use in uses:
            share = 100.0 * use.margin / (0.5 * (use.upper - use.lower))
            assert near.curves[use.joint][:, 1].min() == pytest.approx(share, abs=0.3)
            peak = 100.0 * use.peak_velocity / use.velocity_limit
            assert quick.curves[use.joint][:, 1].max() == pytest.approx(peak, abs=0.3)
        assert near.marks[0][1] == pytest.approx(min(curve[:, 1].min() for curve in near.curves.values()), abs=0.3)
    assert min(panel.marks[0][1] for panel in margins) < 0.0
    assert any(re.search(r": −\d+\.\d % at ", word) for word in texts(files["margins.svg"]))


def test_many_robots_share_a_panel_with_their_worst_joints(passed_run: Any) -> None:
    given = passed_run.report
    names = [f"r{k}" for k in range(12)]
    robots = tuple(replace(passed_run.cell.robots[0], name=name) for name in names)
    uses = [use for use in given.joints if use.robot == "reis"]
    joints = tuple(replace(use, robot=name) for name in names for use in uses)
    q, qd = (dict.fromkeys(names, series["reis"]) for series in (given.q, given.qd))
    report = replace(given, q=q, qd=qd, joints=joints, accuracy=(), closures=(), conditioning=None)

    svg = draw_plots(report, cell=replace(passed_run.cell, robots=robots))["margins.svg"]

    (panel,) = panels(svg)
    assert list(panel.curves) == names
    worst = min(100.0 * use.margin / (0.5 * (use.upper - use.lower)) for use in uses)
    assert panel.marks[0][1] == pytest.approx(worst, abs=0.3)


def test_requested_formats_have_the_same_bytes_whatever_the_user_has_set(rail_run: Any) -> None:
    sheets = {"clearance": run_figures(rail_run.report, cell=rail_run.cell)["clearance"]}
    samples = pictures(sheets, ("png", "pdf"))
    with mpl.rc_context({"font.size": 20.0, "lines.linewidth": 7.0, "pdf.compression": 0, "savefig.dpi": 30}):
        before = dict(mpl.rcParams)
        assert pictures(sheets, ["pdf", "png", "png"]) == samples
        assert dict(mpl.rcParams) == before
    assert list(samples) == ["clearance.svg", "clearance.pdf", "clearance.png"]
    assert not any(b"Date" in data or b"atplotlib" in data for data in samples.values())
    assert samples["clearance.pdf"].startswith(b"%PDF")
    assert struct.unpack(">I", samples["clearance.png"][16:20]) == (1100,)


def test_formats_that_cannot_be_written_are_refused_before_anything_is_drawn() -> None:
    with pytest.raises(InputError, match="expected one of png, pdf, got 'gif'"):
        require_formats(["png", "gif"])
    assert pictures({}, ()) == {}


def test_robot_that_stands_still_and_a_clock_of_two_samples_can_be_drawn(rail_run: Any) -> None:
    report = rail_run.report
    ends = [0, -1]
    report = replace(
        report,
        times=report.times[ends],
        q={robot: 0.0 * values[ends] for robot, values in report.q.items()},
        qd={robot: 0.0 * values[:1] for robot, values in report.qd.items()},
        accuracy=tuple(
            replace(a, position_error=a.position_error[ends], orientation_error=a.orientation_error[ends])
            for a in report.accuracy
        ),
        conditioning=Conditioning(
            stack=0.0 * report.conditioning.stack[ends],
            condition=0.0 * report.conditioning.condition[ends],
            manipulability=np.array([0.0, 5e-324]),  # too small to be scaled
            robots={robot: values[ends] for robot, values in report.conditioning.robots.items()},
        ),
    )
    files = draw_plots(report, cell=rail_run.cell)
    assert "no position limits" in texts(files["positions_reis.svg"])
    assert "no such pair" in texts(files["clearance.svg"])


def test_names_with_signs_of_markup_stay_text(passed_run: Any) -> None:
    given = passed_run.report
    joints = tuple(replace(use, joint=f"{use.joint}$<&_{{") for use in given.joints if use.robot == "kuka")
    q, qd = ({"kuka": series["kuka"]} for series in (given.q, given.qd))
    files = draw_plots(replace(given, joints=joints, q=q, qd=qd, accuracy=()), cell=passed_run.cell)
    assert "B1$<&_{, in deg/s" in texts(files["velocities_kuka.svg"])
    assert "B1$<&_{, in deg" in texts(files["positions_kuka.svg"])


@given(arrays(float, st.integers(1, 5000), elements=st.floats(-1e6, 1e6)))
def test_thinning_keeps_ends_and_extremes(values: Any) -> None:
    chosen = peak_samples(values, 600)
    assert np.all(np.diff(chosen) > 0)
    assert (chosen[0], chosen[-1]) == (0, len(values) - 1)
    assert values[chosen].max() == values.max()
    assert values[chosen].min() == values.min()
    assert len(chosen) <= 600 + 4  # one stretch more than asked for, and the two ends


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6), st.integers(2, 8))
def test_ticks_are_even_and_inside(low: float, span: float, count: int) -> None:
    ticks = nice_ticks(PlotAxis(low=low, high=low + span), count)
    assert len(ticks) <= count + 1
    tolerance = 1e-6 * span + 1e-8 * abs(low)  # ticks are rounded to nine digits
    assert all(low - tolerance <= tick <= low + span + tolerance for tick in ticks)
    if len(ticks) > 2:
        steps = np.diff(ticks)
        assert np.ptp(steps) <= 1e-6 * steps.mean() + 2e-8 * abs(low)


@given(arrays(float, st.integers(3, 3000), elements=st.floats(-1e3, 1e3)), st.floats(0.0, 100.0))
def test_a_straightened_curve_stays_within_its_tolerance(values: Any, tolerance: float) -> None:
    x = np.arange(float(len(values)))

    chosen = straightened(x, values, tolerance)

    assert np.abs(np.interp(x, x[chosen], values[chosen]) - values).max() <= tolerance + 1e-9
    assert (chosen[0], chosen[-1]) == (0, len(values) - 1)


def test_powers_of_ten_are_the_ticks_of_a_logarithmic_axis() -> None:
    assert nice_ticks(PlotAxis(low=1e-3, high=0.3, is_log=True), 4) == pytest.approx([1e-3, 1e-2, 1e-1])
    assert nice_ticks(PlotAxis(low=1e-11, high=2.0, is_log=True), 4) == pytest.approx(
        [1e-11, 1e-9, 1e-7, 1e-5, 1e-3, 0.1]
    )


def test_singular_values_are_drawn_along_the_motion_with_their_smallest(files: dict[str, bytes]) -> None:
    words = texts(files["singularity.svg"])
    assert "all robots together" in words
    assert {"their condition", "their manipulability, in 10⁻⁷", "staubli"} <= set(words)
    assert sum("smallest 0.1" in word for word in words) >= 1
