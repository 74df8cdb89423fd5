"""Who is idle in a run, and what is said of the moves that the run leaves out."""

from dataclasses import replace

import numpy as np
from builders.scene_builders import held_part, make_cell, placed, slide_model, work

from cellplan.geometry.shapes import Box
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.idle import idle_robots, not_in_program

BLOCK = Box((0.1, 0.1, 0.1))


def cell() -> Cell:
    """A holder, two operators with a task each, and a robot without one."""
    names = ("holder", "one", "two", "parked")
    robots = [placed(name, slide_model(BLOCK)) for name in names]
    part = held_part(BLOCK, "holder", np.eye(4))
    return make_cell(*robots, part=part, tasks=(work("one"), work("two")))


def test_idle_is_who_neither_holds_the_part_nor_works() -> None:
    assert idle_robots(cell(), ["work_of_one", "work_of_two"]) == ("parked",)
    assert idle_robots(cell(), ["work_of_two"]) == ("one", "parked")


def test_moves_are_missing_of_robots_that_work_in_another_run() -> None:
    assert not_in_program(cell(), ["work_of_two"]) == (
        "idle in this run: one stands at its home; moves to and from home are not part of the program"
    )
    assert not_in_program(cell(), []) == (
        "idle in this run: one, two stand at their homes; moves to and from home are not part of the program"
    )


def test_nothing_is_missing_of_a_robot_that_never_works() -> None:
    assert not_in_program(cell(), ["work_of_one", "work_of_two"]) == ""
    assert not_in_program(replace(cell(), tasks=()), []) == ""
