"""Robots that come with the program, as joint-axis tables."""

from functools import lru_cache
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.files import AllowedFolders
from cellplan.files.input.findings import did_you_mean, shown
from cellplan.files.robots.joint_table import RobotTable, load_robot_table
from cellplan.model.robot.robot import RobotModel

FOLDER: Final = Path(__file__).resolve().parents[2] / "robots"


def bundled_names() -> tuple[str, ...]:
    """Names of all bundled robots, in alphabetical order."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_bundled(name: str) -> RobotModel:
    """A bundled robot; ``InputError`` where there is none of that name."""
    return load_bundled_table(name).model


@lru_cache(maxsize=16)
def load_bundled_table(name: str) -> RobotTable:
    """A bundled robot with the digest of its table; read once in each process."""
    names = bundled_names()
    if name not in names:
        hint = did_you_mean(name, names)
        raise InputError(
            "expected a bundled robot (`cellplan robots` lists them) or a .urdf, .xacro or .yaml file, got "
            f"{shown(name)}{hint}"
        )
    return load_robot_table(FOLDER / f"{name}.yaml", file=f"bundled:{name}", folders=AllowedFolders(folder=FOLDER))
