"""The stages with tasks of a program, planned alone: in their order, with all starts and homes."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import StartOffTaskError
from cellplan.files.cell.load import load_cell
from cellplan.planning.sequence.stages import program_stages
from cellplan.runs.plan.sequence import plan_work

CELLS = Path(__file__).resolve().parents[3] / "cells"


@pytest.mark.slow
def test_work_is_planned_without_transfers_and_with_every_start() -> None:
    work = plan_work(load_cell(CELLS / "three_tasks_each.yaml"))
    assert [stage.stage.phase.name for stage in work.stages] == [
        *("grip", "lift", "work-1", "work-2", "work-3", "lower", "release")
    ]
    assert all(robot.start is not None and robot.home is not None for robot in work.cell.robots)
    assert all(task.start_posture is not None for task in work.cell.tasks)
    for planned, stage in zip(
        work.stages, (stage for stage in program_stages(work.cell) if stage.phase.tasks), strict=True
    ):
        for name in stage.phase.idle:
            home = work.cell.robot(name).home
            assert np.array_equal(planned.motion.q[-1, work.cell.columns(name)], home)


def test_starts_too_far_off_their_tasks_are_refused_or_searched_for() -> None:
    cell = load_cell(CELLS / "in_turn.yaml").with_values({"robots.kuka.base.z_mm": 400})
    with pytest.raises(StartOffTaskError, match=r"robots\.kuka\.start_deg: the tool of 'kuka' is 100\.000 mm and"):
        plan_work(cell)

    work = plan_work(cell, drops_far=True)

    assert work.far == ("circle",)
    assert plan_work(work.cell).far == ()  # it refuses tools off their tasks
    assert np.array_equal(work.cell.task("rhombus").start_posture, cell.robot("abb").start)
