"""Plots: every peak survives, limits are drawn, and the bytes depend on the data alone."""

import struct
import xml.etree.ElementTree as ET
from dataclasses import replace
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cellplan.errors import InputError
from cellplan.model.report import Conditioning
from cellplan.report.plots.rendering import pictures, require_formats
from cellplan.report.plots.run import run_sheets
from cellplan.report.plots.sheet import nice_ticks, peaks_kept


def draw_plots(report: Any, *, cell: Any, formats: Any = ()) -> dict[str, bytes]:
    return pictures(run_sheets(report, cell=cell), formats)


def text_of(svg: bytes) -> list[str]:
    return [node.text or "" for node in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]  # noqa: S314


@pytest.fixture(scope="module")
def drawn(failed_run: Any) -> dict[str, bytes]:
    return draw_plots(failed_run.report, cell=failed_run.cell)


def test_every_plot_of_the_thesis_is_drawn(drawn: dict[str, bytes]) -> None:
    names = [f"task_{task}" for task in ("circle", "rhombus", "rectangle")]
    names += [f"{kind}_{robot}" for robot in ("reis", "kuka", "abb", "staubli") for kind in ("positions", "velocities")]
    names += ["clearance", "singularity"]
    assert set(drawn) == {f"{name}.svg" for name in names}


def test_pictures_are_whole(drawn: dict[str, bytes]) -> None:
    assert {ET.fromstring(data).tag for data in drawn.values()} == {"{http://www.w3.org/2000/svg}svg"}  # noqa: S314


def test_limits_are_written_beside_their_lines(drawn: dict[str, bytes]) -> None:
    words = text_of(drawn["positions_kuka.svg"])
    for limit in ("185", "−185", "100", "−100", "118", "−118"):
        assert limit in words
    assert "B1, in deg" in words
    assert any(word.startswith("outside by 4.9") for word in words)
    assert "156" in text_of(drawn["velocities_kuka.svg"])
    assert any("required 5" in word for word in text_of(drawn["clearance.svg"]))


def test_unit_of_an_error_suits_its_size(passed_run: Any) -> None:
    tiny = tuple(replace(entry, position_error=1e-9 * entry.position_error) for entry in passed_run.report.accuracy)
    zero = tuple(replace(entry, position_error=0.0 * entry.position_error) for entry in passed_run.report.accuracy)

    def title(accuracy: Any) -> list[str]:
        report = replace(passed_run.report, accuracy=accuracy[:1], q={}, qd={}, joints=())
        return text_of(draw_plots(report, cell=passed_run.cell)["task_circle.svg"])

    assert "position error, total, in µm" in title(passed_run.report.accuracy)
    assert "position error, total, in nm" in title(tiny)
    assert "position error, total, in mm" in title(zero)


def test_ripples_below_a_nanometre_look_small_and_the_tolerance_is_said_to_be_out_of_sight(passed_run: Any) -> None:
    """Given errors of a tenth of a picometre: then the frame ends at 1 nm, so that it has the ticks of 0..1."""
    largest = max(float(np.abs(entry.position_error).max()) for entry in passed_run.report.accuracy)
    ripples = tuple(
        replace(entry, position_error=1e-13 / largest * entry.position_error) for entry in passed_run.report.accuracy
    )
    report = replace(passed_run.report, accuracy=ripples[:1], q={}, qd={}, joints=())

    words = text_of(draw_plots(report, cell=passed_run.cell)["task_circle.svg"])

    total = words[: words.index("position error, total, in nm")]
    assert [word for word in total if word in {"0", "0.25", "0.5", "0.75", "1"}] == ["0", "0.25", "0.5", "0.75", "1"]
    assert "tolerance 0.1 mm, off the scale" in words


def test_error_of_zero_is_drawn_below_its_tolerance(passed_run: Any) -> None:
    exact = tuple(replace(entry, position_error=0.0 * entry.position_error) for entry in passed_run.report.accuracy)
    report = replace(passed_run.report, accuracy=exact[:1], q={}, qd={}, joints=())

    words = text_of(draw_plots(report, cell=passed_run.cell)["task_circle.svg"])

    assert "tolerance 0.1 mm" in words
    assert "0.1" in words


def test_requested_formats_have_the_same_bytes_whatever_the_user_has_set(rail_run: Any) -> None:
    sheets = {"clearance": run_sheets(rail_run.report, cell=rail_run.cell)["clearance"]}
    drawn = pictures(sheets, ("png", "pdf"))
    with mpl.rc_context({"font.size": 20.0, "lines.linewidth": 7.0, "pdf.compression": 0, "savefig.dpi": 30}):
        before = dict(mpl.rcParams)
        assert pictures(sheets, ["pdf", "png", "png"]) == drawn
        assert dict(mpl.rcParams) == before
    assert list(drawn) == ["clearance.svg", "clearance.pdf", "clearance.png"]
    assert not any(b"Date" in data or b"atplotlib" in data for data in drawn.values())
    assert drawn["clearance.pdf"].startswith(b"%PDF")
    assert struct.unpack(">I", drawn["clearance.png"][16:20]) == (1100,)


def test_formats_that_cannot_be_written_are_refused_before_anything_is_drawn(monkeypatch: Any) -> None:
    with pytest.raises(InputError, match="expected one of png, pdf, got 'gif'"):
        require_formats(["png", "gif"])
    monkeypatch.setattr("cellplan.report.plots.rendering.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"plots as PDF: matplotlib is not installed; run 'pip install \"cellplan"):
        require_formats(["pdf"])
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
    assert "no position limits" in text_of(files["positions_reis.svg"])
    assert "no such pair" in text_of(files["clearance.svg"])


def test_names_with_signs_of_markup_stay_text(passed_run: Any) -> None:
    given = passed_run.report
    joints = tuple(replace(use, joint=f"{use.joint}$<&_{{") for use in given.joints if use.robot == "kuka")
    q, qd = ({"kuka": series["kuka"]} for series in (given.q, given.qd))
    files = draw_plots(replace(given, joints=joints, q=q, qd=qd, accuracy=()), cell=passed_run.cell)
    assert "B1$<&_{, in deg/s" in text_of(files["velocities_kuka.svg"])
    assert "B1$<&_{, in deg" in text_of(files["positions_kuka.svg"])


@given(arrays(float, st.integers(1, 5000), elements=st.floats(-1e6, 1e6)))
def test_thinning_keeps_ends_and_extremes(values: Any) -> None:
    kept = peaks_kept(values)
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, len(values) - 1)
    assert values[kept].max() == values.max()
    assert values[kept].min() == values.min()
    assert len(kept) <= 600 + 4  # one stretch more than asked for, and the two ends


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6), st.integers(2, 8))
def test_ticks_are_even_and_inside(low: float, span: float, count: int) -> None:
    ticks = nice_ticks(low, low + span, count)
    assert len(ticks) <= count + 1
    room = 1e-6 * span + 1e-8 * abs(low)  # ticks are rounded to nine digits
    assert all(low - room <= tick <= low + span + room for tick in ticks)
    if len(ticks) > 2:
        steps = np.diff(ticks)
        assert np.ptp(steps) <= 1e-6 * steps.mean() + 2e-8 * abs(low)


def test_singular_values_are_drawn_along_the_motion_with_their_smallest(drawn: dict[str, bytes]) -> None:
    words = text_of(drawn["singularity.svg"])
    assert "all robots together" in words
    assert {"their condition", "their manipulability, in 10⁻⁷", "staubli"} <= set(words)
    assert sum("smallest 0.1" in word for word in words) >= 1
