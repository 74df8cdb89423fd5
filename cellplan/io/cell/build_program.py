"""Order of tasks and marks of the robots of a program, and the program as plain values."""

from typing import Any

from cellplan.io.schema import CellDocument


def build_order(robot: str, document: CellDocument) -> tuple[str, ...]:
    """Tasks and marks of a robot in their order; none in a cell without a program."""
    if document.program is None:
        return ()
    order = document.robots[robot].order
    return tuple(name for name, task in document.tasks.items() if task.robot == robot) if order is None else order


def written_program(document: CellDocument) -> dict[str, Any]:
    """The program as plain values, its marks with their dwells; nothing when the cell has none."""
    if document.program is None:
        return {}
    values = document.program.model_dump(exclude_none=True)
    return {"program": {**values, "marks": tuple(mark.model_dump() for mark in document.program.all_marks)}}
