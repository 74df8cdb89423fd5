"""Phases of work begin where the planned program has them begin, and go on without a robot that cannot."""

from pathlib import Path

import numpy as np

from cellplan import load_cell
from cellplan.runs.plan.sequence import plan_work
from cellplan.runs.plan.work_phases import work_phases

CELLS = Path(__file__).resolve().parents[3] / "cells"


def test_phases_of_work_begin_where_the_planned_stages_do() -> None:
    cell = load_cell(CELLS / "in_turn.yaml")

    stages, phases = plan_work(cell).stages, list(work_phases(cell, "kuka"))

    assert [work.phase for work in phases] == [stage.stage.phase for stage in stages]
    assert [work.name for work in phases] == ["circle", "rhombus", "rectangle"]
    for stage, work in zip(stages, phases, strict=True):
        np.testing.assert_array_equal(work.start, stage.motion.q[0])


def test_pairs_of_a_home_that_is_to_be_found_are_left_out() -> None:
    cell = load_cell(CELLS / "in_turn.yaml")
    homeless = cell.with_values({"robots.kuka.home_deg": None})

    known, unknown = (list(work_phases(written, "abb"))[1] for written in (cell, homeless))

    names = {frozenset(known.scene.names(pair)) for pair in known.scene.pairs}
    left = names - {frozenset(unknown.scene.names(pair)) for pair in unknown.scene.pairs}
    assert left
    assert all(any(name.startswith("kuka/") for name in pair) for pair in left)


def test_a_robot_that_cannot_begin_keeps_no_other_from_it() -> None:
    cell = load_cell(CELLS / "in_turn.yaml")
    away = cell.with_values({"robots.kuka.base.x_mm": 9000, "robots.kuka.start_deg": "auto"})

    starts = [[work.start for work in work_phases(written, "kuka")] for written in (cell, away)]

    kuka = cell.columns("kuka")
    for one, other in zip(*starts, strict=True):
        np.testing.assert_array_equal(np.delete(one, kuka), np.delete(other, kuka))
