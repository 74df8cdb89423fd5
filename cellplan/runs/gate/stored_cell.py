"""The cell of a stored run: read from its resolved copy, and compared with the files it was once read from."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import written_document
from cellplan.files.input.findings import KeyPath, key_text, listed, shown
from cellplan.files.robots.bundled import load_bundled_table
from cellplan.files.run.manifest import BUNDLED
from cellplan.files.run.stored import CELL, StoredRun
from cellplan.model.cell.cell import Cell
from cellplan.model.units import DEG, MM
from cellplan.planning.start.seeds import SEED_SLIDE, SEED_TURN

SEARCHED_KEYS: Final = frozenset({"start", "start_deg", "home", "home_deg"})  # ``auto`` where they were to be found
ROUNDED: Final = 1e-9  # [deg] or [mm] that writing a start changes it by at most


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredCell:
    """The cell of a run and how far its sources were compared."""

    cell: Cell  # the cell that was solved, every start posture filled in
    compared: tuple[str, ...]  # names of the inputs that are as they were
    remarks: tuple[str, ...]  # what was not compared, or set when the cell was solved


def load_stored_cell(stored: StoredRun, *, cell: Path | None, allow_dirs: Sequence[Path]) -> StoredCell:
    """Read the cell of a run, and refuse it when something that the run rests on has changed.

    Args:
        cell: The cell file that was solved; None when it is not at hand, which is enough for cells that name no files
            of their own.
        allow_dirs: Folders, beside the cell's own, that the files it names may lie in.

    Raises:
        InputError: An input has changed or cannot be looked for; the resolved copy is not made from the cell file.
    """
    if cell is None:
        return _without_file(stored)
    changes = stored.manifest.changes
    original = load_cell(cell, allow_dirs=allow_dirs)
    original = original.with_values(changes) if changes else original
    now = {stored.manifest.cell_file if name == cell.name else name: sha for name, sha in original.inputs.items()}
    _refuse_stale(stored, now, where=f"'{cell}'", cell=cell)
    resolved = _resolved(stored, folder=cell.parent, allow_dirs=allow_dirs)
    written, copied = written_document(original), written_document(resolved)
    foreign = [difference for difference in _differences(written, copied) if not _may_differ(*difference)]
    if foreign:
        raise InvalidFileError([_foreign(stored, cell, difference) for difference in foreign])
    remarks = tuple(f"{_change(address, value)} when the cell was solved" for address, value in changes.items())
    return StoredCell(cell=resolved, compared=tuple(now), remarks=remarks)


def _change(address: str, value: object) -> str:
    """A value that was set, as text."""
    return f"{address} was removed" if value is None else f"{address} was set to {shown(value)}"


def _without_file(stored: StoredRun) -> StoredCell:
    """The cell from its resolved copy alone."""
    manifest = stored.manifest
    if manifest.user_files:
        raise InputError(
            f"{stored.folder}: the run depends on files beside its cell file ({listed(manifest.user_files)}): name the "
            f"cell file '{manifest.cell_file}' with --cell, so that they can be compared"
        )
    bundled = [name for name in manifest.cell_inputs if name != manifest.cell_file]
    now = {manifest.cell_file: manifest.inputs[manifest.cell_file]}
    _refuse_stale(stored, now | {name: _bundled_digest(name) for name in bundled}, where="this version of cellplan")
    remark = f"the cell file '{manifest.cell_file}' was not compared with the run; name it with --cell"
    resolved = _resolved(stored, folder=stored.folder, allow_dirs=())
    return StoredCell(cell=resolved, compared=tuple(bundled), remarks=(remark,))


def _changed(stored: StoredRun, name: str, cell: Path | None) -> str:
    """What to say of an input with another content; the cell file may be another one than that of the run."""
    if cell is not None and name == stored.manifest.cell_file and cell.name != name:
        return f"the run was made from '{name}', and '{cell}' differs from it; name the file of the run, or solve again"
    return f"'{name}' has changed since the run was made; solve the cell again"


def _bundled_digest(name: str) -> str:
    """Digest of a robot that comes with the program; empty when it no longer does."""
    try:
        return load_bundled_table(name.removeprefix(BUNDLED)).digest
    except InputError:
        return ""


def _refuse_stale(stored: StoredRun, now: Mapping[str, str], *, where: str, cell: Path | None = None) -> None:
    """Refuse inputs that are not what they were when the run was made."""
    findings = []
    for name, digest in stored.manifest.cell_inputs.items():
        if not now.get(name):
            findings.append(f"the run depends on '{name}', to which {where} does not refer")
        elif now[name] != digest:
            findings.append(_changed(stored, name, cell))
    findings += [
        f"{where} needs '{name}', on which the run does not depend"
        for name in now
        if name not in stored.manifest.cell_inputs
    ]
    if findings:
        raise InvalidFileError([InputError(f"{stored.folder}: {finding}") for finding in findings])


def _resolved(stored: StoredRun, *, folder: Path, allow_dirs: Sequence[Path]) -> Cell:
    """The resolved copy, which must be the file that the manifest names and refer to its inputs."""
    manifest = stored.manifest
    cell = load_cell(stored.folder / CELL, allow_dirs=allow_dirs, folder=folder)
    digests = dict(cell.inputs)
    if digests.pop(CELL) != manifest.files[CELL].digest:
        raise InputError(f"{stored.folder / CELL}: changed while it was read")
    resolved = {name: digest for name, digest in manifest.cell_inputs.items() if name != manifest.cell_file}
    if digests != resolved:
        raise InputError(f"{stored.folder / CELL}: refers to other files than the cell file; solve the cell again")
    if cell.name != manifest.cell:
        raise InputError(f"{stored.folder / CELL}: name: expected '{manifest.cell}', got '{cell.name}'")
    if any(robot.start is None for robot in cell.robots):
        raise InputError(f"{stored.folder / CELL}: robots: expected an explicit start posture of every robot, got auto")
    return cell


def _differences(old: object, new: object, path: KeyPath = ()) -> Iterator[tuple[KeyPath, object, object]]:
    """Key paths at which two documents differ, with both values."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in dict.fromkeys([*old, *new]):
            yield from _differences(old.get(key), new.get(key), (*path, str(key)))
    elif isinstance(old, list | tuple) and isinstance(new, list | tuple) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _differences(one, other, (*path, index))
    elif old != new:
        yield path, old, new


def _may_differ(path: KeyPath, old: object, new: object) -> bool:
    """Whether a run may have another value there than its cell file: a start or home that is found, or was a seed."""
    if not (len(path) >= 3 and path[0] in ("robots", "tasks") and path[2] in SEARCHED_KEYS):
        return False
    if len(path) == 3:
        return old == "auto" or old is None
    is_slide = str(path[3]).endswith("_mm")
    most = MM * SEED_SLIDE if is_slide else DEG * SEED_TURN
    if path[2] not in ("start", "start_deg") or not isinstance(old, float | int) or not isinstance(new, float | int):
        return False
    return abs(new - old) <= most + ROUNDED


def _foreign(stored: StoredRun, cell: Path, difference: tuple[KeyPath, object, object]) -> InputError:
    path, old, new = difference
    return InputError(
        f"{stored.folder / CELL}: {key_text(path)}: expected {shown(old)} as in '{cell}', got {shown(new)}"
    )
