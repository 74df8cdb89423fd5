"""Combinations of branches: order, pruning, and no explosion."""

from itertools import islice, product

import numpy as np

from cellplan.planning.start.search import best_combinations

SCORES = [[0.9, 0.5, 0.1], [float("inf")], [0.8, 0.3], [0.7, 0.6, 0.2]]


def worst(picks):
    return min(branches[pick] for branches, pick in zip(SCORES, picks, strict=True))


def test_all_combinations_come_once_in_the_order_of_their_worst_score():
    combinations = list(best_combinations(SCORES, lambda picks: False))
    assert sorted(combinations) == sorted(product(range(3), range(1), range(2), range(3)))
    assert np.all(np.diff([worst(picks) for picks in combinations]) <= 0)


def test_what_is_ruled_out_meanwhile_does_not_come():
    blocked = set()
    results = []
    for picks in best_combinations(SCORES, lambda partial: any(partial[: len(b)] == b for b in blocked)):
        results.append(picks)
        blocked.add(picks[:1])
    assert [picks[0] for picks in results] == [0, 1, 2]


def test_fifteen_robots_with_four_branches_each_do_not_explode():
    scores = [[0.9, 0.8, 0.7, 0.6]] * 15
    assert next(best_combinations(scores, lambda picks: False)) == (0,) * 15
    assert len(list(islice(best_combinations(scores, lambda picks: False), 10))) == 10


def test_a_search_without_a_way_out_ends():
    scores = [[0.9, 0.8, 0.7, 0.6]] * 15
    assert not list(best_combinations(scores, lambda picks: len(picks) == 15))


def test_one_poor_robot_at_the_end_does_not_make_the_others_be_tried_in_all_ways():
    scores = [[0.9, 0.8, 0.7, 0.6]] * 30 + [[0.1]]
    assert next(best_combinations(scores, lambda picks: False)) == (0,) * 31


def test_a_robot_without_branches_has_no_combination():
    assert not list(best_combinations([[0.9, 0.8], []], lambda picks: False))
