"""Write a 3-D page: of a run, of a cell that was not solved, or of the best layouts of a search."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePath
from typing import Any, Final

from cellplan.errors import InputError, NoSolutionError
from cellplan.files.cell.load import load_cell
from cellplan.files.input.files import read_regular_file
from cellplan.files.input.findings import shown
from cellplan.files.input.json_reader import parse_json, required
from cellplan.files.run.content import is_run_folder
from cellplan.files.run.folder import MANIFEST
from cellplan.files.run.stored import StoredRun, read_stored_run
from cellplan.files.run.whole_file import refuse_foreign, replace_older
from cellplan.geometry.shapes import HalfSpace
from cellplan.jobs.layout.record import SCHEMA as LAYOUT_SCHEMA
from cellplan.jobs.layout.result_file import BEST
from cellplan.jobs.view.cell_scene import blocked_scene, standing_scene, unsolved_scene
from cellplan.jobs.view.geometries import Geometries, shape_key
from cellplan.jobs.view.nearest import ViewedStretch, nearest_record, sampled_rows
from cellplan.jobs.view.result import SCHEMA, ViewRecord, view_page
from cellplan.jobs.view.run_scene import motion_record, run_scene
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import CAUTION
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import clock_paths
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.report.page.render import VIEW_PAGE
from cellplan.report.page.view import is_view_page
from cellplan.report.record.common import Record
from cellplan.runs.gate.stored_cell import load_stored_cell
from cellplan.runs.overrides import with_overrides
from cellplan.runs.plan.run import plan_run
from cellplan.scene.bodies import is_ground, scene_bodies
from cellplan.scene.collision.bodies import prepare
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene
from cellplan.study.folder import JOURNAL, RESULT

ROWS: Final = 500  # [-] of the motion of each layout
DISTANCES: Final = 50  # [-] rows of it at which the closest pair is looked for
RESULT_LIMIT: Final = 200_000_000  # [bytes]
FIGURES: Final = (
    ("cycle_s", "cycle", "s"),
    ("margin_deg", "smallest margin", "deg"),
    ("clearance_mm", "smallest clearance", "mm"),
    ("change", "change", ""),
)


def read_layout_study(folder: Path) -> Record:
    """The result of a layout search; a study without one, or of another kind, is refused."""
    file = folder / RESULT
    if not file.exists():
        raise InputError(f"{file}: missing: the search has not ended; finish it with --resume")
    record = parse_json(read_regular_file(file, file=str(file), limit=RESULT_LIMIT), str(file))
    if record.get("schema") != LAYOUT_SCHEMA or record.get("kind") != "layout":
        got = f"one of the kind {shown(record.get('kind', 'unknown'))}"
        raise InputError(f"{file}: expected the study of a layout search, got {got}: view one of its runs instead")
    required(record, "top", list, file=str(file))
    return record


def cell_of_study(folder: Path, given: Path | None, allow_dirs: Sequence[Path]) -> Cell:
    """The cell that the layouts are made of: the given one, else the best layout in the folder; one must be there."""
    path = folder / BEST if given is None else given
    if given is None and not path.exists():
        raise InputError(f"{folder}: expected {BEST} in it, got none: no layout passed; name the cell file with --cell")
    return load_cell(path, allow_dirs=allow_dirs)


def study_scenes(record: Record, cell: Cell, file: str, geometries: Geometries, progress: Progress) -> Iterator[Record]:
    """A scene for each of the best layouts."""
    top: list[Any] = record["top"]
    first: Scene | None = None
    for place, layout in enumerate(top):
        progress("planning the layouts", place / len(top))
        settings = required(layout, "settings", dict, file=file)
        try:
            scene = placed_scene(first, cell.with_values(settings))
        except InputError as error:
            raise InputError(f"{file}: top[{place}].settings: {str(error).splitlines()[0]}") from None
        first = first or scene
        shown = _moving(standing_scene(scene, geometries), scene)
        yield {
            **shown,
            "name": f"{place + 1} of {len(top)}: trial {layout['trial']}, {layout['status']}",
            "facts": [*_facts(layout), *shown["facts"]],
            "remarks": [*shown["remarks"], *([layout["reason"]] if layout["reason"] else [])],
            "passed": layout["status"] == "certified" or None,
        }


def placed_scene(first: Scene | None, cell: Cell) -> Scene:
    """The scene of a layout, as far as a picture needs it: pairs are sorted, and tools cut, for the first one only.

    Args:
        first: The scene of another layout of the same cell; None for the first one.
    """
    bodies = tuple(sorted(scene_bodies(cell), key=is_ground))
    if first is None or [body.name for body in bodies] != [body.name for body in first.bodies]:
        return Scene.from_cell(cell)
    made = {
        index: prepare(body.name, body.shape)
        for index, (body, old) in enumerate(zip(bodies, first.bodies, strict=True))
        if not isinstance(body.shape, HalfSpace) and shape_key(body.shape) != shape_key(old.shape)
    }
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    return replace(first, cell=cell, chains=chains, bodies=bodies, engine=first.engine.with_bodies(made))


def _moving(standing: Record, scene: Scene) -> Record:
    """The scene with the motion that the layout has at the duration of the cell; as it stands where there is none."""
    cell = scene.cell
    phases = plan_phases(cell).program
    if cell.program.is_home_to_home or len(phases) > 1 or any(robot.start is None for robot in cell.robots):
        return standing
    try:
        paths = clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
        motion = plan_run(cell, paths, phases[0]).motion
    except (InputError, NoSolutionError) as error:
        return {**standing, "remarks": [*standing["remarks"], f"shown at its start: {error}"]}
    rows = sampled_rows(motion.times, (), ROWS)
    times, q = motion.times[rows], motion.q[rows]
    every = sampled_rows(times, (), DISTANCES)
    return {
        **standing,
        "facts": [["shown at", f"{times[-1]:.4g} s"], ["motion", "planned for this page, not verified"]],
        "motion": motion_record(times, q, []),
        "nearest": nearest_record([ViewedStretch(scene, 0, len(times))], times, q, every),
    }


def _facts(layout: Record) -> list[list[str]]:
    facts = [["from", str(layout["origin"])]]
    for key, label, unit in FIGURES:
        if layout[key] is not None:
            facts.append([label, f"{layout[key]:.4g} {unit}".strip()])
    return facts


PAGE: Final = "3-D page"  # in messages
STUDY_PAGE: Final = "study-view.html"  # in the folder of a study
ADVICE: Final = "advice.json"  # in the folder of a repair


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewRequest:
    """What is to be shown.

    Attributes:
        path: A run folder, a cell file, or the folder of a layout search.
        output: The page; None for the usual place.
        cell: The cell file of a run or a search that depends on further files; None where the folder is enough.
        settings: Values of a cell file that is shown, as ``KEY=VALUE``.
        allow_dirs: Folders, beside the cell's own, that the files it names may lie in.
    """

    path: Path
    output: Path | None = None
    cell: Path | None = None
    settings: Sequence[str] = field(default=())
    allow_dirs: Sequence[Path] = field(default=())


def view(request: ViewRequest, *, progress: Progress = silent) -> tuple[ViewRecord, Path]:
    """The record of a page, and where the page belongs; a place that it may not take is refused first.

    Args:
        request: What is to be shown.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The path is neither a run, nor a cell, nor a layout search, or does not fit the options.
    """
    path = request.path
    if path.is_dir():
        if request.settings:
            raise InputError(f"--set: expected a cell file with it, got the folder '{path}'")
        if (path / ADVICE).exists():
            raise InputError(
                f"{path}: expected a run, a layout search or a cell file, got a repair: show '{path / BEST}'"
            )
        if (path / MANIFEST).exists() or is_run_folder(path):
            target = _target(request, path / VIEW_PAGE)
            return _view_of_run(request, progress), target
        if (path / RESULT).exists() or (path / JOURNAL).exists():
            target = _target(request, path / STUDY_PAGE)
            return _view_of_study(request, progress), target
        raise InputError(f"{path}: expected a run, a layout search or a cell file, got a folder that holds none")
    if request.cell is not None:
        raise InputError(f"--cell: expected a run or a layout search with it, got '{path}'")
    cell = with_overrides(load_cell(path, allow_dirs=request.allow_dirs), request.settings)
    target = _target(request, Path("outputs") / f"{cell.name}-view.html")
    geometries = Geometries()
    scene = unsolved_scene(cell, geometries, progress=progress)
    about = {"source": path.as_posix(), "settings": list(request.settings)}
    return {**page_record("cell", cell, geometries, [scene]), **about}, target


def _target(request: ViewRequest, usual: Path) -> Path:
    """Where the page is written."""
    target = request.output or usual
    refuse_foreign(target, is_of_kind=is_view_page, kind=PAGE)
    return target


def write_view_of_run(folder: Path, cell: Cell, *, progress: Progress = silent) -> Path:
    """Write the 3-D page of a run whose cell is at hand into its folder."""
    progress("making the 3-D page", 0.0)
    write_view(_record_of_run(read_stored_run(folder), cell), folder / VIEW_PAGE)
    return folder / VIEW_PAGE


def write_view_of_blocked(error: BlockedTransferError, target: Path) -> bool:
    """Write the page of the best try of a missing transfer move over any older page; False where no try is known."""
    if error.best is None:
        return False
    geometries, cell = Geometries(), error.best.scene.cell
    target.parent.mkdir(parents=True, exist_ok=True)
    scene = blocked_scene(error.best, str(error), geometries)
    write_view(page_record("cell", cell, geometries, [scene]), target)
    return True


def write_view(record: ViewRecord, target: Path) -> int:
    """Write a page whole or not at all; gives its size in bytes.

    Args:
        record: As ``view`` returns it.
        target: The page; an older one there is replaced.

    Raises:
        InputError: The place holds something else, or cannot be written.
    """
    content = view_page(record).encode()
    replace_older(target, content, is_of_kind=is_view_page, kind=PAGE)
    return len(content)


def _view_of_run(request: ViewRequest, progress: Progress) -> ViewRecord:
    """The record of a run on disk."""
    stored = read_stored_run(request.path)
    stored_cell = load_stored_cell(stored, cell=request.cell, allow_dirs=request.allow_dirs)
    progress("making the 3-D page", 0.0)
    return _record_of_run(stored, stored_cell.cell)


def _record_of_run(stored: StoredRun, cell: Cell) -> ViewRecord:
    geometries = Geometries()
    scene = run_scene(stored, cell, geometries)
    return {**page_record("run", cell, geometries, [scene]), "source": stored.manifest.cell_file}


def _view_of_study(request: ViewRequest, progress: Progress) -> ViewRecord:
    """The record of a layout search on disk."""
    study = read_layout_study(request.path)
    if not study["top"]:
        raise InputError(f"{request.path / RESULT}: top: expected at least one layout, got none: nothing was found")
    cell = cell_of_study(request.path, request.cell, request.allow_dirs)
    geometries = Geometries()
    scenes = list(study_scenes(study, cell, str(request.path / RESULT), geometries, progress))
    return page_record("study", cell, geometries, scenes)


def page_record(kind: str, cell: Cell, geometries: Geometries, scenes: list[Record]) -> ViewRecord:
    """The record of a page: of a run, a cell or a study, as ``kind`` says."""
    return {
        "schema": SCHEMA,
        "kind": kind,
        "cell": cell.name,
        "source": PurePath(cell.origin.file).name,
        "settings": [],
        "geometries": geometries.records,
        "scenes": scenes,
        "caution": CAUTION,
    }
