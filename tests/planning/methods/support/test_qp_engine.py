"""The quadratic program's engine against points that are known in closed form."""

import numpy as np
import pytest

from cellplan.errors import NoSolutionError
from cellplan.planning.methods.support.qp_engine import nearest_to_origin


def test_the_origin_is_nearest_when_it_is_allowed():
    y = nearest_to_origin(np.eye(3), lower=-np.ones(3), upper=np.full(3, np.inf))
    np.testing.assert_array_equal(y, np.zeros(3))


def test_nearest_point_of_a_box_and_of_a_half_space():
    np.testing.assert_allclose(
        nearest_to_origin(np.eye(3), lower=np.array([1.0, -2.0, -9.0]), upper=np.array([2.0, -1.0, 9.0])),
        [1.0, -1.0, 0.0],
        atol=1e-9,
    )
    a = np.array([[3.0, 4.0]])  # the foot of the perpendicular on 3 x + 4 y = 10
    np.testing.assert_allclose(nearest_to_origin(a, lower=np.array([10.0]), upper=np.array([20.0])), [1.2, 1.6])


def test_bounds_that_contradict_each_other_are_refused_by_name():
    A = np.array([[1.0, 0.0], [1.0, 0.0]])
    with pytest.raises(NoSolutionError, match="the quadratic program has no solution"):
        nearest_to_origin(A, lower=np.array([1.0, -3.0]), upper=np.array([2.0, -2.0]))


def test_what_is_no_number_is_refused():
    with pytest.raises(NoSolutionError):
        nearest_to_origin(np.full((2, 2), np.nan), lower=-np.ones(2), upper=np.ones(2))
