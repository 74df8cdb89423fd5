"""Robot files before they stand in a cell: what a URDF, a joint-axis table or a bundled robot says."""

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

import numpy as np

from cellplan.cache import as_here
from cellplan.errors import InputError
from cellplan.files.cell.referenced_files import TABLE_SUFFIXES, URDF_SUFFIXES
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.joint_table import load_bundled, load_robot_table
from cellplan.files.robots.urdf.describe import cell_lines, describe_urdf, size_along
from cellplan.files.robots.urdf.load import UrdfOptions
from cellplan.guard import Guard, in_child
from cellplan.model.robot.robot import RobotModel
from cellplan.model.robot.robot_description import DescribedJoint, LinkSize, RobotDescription


def describe_robot(
    written: str,
    *,
    flange: str | None = None,
    package_dirs: Sequence[Path] = (),
    xacro_args: Mapping[str, str] | None = None,
) -> RobotDescription:
    """What a robot's file says, and what a cell has to add.

    Args:
        written: Name of a bundled robot, or path of a URDF or of a joint-axis table.
        flange: Link of a URDF taken as the flange; None for the usual one.
        package_dirs: Folders in which ``package://`` names of a URDF are looked up.
        xacro_args: Values of the arguments of a xacro file, by name; None for its defaults.

    Raises:
        InputError: The file cannot be read, or an option does not apply to it.
    """
    suffix, path = PurePosixPath(written).suffix.lower(), Path(written)
    if suffix in URDF_SUFFIXES | TABLE_SUFFIXES and not path.is_file():
        raise InputError(f"{written}: expected an existing file, got none")
    if suffix in URDF_SUFFIXES:
        options = UrdfOptions(flange=flange, package_dirs=tuple(package_dirs), xacro_args=dict(xacro_args or {}))
        guard = Guard(file=written, worker="the URDF reader")
        return in_child(as_here(describe_urdf), path, path.as_posix(), options, guard=guard)
    if flange is not None or package_dirs or xacro_args:
        raise InputError(f"{written}: expected --flange, --package-dir and --xacro-arg with a URDF only")
    if suffix not in TABLE_SUFFIXES:
        return _described(load_bundled(written), written)
    return _described(load_robot_table(path, file=written, folders=AllowedFolders(folder=path.parent)).model, written)


def _described(model: RobotModel, written: str) -> RobotDescription:
    """The robot of a joint-axis table, which lacks nothing; its links are measured along the axes of the base."""
    return RobotDescription(
        name=model.name,
        source=model.source,
        X_BF=model.X_BF,
        joints=tuple(
            DescribedJoint(
                name=joint.name, kind=str(joint.kind), lower=joint.lower, upper=joint.upper, velocity=joint.velocity
            )
            for joint in model.joints
        ),
        links=tuple(_links(model)),
        cell_lines=cell_lines(Path(written).stem, {"model": written}),
        model=model,
    )


def _links(model: RobotModel) -> list[LinkSize]:
    """The links that have bodies."""
    links = []
    for link in model.links:
        bodies = tuple(body for body in model.bodies if body.link == link.index)
        if bodies:
            shapes = tuple(type(body.shape).__name__.lower() for body in bodies)
            links.append(LinkSize(link=link.name, shapes=shapes, size=size_along(bodies, np.eye(4))))
    return links
