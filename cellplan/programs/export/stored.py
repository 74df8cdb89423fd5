"""Stored export: the record and the files of a folder of programs, read strictly."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final, TypeVar

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.input.files import digest, read_regular_file
from cellplan.files.input.findings import did_you_mean, listed, shown
from cellplan.files.input.json_reader import parse_json, required
from cellplan.files.run.folder import EXPORT, MANIFEST
from cellplan.model.report.exported import Moves, Promise
from cellplan.model.report.verified_run import ReadRun, VerifiedRun
from cellplan.programs.export.choice import Choice

Word = TypeVar("Word", Promise, Moves)

SCHEMA: Final = "cellplan.export/2"
SIZE_LIMIT: Final = 50_000_000  # [bytes] of a record: marks of many phases
FILE_LIMIT: Final = 2_000_000_000  # [bytes] of a program
IGNORED: Final = ".DS_Store"  # put into every folder by the file manager of one system


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredExport:
    """What a folder of programs holds."""

    folder: Path
    record: Mapping[str, Any]  # what its ``export.json`` says
    files: Mapping[str, str]  # text of its programs by path

    @property
    def form(self) -> str:
        """Name of the format."""
        return str(self.record["format"])

    @property
    def where(self) -> str:
        """The record in messages."""
        return str(self.folder / EXPORT)

    @property
    def promise(self) -> Promise:
        """What is promised, as the record says."""
        return self._one_of("promise", Promise)

    @property
    def choice(self) -> Choice:
        """What was chosen, as the record says."""
        robots = required(self.record, "robots", list, file=self.where)
        thinning, split = self.record.get("thinning"), self.record.get("split")
        if split is not None:
            split = required(self.record, "split", int, file=self.where)
        mm, deg = (None, None) if thinning is None else (self._number("mm"), self._number("deg"))
        is_requested = self.record.get("asked_promise") is not None
        return Choice(
            robots=tuple(str(name) for name in robots),
            moves=self._one_of("moves", Moves),
            split=split,
            thin_mm=mm,
            thin_deg=deg,
            promise=self._one_of("asked_promise", Promise) if is_requested else None,
            steps=self.record.get("steps") is True,
        )

    def changed(self) -> Iterator[InputError]:
        """Programs that are not as they were exported."""
        for name, text in self.files.items():
            got = digest(text.encode("utf-8", "surrogateescape"))
            if got != self.record["files"][name]:
                yield InputError(
                    f"{self.folder / name}: changed since it was exported (SHA-256 {got[:12]}…); export the run again"
                )

    def _one_of(self, key: str, kind: type[Word]) -> Word:
        """A word of the record."""
        value, allowed = required(self.record, key, str, file=self.where), [str(member) for member in kind]
        if value not in allowed:
            raise InputError(
                f"{self.where}: {key}: expected one of {', '.join(allowed)}, got {shown(value)}"
                f"{did_you_mean(value, allowed)}"
            )
        return kind(value)

    def _number(self, key: str) -> float:
        """A figure of the thinning."""
        thinning = required(self.record, "thinning", dict, file=self.where)
        value = thinning.get(key)
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise InputError(f"{self.where}: thinning.{key}: expected a number, got {shown(value)}")
        return float(value)


def is_export(folder: Path) -> bool:
    """Whether a folder holds exported programs, not a run."""
    return (folder / EXPORT).is_file() and not (folder / MANIFEST).is_file()


def run_of_export(folder: Path) -> Path:
    """The run folder around a folder of programs; ``InputError`` where there is none."""
    for above in folder.resolve().parents:
        if (above / MANIFEST).is_file():
            try:
                return above.relative_to(Path.cwd())
            except ValueError:
                return above
    raise InputError(f"--run: expected the run folder that the programs in '{folder}' were made from, got none")


def read_stored_export(folder: Path) -> StoredExport:
    """Read a folder of programs: its record, which is of this version, and exactly the texts that this lists."""
    where = str(folder / EXPORT)
    record = parse_json(read_regular_file(folder / EXPORT, file=where, limit=SIZE_LIMIT), where)
    if record.get("schema") != SCHEMA:
        raise InputError(
            f"{where}: schema: expected '{SCHEMA}', got {shown(record.get('schema'))}; export the run again"
        )
    required(record, "format", str, file=where)
    required(record, "run", str, file=where)
    names = required(record, "files", dict, file=where)
    findings = list(_entries(folder, names))
    if findings:
        raise InvalidFileError(findings)
    return StoredExport(folder=folder, record=record, files={name: _text(folder, name) for name in names})


def refuse_other_run(stored: StoredExport, run: VerifiedRun | ReadRun) -> None:
    """Refuse a run that the programs were not made from, or other names of controllers."""
    if stored.record["run"] != run.digest:
        raise InputError(
            f"{stored.where}: run: expected {run.digest[:12]}… as of '{run.folder}', got "
            f"{shown(str(stored.record['run'])[:12])}…; the programs were made from another run"
        )
    files = (required(stored.record, "names", dict, file=stored.where) if "names" in stored.record else {}, run.names)
    made, got = (listed(f"'{name}' (SHA-256 {str(sha)[:12]}…)" for name, sha in names.items()) for names in files)
    if made != got:
        raise InputError(
            f"{stored.where}: names: expected those of {made}, with which the programs were made, got those of {got}; "
            "name that file with --controllers, or a changed cell with --cell, or export the run again"
        )


def _entries(folder: Path, names: Mapping[str, Any]) -> Iterator[InputError]:
    """What is missing or one too many in a folder of programs."""
    for name in names:
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or "\\" in name or str(path) != name or name == EXPORT:
            yield InputError(f"{folder / EXPORT}: files: expected paths inside the folder, got {shown(name)}")
            return
    entries = set()
    for entry in sorted(folder.rglob("*")):
        name = entry.relative_to(folder).as_posix()
        if entry.is_symlink():
            yield InputError(f"{entry}: expected a file or folder of the export, got a symbolic link")
        elif not entry.is_dir() and name not in {EXPORT, IGNORED}:
            entries.add(name)
            if name not in names:
                yield InputError(f"{entry}: not part of the export; remove it, or export the run again")
    for name in names:
        if name not in entries:
            yield InputError(f"{folder / name}: missing; the programs were written with it")


def _text(folder: Path, name: str) -> str:
    """A program as text; the ``InputError`` has the line of what is not UTF-8."""
    data = read_regular_file(folder / name, file=str(folder / name), limit=FILE_LIMIT)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = 1 + data.count(b"\n", 0, error.start)
        raise InputError(f"{folder / name}:{line}: expected text, got byte 0x{data[error.start]:02x}") from None
