"""Polynomials through Chebyshev points: exact for polynomials, spectral for anything smooth."""

import numpy as np
import pytest

from cellplan.geometry.curves.chebyshev import ChebyshevBasis, chebyshev

DEGREES = (1, 2, 5, 6, 12, 24)


def powers(degree: int, x: np.ndarray) -> np.ndarray:
    """All monomials up to a degree at points, shape (points, degree + 1)."""
    return x[:, None] ** np.arange(degree + 1)


@pytest.mark.parametrize("degree", DEGREES)
def test_nodes_are_the_extrema_of_the_chebyshev_polynomial(degree: int) -> None:
    nodes = chebyshev(degree).nodes

    extrema = np.polynomial.Chebyshev.basis(degree)(2.0 * nodes - 1.0)
    assert np.allclose(extrema, (-1.0) ** (degree - np.arange(degree + 1)), atol=1e-13)
    assert (nodes[0], nodes[-1]) == (0.0, 1.0)
    assert np.all(np.diff(nodes) > 0.0)


@pytest.mark.parametrize("degree", DEGREES)
def test_polynomials_are_integrated_exactly(degree: int) -> None:
    basis, k = chebyshev(degree), np.arange(degree + 1)

    integrals = basis.integral @ powers(degree, basis.nodes)

    assert np.allclose(integrals, basis.nodes[:, None] ** (k + 1) / (k + 1), rtol=0.0, atol=4e-16 * (degree + 1))


@pytest.mark.parametrize("degree", DEGREES)
def test_polynomials_are_differentiated_exactly(degree: int) -> None:
    basis, k = chebyshev(degree), np.arange(degree + 1)

    slopes = basis.derivative @ powers(degree, basis.nodes)

    expected = k * basis.nodes[:, None] ** np.maximum(k - 1, 0)
    assert np.allclose(slopes, expected, rtol=0.0, atol=1e-15 * degree**4)  # rounding grows as degree^4 at most


@pytest.mark.parametrize("degree", DEGREES)
def test_polynomials_are_evaluated_exactly_anywhere(degree: int) -> None:
    basis, x = chebyshev(degree), np.linspace(0.0, 1.0, 41)
    assert np.allclose(basis.values(x) @ powers(degree, basis.nodes), powers(degree, x), rtol=0.0, atol=1e-14)
    assert np.array_equal(basis.values(basis.gaps), basis.at_gaps)


def test_values_at_the_nodes_are_those_given_to_the_last_bit() -> None:
    basis = chebyshev(12)
    assert np.array_equal(basis.values(basis.nodes), np.eye(13))
    assert np.all(np.isfinite(basis.values(np.nextafter(basis.nodes, 2.0))))


def test_gaps_lie_between_neighbouring_nodes() -> None:
    for degree in DEGREES:
        basis = chebyshev(degree)
        assert np.all((basis.gaps > basis.nodes[:-1]) & (basis.gaps < basis.nodes[1:]))


def test_what_is_smooth_converges_faster_than_any_power() -> None:
    """Interpolation of exp on 0..1 falls as 1 / (2^(2n) n!), its integral a little faster."""
    x = np.linspace(0.0, 1.0, 101)
    for degree, allowed in ((2, 1e-1), (4, 1e-4), (8, 1e-9), (12, 3e-15)):
        basis = ChebyshevBasis(degree)
        assert np.abs(basis.values(x) @ np.exp(basis.nodes) - np.exp(x)).max() <= allowed
        assert np.abs(basis.integral @ np.exp(basis.nodes) - np.expm1(basis.nodes)).max() <= allowed


def test_the_basis_of_a_degree_is_made_once() -> None:
    assert chebyshev(6) is chebyshev(6)
