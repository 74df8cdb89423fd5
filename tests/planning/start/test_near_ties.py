"""Near ties: rounding does not turn an order over, the next figure decides, and the order of listing never does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.planning.start.near_ties import best_first, levels


def test_the_largest_first_figure_wins():
    assert best_first(np.array([[0.1, 9.0], [0.3, 0.0], [0.2, 5.0]])) == [1, 2, 0]


@pytest.mark.parametrize("noise", [0.0, 1e-15, -1e-15, 4e-10, -4e-10])
def test_near_equal_figures_leave_it_to_the_next_one(noise):
    assert best_first(np.array([[0.2 + noise, 0.5], [0.2, 0.6]])) == [1, 0]


def test_figures_that_differ_by_more_are_no_tie():
    assert best_first(np.array([[0.2 + 1e-8, 0.5], [0.2, 0.6]])) == [0, 1]


def test_what_no_figure_states_apart_stays_in_its_order():
    assert best_first(np.array([[1.0], [1.0], [1.0]])) == [0, 1, 2]
    assert best_first(np.zeros((0, 3))) == []


@given(st.permutations(range(6)), st.lists(st.sampled_from([0.0, 0.25, 0.5]), min_size=12, max_size=12))
def test_the_order_of_candidates_does_not_matter_where_the_last_figure_is_their_own(order, samples):
    figures = np.column_stack([np.array(samples).reshape(6, 2), np.arange(6.0)])

    shuffled = [order[index] for index in best_first(figures[order])]

    assert shuffled == best_first(figures)


def test_levels_make_near_equal_scores_equal():
    assert levels([0.3, 0.3 + 1e-12, 0.1, np.inf]) == [0.3 + 1e-12, 0.3 + 1e-12, 0.1, np.inf]
    assert levels([]) == []
