"""Folder of a study: the journal, the result once all trials are there, and the runs of variants that are kept."""

import json
import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.files import digest
from cellplan.files.run.content import LEFT_ALONE, foreign_within, is_run_folder
from cellplan.files.run.whole_file import refuse_unless_writable, write_whole
from cellplan.study.running import STATE, cannot_write, require_idle

SCHEMA: Final = "cellplan.study/1"
JOURNAL: Final = "study.jsonl"
RESULT: Final = "study.json"
AHEAD: Final = "study-ahead.jsonl"  # trials that wait for one before them
RUNS: Final = "runs"
RESULT_FILE: Final = re.compile(r"\.?study(-[a-z]+)?\.(jsonl|json|csv|html|svg|png|pdf)(\.draft)?")
RUN_NAME: Final = re.compile(r"\d{4,6}")
MARK_WITHIN: Final = 200  # [bytes]
BEFORE_JOURNAL: Final = {STATE, f".{JOURNAL}.draft"}  # all that a study which was killed at its start leaves


def run_folder(folder: Path, number: int) -> Path:
    """Run folder of a variant."""
    return folder / RUNS / f"{number:04d}"


def refuse_unless_study(folder: Path) -> None:
    """Refuse a folder in use, not writable or with what no study wrote; call it early, before any long work."""
    try:
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            raise InputError(f"{folder}: expected a folder for the study, got something else")
        if not folder.exists():
            refuse_unless_writable(folder)
            return
        foreign = _foreign(folder)
        if foreign:
            raise InputError(
                f"{folder}: holds '{foreign}', which no study wrote; choose another folder with -o or empty this one"
            )
        require_idle(folder)
    except OSError as error:
        raise cannot_write(folder, error) from error


def prepare_folder(folder: Path, *, resume: bool) -> None:
    """Make the folder of a study, or empty that of an earlier one; a study that is continued keeps journal and runs."""
    refuse_unless_study(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        expected = {STATE, JOURNAL, AHEAD, RUNS} if resume else {STATE}
        for entry in folder.iterdir():
            if entry.name not in expected:
                shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
    except OSError as error:
        raise cannot_write(folder, error) from error


def write_results(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write the results of a study, each file whole or not at all."""
    for name, content in files.items():
        try:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            write_whole(folder / name, content)
        except OSError as error:
            raise cannot_write(folder / name, error) from error


def _foreign(folder: Path) -> str | None:
    """The first thing in a folder that no study wrote; None when there is none."""
    entries = sorted(folder.iterdir())
    if not _has_journal(folder):
        return next((entry.name for entry in entries if entry.name not in BEFORE_JOURNAL), None)
    listed = _listed(folder)
    for entry in entries:
        if (
            entry.name == LEFT_ALONE
            or _is_listed(entry, folder, listed)
            or (RESULT_FILE.fullmatch(entry.name) and entry.is_file() and not entry.is_symlink())
        ):
            continue
        if entry.name != RUNS or not entry.is_dir() or entry.is_symlink():
            return entry.name
        foreign = next(filter(None, map(_foreign_run, sorted(entry.iterdir()))), None)
        if foreign:
            return f"{RUNS}/{foreign}"
    return None


def _listed(folder: Path) -> Mapping[str, str]:
    """Digests of further results by name, as ``study.json`` lists them; none where it lists none."""
    try:
        record = json.loads((folder / RESULT).read_bytes())
        return {file["name"]: file["sha256"] for file in record["files"]}
    except (OSError, ValueError, TypeError, KeyError):
        return {}


def _is_listed(entry: Path, folder: Path, listed: Mapping[str, str]) -> bool:
    """Whether a file, or every file of a folder, is a result that no one has changed since."""
    if entry.is_symlink():
        return False
    if entry.is_dir():
        within = sorted(entry.iterdir())
        return bool(within) and all(_is_listed(entry, folder, listed) for entry in within)
    return listed.get(entry.relative_to(folder).as_posix()) == digest(entry.read_bytes())


def _foreign_run(entry: Path) -> str | None:
    """The first thing in a run of a study that is not part of it."""
    if entry.is_symlink() or not RUN_NAME.fullmatch(entry.name) or not is_run_folder(entry):
        return entry.name
    within = foreign_within(entry)
    return f"{entry.name}/{within}" if within else None


def _has_journal(folder: Path) -> bool:
    """Whether the folder holds the journal of a study."""
    journal = folder / JOURNAL
    if journal.is_symlink() or not journal.is_file():
        return False
    with journal.open("rb") as file:
        return f'"schema": "{SCHEMA}"'.encode() in file.read(MARK_WITHIN)
