"""What belongs to a run folder, at any depth: everything else in it belongs to the user and is never removed."""

import json
import re
import stat
from collections.abc import Collection, Iterator
from pathlib import Path, PurePosixPath
from typing import Any, Final

MARK: Final = '"schema": "cellplan.'  # stands in the first lines of every report.json and rehearsal.json
MARK_WITHIN: Final = 200  # [bytes]
LIST_LIMIT: Final = 5_000_000  # [bytes] of a file that lists others
ASSIGNMENT: Final = "assign.json"  # who does which task, in the folder of the cell that says so
RECOVERY: Final = "recovery.json"  # what a recovery does, in the folder that holds its tables
REPORTS: Final = (
    "report.json",
    "rehearsal.json",
    "export.json",
    "fastest.json",
    "map.json",
    "advice.json",
    ASSIGNMENT,
    RECOVERY,
)
REHEARSAL: Final = "rehearsal"  # folder of a rehearsal, inside the run folder of its cell
PROGRAMS: Final = "programs"  # folder of exported programs, inside the run folder that they were made from
RECOVER: Final = "recover"  # folder of a recovery, inside the run folder that it starts from
EXPORT: Final = "export.json"  # what was exported, in the folder that holds it
MANIFEST: Final = "manifest.json"
LEFT_ALONE: Final = ".DS_Store"  # put into every folder by the file manager of one system
RUN_FOLDERS: Final = frozenset({PROGRAMS, "plots", "tables", "rejected"})  # their content is compared file by file
USUAL: Final = re.compile(  # what a run, a rehearsal or a draft of them may hold that lists no files
    r"cell\.yaml|(manifest|series)\.json|view\.html|(still|floor_plan)\.svg|(report|rehearsal|export|fastest|advice)\.(json|html)|map\.(json|html|svg|png|pdf)|curve\.csv|(demand|best)\.yaml"
    r"|plots/[^/]+\.(svg|png|pdf)|(tables|rejected)/([^/]+/)?[^/]+\.csv"
)


def is_run_folder(path: Path) -> bool:
    """Whether a folder holds a report that cellplan wrote."""
    return any(_is_its_report(path / name) for name in REPORTS)


def foreign_entry(path: Path, *, unlisted: Collection[str] = ()) -> str | None:
    """The first thing in a folder that is not part of a run; None when the folder is empty or a run.

    A folder that holds nothing but the rehearsal of its cell is to become a run.

    Args:
        unlisted: Names of files that may stand there too, with a run or without one.
    """
    names = sorted(entry.name for entry in path.iterdir() if entry.name not in unlisted)
    if names and not is_run_folder(path) and not (names == [REHEARSAL] and _is_run_entry(path / REHEARSAL)):
        return names[0]
    return foreign_within(path, unlisted=unlisted)


def foreign_within(path: Path, *, unlisted: Collection[str] = ()) -> str | None:
    """The first thing at any depth of a run, or of a draft of one, that is not part of it; None when there is none.

    Args:
        unlisted: Names of files in the folder itself that are taken as part of it.
    """
    return next((name for name in _foreign(path, "") if name not in unlisted), None)


def _foreign(run: Path, above: str) -> Iterator[str]:
    """Everything in a run that is not part of it, by its path with what stands above the run."""
    listed = _listed(run)
    waiting = [run]
    while waiting:
        for entry in sorted(waiting.pop().iterdir()):
            name = entry.relative_to(run).as_posix()
            mode = entry.lstat().st_mode
            if stat.S_ISDIR(mode):
                if _is_run_entry(entry) and not _holds_listed(name, listed):
                    yield from _foreign(entry, f"{above}{name}/")
                elif _holds_listed(name, listed) or PurePosixPath(name).parts[0] in RUN_FOLDERS:
                    waiting.append(entry)
                else:
                    yield f"{above}{name}"
            elif not stat.S_ISREG(mode) or not _is_part(name, listed):
                yield f"{above}{name}"


def _is_part(name: str, listed: frozenset[str] | None) -> bool:
    """Whether a file is part of a run: one that the run lists, or a usual one of a run that lists none."""
    if PurePosixPath(name).name == LEFT_ALONE:
        return True
    if listed is None or name == "view.html":
        return USUAL.fullmatch(name) is not None
    return name in listed


def _holds_listed(name: str, listed: frozenset[str] | None) -> bool:
    """Whether a run lists files below a folder."""
    return listed is not None and any(file.startswith(f"{name}/") for file in listed)


def _listed(run: Path) -> frozenset[str] | None:
    """The files that a run or another result lists, the lists themselves among them; None when it lists none."""
    names: set[str] = set()
    for name in (MANIFEST, EXPORT, RECOVERY, ASSIGNMENT):
        files = _files_of(run / name)
        if files is not None:
            names |= {name, *files}
    return frozenset(names) or None


def _files_of(record: Path) -> list[str] | None:
    """Names of the files that a record lists; None when there is no such record, or none that can be read."""
    if not _is_its_report(record):
        return None
    try:
        files: Any = json.loads(record.read_bytes()[:LIST_LIMIT])["files"]
        return [str(name) for name in files]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def _is_its_report(report: Path) -> bool:
    """Whether a file is a report that cellplan wrote."""
    if report.is_symlink() or not report.is_file():
        return False
    with report.open("rb") as file:
        return MARK.encode() in file.read(MARK_WITHIN)


def _is_run_entry(entry: Path) -> bool:
    """Whether something in a folder is a run folder of its own."""
    return entry.is_dir() and not entry.is_symlink() and is_run_folder(entry)
