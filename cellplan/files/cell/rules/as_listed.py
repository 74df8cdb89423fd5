"""Names of robots as a cell file lists them, also in entries that are wrong in other ways."""

from collections.abc import Iterator

from cellplan.files.input.findings import KeyPath
from cellplan.files.yaml.reader import YamlDocument


def holders_as_written(document: YamlDocument) -> Iterator[tuple[KeyPath, str]]:
    """Robots that hold the part, also of a part that is wrong in other ways."""
    part = document.root.get("part")
    grasps = part.get("held_by") if isinstance(part, dict) else None
    for index, grasp in enumerate(grasps if isinstance(grasps, tuple) else ()):
        robot = grasp.get("robot") if isinstance(grasp, dict) else None
        if isinstance(robot, str):
            yield ("part", "held_by", index, "robot"), robot


def operators_as_written(document: YamlDocument) -> Iterator[tuple[str, KeyPath, str]]:
    """Robots of the tasks, also of tasks that are wrong in other ways."""
    tasks = document.root.get("tasks")
    for name, task in tasks.items() if isinstance(tasks, dict) else ():
        robot = task.get("robot") if isinstance(task, dict) else None
        if isinstance(robot, str):
            yield name, ("tasks", name, "robot"), robot
