"""Colours of robots: none twice, all dark enough on white."""

from dataclasses import replace
from typing import Any

from cellplan.report.plots.palette import ROBOTS, robot_colours

READABLE = 3.0  # [-] contrast that WCAG 2 asks of graphical objects


def luminance(colour: str) -> float:
    shares = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [s / 12.92 if s <= 0.03928 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_sixty_four_robots_have_colours_of_their_own_that_are_dark_on_white(passed_run: Any) -> None:
    robot = passed_run.cell.robots[0]
    cell = replace(passed_run.cell, robots=tuple(replace(robot, name=f"r{k}") for k in range(64)))

    colours = list(robot_colours(cell).values())

    assert colours[: len(ROBOTS)] == list(ROBOTS)
    assert len(set(colours)) == 64
    assert min(1.05 / (luminance(colour) + 0.05) for colour in colours) >= READABLE
