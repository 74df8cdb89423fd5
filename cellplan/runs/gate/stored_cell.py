"""The cell of a stored run: read from its resolved copy, and compared with the files it was once read from."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.cell.load import load_cell, load_copy, with_names
from cellplan.files.cell.names import is_name
from cellplan.files.cell.write import written_document
from cellplan.files.input.files import digest_of_file
from cellplan.files.input.findings import KeyPath, key_text, listed, shown, shown_whole
from cellplan.files.robots.joint_table import load_bundled_table
from cellplan.files.run.manifest import BUNDLED
from cellplan.files.run.stored import CELL, StoredRun
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.branches import SEED_SLIDE, SEED_TURN
from cellplan.model.units import DEG, MM

SEARCHED_KEYS: Final = frozenset({"start", "start_deg", "home", "home_deg"})  # ``auto`` where they were to be found
MOST: Final = 10  # changes of a cell file that are listed
ROUNDED: Final = 1e-9  # [deg] or [mm] that writing a start changes it by at most


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredCell:
    """The cell of a run and how far its sources were compared."""

    cell: Cell  # the cell that was solved, every start posture filled in, with the names of controllers of now
    compared: tuple[str, ...]  # names of the inputs that are as they were
    remarks: tuple[str, ...]  # what was not compared, or set when the cell was solved, or is named otherwise now
    names: Mapping[str, str] = field(default_factory=dict)  # SHA-256 of files of other names than those of the run


def load_stored_cell(
    stored: StoredRun, *, cell: Path | str | None, allow_dirs: Sequence[Path], controllers: Path | str | None = None
) -> StoredCell:
    """Read the cell of a run, and refuse it when something that the run rests on has changed.

    Args:
        cell: The cell file that was solved; None when it is not at hand, which is enough for cells that name no files
            of their own.
        allow_dirs: Folders, beside the cell's own, that the files it names may lie in.
        controllers: A file of names that take the place of those of the cell; None for no such file.

    Raises:
        InputError: An input has changed or cannot be looked for; the resolved copy is not made from the cell file.
    """
    source, named = _without_file(stored) if cell is None else _with_file(stored, Path(cell), allow_dirs)
    names = dict(source.names)
    if controllers is not None:
        named = with_names(named, file := Path(controllers))
        names[file.name] = digest_of_file(file, file=str(file))
    renamed = [
        f"{key_text(path)}: {shown(new)} as in {listed(names)}, {shown(old)} when the cell was solved"
        for path, old, new in _differences(written_document(source.cell), written_document(named))
        if is_name(path)
    ]
    robots = tuple(replace(robot, control=named.robot(robot.name).control) for robot in source.cell.robots)
    solved = replace(source.cell, robots=robots, controllers=named.controllers)
    return replace(source, cell=solved, remarks=(*source.remarks, *renamed), names=names)


def _with_file(stored: StoredRun, cell: Path, allow_dirs: Sequence[Path]) -> tuple[StoredCell, Cell]:
    """The cell as it was solved, compared with its file, and the cell of this file, which may have other names."""
    manifest, changes = stored.manifest, stored.manifest.changes
    original = load_cell(cell, allow_dirs=allow_dirs)
    original = original.with_values(changes) if changes else original
    now = {manifest.cell_file if name == cell.name else name: sha for name, sha in original.inputs.items()}
    stale = _stale(stored, now, where=f"'{cell}'", cell=cell)
    if set(stale) - {manifest.cell_file}:
        _refuse(stored, stale)
    resolved = _resolved(stored, load_copy(stored.folder / CELL, original))
    seeds = _seeds(stored) if stale else None
    differences = [
        difference
        for difference in _differences(written_document(original), written_document(resolved))
        if not _may_differ(*difference, seeds)
    ]
    others = [difference for difference in differences if not (stale and is_name(difference[0]))]
    if stale and (others or not differences):
        details = [
            f"{original.origin.at(key_text(path))}: expected {shown_whole(then)}, with which the run was made, got "
            f"{shown_whole(now)}; solve the cell again"
            for path, now, then in others[:MOST]
        ]
        _refuse(stored, stale, details)
    if others:
        lines = (
            f"{key_text(key)}: expected {shown_whole(old)} as in '{cell}', got {shown_whole(new)}; solve the cell again"
            for key, old, new in others
        )
        raise InvalidFileError([InputError(f"{stored.folder / CELL}: {line}") for line in lines])
    remarks = tuple(f"{_change(address, value)} when the cell was solved" for address, value in changes.items())
    compared = tuple(name for name in now if name not in stale)
    names = {cell.name: now[manifest.cell_file]} if stale else {}
    return StoredCell(cell=resolved, compared=compared, remarks=remarks, names=names), original


def _change(address: str, value: object) -> str:
    """A value that was set, as text."""
    return f"{address} was removed" if value is None else f"{address} was set to {shown(value)}"


def _without_file(stored: StoredRun) -> tuple[StoredCell, Cell]:
    """The cell from its resolved copy alone, whose names hold too."""
    manifest = stored.manifest
    if manifest.user_files:
        raise InputError(
            f"{stored.folder}: the run depends on files beside its cell file ({listed(manifest.user_files)}): name the "
            f"cell file '{manifest.cell_file}' with --cell, so that they can be compared"
        )
    bundled = [name for name in manifest.cell_inputs if name != manifest.cell_file]
    now = {manifest.cell_file: manifest.inputs[manifest.cell_file]}
    now |= {name: _bundled_digest(name) for name in bundled}
    _refuse(stored, _stale(stored, now, where="this version of cellplan"))
    remark = f"the cell file '{manifest.cell_file}' was not compared with the run; name it with --cell"
    resolved = _resolved(stored, load_cell(stored.folder / CELL))
    return StoredCell(cell=resolved, compared=tuple(bundled), remarks=(remark,)), resolved


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


def _stale(stored: StoredRun, now: Mapping[str, str], *, where: str, cell: Path | None = None) -> dict[str, str]:
    """What to say of inputs that are not what they were when the run was made, by name."""
    findings = {}
    for name, digest in stored.manifest.cell_inputs.items():
        if not now.get(name):
            findings[name] = f"the run depends on '{name}', to which {where} does not refer"
        elif now[name] != digest:
            findings[name] = _changed(stored, name, cell)
    new = (name for name in now if name not in stored.manifest.cell_inputs)
    return findings | {name: f"{where} needs '{name}', on which the run does not depend" for name in new}


def _refuse(stored: StoredRun, stale: Mapping[str, str], details: Iterable[str] = ()) -> None:
    """Refuse a run of which inputs have changed."""
    if stale:
        lines = [*(f"{stored.folder}: {text}" for text in stale.values()), *details]
        raise InvalidFileError([*map(InputError, lines)])


def _resolved(stored: StoredRun, cell: Cell) -> Cell:
    """The resolved copy, which must be the file that the manifest names and refer to its inputs."""
    manifest = stored.manifest
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
    """Key paths at which two documents differ, with both values: the order of the keys, where only that differs."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        orders = [listed(str(key) for key in one if key in other) for one, other in ((old, new), (new, old))]
        if orders[0] != orders[1]:
            yield path, orders[0], orders[1]
        for key in dict.fromkeys([*old, *new]):
            yield from _differences(old.get(key), new.get(key), (*path, str(key)))
    elif isinstance(old, list | tuple) and isinstance(new, list | tuple) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from _differences(one, other, (*path, index))
    elif old != new:
        yield path, old, new


def _seeds(stored: StoredRun) -> set[object]:
    """Robots and tasks whose starts were moved when the cell was solved, and so were seeds."""
    moved = stored.record.get("solver", {}).get("moved_starts") or []
    return {start.get(key) for start in moved for key in ("robot", "task")}


def _may_differ(path: KeyPath, old: object, new: object, seeds: Container[object] | None) -> bool:
    """Whether a run may have another value there than its cell file: a start or home that is found, or was a seed.

    ``seeds`` are the robots and tasks whose starts may have been; None for all.
    """
    if not (len(path) >= 3 and path[0] in ("robots", "tasks") and path[2] in SEARCHED_KEYS):
        return False
    if len(path) == 3:
        return old == "auto" or old is None
    is_slide = str(path[3]).endswith("_mm")
    most = MM * SEED_SLIDE if is_slide else DEG * SEED_TURN
    if path[2] not in ("start", "start_deg") or not isinstance(old, float | int) or not isinstance(new, float | int):
        return False
    return abs(new - old) <= (most if seeds is None or path[1] in seeds else 0.0) + ROUNDED
