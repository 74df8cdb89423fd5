"""Samples of all joints are bounded, with the memory that they would take said before it is taken."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import MOST_VALUES, clock_paths, require_memory

SHIPPED = Path(__file__).parents[3] / "cells" / "planar_pair.yaml"  # two arms of three joints, 12 s


def with_step(cell: Cell, step: float) -> Cell:
    return replace(cell, motion=replace(cell.motion, step=step))


def test_what_fits_is_taken_and_one_sample_more_is_not() -> None:
    cell = load_cell(SHIPPED)
    most = MOST_VALUES // 6

    require_memory(cell, most)
    with pytest.raises(InputError, match=f"got {most + 1} x 6, which take about 6 GB of memory"):
        require_memory(cell, most + 1)


def test_a_clock_that_is_too_fine_is_refused_before_it_is_made_and_the_cure_helps() -> None:
    cell = load_cell(SHIPPED)
    paths = [build_toolpath(task, cell.part) for task in cell.tasks]

    with pytest.raises(InputError) as caught:
        clock_paths(with_step(cell, 6.5e-6), paths)

    message = str(caught.value)
    assert re.match(
        rf"{re.escape(str(SHIPPED))}:\d+: motion\.step_s: expected at most 10000000 samples times joints", message
    )
    assert "got 1846155 x 6, which take about 6.6 GB of memory; make the step at least 7.3e-06 s" in message
    clock_paths(with_step(cell, 7.3e-6), paths)
