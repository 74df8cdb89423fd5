"""Starts of small cells, prepared once."""

from pathlib import Path

import pytest

from cellplan import load_cell
from cellplan.search.starts import at_rest, combined
from cellplan.search.starts.effort import StartEffort
from cellplan.search.starts.problem import StartProblem
from cellplan.search.variables.variables import Variables

CELLS = Path(__file__).parents[3] / "cells"
DRAWS = 200


@pytest.fixture(autouse=True)
def fewer_draws(request, monkeypatch):
    """A tenth of the draws of a search: small cells need no more."""
    if request.node.get_closest_marker("slow") is None:
        for module in (at_rest, combined):
            monkeypatch.setattr(module, "EFFORT", StartEffort(bases=DRAWS, settings=40, combinations=32))


def prepared(cell):
    """The problem of a cell, and its variables."""
    variables = Variables.of(cell)
    return StartProblem.of(variables.base, variables, margin=variables.margin)


@pytest.fixture(scope="package")
def four_robots():
    return prepared(load_cell(CELLS / "four_robots_initial.yaml"))


@pytest.fixture(scope="package")
def turntable():
    return prepared(load_cell(CELLS / "turntable.yaml"))
