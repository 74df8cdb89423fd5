"""Manifest of a run: every file of its folder with size and digest, and the digests and versions it rests on."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePath, PurePosixPath
from typing import Any, Final

from cellplan.errors import InputError
from cellplan.files.input.files import digest_of_file
from cellplan.files.input.findings import shown
from cellplan.files.input.json_reader import parse_json, required
from cellplan.files.run.folder import MANIFEST, PROGRAMS, RECOVER, REHEARSAL
from cellplan.model.cell.cell import Cell

SCHEMA: Final = "cellplan.manifest/1"
SIZE_LIMIT: Final = 5_000_000  # [bytes] of the manifest; two hundred runs of sixty-four robots need less than half
BUNDLED: Final = "bundled:"  # begins the name of an input that comes with the program
NEAR: Final = "near:"  # begins that of a run of which the branches were kept; no file of the cell
MADE_LATER: Final = frozenset({PROGRAMS, REHEARSAL, RECOVER, "view.html"})  # from a written run; no part of it
IGNORED: Final = ".DS_Store"  # put into every folder by the file manager of one system
KEYS: Final = ("schema", "cell", "status", "cell_file", "changes", "inputs", "versions", "files")
_DIGEST: Final = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredFile:
    """What a manifest says of one file: its size in bytes and its SHA-256 in hexadecimal."""

    size: int
    digest: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a run folder holds and rests on."""

    cell: str  # name of the cell
    status: str  # ``passed`` or ``failed``
    cell_file: str  # name of the cell file, without folders
    changes: Mapping[str, object]  # values that were set when the cell was solved, by their address in the cell file
    inputs: Mapping[str, str]  # SHA-256 of every file that was read, by its path from the folder of the cell file
    versions: Mapping[str, str]  # version by package, of those whose arithmetic the result rests on
    files: Mapping[str, StoredFile]  # every file of the run but the manifest, by its path in the run folder

    @property
    def user_files(self) -> tuple[str, ...]:
        """Files beside the cell file that the cell names; robots that come with the program are not among them."""
        return user_files(self.inputs, self.cell_file)

    @property
    def cell_inputs(self) -> dict[str, str]:
        """The inputs but for a run of which the branches were kept: it is not needed any more."""
        return {name: digest for name, digest in self.inputs.items() if not name.startswith(NEAR)}


def user_files(inputs: Iterable[str], cell_file: str) -> tuple[str, ...]:
    """Files that a cell names, but for those that come with the program, and the cell file without its folders."""
    return tuple(name for name in inputs if name != cell_file and not name.startswith((BUNDLED, NEAR)))


def render_manifest(
    cell: Cell, *, passed: bool, versions: Mapping[str, str], files: Mapping[str, tuple[int, str]]
) -> str:
    """The manifest as JSON text, the same for the same run.

    ``files`` has size in bytes and SHA-256 of every file of the run, by its path in the run folder.
    """
    record = {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if passed else "failed",
        "cell_file": PurePath(cell.origin.file).name,
        "changes": dict(cell.origin.changes),
        "inputs": dict(sorted(cell.inputs.items())),
        "versions": dict(versions),
        "files": {name: {"bytes": size, "sha256": digest} for name, (size, digest) in sorted(files.items())},
    }
    return _as_text(record)


def parse_manifest(data: bytes, file: str) -> Manifest:
    """Read a manifest of this version back, strictly; an ``InputError`` has the file."""
    record = parse_json(data, file)
    if record.get("schema") != SCHEMA:
        raise InputError(f"{file}: schema: expected '{SCHEMA}', got {shown(record.get('schema'))}")
    unknown = sorted(set(record) - set(KEYS))
    if unknown:
        raise InputError(f"{file}: {unknown[0][:40]}: unexpected key; allowed are {', '.join(KEYS)}")
    if _as_text(record).encode() != data:
        raise InputError(f"{file}: changed since the run was written: its layout is not that of cellplan")
    texts = {key: required(record, key, str, file=file) for key in ("cell", "status", "cell_file")}
    if texts["status"] not in {"passed", "failed"}:
        raise InputError(f"{file}: status: expected passed or failed, got {shown(texts['status'])}")
    inputs = {name: _digest(value, f"{file}: inputs.{name}") for name, value in _mapping(record, "inputs", file)}
    if texts["cell_file"] not in inputs:
        raise InputError(f"{file}: inputs: expected the cell file {shown(texts['cell_file'])} among them")
    return Manifest(
        **texts,
        changes=dict(_mapping(record, "changes", file)) if "changes" in record else {},
        inputs=inputs,
        versions={name: str(value) for name, value in _mapping(record, "versions", file)},
        files={
            _file_name(name, file): _stored_file(name, value, file) for name, value in _mapping(record, "files", file)
        },
    )


def file_findings(folder: Path, manifest: Manifest) -> dict[str, InputError]:
    """Every file of a run folder that is missing, changed, exchanged or not part of the run; one line each, by name."""
    files, findings = _walk(folder, manifest)
    for name, stored in manifest.files.items():
        if name in files:
            error = _change(folder / name, name, stored, manifest=manifest)
            findings |= {name: error} if error else {}
        elif not any(above in findings for above in (name, *map(str, PurePosixPath(name).parents))):
            findings[name] = InputError(f"{folder / name}: missing; the run was written with it")
    for name in files:
        if name not in manifest.files and name != MANIFEST:
            findings[name] = InputError(f"{folder / name}: not part of the run; remove it, or solve the cell again")
    return dict(sorted(findings.items()))


def _change(path: Path, name: str, stored: StoredFile, *, manifest: Manifest) -> InputError | None:
    """What is to be said of a file that is not as it was written."""
    try:
        digest = digest_of_file(path, file=str(path))
        size = path.stat().st_size
    except InputError as error:
        return error
    except OSError as error:
        return InputError(f"{path}: cannot be read: {(error.strerror or str(error)).lower()}")
    if digest == stored.digest and size == stored.size:
        return None
    others = [other for other, file in manifest.files.items() if file.digest == digest and other != name]
    if others:
        return InputError(f"{path}: holds what was written as '{others[0]}'; solve the cell again")
    sizes = f"{size} bytes, written were {stored.size}" if size != stored.size else f"SHA-256 {digest[:12]}…"
    return InputError(f"{path}: changed since the run was written ({sizes}); solve the cell again")


def _walk(folder: Path, manifest: Manifest) -> tuple[list[str], dict[str, InputError]]:
    """Names of all regular files that may be part of the run, and findings about links and devices."""
    listed = {PurePosixPath(name).parts[0] for name in manifest.files}
    names: list[str] = []
    findings: dict[str, InputError] = {}
    waiting = [folder]
    while waiting:
        place = waiting.pop()
        try:
            entries = sorted(place.iterdir())
        except OSError as error:
            why = (error.strerror or str(error)).lower()
            findings[place.relative_to(folder).as_posix()] = InputError(f"{place}: cannot be read: {why}")
            continue
        for entry in entries:
            name = entry.relative_to(folder).as_posix()
            if entry.is_symlink():
                findings[name] = InputError(f"{entry}: expected a file or folder of the run, got a symbolic link")
            elif name in MADE_LATER - listed:
                continue
            elif entry.is_dir():
                waiting.append(entry)
            elif not entry.is_file():
                findings[name] = InputError(f"{entry}: expected a regular file, got a pipe or a device")
            elif entry.name != IGNORED:
                names.append(name)
    return sorted(names), findings


def _as_text(record: Mapping[str, Any]) -> str:
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _mapping(record: Mapping[str, Any], key: str, file: str) -> Iterator[tuple[str, Any]]:
    yield from required(record, key, dict, file=file).items()


def _digest(value: Any, where: str) -> str:
    if not isinstance(value, str) or not _DIGEST.fullmatch(value):
        raise InputError(f"{where}: expected a SHA-256 in hexadecimal, got {shown(value)}")
    return value


def _file_name(name: str, file: str) -> str:
    """A path that stays inside the run folder."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or "\\" in name or str(path) != name or not path.name:
        raise InputError(f"{file}: files: expected paths inside the run folder, got {shown(name)}")
    return name


def _stored_file(name: str, value: Any, file: str) -> StoredFile:
    where = f"{file}: files.{name}"
    if not isinstance(value, dict) or set(value) != {"bytes", "sha256"}:
        raise InputError(f"{where}: expected the keys bytes and sha256, got {shown(value)}")
    size = required(value, "bytes", int, file=where)
    if size < 0:
        raise InputError(f"{where}: bytes: expected a size, got {size}")
    return StoredFile(size=size, digest=_digest(value["sha256"], f"{where}: sha256"))
