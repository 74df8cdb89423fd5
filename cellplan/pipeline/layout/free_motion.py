"""What is free in a motion whose bases and tools stay as they are, as keys of ``layout.vary``."""

from collections.abc import Iterable
from typing import Final

from cellplan.errors import InputError
from cellplan.io.input.findings import did_you_mean, listed, shown
from cellplan.model.cell import Cell

FREE: Final = ("start", "weights", "path", "spin")


def freed(cell: Cell, words: Iterable[str]) -> dict[str, object]:
    """Keys of ``layout.vary``, without ``robots.``, for what is named.

    Args:
        words: ``start``: the start posture of the positioner; ``weights``: of all joints; ``path``: the joint path
            of the positioner; ``spin``: how the tools are turned about their own axes.

    Raises:
        InputError: A word is none of these, or the cell has no positioner where one is needed.
    """
    vary = dict[str, object]()
    for word in words:
        match word:
            case "start" | "path" if cell.carrier is None:
                where = cell.origin.at("part.held_by")
                raise InputError(f"{where}: expected a robot that holds the part, for --free {word}")
            case "start":
                robot = cell.robot(cell.positioners[0])
                is_turning = all(joint.is_revolute for joint in robot.model.joints)
                vary[f"{robot.name}.start_deg" if is_turning else f"{robot.name}.start"] = True
            case "weights":
                vary |= {f"{robot.name}.weights": True for robot in cell.robots}
            case "path":
                vary[f"{cell.positioners[0]}.path"] = True
            case "spin":
                vary |= {f"tasks.{task.name}.spin_deg": True for task in cell.tasks}
            case _:
                hint = did_you_mean(word, FREE)
                raise InputError(f"--free: expected some of {listed(FREE)}, got {shown(word)}{hint}")
    return vary
