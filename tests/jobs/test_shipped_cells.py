"""Every shipped cell that is meant to pass does, and its resolved copy says so again."""

from pathlib import Path

import pytest
from builders.solution_memo import solved_anew
from builders.stored_cells import write_cell

from cellplan import load_cell, solve
from cellplan.jobs.check import check

pytestmark = pytest.mark.usefixtures("stored_solutions")

CELLS = sorted((Path(__file__).resolve().parents[2] / "cells").glob("*.yaml"))
# `test_cell_passes` finds the same starts and proves more of them
LONG_TO_CHECK = {
    "dual_arm",
    "fixed_part",
    "gripper",
    "load_sharing",
    "load_sharing_planar",
    "mesh_part_csv",
    "multimove",
    "own_urdf",
    "pedestal",
    "pressed_beam",
    "rail",
    "step_frame",
    "three_tasks_each",
    "tilted_mount",
    "turntable",
    "two_robots",
}
MEANT_TO_FAIL = {"four_robots_initial", "find_a_layout"}  # the starts of layout searches
# The first two are programs of 23 s; `multimove` searches starts of three robots, `mesh_part_csv` certifies a mesh,
# `load_sharing` has a planar twin; the others are templates, of which the quick tests solve the first.
LONG = {
    "dual_arm",
    "rail",
    "load_sharing_planar",
    "three_tasks_each",
    "in_turn",
    "fixed_part",
    "four_controllers",
    "load_sharing",
    "mesh_part_csv",
    "multimove",
    "own_urdf",
    "pedestal",
    "pressed_beam",
    "step_frame",
    "tilted_mount",
    "turntable",
    "two_robots",
}
MEANT_TO_PASS = [
    pytest.param(p, marks=pytest.mark.slow if p.stem in LONG else (), id=p.stem)
    for p in CELLS
    if p.stem not in MEANT_TO_FAIL
]


@pytest.mark.parametrize("path", MEANT_TO_PASS)
def test_cell_passes(path):
    solution = solve(load_cell(path))
    assert solution.passed, [c.message for run in solution.runs for c in run.report.checks if not c.passed]
    for run in solution.runs:
        clearance = run.report.clearance
        assert clearance.not_certified == ()
        assert all(value.certified for value in clearance.minima.values() if value.minimum is not None)


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=pytest.mark.slow if p.stem in LONG_TO_CHECK else (), id=p.stem) for p in CELLS],
)
def test_cell_can_be_checked_without_solving(path):
    assert check(load_cell(path)).passed is (path.stem not in MEANT_TO_FAIL)


def test_tables_do_not_depend_on_where_the_cell_was_called_from(tmp_path, monkeypatch):
    """The small cell names files of every kind."""
    path = write_cell(tmp_path / "cell")
    with solved_anew():
        from_afar = solve(load_cell(path)).runs[0].program.tables
        monkeypatch.chdir(path.parent)
        tables = solve(load_cell(path.name)).runs[0].program.tables

    assert tables == from_afar
    assert all("# cell digest: sha256 " in text for text in tables.values())
