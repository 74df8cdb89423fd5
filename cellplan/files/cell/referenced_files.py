"""Files that a cell names: robots, meshes and toolpaths, each read once and known by its digest."""

import os
import posixpath
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from cellplan.cache import as_here
from cellplan.errors import InputError
from cellplan.files.cell.paths.apt import read_apt
from cellplan.files.cell.paths.csv_table import read_toolpath_csv
from cellplan.files.cell.paths.gcode import read_gcode
from cellplan.files.cell.paths.settings import CamSettings
from cellplan.files.input.files import AllowedFolders, digest_of_file
from cellplan.files.input.findings import Finding, KeyPath, key_text, shown
from cellplan.files.robots.build_controller import with_zero_of_file
from cellplan.files.robots.joint_table import RobotTable, load_bundled_table, load_robot_table
from cellplan.files.robots.rules import limits_in_si, tightened
from cellplan.files.robots.urdf import XACRO_SUFFIX
from cellplan.files.schema.path import CsvEntry, PathShapeEntry
from cellplan.files.schema.programmed import CamEntry, GcodeEntry
from cellplan.files.schema.robot import RobotEntry
from cellplan.files.schema.tool import GripperEntry
from cellplan.files.yaml.reader import YamlDocument
from cellplan.geometry.mesh.load import read_drawing
from cellplan.geometry.shapes import Mesh
from cellplan.guard import Guard, in_child
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.units import Deg, si_or_none
from cellplan.model.task.task import SampledPath, TimedPath

if TYPE_CHECKING:  # read only for a cell that names such a file
    from cellplan.files.robots.urdf.gripper import GripperState
    from cellplan.files.robots.urdf.load import UrdfOptions, UrdfRobot
    from cellplan.files.robots.urdf.srdf import Srdf

Urdfs = dict[Hashable, "UrdfRobot"]  # by what was read of which file
URDF_SUFFIXES = frozenset({".urdf", XACRO_SUFFIX})
TABLE_SUFFIXES = frozenset({".yaml", ".yml"})


class Sources:
    """Reads what a cell names and gathers what is wrong with it."""

    def __init__(self, document: YamlDocument, folders: AllowedFolders, urdfs: Urdfs) -> None:
        """Keep the folders, the document that findings refer to, and robots of URDFs as they were read."""
        self.document = document
        self._folders = folders
        self._meshes: dict[tuple[str, str | None], Mesh | None] = {}
        self._urdfs = urdfs
        self.inputs: dict[str, str] = {}  # SHA-256 of every file that was read, by the path as written
        self.findings: list[Finding] = []  # about the names in the cell file
        self.errors: list[InputError] = []  # about the files themselves
        self.remarks: list[tuple[str, str]] = []  # key of the cell file, and what was not read of its file

    def mesh(
        self, written: str, unit: str | None, path: KeyPath, *, requirement: Callable[[Mesh], None] | None = None
    ) -> Mesh | None:
        """Mesh in [m] that meets a requirement, which raises an input error otherwise; None after a finding."""
        if (written, unit) not in self._meshes:
            self._meshes[written, unit] = self._read_mesh(written, unit, path)
        mesh = self._meshes[written, unit]
        try:
            if mesh is not None and requirement is not None:
                requirement(mesh)
        except InputError as error:
            self.findings.append(self.document.finding(path, str(error)))
            return None
        return mesh

    def targets(self, entry: PathShapeEntry, path: KeyPath) -> SampledPath | TimedPath | None:
        """Tool targets of a task from the file of its path; None after a finding."""
        key = entry.file_key or ""
        written = getattr(entry, key)
        kinds: dict[str, type[CsvEntry | CamEntry]] = {"csv": CsvEntry, "apt": CamEntry, "gcode": GcodeEntry}
        settings = kinds[key](file=written) if isinstance(written, str) else written
        place = self.file(settings.file, (*path, key) if isinstance(written, str) else (*path, key, "file"))
        if place is None:
            return None
        try:
            sampled: SampledPath | TimedPath
            if isinstance(settings, CamEntry):
                sampled, remark = (read_gcode if key == "gcode" else read_apt)(place, _cam_settings(settings))
                self.remarks += [(key_text((*path, key)), remark)] if remark else []
            else:
                sampled = _sampled(settings, place)
            self.inputs[settings.file] = digest_of_file(place, file=settings.file)
        except InputError as error:
            self.errors.append(error)
            return None
        return sampled

    def robot(self, name: str, entry: RobotEntry) -> RobotModel | None:
        """Model of a robot within the limits of the cell, its controller's zero included; None after a finding."""
        suffix = PurePosixPath(entry.model).suffix.lower()
        if suffix in URDF_SUFFIXES:
            model = self._urdf(name, entry)
        else:
            self.findings += _only_for_urdf(name, entry, self.document)
            model = self._table(name, entry, is_file=suffix in TABLE_SUFFIXES)
            if model is not None:
                model, findings = tightened(("robots", name), entry, model, self.document)
                self.findings += findings
                model = None if findings else model
        return model if model is None or entry.controller_zero is None else self._with_zero(name, entry, model)

    def look_for_model(self, name: str, written: str) -> None:
        """Note a model that does not exist, of a robot that is invalid for other reasons too."""
        path = ("robots", name, "model")
        if PurePosixPath(written).suffix.lower() in URDF_SUFFIXES | TABLE_SUFFIXES:
            self.file(written, path)
            return
        try:
            load_bundled_table(written)
        except InputError as error:
            self.findings.append(self.document.finding(path, str(error)))

    def srdf(self, name: str, written: str, entry: RobotEntry) -> "Srdf | None":
        """SRDF of a robot, expanded with its packages and arguments; None after a finding."""
        from cellplan.files.robots.urdf.document.xacro import XacroSettings
        from cellplan.files.robots.urdf.srdf import read_srdf

        path: KeyPath = ("robots", name, "srdf")
        place, folders = self.file(written, path), self._package_dirs(name, entry)
        if place is None or folders is None:
            return None
        arguments = _arguments(entry)
        settings = XacroSettings(
            arguments=arguments,
            package_dirs=folders,
            within=self._folders,
            elsewhere=frozenset(arguments) if _is_xacro(entry.model) else frozenset(),
        )
        try:
            srdf = in_child(read_srdf, place, settings, guard=Guard(file=written, worker="the SRDF reader"))
            self.inputs[written] = digest_of_file(place, file=written)
            self.remarks += [(key_text(path), remark) for remark in srdf.remarks]
            self.inputs |= _digests(written, place, srdf.included)
        except InputError as error:
            self.errors.append(error)
            return None
        return srdf

    def _with_zero(self, name: str, entry: RobotEntry, model: RobotModel) -> RobotModel | None:
        """The robot with the counting that a file beside it states, unless its own file does; None after a finding."""
        written, path = entry.controller_zero or "", ("robots", name, "controller_zero")
        if model.controller is not None:
            text = (
                f"unexpected key, the file of '{model.name}' states how its controller counts the joints: "
                "leave it out, it would be applied twice"
            )
            self.findings.append(self.document.key_finding(path, text))
            return None
        place = self.file(written, path)
        if place is None:
            return None
        try:
            model, self.inputs[written] = with_zero_of_file(model, place, file=str(place))
        except InputError as error:
            self.errors.append(error)
            return None
        return model

    def _read_mesh(self, written: str, unit: str | None, path: KeyPath) -> Mesh | None:
        """Mesh in [m]; None after a finding."""
        place = self.file(written, path)
        if place is None:
            return None
        try:
            guard = Guard(file=written, worker="the mesh reader")
            mesh = in_child(as_here(partial(read_drawing, unit=unit)), place, guard=guard)
            self.inputs[written] = digest_of_file(place, file=written)
        except InputError as error:
            self.findings.append(self.document.finding(path, str(error)))
            return None
        return mesh

    def file(self, written: str, path: KeyPath) -> Path | None:
        """Path of a named file; None after a finding."""
        try:
            return self._folders.file(written)
        except InputError as error:
            self.findings.append(self.document.finding(path, str(error)))
            return None

    def _table(self, name: str, entry: RobotEntry, *, is_file: bool) -> RobotModel | None:
        """Model from a joint-axis table, bundled or in a file."""
        path = ("robots", name, "model")
        table: RobotTable
        if not is_file:
            try:
                table = load_bundled_table(entry.model)
            except InputError as error:
                self.findings.append(self.document.finding(path, str(error)))
                return None
            self.inputs[f"bundled:{entry.model}"] = table.digest
            return table.model
        place = self.file(entry.model, path)
        if place is None:
            return None
        try:
            folders = AllowedFolders(folder=place.parent, allowed=(self._folders.folder, *self._folders.allowed))
            table = load_robot_table(place, file=str(place), folders=folders)
            self.inputs[entry.model] = table.digest
            for written, mesh in table.mesh_files.items():
                key = posixpath.join(posixpath.dirname(entry.model), written)
                self.inputs[key] = digest_of_file(mesh, file=written)
        except InputError as error:
            self.errors.append(error)
            return None
        return table.model

    def _urdf(self, name: str, entry: RobotEntry) -> RobotModel | None:
        path, limits = ("robots", name, "model"), entry.moveit_limits
        place, folders = self.file(entry.model, path), self._package_dirs(name, entry)
        moveit = None if limits is None else self.file(limits, ("robots", name, "moveit_limits"))
        if place is None or folders is None or (moveit is None and limits is not None):
            return None
        if entry.xacro_args and not (_is_xacro(entry.model) or _is_xacro(entry.srdf)):
            text = f"unexpected key, it applies to a file whose name ends in {XACRO_SUFFIX} only"
            self.findings.append(self.document.key_finding(("robots", name, "xacro_args"), text))
        try:
            options = _urdf_options(entry, folders, moveit, within=self._folders)
            self.inputs |= {} if moveit is None else {limits or "": digest_of_file(moveit, file=str(moveit))}
            robot = _read_urdf(self._urdfs, entry, place, options=options)
            self.inputs[entry.model] = digest_of_file(place, file=entry.model)
            self.remarks += [(key_text(path), remark) for remark in robot.remarks]
            for file in (*robot.included, *robot.mesh_files):
                if not self._folders.holds(file):
                    text = f"expected files below the folder of the cell file, got {shown(file.name)} from elsewhere"
                    self.findings.append(self.document.finding(path, f"{text}; allow it with --allow-dir"))
                    return None
            self.inputs |= _digests(entry.model, place, (*robot.included, *robot.mesh_files))
        except InputError as error:
            self.errors.append(error)
            return None
        return robot.model

    def _package_dirs(self, name: str, entry: RobotEntry) -> tuple[Path, ...] | None:
        """Folders for ``package://``; None after a finding."""
        folders: list[Path] = []
        for index, written in enumerate(entry.package_dirs):
            try:
                folders.append(self._folders.directory(written))
            except InputError as error:
                path = ("robots", name, "package_dirs", index)
                self.findings.append(self.document.finding(path, str(error)))
        return tuple(folders) if len(folders) == len(entry.package_dirs) else None


def _sampled(entry: CsvEntry, place: Path) -> SampledPath | TimedPath:
    """Tool targets of a table."""
    return read_toolpath_csv(
        place, is_smooth=entry.smooth, is_closed=entry.closed, source=entry.file, join=entry.join_mm.si
    )


def _cam_settings(entry: CamEntry) -> CamSettings:
    """What a cell adds to a file of CAM."""
    return CamSettings(
        source=entry.file,
        X_PF=entry.at.matrix,
        transfer=entry.transfer_mm_s.si,
        rounding=entry.rounding_mm.si,
        stop_angle=entry.stop_deg.si,
        chord=entry.chord_mm.si if isinstance(entry, GcodeEntry) else 0.0,
    )


def _only_for_urdf(name: str, entry: RobotEntry, document: YamlDocument) -> Iterator[Finding]:
    """Keys that say something about a URDF."""
    for key in ("package_dirs", "xacro_args", "flange", "locked", "srdf", "moveit_limits", "gripper"):
        if getattr(entry, key):
            yield document.key_finding(("robots", name, key), "unexpected key, it applies to a URDF only")
    if entry.inertias == "urdf":
        text = "expected masses of its links, got urdf, which applies to a URDF only"
        yield document.finding(("robots", name, "inertias"), text)


def _read_urdf(known: Urdfs, entry: RobotEntry, place: Path, *, options: "UrdfOptions") -> "UrdfRobot":
    """Robot of a URDF; robots that say the same of the same file share one."""
    from cellplan.files.robots.urdf.load import load_urdf

    locked = _items(options.locked), _items(options.lock_units), options.locks_others, options.gripper, options.inertias
    limits, arguments = (_items(options.limits), entry.moveit_limits), (_items(options.xacro_args), entry.srdf)
    key = (entry.model, place, options.flange, options.package_dirs, limits, locked, arguments)
    if key not in known:
        guard = Guard(file=entry.model, worker="the URDF reader")
        known[key] = in_child(as_here(load_urdf), place, options, guard=guard)
    return known[key]


def _urdf_options(
    entry: RobotEntry, package_dirs: tuple[Path, ...], moveit: Path | None, *, within: AllowedFolders
) -> "UrdfOptions":
    """What a cell adds to a URDF."""
    from cellplan.files.robots.urdf.document.xacro import argument_names
    from cellplan.files.robots.urdf.load import UrdfOptions
    from cellplan.files.robots.urdf.moveit_limits import read_moveit_limits

    rail = entry.mount.rail.name if entry.mount is not None and entry.mount.rail is not None else None
    srdf = within.folder / (entry.srdf or "")
    return UrdfOptions(
        flange=entry.flange,
        package_dirs=package_dirs,
        limits={joint: limits_in_si(limits) for joint, limits in entry.limits.items() if joint != rail},
        locked={joint: at.si for joint, at in entry.locked_joints.items()},
        lock_units={joint: "deg" if isinstance(at, Deg) else "mm" for joint, at in entry.locked_joints.items()},
        locks_others=entry.locks_others,
        within=within,
        moveit=None if moveit is None else read_moveit_limits(moveit, str(moveit)),
        xacro_args=_arguments(entry),
        xacro_elsewhere=argument_names(srdf) if _is_xacro(entry.srdf) and within.holds(srdf) else frozenset(),
        inertias=entry.inertias == "urdf",
        gripper=_gripper_state(entry.gripper),
    )


def _digests(written: str, place: Path, files: Iterable[Path]) -> dict[str, str]:
    """Digests of what a file reads in turn, by the paths from the cell."""
    digests = {}
    for file in files:
        relative = os.path.relpath(file.resolve(), place.parent.resolve()).replace(os.sep, "/")
        key = posixpath.normpath(posixpath.join(posixpath.dirname(written), relative))
        digests[key] = digest_of_file(file, file=file.name)
    return digests


def _is_xacro(written: str | None) -> bool:
    """Whether the name of a file is one of xacro."""
    return written is not None and PurePosixPath(written).suffix.lower() == XACRO_SUFFIX


def _arguments(entry: RobotEntry) -> dict[str, str]:
    """Values of the arguments of xacro files as their texts say them."""
    return {key: argument_text(value) for key, value in entry.xacro_args.items()}


def argument_text(value: str | float) -> str:
    """An argument of a xacro file as its text says it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def _gripper_state(entry: GripperEntry | None) -> "GripperState | None":
    """How far a gripper is open; None where the cell does not say it."""
    from cellplan.files.robots.urdf.gripper import GripperState

    if entry is None or (entry.opening_mm is None and entry.angle_deg is None):
        return None
    return GripperState(joints=entry.joints, opening=si_or_none(entry.opening_mm), angle=si_or_none(entry.angle_deg))


def _items(table: Mapping[str, Hashable]) -> Hashable:
    """What a table says, as part of a key."""
    return tuple(sorted(table.items(), key=lambda item: item[0]))
