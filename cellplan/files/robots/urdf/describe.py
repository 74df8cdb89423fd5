"""What a URDF says before a cell adds anything: possible flanges, joints, what is missing, bodies and their size."""

import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from textwrap import indent
from typing import Final

from cellplan.errors import InputError
from cellplan.files.robots.urdf.bodies import MeshShelf, link_bodies
from cellplan.files.robots.urdf.document.document import read_document
from cellplan.files.robots.urdf.document.packages import Packages
from cellplan.files.robots.urdf.drawings import edges_of_box, small_bodies
from cellplan.files.robots.urdf.flange import axis_along, choose_flange, flange_remarks, is_along, last_joint
from cellplan.files.robots.urdf.limits import MissingLimits, limits_to_state, missing_limits, with_blanks
from cellplan.files.robots.urdf.load import UrdfOptions, UrdfStructure, urdf_model, urdf_structure
from cellplan.files.robots.urdf.locks import lock_positions
from cellplan.files.robots.urdf.tree import UrdfTree, build_tree, joints_to, links_in_order, moving_leaves
from cellplan.files.schema.robot import OTHERS
from cellplan.files.yaml.writer import flow_text, yaml_text
from cellplan.geometry.transforms import Array, inverse
from cellplan.model.robot.robot import Body, RobotModel
from cellplan.model.robot.robot_description import (
    DescribedJoint,
    DescribedMimic,
    FlangeChoice,
    LinkSize,
    RobotDescription,
)

TOOL_SIDE: Final = re.compile(r"(^|[^a-z0-9])(tool\d*|flange|tcp|eef?|end_?effector)($|[^a-z0-9])", re.IGNORECASE)
NAMED_LOCKS: Final = 12  # more locked joints than these are locked together
BEYOND_NAME: Final = re.compile(r"[^A-Za-z0-9_-]+")
LONGEST_NAME: Final = 40  # characters of the name of a robot in a cell


def describe_urdf(path: Path, written: str, options: UrdfOptions) -> RobotDescription:
    """What a URDF says for one flange: the named one, the usual one, or the one behind the most joints.

    It has a name for lines of a cell. Missing limits and locks are no ``InputError``.
    """
    tree = build_tree(read_document(path, options.xacro))
    choices = tuple(_choices(tree))
    flange, is_usual = _flange(tree, choices, options.flange)
    structure = urdf_structure(tree, flange, options)
    shelf = MeshShelf(Packages(folder=path.parent, package_dirs=options.package_dirs))
    bodies = link_bodies(tree, structure.configuration, shelf)
    missing = missing_limits(structure.roles.driven, {})
    model = None if missing else urdf_model(structure, bodies, limits={}, source=path.name)
    return RobotDescription(
        name=tree.document.name,
        source=path.name,
        base=tree.root,
        flange=flange,
        is_usual=is_usual,
        flanges=choices,
        X_BF=structure.configuration.X_BL[flange],
        joints=tuple(_joints(structure, missing, model)),
        mimics=tuple(_mimics(tree)),
        locked=lock_positions(structure.unlocked, {}),
        links=tuple(_links(structure, bodies)),
        cell_lines=_cell_lines(structure, missing, written=written, options=options),
        model=model,
        remarks=(
            *flange_remarks(tree, flange, is_named=not is_usual or options.flange is not None),
            *tree.document.remarks,
            *shelf.remarks.lines,
            *small_bodies(tree, structure.configuration, bodies, flange=flange, shelf=shelf),
            *_elsewhere(path, tree, shelf),
        ),
    )


def size_along(bodies: tuple[Body, ...], X_BL: Array) -> Array:
    """Edges of the box along the axes of a frame L that holds at least one body, in [m], shape (3,).

    ``X_BL`` is the pose of L in the base while all joints read zero.
    """
    X_LB = inverse(X_BL)
    return edges_of_box([(body.shape, X_LB @ body.X_BS) for body in bodies])


def cell_lines(name: str, entry: Mapping[str, object]) -> str:
    """A robot as it stands in a cell, one key to a line."""
    return f"robots:\n  {flow_text(name)}:\n{indent(yaml_text(entry), '    ')}"


def _elsewhere(path: Path, tree: UrdfTree, shelf: MeshShelf) -> Iterator[str]:
    """What a cell in the current folder needs to read files that lie elsewhere."""
    folders = [*shelf.packages.package_dirs, *(file.parent for file in (path, *tree.document.included, *shelf.files))]
    outside = [folder.resolve() for folder in folders if not folder.resolve().is_relative_to(Path.cwd())]
    for drive in dict.fromkeys(folder.anchor for folder in outside):
        shared = os.path.commonpath([folder for folder in outside if folder.anchor == drive])
        yield f"lies elsewhere: a cell in this folder reads it with --allow-dir {shared}"


def _choices(tree: UrdfTree) -> Iterator[FlangeChoice]:
    """Last links and links with the name of a flange, as far as a joint moves them, in the order of the file."""
    leaves = moving_leaves(tree)
    for link in links_in_order(tree):
        chain = [joint for joint in tree.path_to(link.name) if not joint.is_fixed]
        if not chain or (link.name not in leaves and not TOOL_SIDE.search(link.name)):
            continue
        yield FlangeChoice(
            link=link.name,
            joints=tuple(joint.name for joint in joints_to(tree, link.name)),
            note=_axis_note(tree, link.name),
        )


def _axis_note(tree: UrdfTree, link: str) -> str:
    """Which axis of a link lies along the last axis, where it is not z and the last joint turns."""
    last, axis = last_joint(tree, link), axis_along(tree, link)
    if last is None or last.kind == "prismatic" or axis == "z":
        return ""
    return f"{axis or 'none of x, y, z'} along the axis of {last.name}"


def _flange(tree: UrdfTree, choices: tuple[FlangeChoice, ...], desired: str | None) -> tuple[str, bool]:
    """The flange to be described, and whether it is the usual one."""
    try:
        return choose_flange(tree, desired), desired is None
    except InputError:
        if desired is not None or not choices:
            raise
        return max(
            choices,
            key=lambda it: (
                bool(TOOL_SIDE.search(it.link)) and is_along(tree, it.link),
                not any(joint.mimic for joint in tree.path_to(it.link)),  # fingers follow one another, arms seldom
                is_along(tree, it.link),
                bool(TOOL_SIDE.search(it.link)),
                len(it.joints),
            ),
        ).link, False


def _joints(
    structure: UrdfStructure, missing: tuple[MissingLimits, ...], model: RobotModel | None
) -> Iterator[DescribedJoint]:
    """The driven joints, with the limits of those that follow them where none is missing."""
    without = {entry.joint.name: entry for entry in missing}
    complete = {} if model is None else {joint.name: joint for joint in model.joints}
    for joint in structure.roles.driven:
        limits, gap = complete.get(joint.name, joint.limit), without.get(joint.name)
        yield DescribedJoint(
            name=joint.name,
            kind=joint.kind,
            lower=limits.lower,
            upper=limits.upper,
            velocity=limits.velocity,
            missing=() if gap is None else gap.keys,
            reason="" if gap is None else gap.reason,
        )


def _mimics(tree: UrdfTree) -> Iterator[DescribedMimic]:
    """All joints that follow others."""
    for joint in tree.joints:
        if joint.mimic is not None:
            mimic = joint.mimic
            yield DescribedMimic(
                name=joint.name,
                leader=mimic.leader,
                ratio=mimic.multiplier,
                offset=mimic.offset,
                is_revolute=joint.kind != "prismatic",
            )


def _links(structure: UrdfStructure, bodies: tuple[Body, ...]) -> Iterator[LinkSize]:
    """The links that have bodies; these come in the order of links and of their elements."""
    first = 0
    for link in links_in_order(structure.tree):
        solids = bodies[first : first + len(link.solids)]
        first += len(solids)
        if solids:
            shapes = tuple(type(body.shape).__name__.lower() for body in solids)
            X_BL = structure.configuration.X_BL[link.name]
            yield LinkSize(link=link.name, shapes=shapes, size=size_along(solids, X_BL))


def _cell_lines(
    structure: UrdfStructure, missing: tuple[MissingLimits, ...], *, written: str, options: UrdfOptions
) -> str:
    """The robot as a cell states it, with … for every value that the file lacks."""
    entry: dict[str, object] = {"model": written}
    if options.package_dirs:
        entry["package_dirs"] = [folder.as_posix() for folder in options.package_dirs]
    if options.xacro_args:
        entry["xacro_args"] = options.xacro_args
    entry["flange"] = structure.flange
    if structure.unlocked:
        are_few = len(structure.unlocked) <= NAMED_LOCKS
        entry["locked"] = lock_positions(structure.unlocked, {}) if are_few else {OTHERS: "zero"}
    if missing:
        entry["limits"] = limits_to_state(missing)
    name = BEYOND_NAME.sub("_", structure.tree.document.name)[:LONGEST_NAME]
    return with_blanks(cell_lines(name, entry))
