"""Real arms among random obstacles: ways known to be there are found, and none where there is none."""

import numpy as np
import pytest
from transfers import free_case, models, outcome, walled_case

COUNT = 20
FEWEST = 19  # of the cells with a way: a search that ends by a count may miss one


@pytest.mark.slow
def test_transfers_of_real_arms_are_found_and_touch_nothing() -> None:
    arms = models()
    cases = (free_case(arms[k % len(arms)], np.random.default_rng([k, False])) for k in range(COUNT))

    outcomes = [outcome(case) for case in cases]

    assert [outcome.contact for outcome in outcomes if outcome.contact is not None] == []
    assert sum(outcome.move is not None for outcome in outcomes) >= FEWEST


@pytest.mark.slow
def test_arms_that_are_walled_in_are_refused_with_what_is_in_the_way() -> None:
    arms = models()
    cases = (walled_case(arms[k % len(arms)], np.random.default_rng([k, True])) for k in range(COUNT))

    outcomes = [outcome(case) for case in cases]

    assert [outcome.model for outcome in outcomes if outcome.move is not None] == []
    assert all("'block'" in outcome.reason for outcome in outcomes)
