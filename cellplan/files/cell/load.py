"""Loading of a cell file and of the files that it names; all findings at once."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

from cellplan.errors import InputError
from cellplan.files.cell.build.accelerations import acceleration_findings
from cellplan.files.cell.build.cell import (
    build_motion,
    build_obstacle,
    build_part,
    build_robot,
    build_task,
    resolved_document,
)
from cellplan.files.cell.build.controllers import control_findings
from cellplan.files.cell.build.grips import grip_findings, tool_names
from cellplan.files.cell.build.mounting import (
    accuracy_findings,
    mounted_names,
    mounting_findings,
    on_mount,
    rail_entries,
)
from cellplan.files.cell.build.path import is_woven_by_controller
from cellplan.files.cell.build.smoothed_path import narrow_tubes
from cellplan.files.cell.build.srdf import apply_srdfs
from cellplan.files.cell.changes import changed, plain_values
from cellplan.files.cell.expansion import is_of_entry, with_values
from cellplan.files.cell.face_rasters import raster_paths
from cellplan.files.cell.layout.build_layout import read_layout
from cellplan.files.cell.names import with_stated_names
from cellplan.files.cell.open_tasks import open_task_findings, open_tasks, unknown_robot_findings, with_first_robots
from cellplan.files.cell.outlines import outline_paths
from cellplan.files.cell.referenced_files import Sources, Urdfs
from cellplan.files.cell.rules.path_rules import path_findings
from cellplan.files.cell.rules.program_rules import posture_findings, program_findings, with_stand_offs
from cellplan.files.cell.rules.rules import Targets, rule_findings, target_findings
from cellplan.files.cell.rules.solver_rules import solver_findings
from cellplan.files.cell.rules.task_rules import task_rule_findings
from cellplan.files.cell.step_parts import edge_length, edge_lines, read_part
from cellplan.files.cell.user_folders import user_folders
from cellplan.files.input.files import AllowedFolders
from cellplan.files.input.findings import Finding, KeyPath, did_you_mean, key_text, raise_findings, shown
from cellplan.files.robots.rules import robot_findings, with_statements
from cellplan.files.schema import CellDocument
from cellplan.files.schema.partial import ValidEntries, read_valid_entries
from cellplan.files.schema.shapes import SolidEntry, ToolShapeEntry
from cellplan.files.yaml.reader import YamlDocument, read_yaml
from cellplan.geometry.mesh.load import require_enclosing, require_solid
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.step.part import StepPart
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.mirror import mirrored_part, mirrored_task
from cellplan.model.origin import Origin
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.program import NoTransfers
from cellplan.model.task.task import PlaneName, SampledPath, Task, TimedPath

PART_EXTENT_MM: Final = (1.0, 20_000.0)  # smaller or larger parts are a wrong unit
PARTS: Final = (
    "robots",
    "part",
    "tasks",
    "obstacles",
    "motion",
    "solver",
    "checks",
    "program",
    "layout",
    "controllers",
)  # of a cell, from its document


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CellFile:
    """The document of a cell, and the folders of the files that it names."""

    entries: YamlDocument  # the file
    document: YamlDocument  # the same with all tasks that others stand for, and with the values that were changed since
    changes: Mapping[str, object] = field(default_factory=dict)  # by address, in the order in which they were set
    name: str  # name of the file, without folders
    folder: Path  # folder that the names of files start from
    allow_dirs: tuple[Path, ...]  # further folders that these files may lie in
    parts: Mapping[str, object] = field(default_factory=dict)  # of the cell as built from it, by attribute
    robots: Mapping[str, Sequence[str]] = field(default_factory=dict)  # that may do a task which is open to several
    urdfs: Urdfs = field(default_factory=dict)  # robots of URDFs as they were read

    @property
    def folders(self) -> AllowedFolders:
        """The folders that the files which it names may lie in."""
        return AllowedFolders(folder=self.folder, allowed=(*self.allow_dirs, *user_folders(self.folder)))

    @property
    def written(self) -> Mapping[str, Any]:
        """The values of the document as they stand in it, no default filled in."""
        return self.document.root

    def with_values(self, cell: Cell, values: Mapping[str, object]) -> Cell:
        """The cell of the document with other values; see ``Cell.with_values``."""
        for key, part in self.parts.items():
            if getattr(cell, key) is not part:
                raise InputError(
                    f"cell '{cell.name}': expected the cell as it was read, got one whose {key} was changed in Python; "
                    "call with_values first"
                )
        changes = {address: value for address, value in self.changes.items() if address not in values}
        if any(is_of_entry(address, self.entries, self.document) for address in values):
            document = self.document_with({**changes, **values})
            document = with_first_robots(document) if self.robots else document
        else:
            document = changed(self.document, values)
        return _read(replace(self, document=document, changes=changes | plain_values(values), urdfs={}))

    def document_with(self, values: Mapping[str, object]) -> YamlDocument:
        """The document of the file with values in place of its own."""
        return with_values(self.entries, values, partial(edge_length, folders=self.folders))


def load_cell(path: Path | str, *, allow_dirs: Sequence[Path] = (), folder: Path | None = None) -> Cell:
    """Read a cell file and everything it names.

    Args:
        path: The cell file.
        allow_dirs: Folders, beside the cell's own and those that the user allows for every cell, that the files it
            names may lie in.
        folder: The folder that its names start from; None for the one it lies in.

    Raises:
        InvalidFileError: Everything that is wrong with the cell and the files it names, one located line each.
        InputError: The cell file cannot be read at all.
    """
    return _read(_cell_file(Path(path), {}, allow_dirs=allow_dirs, folder=folder))


def load_copy(path: Path, cell: Cell) -> Cell:
    """A copy of a cell that was just read from its file: the same folders hold, and URDFs are not read again."""
    source = cast("CellFile", cell.origin.source)
    source = replace(source, entries=read_yaml(path, file=str(path)), name=path.name, changes={})
    return _read(replace(source, document=source.document_with({})))


def load_open_cell(
    path: Path | str, *, allow_dirs: Sequence[Path] = (), values: Mapping[str, object] | None = None
) -> tuple[Cell, dict[str, tuple[str, ...]]]:
    """Read a cell in which tasks may be open to several robots, for a search that chooses one of them.

    Args:
        values: Values in place of those of the file, by address; see ``Cell.with_values``.

    Returns:
        The cell with the first robot of each open task, and all robots of each by the name of the task.

    Raises:
        InvalidFileError: As ``load_cell``.
        InputError: The cell file cannot be read at all.
    """
    source = _cell_file(Path(path), values or {}, allow_dirs=allow_dirs)
    document, robots = source.document, open_tasks(source.document.root)
    source = replace(source, document=with_first_robots(document), robots=robots)
    return _read(source, unknown_robot_findings(document)), robots


def _cell_file(
    path: Path, values: Mapping[str, object], *, allow_dirs: Sequence[Path] = (), folder: Path | None = None
) -> CellFile:
    """A cell file as it is read, with values in place of its own."""
    entries, allowed = read_yaml(path, file=str(path)), tuple(Path(it) for it in allow_dirs)
    file = CellFile(
        entries=entries,
        document=entries,
        changes=plain_values(values),
        name=path.name,
        folder=folder or path.parent,
        allow_dirs=allowed,
    )
    return replace(file, document=file.document_with(values))


def with_names(cell: Cell, file: Path) -> Cell:
    """A cell that was read from a file, with the names that another file states for its controllers.

    An ``InvalidFileError`` has all that is wrong with these, one located line each.
    """
    source = cell.origin.source
    if not isinstance(source, CellFile):
        raise InputError(f"{file}: expected names for a cell that was read from a file, got '{cell.name}'")
    return _read(replace(source, document=with_stated_names(source.document, file)))


def _read(source: CellFile, known: Iterable[Finding] = ()) -> Cell:
    """The cell of a document, after all rules were applied to it and to the files that it names."""
    document, file = with_first_robots(source.document), source.document.file
    valid, findings = read_valid_entries(document)
    findings += [*document.findings, *(() if source.robots else open_task_findings(source.document)), *known]
    if valid.is_too_large:
        raise_findings(file, findings)
    findings += program_findings(valid, document)
    valid = with_stand_offs(valid)
    findings += rule_findings(valid, document)
    findings += task_rule_findings(valid, document, source.robots)
    sources = Sources(document, source.folders, source.urdfs)
    sources.inputs[source.name] = document.digest
    valid, models = apply_srdfs(valid, _models(valid, document, sources), sources, document)
    sound = dict(models)
    for name, model in models.items():
        wrong = [*robot_findings(name, valid.robots[name], model, document)]
        wrong += mounting_findings(name, model, valid, document)
        findings += wrong
        if wrong:
            del sound[name]
    findings += posture_findings(valid, models, document)
    findings += path_findings(valid, models, document)
    findings += grip_findings(valid, models, document)
    findings += acceleration_findings(valid, models, document)
    findings += _unknown_bodies(valid, models, document)
    findings += accuracy_findings(valid, models, document)
    findings += control_findings(valid, models, document)
    findings += solver_findings(valid, models, document)
    findings += _part_extent(valid, document)
    _read_meshes(valid, sources)
    part = read_part(valid, sources)
    layout, wrong = read_layout(valid, sound, document)
    findings += wrong
    targets = _targets(valid, sources, part)
    findings += target_findings(valid, targets, document)
    raise_findings(file, [*findings, *sources.findings], sources.errors)
    if valid.whole is None:
        raise InputError(f"{file}: the cell cannot be understood")
    cell = _cell(valid.whole, models, targets, source=source, sources=sources, part=part)
    return _with_source(replace(cell, layout=layout), source)


def _models(valid: ValidEntries, document: YamlDocument, sources: Sources) -> dict[str, RobotModel]:
    read = {name: sources.robot(name, entry) for name, entry in valid.robots.items()}
    for name in valid.names["robots"]:
        written = document.root["robots"][name]
        if name not in read and isinstance(written, dict) and isinstance(written.get("model"), str):
            sources.look_for_model(name, written["model"])
    models = {name: model for name, model in read.items() if model is not None}
    return {
        name: on_mount(valid.robots[name], with_statements(valid.robots[name], model)) for name, model in models.items()
    }


def _targets(valid: ValidEntries, sources: Sources, part: StepPart | None) -> Targets:
    """Tool targets from files, lines along edges of the part, and outlines on it, by task."""
    samples = {
        name: sources.targets(task.path, ("tasks", name, "path"))
        for name, task in valid.tasks.items()
        if task.path.file_key is not None
    }
    read: Targets = {name: path for name, path in samples.items() if path is not None}
    of_part: Targets = {
        **edge_lines(valid, sources),
        **raster_paths(valid, sources),
        **outline_paths(valid, sources, part),
    }
    return {**read, **of_part}


def _unknown_bodies(valid: ValidEntries, models: Mapping[str, RobotModel], document: YamlDocument) -> Iterator[Finding]:
    """Exclusions name bodies that exist; checked only when all robots are known."""
    if valid.checks is None or set(models) != set(valid.names["robots"]):
        return
    known = {"part", *valid.names["environment"]}
    for name, model in models.items():
        with_bodies = {body.link for body in model.bodies}
        known |= {name, *(f"{name}/{body.name}" for body in model.bodies)}
        known |= {f"{name}/{link.name}" for link in model.links if link.index in with_bodies}
        known |= {f"{name}/{body}" for body in (*mounted_names(valid.robots[name]), *tool_names(valid.robots[name]))}
    for index, pair in enumerate(valid.checks.exclude):
        for side, body in enumerate(pair.bodies):
            if body not in known:
                text = f"expected a body of this cell, got {shown(body)}{did_you_mean(body, sorted(known))}"
                yield document.finding(("checks", "exclude", index, "bodies", side), text)


def _part_extent(valid: ValidEntries, document: YamlDocument) -> Iterator[Finding]:
    """A part of a likely size; meshes are checked by their reader."""
    shape = valid.part.geometry if valid.part else None
    if shape is None or shape.mesh is not None:
        return
    extent = 0.0
    if shape.box is not None:
        extent = max(shape.box.size_mm)
    elif shape.cylinder is not None:
        extent = max(2.0 * shape.cylinder.radius_mm, shape.cylinder.length_mm)
    elif shape.sphere is not None:
        extent = 2.0 * shape.sphere.radius_mm
    low, high = PART_EXTENT_MM
    if not low <= extent <= high:
        text = f"expected a part of {low:g} to {high:g} mm, got {extent:g} mm; is the unit right?"
        yield document.finding(("part", "geometry"), text)


def _read_meshes(valid: ValidEntries, sources: Sources) -> None:
    """Read every mesh once, so that all findings come together."""
    shapes: list[tuple[KeyPath, SolidEntry | ToolShapeEntry]] = []
    shapes += [(("environment", name), it) for name, it in valid.environment.items()]
    for name, robot in valid.robots.items():
        place: KeyPath = ("robots", name, "tool")
        shapes += [((*place, "bodies", index), body) for index, body in enumerate(robot.tool.bodies)]
        shapes += [(("robots", name, "attachments", index), it) for index, it in enumerate(robot.attachments)]
        shapes += [(("robots", name, "mount", "rail", key, index), it) for key, index, it in rail_entries(robot)]
        shapes += [((*place, "geometry"), robot.tool.geometry)] if robot.tool.geometry is not None else []
    part = valid.part.geometry if valid.part is not None else None
    if part is not None and part.mesh is not None:
        sources.mesh(part.mesh, part.unit, ("part", "geometry", "mesh"), requirement=require_solid)
    for path, shape in shapes:
        if shape.mesh is not None:
            sources.mesh(shape.mesh, shape.unit, (*path, "mesh"), requirement=None if shape.open else require_enclosing)


def _cell(
    whole: CellDocument,
    models: Mapping[str, RobotModel],
    targets: Targets,
    *,
    source: CellFile,
    sources: Sources,
    part: StepPart | None,
) -> Cell:
    """The cell, once there are no findings."""
    document = source.document

    def mesh(written: str, unit: str | None) -> Mesh:
        """A mesh that was read before."""
        mesh = sources.mesh(written, unit, ())
        if mesh is None:
            raise InputError(f"{document.file}: mesh '{written}' could not be read")
        return mesh

    timed = {name for name, path in targets.items() if isinstance(path, TimedPath)}
    origin = Origin(
        file=document.file,
        lines=document.lines(),
        document=resolved_document(whole, timed=timed),
        changes=source.changes,
        changed={key_text(path): text for path, text in document.changes.items()},
    )
    workpiece = build_part(whole, models, mesh, part)
    tasks = [build_task(name, whole, models, targets.__getitem__, origin) for name in whole.tasks]
    if whole.part.mirror is not None:
        plane = PlaneName(whole.part.mirror.plane)
        workpiece, tasks = mirrored_part(workpiece, plane), [mirrored_task(task, plane) for task in tasks]
    return Cell(
        name=whole.name,
        robots=tuple(build_robot(name, whole, models[name], mesh) for name in whole.robots),
        part=workpiece,
        tasks=tuple(tasks),
        obstacles=tuple(build_obstacle(name, entry, mesh) for name, entry in whole.environment.items()),
        motion=build_motion(whole.motion),
        solver=whole.solver.at_step(whole.motion.step_s),
        checks=whole.checks,
        origin=origin,
        inputs=dict(sorted(sources.inputs.items())),
        remarks=(*sources.remarks, *_weave_remarks(whole), *_smooth_remarks(whole, tasks)),
        program=whole.program or NoTransfers(),
        controllers=whole.controllers or {},
        assign=whole.assign,
    )


def _weave_remarks(whole: CellDocument) -> Iterator[tuple[str, str]]:
    """Tasks whose controllers weave."""
    for name, task in whole.tasks.items():
        if task.path.weave is not None and is_woven_by_controller(task, whole):
            yield f"tasks.{name}.path.weave", f"the controller of '{task.robot}' weaves, rows stay on the path"


def _smooth_remarks(whole: CellDocument, tasks: Sequence[Task]) -> Iterator[tuple[str, str]]:
    """Tasks whose paths are smoothed in a tube that is too narrow to gain anything."""
    for task in tasks:
        entry = whole.tasks[task.name]
        if entry.path.smooth is not None and isinstance(task.path, SampledPath):
            for key, text in narrow_tubes(task.path, entry, task.tool_axis):
                yield f"tasks.{task.name}.path.smooth.{key}", text


def _with_source(cell: Cell, source: CellFile) -> Cell:
    """The cell with the document that it was read from."""
    parts = {key: getattr(cell, key) for key in PARTS}
    return replace(cell, origin=replace(cell.origin, source=replace(source, parts=parts)))
