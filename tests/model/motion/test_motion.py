"""Motion: what is said of how it was resolved holds figures only."""

import math
from typing import Any

import pytest

from cellplan.model.motion.motion import Resolution
from cellplan.model.solver import Integrator


@pytest.mark.parametrize(
    "figures",
    [
        {"nodes": -1},
        {"error_between": math.nan},
        {"error_between": math.inf},
        {"error_between": -1e-12},
        {"euler_from": math.nan},
        {"euler_from": -0.5},
    ],
)
def test_a_resolution_refuses_what_is_no_figure(figures: dict[str, Any]) -> None:
    counts = {"panels": 1, "nodes": 9, "sweeps": 2, "solves": 18} | figures
    with pytest.raises(ValueError, match="resolution: expected"):
        Resolution(integrator=Integrator.ACCURATE, **counts)


def test_a_motion_of_steps_has_no_error_between_nodes() -> None:
    made = Resolution(integrator=Integrator.EULER, panels=0, nodes=0, sweeps=0, solves=0)

    assert (made.error_between, made.euler_from) == (None, None)
