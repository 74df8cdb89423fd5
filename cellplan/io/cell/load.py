"""Cell file: read, understood, checked against itself and against the files it names; all findings at once."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.geometry.mesh.load import require_enclosing, require_solid
from cellplan.geometry.shapes import Mesh
from cellplan.io.cell.build import (
    build_checks,
    build_motion,
    build_obstacle,
    build_part,
    build_robot,
    build_task,
    resolved_document,
)
from cellplan.io.cell.build_accelerations import acceleration_findings
from cellplan.io.cell.build_mounting import accuracy_findings, mounted_names, mounting_findings
from cellplan.io.cell.build_solver import build_solver
from cellplan.io.cell.referenced_files import Sources
from cellplan.io.cell.rules import rule_findings
from cellplan.io.cell.solver_rules import solver_findings
from cellplan.io.cell.trajectory_rules import Targets, target_findings
from cellplan.io.cell.user_folders import user_folders
from cellplan.io.input.allowed_folders import AllowedFolders
from cellplan.io.input.findings import Finding, KeyPath, did_you_mean, raise_findings, shown
from cellplan.io.robots.rules import robot_findings, with_statements
from cellplan.io.schema import CellDocument
from cellplan.io.schema.mounting import AttachmentEntry
from cellplan.io.schema.partial import Pieces, read_pieces
from cellplan.io.schema.shapes import ObstacleEntry, ToolBodyEntry, ToolShapeEntry
from cellplan.io.yaml.reader import YamlDocument, read_yaml
from cellplan.model.cell import Cell
from cellplan.model.origin import Origin
from cellplan.model.robot import RobotModel
from cellplan.model.task import TimedPath

PART_EXTENT_MM: Final = (1.0, 20_000.0)  # smaller or larger parts are slips of the unit


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
    path = Path(path)
    file = str(path)
    document = read_yaml(path, file=file)
    pieces, findings = read_pieces(document)
    findings += document.findings
    if pieces.is_too_large:
        raise_findings(file, findings)
    findings += rule_findings(pieces, document)
    start = folder or path.parent
    allowed = (*(Path(each) for each in allow_dirs), *user_folders(start))
    sources = Sources(document, AllowedFolders(folder=start, allowed=allowed))
    sources.inputs[path.name] = document.digest
    models = _models(pieces, document, sources)
    for name, model in models.items():
        findings += robot_findings(name, pieces.robots[name], model, document)
        findings += mounting_findings(name, model, pieces, document)
    findings += acceleration_findings(pieces, models, document)
    findings += _unknown_bodies(pieces, models, document)
    findings += accuracy_findings(pieces, models, document)
    findings += solver_findings(pieces, models, document)
    findings += _part_extent(pieces, document)
    _read_meshes(pieces, sources)
    targets = _targets(pieces, sources)
    findings += target_findings(pieces, targets, document)
    raise_findings(file, [*findings, *sources.findings], sources.errors)
    if pieces.whole is None:
        raise InputError(f"{file}: the cell cannot be understood")
    return _cell(pieces.whole, models, targets, document=document, sources=sources)


def _models(pieces: Pieces, document: YamlDocument, sources: Sources) -> dict[str, RobotModel]:
    """Models of all robots that are understood, by name."""
    found = {name: sources.robot(name, entry) for name, entry in pieces.robots.items()}
    for name in pieces.names["robots"]:
        written = document.root["robots"][name]
        if name not in found and isinstance(written, dict) and isinstance(written.get("model"), str):
            sources.look_for_model(name, written["model"])
    return {name: with_statements(pieces.robots[name], model) for name, model in found.items() if model is not None}


def _targets(pieces: Pieces, sources: Sources) -> Targets:
    """Tool targets from files, by task."""
    found = {
        name: sources.targets(task.path.csv, ("tasks", name, "path", "csv"))
        for name, task in pieces.tasks.items()
        if task.path.csv is not None
    }
    return {name: sampled for name, sampled in found.items() if sampled is not None}


def _unknown_bodies(pieces: Pieces, models: Mapping[str, RobotModel], document: YamlDocument) -> Iterator[Finding]:
    """Exclusions name bodies that exist; told only when all robots are known."""
    if pieces.checks is None or set(models) != set(pieces.names["robots"]):
        return
    known = {"part", *pieces.names["environment"]}
    for name, model in models.items():
        tool = pieces.robots[name].tool
        count = len(tool.bodies) + (tool.geometry is not None)
        known |= {f"{name}/{body.name}" for body in model.bodies}
        known |= {f"{name}/{body}" for body in mounted_names(pieces.robots[name])}
        known |= {f"{name}/tool" if number == 1 else f"{name}/tool_{number}" for number in range(1, count + 1)}
    for index, pair in enumerate(pieces.checks.exclude):
        for side, body in enumerate(pair.bodies):
            if body not in known:
                text = f"expected a body of this cell, got {shown(body)}{did_you_mean(body, sorted(known))}"
                yield document.finding(("checks", "exclude", index, "bodies", side), text)


def _part_extent(pieces: Pieces, document: YamlDocument) -> Iterator[Finding]:
    """A part of a likely size; meshes are looked at by their reader."""
    shape = pieces.part.geometry if pieces.part else None
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


Meshed = ToolShapeEntry | ToolBodyEntry | ObstacleEntry | AttachmentEntry


def _read_meshes(pieces: Pieces, sources: Sources) -> None:
    """Read every mesh once, so that all findings come together."""
    shapes: list[tuple[KeyPath, Meshed]] = [(("environment", name), it) for name, it in pieces.environment.items()]
    for name, robot in pieces.robots.items():
        place: KeyPath = ("robots", name, "tool")
        shapes += [((*place, "bodies", index), body) for index, body in enumerate(robot.tool.bodies)]
        shapes += [(("robots", name, "attachments", index), it) for index, it in enumerate(robot.attachments)]
        shapes += [((*place, "geometry"), robot.tool.geometry)] if robot.tool.geometry is not None else []
    part = pieces.part.geometry if pieces.part is not None else None
    if part is not None and part.mesh is not None and part.unit is not None:
        sources.mesh(part.mesh, part.unit, ("part", "geometry", "mesh"), demand=require_solid)
    for path, shape in shapes:
        if shape.mesh is not None and shape.unit is not None:
            sources.mesh(shape.mesh, shape.unit, (*path, "mesh"), demand=None if shape.open else require_enclosing)


def _cell(
    whole: CellDocument,
    models: Mapping[str, RobotModel],
    targets: Targets,
    *,
    document: YamlDocument,
    sources: Sources,
) -> Cell:
    """The cell, once nothing is left to complain about."""

    def mesh(written: str, unit: str) -> Mesh:
        """A mesh that was read before."""
        found = sources.mesh(written, unit, ())
        if found is None:
            raise InputError(f"{document.file}: mesh '{written}' could not be read")
        return found

    timed = {name for name, path in targets.items() if isinstance(path, TimedPath)}
    origin = Origin(file=document.file, lines=document.lines(), document=resolved_document(whole, timed=timed))
    return Cell(
        name=whole.name,
        robots=tuple(build_robot(name, whole, models[name], mesh) for name in whole.robots),
        part=build_part(whole.part, mesh),
        tasks=tuple(build_task(name, whole, targets.__getitem__, origin) for name in whole.tasks),
        obstacles=tuple(build_obstacle(name, entry, mesh) for name, entry in whole.environment.items()),
        motion=build_motion(whole.motion),
        solver=build_solver(whole.solver, whole.motion.step_s, models),
        checks=build_checks(whole.checks),
        origin=origin,
        inputs=dict(sorted(sources.inputs.items())),
    )
