"""Names of a ROS 2 trajectory as its writer and its reader share them: files, joints, and how many decimals."""

from dataclasses import replace
from typing import Final

from cellplan.model.cell.cell import Robot

DECIMALS: Final = 9  # of a radian or metre, and of their speeds
SHORTEST: Final = 2  # points: MotoROS2 takes no fewer
ENDING: Final = ".yaml"


def file_name(robot: str, part: int, parts: int) -> str:
    """Name of the file of one part of a robot's trajectory; ``parts`` is 0 where it is not split."""
    return f"{robot}_{part}_of_{parts}{ENDING}" if parts else f"{robot}{ENDING}"


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Names of the joints of a robot, unique in the cell."""
    return tuple(f"{robot.name}/{joint.name}" for joint in robot.model.joints)


def quoted(name: str) -> str:
    """A name in double quotes, of printable ASCII characters, as YAML reads it."""
    letters = (letter if " " <= letter <= "~" and letter not in '"\\' else f"\\U{ord(letter):08x}" for letter in name)
    return '"' + "".join(letters) + '"'


def of_model(robot: Robot) -> Robot:
    """A robot whose positions count from the zero of its model."""
    return replace(robot, model=replace(robot.model, controller=None))
