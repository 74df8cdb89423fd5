"""For whom the feed holds in step: speeds on the part that are known from how the rows are made."""

from dataclasses import replace

import numpy as np
import pytest
from builders.rapid_jobs import part_cell

from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.programs.rows.feeds import feeds_in_step
from cellplan.programs.rows.rows import EssentialRows, WorkRows

FEED = 0.04  # [m/s]
STEPS = 10


def rows_at(robot: str, speeds: np.ndarray) -> RobotRows:
    """A tool that is in process on a line, at some speeds from row to row, after a motion of joints."""
    times = np.concatenate([[0.0], 1.0 + np.arange(STEPS + 1.0)])
    X = np.full((STEPS + 2, 4, 4), np.nan)
    X[2:] = np.eye(4)
    X[2:, 0, 3] = np.cumsum(speeds)
    process = np.array([False] + [True] * STEPS + [False])
    return RobotRows(robot=robot, q=np.zeros((STEPS + 2, 6)), times=times, process=process, X_PT=X)


def said(*speeds: np.ndarray, feeds: tuple[float | None, ...]) -> list[str]:
    cell = part_cell()
    tasks = tuple(replace(task, feed=feed) for task, feed in zip(cell.tasks, feeds, strict=True))
    cell = replace(cell, tasks=tasks)
    robots = {task.robot: rows_at(task.robot, speed) for task, speed in zip(tasks, speeds, strict=True)}
    program = ProgramRows(name=None, robots=robots)
    work = WorkRows(slice(1, STEPS + 2), cell, tuple(task.name for task in tasks), {}, {})
    return list(feeds_in_step([program], [program], [EssentialRows((), (work,))]))


def test_the_head_says_for_whom_the_feed_holds_and_who_is_slower() -> None:
    even, slower = np.full(STEPS, FEED), np.full(STEPS, 0.5 * FEED)
    slower[4] = 0.25 * FEED

    holds = "at the stated times the feed on the part holds for the tool of '{}'".format
    assert said(even, even, feeds=(FEED, FEED)) == [holds("alpha"), holds("beta")]
    assert said(even, slower, feeds=(FEED, 0.5 * FEED)) == [
        holds("alpha"),
        # 8 of 8.5 steps
        "at the stated times the tool of 'beta' has its feed on 94% of its way in process, and goes down to 50%",
    ]
    assert said(slower, slower, feeds=(None, None)) == []


@pytest.mark.parametrize(("bend", "holds"), [(0.2, True), (0.6, False)])
def test_chords_of_a_circle_count_as_its_arc_while_they_are_short(bend: float, holds: bool) -> None:
    """A chord over an angle is sin(a/2)/(a/2) of its arc: 0.17 % less at 0.2 rad, 1.5 % at 0.6 rad."""
    chord = FEED * np.sin(0.5 * bend) / (0.5 * bend)

    (text,) = said(np.full(STEPS, chord), np.full(STEPS, chord), feeds=(FEED, None))

    assert ("holds for" in text) is holds
