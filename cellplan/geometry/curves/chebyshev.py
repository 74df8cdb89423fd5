"""Polynomials through Chebyshev points: integrated, differentiated and evaluated anywhere by matrices."""

from functools import cache
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array

NODE_TOL: Final = float(np.finfo(float).tiny)  # nearer to a node than this, the quotient would overflow


class ChebyshevBasis:
    """Polynomials of one degree on the interval 0..1, given by their values at the Chebyshev points of the second kind.

    All matrices multiply values at the points, shape (degree + 1, ...).

    Attributes:
        nodes: The points, ascending, both ends included, shape (degree + 1,).
        integral: Integrals from 0 to each node, shape (degree + 1, degree + 1).
        derivative: Derivatives at the nodes, shape (degree + 1, degree + 1).
        gaps: Points between neighbouring nodes, where the error of interpolation is largest, shape (degree,).
        at_gaps: Values there, shape (degree, degree + 1).
    """

    def __init__(self, degree: int) -> None:
        """Prepare the matrices of one degree, at least 1."""
        self.nodes = 0.5 * (1.0 - np.cos(np.pi * np.arange(degree + 1) / degree))
        self._signs = np.where(np.arange(degree + 1) % 2 == 0, 1.0, -1.0)
        self._signs[[0, -1]] *= 0.5
        self.gaps = 0.5 * (1.0 - np.cos(np.pi * (np.arange(degree) + 0.5) / degree))
        self.at_gaps = self.values(self.gaps)
        self.derivative = self._derivative()
        points, weights = np.polynomial.legendre.leggauss(degree + 1)  # exact for the degree and more
        inside = self.nodes[:, None] * 0.5 * (1.0 + points)
        shares = self.values(inside.ravel()).reshape(degree + 1, degree + 1, degree + 1)
        self.integral = 0.5 * self.nodes[:, None] * np.einsum("g,igk->ik", weights, shares)

    def values(self, x: Array) -> Array:
        """Matrix that gives the values at points of 0..1, shape (m,), by the barycentric formula."""
        away = x[:, None] - self.nodes
        hit = np.abs(away) <= NODE_TOL
        terms = self._signs / np.where(hit, 1.0, away)
        matrix = np.where(hit.any(axis=1, keepdims=True), hit.astype(float), terms)
        matrix /= matrix.sum(axis=1, keepdims=True)
        return matrix

    def _derivative(self) -> Array:
        """Differentiation matrix; each row sums to zero, as constants have no derivative."""
        away = self.nodes[:, None] - self.nodes
        np.fill_diagonal(away, 1.0)
        matrix = (self._signs / self._signs[:, None]) / away
        np.fill_diagonal(matrix, 0.0)
        np.fill_diagonal(matrix, -matrix.sum(axis=1))
        return matrix


@cache
def chebyshev(degree: int) -> ChebyshevBasis:
    """The basis of one degree, made once."""
    return ChebyshevBasis(degree)
