"""Joint paths are continuous, go through their nodes, and leave joints that stand still where they are."""

import numpy as np
import pytest

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.planning.collocation.joint_polynomials import CollocatedPath, joined
from cellplan.planning.collocation.windows import Panel

PANELS = (Panel(1.0, 1.5, 6), Panel(1.5, 3.0, 12), Panel(3.0, 3.25, 6))


def curve(t: np.ndarray) -> np.ndarray:
    """A joint that moves as a polynomial, one that swings, and one that stands still; shape (3, N)."""
    return np.stack([t**3 - t, 1e-3 * np.exp(t), np.full(np.shape(t), 0.1)])


@pytest.fixture
def path() -> CollocatedPath:
    nodes = [curve(panel.begin + panel.length * chebyshev(panel.degree).nodes) for panel in PANELS]
    return CollocatedPath(curve(np.array([1.0]))[:, 0], 1.0, PANELS, nodes, worst=2e-8)


def test_values_are_those_of_the_curve_and_exact_at_the_nodes(path: CollocatedPath) -> None:
    t = np.linspace(1.0, 3.25, 301)
    np.testing.assert_allclose(path.at(t), curve(t).T, atol=1e-10)
    for panel, nodes in zip(path.panels, path.nodes, strict=True):
        times = panel.begin + panel.length * chebyshev(panel.degree).nodes
        np.testing.assert_allclose(path.at(times), nodes.T, atol=2e-15 * 30.0)


def test_joints_that_stand_still_do_so_to_the_last_bit(path: CollocatedPath) -> None:
    assert np.ptp(path.at(np.linspace(1.0, 3.25, 301))[:, 2]) == 0.0


def test_no_jump_where_two_panels_meet(path: CollocatedPath) -> None:
    for t in (1.5, 3.0):
        before, here, after = path.at(np.array([np.nextafter(t, 0.0), t, np.nextafter(t, 9.0)]))
        assert np.abs(np.diff([before, here, after], axis=0)).max() < 1e-13
    assert np.array_equal(path.at(np.array([3.25]))[0], path.last)


def test_instants_at_the_ends_may_be_off_by_rounding(path: CollocatedPath) -> None:
    result = path.at(np.array([1.0 - 5e-10, 3.25 + 5e-10]))
    assert np.abs(result - [path.start, path.last]).max() < 1e-15


def test_a_path_of_no_panels_is_its_start() -> None:
    path = CollocatedPath(np.array([1.0, 2.0]), 0.5, (), ())
    assert (path.end, path.node_count) == (0.5, 1)
    assert np.array_equal(path.at(np.array([0.5])), [[1.0, 2.0]])
    assert path.last is path.start


def test_a_path_comes_again_later_and_goes_on(path: CollocatedPath) -> None:
    twice = joined(path, path.shifted(2.25))
    t = np.linspace(1.05, 3.2, 23)
    np.testing.assert_allclose(twice.at(t + 2.25), path.at(t), atol=1e-12)
    assert (twice.begin, twice.end, twice.worst) == (1.0, 5.5, 2e-8)
    assert twice.node_count == 2 * path.node_count - 1
    assert joined(path, CollocatedPath(path.last, 3.25, (), ())).panels == list(PANELS)
