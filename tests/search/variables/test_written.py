"""Start postures as a search writes them into a cell file."""

from pathlib import Path

import numpy as np

from cellplan import load_cell
from cellplan.search.variables.written import written_start

CELLS = Path(__file__).parents[3] / "cells"


def test_a_start_by_joint_replaces_the_list_that_sliding_joints_do_not_take() -> None:
    cell = load_cell(CELLS / "rail.yaml")
    carrier, start = cell.robot("carrier"), cell.robot("carrier").start
    auto = cell.with_values({"robots.carrier.start": None, "robots.carrier.start_deg": "auto"})
    assert start is not None

    written = auto.with_values(written_start(auto, auto.robot("carrier"), start)).robot("carrier")

    assert carrier.start is not None
    assert written.start is not None
    np.testing.assert_allclose(written.start, carrier.start, atol=1e-8)
