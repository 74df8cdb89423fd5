"""Perturbations."""

from dataclasses import replace

import numpy as np
from builders.toy_problem import Toy

from cellplan.search.programs.problem import perturbed


def test_draws_without_a_motion_are_drawn_again() -> None:
    toy = replace(Toy(), reaches=0.6)
    for seed in range(8):
        point = perturbed(toy, toy.given, np.zeros(2), np.random.default_rng(seed), size=2.0)
        assert point is not None
        assert point.x[0] <= 0.6
        assert np.all((point.x >= toy.lower) & (point.x <= toy.upper))


def test_equal_seeds_give_equal_points() -> None:
    toy = Toy()
    one, two = (perturbed(toy, toy.given, np.zeros(2), np.random.default_rng(5)) for _ in range(2))
    assert one is not None
    assert two is not None
    assert one.x.tobytes() == two.x.tobytes()


def test_where_nothing_reaches_there_is_none() -> None:
    toy = replace(Toy(), reaches=0.05)
    assert perturbed(toy, toy.given, np.zeros(2), np.random.default_rng(0), draws=5) is None
