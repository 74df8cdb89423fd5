"""Write a 3-D page: of a run, of a cell that was not solved, or of the best layouts of a search."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Final

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.run.content import is_run_folder
from cellplan.files.run.folder import MANIFEST
from cellplan.files.run.stored import StoredRun, read_stored_run
from cellplan.files.run.whole_file import refuse_foreign, replace_older
from cellplan.jobs.layout.result_file import BEST
from cellplan.jobs.view.cell_scene import blocked_scene, unsolved_scene
from cellplan.jobs.view.geometries import Geometries
from cellplan.jobs.view.result import SCHEMA, ViewRecord, view_page
from cellplan.jobs.view.run_scene import run_scene
from cellplan.jobs.view.study_scenes import cell_of_study, read_layout_study, study_scenes
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import CAUTION
from cellplan.planning.transfer.best_try import BlockedTransferError
from cellplan.report.page.render import VIEW_PAGE
from cellplan.report.page.view import is_view_page
from cellplan.report.record.common import Record
from cellplan.runs.gate.stored_cell import load_stored_cell
from cellplan.runs.overrides import with_overrides
from cellplan.study.folder import JOURNAL, RESULT

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
    return {**_record("cell", cell, geometries, [scene]), **about}, target


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
    write_view(_record("cell", cell, geometries, [scene]), target)
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
    """The record of a run that was read."""
    geometries = Geometries()
    scene = run_scene(stored, cell, geometries)
    return {**_record("run", cell, geometries, [scene]), "source": stored.manifest.cell_file}


def _view_of_study(request: ViewRequest, progress: Progress) -> ViewRecord:
    """The record of a layout search on disk."""
    study = read_layout_study(request.path)
    if not study["top"]:
        raise InputError(f"{request.path / RESULT}: top: expected at least one layout, got none: nothing was found")
    cell = cell_of_study(request.path, request.cell, request.allow_dirs)
    geometries = Geometries()
    scenes = list(study_scenes(study, cell, str(request.path / RESULT), geometries, progress))
    return _record("study", cell, geometries, scenes)


def _record(kind: str, cell: Cell, geometries: Geometries, scenes: list[Record]) -> ViewRecord:
    """A page."""
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
