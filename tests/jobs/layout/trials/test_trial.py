"""One trial of a layout search, from where it begins to its figures."""

from pathlib import Path

import pytest

from cellplan import LayoutRequest
from cellplan.jobs.layout.trials.trial import evaluate
from cellplan.search.programs.objective import Objective
from cellplan.study.trial import TrialStatus, Variant

CELLS = Path(__file__).parents[4] / "cells"
FAR = "robots.right.base.xyz_mm=[4000, 2000, 500]"


@pytest.mark.slow
def test_where_no_motion_begins_at_the_given_layout_a_sample_takes_its_place() -> None:
    settings = ("motion.duration_s=2", "motion.step_s=0.02", FAR)
    request = LayoutRequest(cell=CELLS / "planar_pair.yaml", settings=settings, objective=Objective.CONFORMING)
    near = {"kind": "perturbed", "of": None, "spread": 1.0}

    given, perturbed = (
        evaluate(request, Variant(number, values)) for number, values in enumerate(({"kind": "given"}, near))
    )

    assert given.status is TrialStatus.PASSED
    assert given.figures["sampled"] is perturbed.figures["sampled"] is True
    assert given.figures["x"] != perturbed.figures["x"]
