"""Screening by cell: the runs of its mode, put together."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import Candidates, load_cell, screen
from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell, Mode

CELLS = Path(__file__).resolve().parents[2] / "cells"


def as_candidate(cell: Cell) -> Candidates:
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    return Candidates.of([cell], start[None])


def test_a_pairwise_job_is_as_good_as_its_worst_run() -> None:
    cell = load_cell(CELLS / "four_robots.yaml")
    pairwise = replace(cell, motion=replace(cell.motion, mode=Mode.PAIRWISE))
    candidate = as_candidate(cell)

    whole = screen(pairwise, candidate)

    entry = [screen(pairwise, candidate, task=task.name) for task in cell.tasks]
    np.testing.assert_array_equal(whole.margins, np.min([run.margins for run in entry], axis=0))
    np.testing.assert_array_equal(whole.speed_ratios, np.max([run.speed_ratios for run in entry], axis=0))
    assert whole.error == max(run.error for run in entry)
    assert whole.is_followed == all(run.is_followed for run in entry)


@pytest.mark.parametrize(
    "name", ["four_robots_initial", "papers/ribeiro_mode_2", "papers/ribeiro_mode_3", "papers/nicolato_circle"]
)
def test_every_kind_of_job_can_be_screened(name: str) -> None:
    cell = load_cell(CELLS / f"{name}.yaml")

    screening = screen(cell, as_candidate(cell))

    assert screening.is_followed.all()
    assert screening.error[0] <= 1e-5  # [m] the accuracy that is asked for


def test_candidates_are_left_as_they_are() -> None:
    candidate = as_candidate(load_cell(CELLS / "four_robots.yaml"))
    start = candidate.start.copy()

    screen(load_cell(CELLS / "four_robots.yaml"), candidate)

    np.testing.assert_array_equal(candidate.start, start)


def test_an_unknown_task_is_refused() -> None:
    cell = load_cell(CELLS / "four_robots.yaml")

    with pytest.raises(InputError, match="task: expected one of"):
        screen(cell, as_candidate(cell), task="polish")
