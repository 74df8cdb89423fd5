"""Each toolpath of a solve is put on the clock once, however many starts are tried and phases are planned."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

import cellplan.planning.start.trial_motion as trials
from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell, Mode
from cellplan.planning.timing import schedule
from cellplan.planning.timing.schedule import clock_path
from cellplan.runs.solve import solve

CELL = Path(__file__).parents[2] / "cells" / "planar_pair.yaml"

QUICK = {(False, Mode.SIMULTANEOUS), (True, Mode.PAIRWISE)}  # starts given and found, one phase and several


@pytest.fixture
def clocked(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    counts: Counter[str] = Counter()

    def counting(cell, task, toolpath):
        counts[task.name] += 1
        return clock_path(cell, task, toolpath)

    for module in (schedule, trials):
        monkeypatch.setattr(module, "clock_path", counting)
    return counts


def coarse(mode: Mode, *, is_open: bool) -> Cell:
    cell = load_cell(CELL)
    robots = tuple(replace(robot, start=None if is_open else robot.start) for robot in cell.robots)
    return replace(cell, robots=robots, motion=replace(cell.motion, mode=mode, step=0.02))


@pytest.mark.parametrize(
    ("is_open", "mode"),
    [
        pytest.param(
            is_open,
            mode,
            id=f"{'found' if is_open else 'given'} starts-{mode}",
            marks=() if (is_open, mode) in QUICK else pytest.mark.slow,
        )
        for is_open in (False, True)
        for mode in Mode
        if mode is not Mode.SEMI_COORDINATED  # for programs from home to home only
    ],
)
def test_each_toolpath_is_put_on_the_clock_once(clocked: Counter[str], mode: Mode, is_open: bool) -> None:
    cell = coarse(mode, is_open=is_open)

    solve(cell)

    assert clocked == {task.name: 1 for task in cell.tasks}
