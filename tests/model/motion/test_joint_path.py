"""Joint paths: values at rows and nodes, derivatives by differences, and what two kinds of pieces have in common."""

import numpy as np
import pytest

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.model.motion.joint_path import JointPath

TIMES = np.cumsum([0.5, 0.1, 0.2, 0.05, 0.15, 0.1])
H = 1e-5  # [s] of central differences: H^2 and eps / H are below 1e-9 of values near 1


def rows() -> np.ndarray:
    return np.stack([np.sin(3.0 * TIMES), TIMES**2, np.full(len(TIMES), 0.7)], axis=1)


def polynomials() -> JointPath:
    """The cubics t^3 and 2 - t on pieces of different degree, and a joint that stands still."""
    breaks = np.array([1.0, 1.5, 3.0])
    nodes = []
    for begin, end, degree in ((1.0, 1.5, 6), (1.5, 3.0, 12)):
        t = begin + (end - begin) * chebyshev(degree).nodes
        nodes.append(np.stack([t**3, 2.0 - t, np.full(len(t), 0.1)]))
    return JointPath(nodes[0][:, 0], breaks, nodes)


def test_a_hermite_path_goes_through_its_rows_and_rests_at_both_ends() -> None:
    q = rows()
    path = JointPath.through(TIMES, q)
    np.testing.assert_allclose(path.at(TIMES), q, atol=1e-15 * 10)
    np.testing.assert_allclose(path.at(TIMES[[0, -1]], 1), 0.0, atol=1e-13)
    inner = path.at(TIMES, 1)[1:-1]
    np.testing.assert_allclose(inner, (q[2:] - q[:-2]) / (TIMES[2:] - TIMES[:-2])[:, None], atol=1e-12)
    assert path.last is not q
    np.testing.assert_array_equal(path.last, q[-1])
    assert path.end == TIMES[-1]


def test_a_hermite_path_is_the_usual_cubic_between_rows() -> None:
    q, u = rows(), 0.3
    path = JointPath.through(TIMES, q)
    h = TIMES[2] - TIMES[1]
    m = [(q[k + 1] - q[k - 1]) / (TIMES[k + 1] - TIMES[k - 1]) for k in (1, 2)]
    h00, h10, h01, h11 = 2 * u**3 - 3 * u**2 + 1, u**3 - 2 * u**2 + u, -2 * u**3 + 3 * u**2, u**3 - u**2
    expected = h00 * q[1] + h10 * h * m[0] + h01 * q[2] + h11 * h * m[1]
    np.testing.assert_allclose(path.at(np.array([TIMES[1] + u * h]))[0], expected, atol=1e-14)


def test_polynomials_are_reproduced_with_their_derivatives() -> None:
    path, t = polynomials(), np.linspace(1.0, 3.0, 41)
    still = np.zeros_like(t)
    for order, columns in enumerate(
        [(t**3, 2.0 - t, still + 0.1), (3.0 * t**2, still - 1.0, still), (6.0 * t, still, still)]
    ):
        np.testing.assert_allclose(path.at(t, order), np.stack(columns, axis=1), atol=1e-9)
    assert not path.at(t, 1)[:, 2].any()


@pytest.mark.parametrize("path", [polynomials(), JointPath.through(TIMES, rows())], ids=["polynomials", "rows"])
def test_velocities_are_the_differences_of_positions(path: JointPath) -> None:
    t = np.linspace(path.breaks[0] + 0.011, path.end - 0.013, 57)
    t = t[np.abs(t[:, None] - path.breaks).min(axis=1) > 2.0 * H]
    differences = (path.at(t + H) - path.at(t - H)) / (2.0 * H)
    np.testing.assert_allclose(path.at(t, 1), differences, atol=1e-7)


def test_a_path_of_no_pieces_is_its_start() -> None:
    path = JointPath(np.array([1.0, 2.0]), np.array([0.5]), ())
    np.testing.assert_array_equal(path.at(np.array([0.5])), [[1.0, 2.0]])
    np.testing.assert_array_equal(path.at(np.array([0.5]), 1), [[0.0, 0.0]])
    assert path.last is path.start
