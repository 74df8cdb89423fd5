"""The planar pair with its right base on a small grid, made ready for a map."""

from pathlib import Path

import pytest

from cellplan import BaseGrid, load_cell
from cellplan.jobs.base_map.prepared import PreparedMap, prepared

CELL = Path(__file__).resolve().parents[3] / "cells" / "planar_pair.yaml"
SETTINGS = {
    "robots.left.start_deg": [50, -85, 35],
    "motion.duration_s": 3.0,
    "motion.step_s": 0.03,
    "motion.time_law": "quintic",
    "acceleration": {"full_speed_in_s": [1.2, 0.9, 0.6]},
}


@pytest.fixture(scope="package")
def ready() -> PreparedMap:
    """Places from out of reach to too near, at the base's present angle."""
    cell = load_cell(CELL).with_values({**SETTINGS, "checks.clearance_mm": 20})
    return prepared(cell, "right", BaseGrid(x=(1300, 2700), y=(-100, 700), step=400))
