"""A run as it stands on disk: its folder read whole, each file as it was written, and compared with its manifest."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Final

import numpy as np

from cellplan.errors import InputError, InvalidFileError
from cellplan.files.input.files import digest, read_regular_file, utf8_text
from cellplan.files.input.findings import shown
from cellplan.files.input.json_reader import parse_json, required
from cellplan.files.run.clock_table import parse_clock
from cellplan.files.run.folder import MANIFEST
from cellplan.files.run.joint_tables import MM_PER_M, parse_header, parse_table, row_place
from cellplan.files.run.manifest import SIZE_LIMIT, Manifest, file_findings, parse_manifest
from cellplan.model.motion.motion import JointTable

REPORT_SCHEMA: Final = "cellplan.report/1"
OF_EVERY_RUN: Final = ("report.html", "report.json")
SERIES: Final = "series.json"
CELL: Final = "cell.yaml"
CLOCK: Final = "clock"  # name of the table beside those of the robots: none of them may have it
TABLE_LIMIT: Final = 500_000_000  # [bytes] of a table that is read only to find where it was changed
SERIES_TOL: Final = 1e-6  # [-] series have seven digits

Record = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredRun:
    """The content of a run folder whose files are all as they were written."""

    folder: Path  # the run folder
    digest: str  # SHA-256 of the manifest, which stands for the whole run
    manifest: Manifest  # what the run holds and rests on
    record: Record  # its ``report.json``
    records: Mapping[str, Record]  # ``report.json`` of each phase, by its place in the folder, empty for a single one
    tables: Mapping[str, str]  # text of the joint tables, by robot
    clock: str  # text of the clock of the program; empty for a failed run

    def file(self, place: str, name: str) -> str:
        """Path of a file of one run as messages show it."""
        return str(self.folder / place / name)

    def content(self, place: str, name: str) -> bytes:
        """Content of a file of one run, which is still as it was written."""
        return _content(self.folder, _at(place, name), self.manifest)

    def report(self, place: str) -> Record:
        """The ``report.json`` of one phase, or of the program."""
        return self.records.get(place, self.record)

    def series(self, place: str) -> Record:
        """The ``series.json`` of one run, unchanged and in JSON."""
        return parse_json(self.content(place, SERIES), self.file(place, SERIES))

    def drawings(self, place: str) -> dict[str, bytes]:
        """The SVG pictures of one run by file name, in the order of the manifest."""
        plots = PurePosixPath(_at(place, "plots"))
        names = [PurePosixPath(name) for name in self.manifest.files]
        drawing_names = [path.name for path in names if path.parent == plots and path.suffix == ".svg"]
        return {name: self.content(place, f"plots/{name}") for name in drawing_names}


def read_stored_run(folder: Path) -> StoredRun:
    """Read a run folder and compare every file with the manifest; an ``InvalidFileError`` has a line for each."""
    manifest, whole = _manifest(folder)
    changed = file_findings(folder, manifest)
    if changed:
        raise InvalidFileError([*changed.values(), *_spoilt_tables(folder, changed, manifest)])
    record = _record(folder, "report.json", manifest)
    records = _records(folder, record, manifest)
    findings = list(_incomplete(folder, manifest, [*records]))
    findings += _contradictions(folder, manifest, record=record, records=records)
    if findings:
        raise InvalidFileError(findings)
    tables = dict(_tables(folder, manifest))
    clock = tables.pop(CLOCK, "")
    return StoredRun(
        folder=folder, digest=whole, manifest=manifest, record=record, records=records, tables=tables, clock=clock
    )


def _manifest(folder: Path) -> tuple[Manifest, str]:
    if not folder.is_dir():
        what = "a file" if folder.exists() else "nothing"
        raise InputError(f"{folder}: expected the folder of a run, got {what}")
    path = folder / MANIFEST
    if path.is_symlink():
        raise InputError(f"{path}: expected a file of the run, got a symbolic link")
    if not path.exists():
        has_report = (folder / "report.json").is_file()
        why = "a run without a manifest: solve the cell again" if has_report else "no manifest.json in it"
        raise InputError(f"{folder}: expected the folder of a run, got {why}")
    data = read_regular_file(path, file=str(path), limit=SIZE_LIMIT)
    return parse_manifest(data, str(path)), digest(data)


def _content(folder: Path, name: str, manifest: Manifest) -> bytes:
    """Content of a file that must be the one of the manifest, even if it is written to meanwhile."""
    file, stored = str(folder / name), manifest.files.get(name)
    if stored is None:
        raise InputError(f"{file}: missing; the run was written without it")
    data = read_regular_file(folder / name, file=file, limit=stored.size)
    if digest(data) != stored.digest:
        raise InputError(f"{file}: changed while it was read")
    return data


def _record(folder: Path, name: str, manifest: Manifest) -> Record:
    """A report of known form."""
    file = str(folder / name)
    record = parse_json(_content(folder, name, manifest), file)
    if record.get("schema") != REPORT_SCHEMA:
        raise InputError(f"{file}: schema: expected '{REPORT_SCHEMA}', got {shown(record.get('schema'))}")
    for key, kind in (("cell", str), ("status", str), ("tasks", dict), ("inputs", dict), ("versions", dict)):
        required(record, key, kind, file=file)
    return record


def _records(folder: Path, record: Record, manifest: Manifest) -> dict[str, Record]:
    """The report of each run, by its place."""
    if "runs" not in record:
        return {"": record}
    runs = required(record, "runs", dict, file=str(folder / "report.json"))
    if not runs:
        raise InputError(f"{folder / 'report.json'}: runs: expected at least one")
    return {name: _record(folder, f"{name}/report.json", manifest) for name in runs}


def _incomplete(folder: Path, manifest: Manifest, places: list[str]) -> Iterator[InputError]:
    """What a run must have and this one has not, and tables that do not go with the verdict."""
    demanded = [CELL, *(_at(place, name) for place in dict.fromkeys(["", *places]) for name in OF_EVERY_RUN)]
    demanded += [_at(place, SERIES) for place in places]
    demanded += [f"tables/{CLOCK}.csv"] if manifest.status == "passed" else []
    for name in demanded:
        if name not in manifest.files:
            yield InputError(f"{folder / name}: missing; every run has it")
    unfitting = "rejected" if manifest.status == "passed" else "tables"
    for name in manifest.files:
        if _is_table(name, unfitting):
            yield InputError(f"{folder / name}: does not go with a run that has {manifest.status}")
        elif PurePosixPath(name).suffix == ".csv" and not _is_table(name) and not _is_table(name, "rejected"):
            yield InputError(f"{folder / name}: is not a table of the run; all of them lie in 'tables'")


def _contradictions(
    folder: Path, manifest: Manifest, *, record: Record, records: Mapping[str, Record]
) -> Iterator[InputError]:
    """Reports that say something else than the manifest."""
    named = {"report.json": record} | {_at(place, "report.json"): entry for place, entry in records.items()}
    for name, entry in named.items():
        said = {
            "cell": (entry["cell"], manifest.cell),
            "inputs": (entry["inputs"], dict(manifest.inputs)),
            "versions": (entry["versions"], dict(manifest.versions)),
        }
        if name == "report.json":
            said["status"] = (entry["status"], manifest.status)
        for key, (got, expected) in said.items():
            if got != expected:
                yield InputError(f"{folder / name}: {key}: contradicts {MANIFEST}; solve the cell again")


def _tables(folder: Path, manifest: Manifest) -> Iterator[tuple[str, str]]:
    """Name and text of each table of the program."""
    for name in manifest.files:
        if _is_table(name):
            yield PurePosixPath(name).stem, utf8_text(_content(folder, name, manifest), file=str(folder / name))


def _is_table(name: str, folder: str = "tables") -> bool:
    """Whether a file of the manifest is a table of the program."""
    path = PurePosixPath(name)
    return path.suffix == ".csv" and str(path.parent) == folder


def _spoilt_tables(folder: Path, changed: Iterable[str], manifest: Manifest) -> Iterator[InputError]:
    """Where exactly a table that was changed can no longer be read, or is another one."""
    for name in changed:
        path = folder / name
        if path.suffix != ".csv" or path.is_symlink() or not path.is_file():
            continue
        try:
            data = read_regular_file(path, file=str(path), limit=TABLE_LIMIT)
            text = data.decode("utf-8", "replace")
            if path.stem == CLOCK:
                parse_clock(text, str(path))
            else:
                parse_header(text, str(path))
                yield from _first_other_row(parse_table(text, str(path)), text, path, _series_of(folder, manifest))
        except InputError as error:
            yield error
        except (AttributeError, KeyError, TypeError, ValueError):  # the report was changed too: nothing to compare with
            continue


def _series_of(folder: Path, manifest: Manifest) -> list[Record]:
    """The series of all phases in their order, as they are on disk now."""
    report = parse_json(_as_it_is(folder / "report.json"), str(folder / "report.json"))
    names = [_at(place, SERIES) for place in report.get("runs", {"": None})]
    return [parse_json(_as_it_is(folder / name), str(folder / name)) for name in names if name in manifest.files]


def _as_it_is(path: Path) -> bytes:
    """Content of a file that may have been changed."""
    return read_regular_file(path, file=str(path), limit=TABLE_LIMIT)


def _first_other_row(table: JointTable, text: str, path: Path, series: list[Record]) -> Iterator[InputError]:
    """The first number that differs from the series of the phases, where these have all rows."""
    curves_of_robot = [curves.get("joints", {}).get(table.robot, {}) for curves in series]
    if any(curves.get("every") != 1 for curves in series) or any(
        list(one) != list(table.joints) for one in curves_of_robot
    ):
        return
    others = []
    for joint, q in zip(table.joints, table.q.T, strict=True):
        is_turn = "position_deg" in curves_of_robot[0][joint]
        key = "position_deg" if is_turn else "position_mm"
        said = np.concatenate([np.array(one[joint][key], dtype=np.float64) for one in curves_of_robot])
        written = np.rad2deg(q) if is_turn else MM_PER_M * q
        if said.shape != written.shape:
            return
        other = np.flatnonzero(~np.isclose(written, said, rtol=SERIES_TOL, atol=SERIES_TOL))
        others += [(int(other[0]), joint, float(said[other[0]]), float(written[other[0]]))] if len(other) else []
    if others:
        row, joint, said_there, got = min(others)
        place = row_place(text, str(path), row)
        yield InputError(f"{place}: {joint}: expected {said_there:.7g} as in {SERIES}, got {got:.10g}")


def _at(place: str, name: str) -> str:
    """Path of a file in the run folder."""
    return f"{place}/{name}" if place else name
