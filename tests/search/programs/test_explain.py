"""What binds and what variables do, by sensitivities in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from builders.toy_problem import Toy

from cellplan.search.programs.explain import Explanation, explain
from cellplan.search.programs.improve import improve
from cellplan.search.programs.measures import MeasureKind
from cellplan.search.programs.objective import Demands, Effort, Objective, Reserve

EXACT = Effort(within=20.0, reserve=Reserve(margin=0.0, distance=0.0, within_robot=0.0, time=0.0))


def explained(toy: Toy, demands: Demands) -> Explanation:
    improved = improve(toy, toy.given, np.zeros(2), demands, EXACT)
    assert improved is not None
    explanation = explain(toy, improved.point, demands, EXACT)
    assert explanation is not None
    return explanation


def test_two_joints_that_are_equally_fast_share_the_cycle() -> None:
    explanation = explained(Toy(), Demands(objective=Objective.CYCLE, margin=np.zeros(2)))
    shares = {entry.names[1]: entry.share for entry in explanation.binding if entry.kind is MeasureKind.SPEED}
    assert shares == pytest.approx({"joint_0": 2.0 / 3.0, "joint_1": 1.0 / 3.0}, abs=1e-3)
    np.testing.assert_allclose(explanation.by_variable, 0.0, atol=1e-2)


def test_a_margin_that_binds_costs_what_its_limit_would_gain() -> None:
    near = replace(Toy(), upper_limit=3.5)
    explanation = explained(near, Demands(objective=Objective.CYCLE, margin=np.zeros(2)))
    limit = next(entry for entry in explanation.binding if entry.kind is MeasureKind.UPPER_LIMIT)
    assert limit.names == ("robot", "joint_0")
    assert limit.time == pytest.approx(2.0)
    assert limit.gain == pytest.approx(2.0, rel=1e-2)  # cycle 2 (6 - 2 x0) s at x0 = limit / 2
    assert explanation.by_variable[0] == pytest.approx(-4.0, rel=1e-2)


def test_a_variable_at_its_bound_is_held_there() -> None:
    narrow = replace(Toy(), upper=np.array([1.5, 10.0]))
    explanation = explained(narrow, Demands(objective=Objective.CYCLE, margin=np.zeros(2)))
    assert explanation.held[0] == pytest.approx(4.0, rel=1e-2)
    assert explanation.held[1] == pytest.approx(0.0, abs=1e-2)
