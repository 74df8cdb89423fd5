"""Sequences: the tasks and marks of a robot in their order."""

from collections.abc import Collection, Iterator, Mapping, Sequence

from cellplan.model.cell.cell import Cell


def sequence_of(cell: Cell, robot: str) -> tuple[str, ...]:
    """Tasks and marks of a robot in their order: that of the cell's tasks when the robot states none."""
    return cell.robot(robot).order or tuple(task.name for task in cell.tasks if task.robot == robot)


def order_faults(
    robot: str, order: Sequence[str], operators: Mapping[str, str], marks: Collection[str]
) -> Iterator[tuple[int | None, str]]:
    """Everything that is wrong with the order of a robot: the index in it, None for the whole, and what is wrong.

    ``operators`` has the robot of every task of the cell, by task.
    """
    robot_tasks = [task for task, operator in operators.items() if operator == robot]
    known = ", ".join([*robot_tasks, *marks]) or "none"
    for index, name in enumerate(order):
        if name in order[:index]:
            yield index, f"expected each name once, got '{name}' twice"
        elif name in operators and operators[name] != robot:
            yield (
                index,
                f"expected a task of '{robot}' or a mark ({known}), got '{name}', a task of '{operators[name]}'",
            )
        elif name not in operators and name not in marks:
            yield index, f"expected a task of '{robot}' or a mark ({known}), got '{name}'"
    for name in robot_tasks:
        if name not in order:
            yield None, f"expected every task of '{robot}', got none of the name '{name}': add it"
