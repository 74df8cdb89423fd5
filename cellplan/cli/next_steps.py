"""The lines to type next: what a passed cell or run is for, and what helps a failed one."""

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Final

from cellplan.files.run.manifest import user_files
from cellplan.files.yaml.writer import flow_text
from cellplan.model.cell.cell import Cell
from cellplan.model.report.check_kinds import PASSED_BY_TIME
from cellplan.search.synchronous import is_searchable

OPTIONS: Final = {"motion.duration_s": "--duration", "checks.clearance_mm": "--clearance"}  # of layout, by address


def after_check(cell: Path, checked: Cell, *, passed: bool, allow_dirs: Sequence[Path] = ()) -> list[str]:
    """What to type after a check."""
    if passed:
        return [_line("solve", str(cell), *_settings(checked.origin.changes), *_folders(allow_dirs))]
    return list(_repair(cell, checked, allow_dirs))


def after_solve(cell: Path, solved: Cell, failed: Iterable[str], *, run: Path, allow_dirs: Sequence[Path]) -> list[str]:
    """What to type after a cell was solved."""
    names = set(failed)
    if not names:
        return [export_line(run, cell, allow_dirs)]
    lines = list(_repair(cell, solved, allow_dirs))
    if names <= PASSED_BY_TIME:
        lines.insert(0, _line("fastest", str(cell), *_settings(solved.origin.changes), *_folders(allow_dirs)))
    return lines


def export_line(run: Path, cell: Path | None, allow_dirs: Sequence[Path]) -> str:
    """The line to type for the programs of a run; without its cell file, by the run's own copy of it."""
    words = ["--without-cell"] if cell is None else ["--cell", str(cell)]
    return _line("export", str(run), "--format", "csv", *words, *_folders(allow_dirs))


def view_line(run: Path, cell: Path, solved: Cell, allow_dirs: Sequence[Path]) -> str:
    """The line to type for the 3-D page of a run; with its cell file where that names files of its own."""
    inputs = user_files(solved.inputs, PurePath(solved.origin.file).name)
    named = ["--cell", str(cell), *_folders(allow_dirs)] if inputs else []
    return _line("view", str(run), *named)


def _repair(cell: Path, failed: Cell, allow_dirs: Sequence[Path]) -> Iterator[str]:
    """The line to type for a cell that fails; none for a job that cannot be searched."""
    if is_searchable(failed):
        words = []
        for address, value in failed.origin.changes.items():
            option = OPTIONS.get(address)
            words += [option, _text(value)] if option else _settings({address: value})
        yield _line("layout", str(cell), "--repair", *words, *_folders(allow_dirs))


def _settings(changes: Mapping[str, object]) -> list[str]:
    """Values that were set in the cell, as options."""
    return [word for address, value in changes.items() for word in ("--set", f"{address}={_text(value)}")]


def _folders(allow_dirs: Sequence[Path]) -> list[str]:
    return [word for folder in allow_dirs for word in ("--allow-dir", str(folder))]


def _text(value: object) -> str:
    """A value as it is written on the command line."""
    return "null" if value is None else flow_text(value)


def _line(*words: str) -> str:
    """A command to type."""
    return f"next: {shlex.join(['cellplan', *words])}"
