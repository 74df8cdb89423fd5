"""Robot from a URDF: joint axes and link bodies at the zero configuration, with nothing of the file lost."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from cellplan.errors import CellplanError, InvalidFileError
from cellplan.files.input.files import AllowedFolders
from cellplan.files.robots.limits import StatedLimits, rates_of
from cellplan.files.robots.urdf.bodies import MeshShelf, link_bodies
from cellplan.files.robots.urdf.document.document import UrdfDocument, UrdfJoint, read_document
from cellplan.files.robots.urdf.document.packages import Packages
from cellplan.files.robots.urdf.document.xacro import XacroSettings
from cellplan.files.robots.urdf.drawings import small_bodies
from cellplan.files.robots.urdf.flange import choose_flange, flange_remarks
from cellplan.files.robots.urdf.gripper import GripperState, gripper_locks, require_opposed
from cellplan.files.robots.urdf.inertials import DYNAMIC, urdf_inertias, with_efforts
from cellplan.files.robots.urdf.limits import joint_range, missing_error, missing_limits
from cellplan.files.robots.urdf.locks import require_sound_locks, rest_position, unlocked_error, unlocked_joints
from cellplan.files.robots.urdf.moveit_limits import MoveitLimits, with_moveit_limits
from cellplan.files.robots.urdf.tree import (
    Roles,
    UrdfTree,
    ZeroConfiguration,
    assign_roles,
    build_tree,
    known_joint,
    links_in_order,
    zero_configuration,
)
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import Body, FollowerJoint, Joint, JointKind, Link, RobotModel

PLAIN_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,59}")


@dataclass(frozen=True, slots=True, kw_only=True)
class UrdfOptions:
    """What a cell adds to a URDF."""

    flange: str | None = None  # its link; None for the usual one (``tool0``, ``flange``, the only moving leaf)
    package_dirs: tuple[Path, ...] = ()  # folders in which ``package://`` names are looked up
    limits: Mapping[str, StatedLimits] = field(default_factory=dict)  # by joint; they tighten or supply the URDF's
    locked: Mapping[str, float] = field(default_factory=dict)  # position in [rad] or [m] of joints at rest, by name
    locks_others: bool = False  # whether all others that do not lead to the flange are held at their `rest_position`
    lock_units: Mapping[str, str] = field(default_factory=dict)  # ``deg`` or ``mm``, by name, as positions were written
    within: AllowedFolders | None = None  # folders that its meshes and included files must lie in; None for all
    moveit: MoveitLimits | None = None  # limits that MoveIt states
    xacro_args: Mapping[str, str] = field(default_factory=dict)  # values of the arguments of a xacro file, by name
    xacro_elsewhere: frozenset[str] = frozenset()  # names of those that another file of the robot takes
    inertias: bool = False  # whether its inertias are taken, and its efforts as largest torques
    gripper: GripperState | None = None  # how far its gripper is open; None to leave its joints to ``locked``

    @property
    def xacro(self) -> XacroSettings:
        """What a xacro file needs to be expanded."""
        return XacroSettings(
            arguments=self.xacro_args,
            package_dirs=self.package_dirs,
            within=self.within,
            elsewhere=self.xacro_elsewhere,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfRobot:
    """A robot model, and what it was read from."""

    model: RobotModel
    mesh_files: tuple[Path, ...]  # mesh files, each once
    included: tuple[Path, ...] = ()  # files that a xacro file includes, each once
    remarks: tuple[str, ...] = ()  # what was not read, one line for each kind


def read_urdf(path: Path, options: UrdfOptions | None = None) -> RobotModel:
    """Robot model of a URDF; see `load_urdf`."""
    return load_urdf(path, options).model


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UrdfStructure:
    """What each joint of a URDF does for one flange, before its limits and bodies are read."""

    tree: UrdfTree  # links and joints
    flange: str  # name of the flange link
    unlocked: tuple[UrdfJoint, ...]  # movable joints off the chain that are not locked by name, at rest
    roles: Roles  # what each joint does
    configuration: ZeroConfiguration  # poses of all links while every driven joint reads zero


def load_urdf(path: Path, options: UrdfOptions | None = None) -> UrdfRobot:
    """Read a URDF and its collision meshes.

    The root link is the base frame B. Joints between base and flange are driven; mimic joints follow them; every other
    movable joint must be locked. A link without collision elements is represented by its visual ones.

    Args:
        options: What the cell adds; None adds nothing.

    Raises:
        InputError: With file and line, for anything that cannot be taken over faithfully.
    """
    options = options or UrdfOptions()
    document = read_document(path, options.xacro, used=DYNAMIC if options.inertias else ())
    document = with_moveit_limits(with_efforts(document) if options.inertias else document, options.moveit)
    tree = build_tree(document)
    flange = choose_flange(tree, options.flange)
    held = gripper_locks(tree, flange, options.gripper, options.locked)
    structure = urdf_structure(tree, flange, replace(options, locked={**options.locked, **held}))
    roles = structure.roles
    _require_plain_names(roles)
    _require_known_limits(document, roles, options.limits)
    missing = missing_limits(roles.driven, options.limits)
    errors = [missing_error(missing)] if missing else []
    if structure.unlocked and not options.locks_others:
        errors.insert(0, unlocked_error(tree, structure.flange, structure.unlocked, options.locked))
    if errors:
        raise errors[0] if len(errors) == 1 else InvalidFileError(errors)
    shelf = MeshShelf(Packages(folder=path.parent, package_dirs=options.package_dirs, within=options.within))
    bodies = link_bodies(tree, structure.configuration, shelf)
    model = urdf_model(structure, bodies, limits=options.limits, source=path.name)
    if options.inertias:
        model = replace(model, inertias=urdf_inertias(tree, structure.configuration), inertia_source=path.name)
    require_opposed(tree, options.gripper, locks=held, configuration=structure.configuration, bodies=model.bodies)
    return UrdfRobot(
        model=model,
        mesh_files=tuple(shelf.files),
        included=document.included,
        remarks=(
            *flange_remarks(tree, flange, is_named=options.flange is not None),
            *document.remarks,
            *shelf.remarks.lines,
            *small_bodies(tree, structure.configuration, bodies, flange=flange, shelf=shelf),
        ),
    )


def urdf_structure(tree: UrdfTree, flange: str, options: UrdfOptions) -> UrdfStructure:
    """What each joint does, with every unlocked joint at rest; locks and mimics must be sound, one joint driven."""
    require_sound_locks(tree.document, options.locked, options.lock_units)
    unlocked = unlocked_joints(tree, flange, options.locked)
    held = {**{joint.name: rest_position(joint) for joint in unlocked}, **options.locked}
    roles = assign_roles(tree, flange, held)
    return UrdfStructure(
        tree=tree, flange=flange, unlocked=unlocked, roles=roles, configuration=zero_configuration(tree, roles)
    )


def urdf_model(
    structure: UrdfStructure, bodies: tuple[Body, ...], *, limits: Mapping[str, StatedLimits], source: str
) -> RobotModel:
    """The robot model; its limits must be there and sound."""
    document, roles, configuration = structure.tree.document, structure.roles, structure.configuration
    model = RobotModel(
        name=document.name,
        source=source,
        joints=tuple(_driven(joint, roles, configuration, limits=limits) for joint in roles.driven),
        followers=tuple(_follower(joint, roles, configuration) for joint in roles.followers),
        flange_link=configuration.carrier[structure.flange],
        X_BF=configuration.X_BL[structure.flange],
        bodies=bodies,
        links=tuple(
            Link(name=link.name, index=configuration.carrier[link.name], X_BL=configuration.X_BL[link.name])
            for link in links_in_order(structure.tree)
        ),
    )
    _require_complete(document, roles, model)
    return model


def _require_plain_names(roles: Roles) -> None:
    """Joints that are driven head columns of tables and are keys of cells."""
    for joint in roles.driven:
        if not PLAIN_NAME.fullmatch(joint.name):
            raise joint.error("is driven: expected a name of 1 to 60 letters, digits, '_', '-' or '.', got another one")


def _require_known_limits(document: UrdfDocument, roles: Roles, limits: Mapping[str, StatedLimits]) -> None:
    """Limits make sense only for joints that are driven."""
    driven = {joint.name for joint in roles.driven}
    for name in limits:
        joint = known_joint(document, name, "limits")
        if name not in driven:
            reason = "is fixed" if joint.is_fixed else "follows another joint" if joint.mimic else "is locked"
            raise joint.error(f"has limits in the cell, but it {reason}")


def _driven(
    joint: UrdfJoint, roles: Roles, configuration: ZeroConfiguration, *, limits: Mapping[str, StatedLimits]
) -> Joint:
    """A driven joint with its axis in B."""
    followers = [other for other in roles.followers if other.mimic and other.mimic.leader == joint.name]
    stated = limits.get(joint.name, StatedLimits())
    axis_B, point_B = _axis_in_base(joint, configuration)
    return Joint(
        name=joint.name,
        kind=_kind(joint),
        parent=configuration.carrier[joint.parent],
        axis_B=axis_B,
        point_B=point_B,
        rated_velocity=None if stated.velocity is None else joint.limit.stated.velocity,
        **rates_of(joint_range(joint, stated, followers)),
    )


def _follower(joint: UrdfJoint, roles: Roles, configuration: ZeroConfiguration) -> FollowerJoint:
    """A joint that a driven one moves, with its axis in B."""
    axis_B, point_B = _axis_in_base(joint, configuration)
    leader = next(i for i, other in enumerate(roles.driven) if joint.mimic and other.name == joint.mimic.leader)
    return FollowerJoint(
        name=joint.name,
        kind=_kind(joint),
        parent=configuration.carrier[joint.parent],
        axis_B=axis_B,
        point_B=point_B,
        leader=leader,
        ratio=joint.mimic.multiplier if joint.mimic else 0.0,
        offset=0.0,  # the zero configuration has it
    )


def _axis_in_base(joint: UrdfJoint, configuration: ZeroConfiguration) -> tuple[Array, Array]:
    """Unit axis and a point on it in B."""
    X_BJ = configuration.X_BJ[joint.name]
    return X_BJ[:3, :3] @ joint.axis_J, X_BJ[:3, 3]


def _kind(joint: UrdfJoint) -> JointKind:
    return JointKind.PRISMATIC if joint.kind == "prismatic" else JointKind.REVOLUTE


def _require_complete(document: UrdfDocument, roles: Roles, model: RobotModel) -> None:
    """Compare what was read with what came out, once more."""
    joints = len(model.joints) + len(model.followers) + len(roles.still)
    solids = sum(len(link.solids) for link in document.links.values())
    if joints != len(document.joints) or solids != len(model.bodies):
        raise CellplanError(
            f"{document.file}: read {len(document.joints)} joints and {solids} bodies, but took over {joints} "
            f"and {len(model.bodies)}"
        )
