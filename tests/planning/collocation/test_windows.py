"""Windows cover the time without gaps, and their matrices are exact for polynomials on each panel."""

from itertools import pairwise

import numpy as np
import pytest

from cellplan.planning.collocation.windows import (
    DEGREES,
    FEWEST_KNOTS,
    MOST_KNOTS,
    MOST_NODES,
    SHARE_OF_MOTION,
    Panel,
    Window,
    grouped,
    windows_between,
)

WINDOW = Window((Panel(0.0, 0.3, 6), Panel(0.3, 1.1, 12), Panel(1.1, 1.2, 6)))


def panels_of(windows: tuple[Window, ...]) -> list[Panel]:
    return [panel for window in windows for panel in window.panels]


def cubics(t: np.ndarray, begins: np.ndarray) -> np.ndarray:
    """Another cubic on each panel, with a jump where two meet."""
    return (1.0 + begins) * t**3 - 2.0 * begins + t


@pytest.mark.parametrize("breaks", [[0.0, 4.0], [0.0, 1.0, 1.00001, 3.5, 4.0], np.linspace(0.0, 4.0, 1261).tolist()])
def test_panels_cover_the_time_from_break_to_break(breaks: list[float]) -> None:
    windows = windows_between(np.array(breaks), whole=4.0)

    panels = panels_of(windows)
    assert (panels[0].begin, panels[-1].end) == (0.0, 4.0)
    assert all(one.end == other.begin for one, other in pairwise(panels))
    assert set(breaks) <= {panel.begin for panel in panels} | {4.0}
    assert all(panel.length <= SHARE_OF_MOTION * 4.0 * (1.0 + 1e-12) for panel in panels)
    assert all(window.count <= MOST_NODES for window in windows)
    assert all(
        window.panels[-1].end - window.panels[0].begin <= SHARE_OF_MOTION * 4.0 * (1.0 + 1e-12) for window in windows
    )


def test_short_stretches_begin_with_lower_degrees() -> None:
    windows = windows_between(np.array([0.0, 0.01, 0.1, 1.0]), whole=4.0)
    assert [panel.degree for panel in panels_of(windows)] == list(DEGREES)


def test_integrals_are_exact_for_polynomials_with_jumps_between_panels() -> None:
    begins, ends = (part[: WINDOW.count] for part in WINDOW.stretches)
    t = WINDOW.times[: WINDOW.count]

    result = WINDOW.integral @ cubics(t, begins)

    def primitive(x: np.ndarray, begin: np.ndarray | float) -> np.ndarray:
        return (1.0 + begin) * x**4 / 4.0 - 2.0 * begin * x + x**2 / 2.0

    whole = np.cumsum([0.0, *(primitive(p.end, p.begin) - primitive(p.begin, p.begin) for p in WINDOW.panels)])
    before = whole[WINDOW.panel_of[: WINDOW.count]]
    np.testing.assert_allclose(result, before + primitive(t, begins) - primitive(begins, begins), atol=1e-14)
    assert np.all(t <= ends)


def test_values_between_the_nodes_are_exact_for_polynomials() -> None:
    begins, _ = WINDOW.stretches
    t, count = WINDOW.times, WINDOW.count
    np.testing.assert_allclose(
        WINDOW.between @ cubics(t[:count], begins[:count]), cubics(t[count:], begins[count:]), atol=1e-14
    )


def test_instants_lie_within_their_panels_and_every_panel_has_both_ends() -> None:
    begins, ends = WINDOW.stretches
    assert np.all((WINDOW.times >= begins) & (WINDOW.times <= ends))
    assert [WINDOW.panels[k].begin for k in WINDOW.panel_of] == begins.tolist()
    for panel, place in zip(WINDOW.panels, WINDOW.places, strict=True):
        assert WINDOW.times[place][[0, -1]] == pytest.approx([panel.begin, panel.end], abs=1e-16)


def test_rough_panels_get_higher_degrees_and_are_halved_at_the_last() -> None:
    panel = Panel(0.0, 1.0, DEGREES[0])
    for degree in DEGREES[1:]:
        (panel,) = panel.refined()
        assert panel == Panel(0.0, 1.0, degree)
    assert panel.refined() == (Panel(0.0, 0.5, DEGREES[-1]), Panel(0.5, 1.0, DEGREES[-1]))


def test_only_rough_panels_are_refined() -> None:
    result = panels_of(WINDOW.refined([False, True, False], shortest=0.0))
    assert result == [WINDOW.panels[0], Panel(0.3, 1.1, 24), WINDOW.panels[2]]


def test_no_panel_is_halved_below_the_shortest_length() -> None:
    top = Window((Panel(0.0, 1e-6, 6), Panel(1e-6, 1.0, DEGREES[-1])))
    assert top.refined([False, True], shortest=0.6) == ()
    assert len(panels_of(top.refined([True, True], shortest=0.4))) == 3  # a tiny one may still get a higher degree
    assert len(top.parts(shortest=0.6)) == 2  # panels that are there already may be tiny
    assert Window((Panel(0.0, 1.0, 6),)).parts(shortest=0.6) == ()
    assert panels_of(Window((Panel(0.0, 1.0, 6),)).parts(shortest=0.4)) == [Panel(0.0, 0.5, 6), Panel(0.5, 1.0, 6)]


def test_halves_of_a_window_are_the_window() -> None:
    assert tuple(panels_of(WINDOW.parts(shortest=0.0))) == WINDOW.panels


def test_panels_with_many_nodes_stay_alone() -> None:
    panels = [Panel(k, k + 1.0, 60) for k in range(3)]
    assert [window.panels for window in grouped(panels, longest=10.0)] == [(panel,) for panel in panels]


CLOSE = np.linspace(0.0, 4.0, 1261)


def test_panels_reach_over_knots_that_follow_each_other_closely() -> None:
    panels = panels_of(windows_between(np.array([0.0, 1.0, 4.0]), whole=4.0, knots=CLOSE))

    assert (panels[0].begin, panels[-1].end) == (0.0, 4.0)
    assert all(one.end == other.begin for one, other in pairwise(panels))
    assert 1.0 in {panel.end for panel in panels}
    assert all(len(panel.knots) <= MOST_KNOTS for panel in panels)
    assert len(panels) < 1261 / MOST_KNOTS + 2 * FEWEST_KNOTS
    seen = {0.0, 1.0, 4.0}.union(*((panel.begin, *panel.knots) for panel in panels))
    assert seen == {0.0, 1.0, 4.0}.union(CLOSE.tolist())


def test_knots_far_apart_and_few_knots_end_panels() -> None:
    far = panels_of(windows_between(np.array([0.0, 4.0]), whole=4.0, knots=np.array([0.5, 1.0, 3.0])))
    assert not any(panel.knots for panel in far)
    assert {0.5, 1.0, 3.0} <= {panel.end for panel in far}
    few = panels_of(windows_between(np.array([0.0, 0.03]), whole=4.0, knots=np.array([0.01, 0.02])))
    assert few == [Panel(0.0, 0.01, DEGREES[0]), Panel(0.01, 0.02, DEGREES[0]), Panel(0.02, 0.03, DEGREES[0])]


def test_knots_that_are_breaks_too_count_once() -> None:
    panels = panels_of(windows_between(np.array([0.0, 2.0, 4.0]), whole=4.0, knots=np.array([0.0, 2.0 + 1e-10, 4.0])))
    assert 2.0 in {panel.end for panel in panels}
    assert min(panel.length for panel in panels) > 0.5


def test_panels_over_knots_are_cut_at_knots_down_to_one_panel_for_each_stretch() -> None:
    knots = tuple((0.1 * np.arange(1, 20)).tolist())
    left = [Panel(0.0, 2.0, DEGREES[-1], knots)]
    for _ in range(3):
        left = [part for panel in left for part in (panel.parts() if panel.knots else (panel,))]
    assert [panel.end for panel in left] == [*knots, 2.0]
    assert {panel.degree for panel in left} == {DEGREES[0]}
    assert len(Window((Panel(0.0, 2.0, DEGREES[-1], knots),)).parts(shortest=9.0)) == 4  # stretches that are there


def test_the_error_is_looked_at_in_every_knot() -> None:
    knots = (0.11, 0.2, 0.35, 0.5, 0.6)
    window = Window((Panel(0.0, 0.1, 6), Panel(0.1, 0.7, 24, knots), Panel(0.7, 1.0, 6)))
    begins, _ = window.stretches
    t, count = window.times, window.count
    assert all(np.abs(t[count:] - knot).min() < 1e-15 for knot in knots)
    np.testing.assert_allclose(
        window.between @ cubics(t[:count], begins[:count]), cubics(t[count:], begins[count:]), atol=1e-14
    )
    assert window.between.shape == (len(t) - count, count)


def test_a_shifted_panel_takes_its_knots_along() -> None:
    assert Panel(0.0, 1.0, 24, (0.25, 0.5)).shifted(2.0) == Panel(2.0, 3.0, 24, (2.25, 2.5))
