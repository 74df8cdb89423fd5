"""What a record says of robots that have nothing to do, and of moves that the program leaves out."""

from collections.abc import Iterable, Mapping
from typing import Any

from cellplan.model.cell import Cell
from cellplan.model.idle import idle_robots, not_in_program


def idle_record(cell: Cell, tasks: Iterable[str]) -> dict[str, Any]:
    """Idle robots of one run, and what it leaves out.

    Args:
        cell: The cell.
        tasks: Names of the tasks that were worked on.
    """
    names = tuple(tasks)
    return {"idle": list(idle_robots(cell, names)), "not_in_program": missing_moves(cell, {None: names})}


def missing_moves(cell: Cell, runs: Mapping[str | None, Iterable[str]]) -> list[str]:
    """Lines on what the programs of several runs leave out, each with the name of its run.

    Args:
        cell: The cell.
        runs: Names of the tasks that were worked on, by the name of the run.
    """
    lines = {run: not_in_program(cell, tuple(tasks)) for run, tasks in runs.items()}
    return [f"{run}: {line}" if run else line for run, line in lines.items() if line]
