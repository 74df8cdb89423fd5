"""Verification of exported programs: as they lie on disk, against the run that they were made from."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Final

from cellplan.cache import without_cache
from cellplan.errors import InputError, InvalidFileError, NotVerifiedError
from cellplan.files.input.findings import shown
from cellplan.model.progress import Progress, silent
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.exporters import EXPORTERS, exporter_of, require_format
from cellplan.programs.export.prepare import prepare
from cellplan.programs.export.program import verify_rounded
from cellplan.programs.export.record import export_record, table_record
from cellplan.programs.export.refusals import frame_of
from cellplan.programs.export.stored import StoredExport, refuse_other_run
from cellplan.programs.export.written import judged, with_notes
from cellplan.programs.shared import Shared
from cellplan.runs.write_run import versions

NOISE: Final = 1e-6  # [-] of a figure, and of its unit: processors differ in the last digits
MOST: Final = 10  # differences of a record that are listed
NOT_COMPARED: Final = "the texts were not compared: another version of cellplan wrote them"


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifiedExport:
    """What was found of a folder of programs."""

    record: Mapping[str, Any]  # what its ``export.json`` says
    remarks: tuple[str, ...]  # what to know before relying on it


def verify_export(stored: StoredExport, run: VerifiedRun, *, progress: Progress = silent) -> VerifiedExport:
    """Verify exported programs: read them by the reader of their format, and judge what was read against their run.

    A text that is no program of its format is refused with its line, one that was changed otherwise by its digest. With
    digests that fit, every check is made on what the texts hold; and the texts must be those that the run gives.

    Raises:
        InputError: A file was changed, or is none of its format; the programs belong to another run.
        NotVerifiedError: A check fails on what the files hold.
    """
    refuse_other_run(stored, run)
    require_format(stored.form)
    with without_cache():  # a proof rests on the files themselves
        choice = stored.choice if isinstance(EXPORTERS[stored.form], Dialect) else Choice()
        read = _read(stored, run, choice)
        changed = list(stored.changed())
        if changed:
            raise InvalidFileError(changed)
        files, record = _made_again(stored, run, choice, read=read, progress=progress)
    if stored.record.get("promise") != record.get("promise"):
        got, expected = shown(stored.record.get("promise")), shown(record.get("promise"))
        raise InputError(f"{stored.where}: promise: expected {expected}, got {got}")
    if stored.record.get("versions", {}).get("cellplan") != versions()["cellplan"]:
        return VerifiedExport(record=stored.record, remarks=(NOT_COMPARED,))
    other = [*_other_texts(stored, files), *_other_record(stored, record)]
    if other:
        raise InvalidFileError(other[:MOST])
    return VerifiedExport(record=stored.record, remarks=())


def _made_again(
    stored: StoredExport, run: VerifiedRun, choice: Choice, *, read: Any, progress: Progress = silent
) -> tuple[Mapping[str, str], Mapping[str, Any]]:
    """The files and the record that the run gives, after all checks were made on what was read."""
    dialect = exporter_of(stored.form, choice)
    try:
        if isinstance(dialect, Dialect):
            prepared = prepare(run, dialect, choice, progress=progress)
            written = with_notes(run, prepared, judged(run, prepared, read, progress=progress))
            return written.files, export_record(run, prepared, written)
        verify_rounded(Shared(run), read, decimals=dialect.decimals, progress=progress)
        files = dialect.render(run)
        return files, table_record(run, stored.form, dialect.decimals, files)
    except InputError as error:
        raise _placed(stored, error) from None
    except NotVerifiedError as error:
        named = (finding if finding.startswith("  ") else f"{stored.folder}: {finding}" for finding in error.findings)
        raise NotVerifiedError([*named]) from None


def _read(stored: StoredExport, run: VerifiedRun, choice: Choice) -> Any:
    """What the reader of the format finds in the files."""
    dialect = exporter_of(stored.form, choice)
    try:
        if not isinstance(dialect, Dialect):
            return dialect.read(run, stored.files)
        frame = frame_of(run, dialect, _robots(stored, run, choice), stored.promise, choice)
        return dialect.read(frame, stored.files)
    except KeyError as error:
        raise InputError(f"{stored.folder}: expected a program {error}, got none") from None
    except InputError as error:
        raise _placed(stored, error) from None


def _robots(stored: StoredExport, run: VerifiedRun, choice: Choice) -> tuple[str, ...]:
    """The robots of the record, which must be some of the cell, in its order."""
    names = tuple(robot.name for robot in run.cell.robots if robot.name in choice.robots)
    if names != choice.robots or not names:
        raise InputError(
            f"{stored.where}: robots: expected robots of the cell in its order, got {shown(list(choice.robots))}"
        )
    return names


def _placed(stored: StoredExport, error: InputError) -> InputError:
    """A finding of a reader with the folder before the name of the file."""
    findings = error.findings if isinstance(error, InvalidFileError) else [error]
    names, folder = tuple(stored.files), stored.folder
    placed = (f"{folder}{'/' if str(finding).startswith(names) else ': '}{finding}" for finding in findings)
    return InvalidFileError([InputError(text) for text in placed])


def _other_texts(stored: StoredExport, files: Mapping[str, str]) -> Iterator[InputError]:
    """The first line of each file that is not as the run gives it."""
    for name, text in files.items():
        got = stored.files.get(name)
        if got is None:
            yield InputError(f"{stored.folder / name}: missing; the run gives it")
        elif got != text:
            line, expected, actual = _first_other_line(text, got)
            yield InputError(f"{stored.folder / name}:{line}: expected {shown(expected)}, got {shown(actual)}")
    for name in stored.files:
        if name not in files:
            yield InputError(f"{stored.folder / name}: expected no such file; the run does not give it")


def _first_other_line(expected: str, got: str) -> tuple[int, str, str]:
    """Number of the first line that differs, from 1, and both, or that there is none."""
    lines = enumerate(zip_longest(expected.split("\n"), got.split("\n")), start=1)
    number, (one, other) = next((number, pair) for number, pair in lines if pair[0] != pair[1])
    return number, "the end" if one is None else one, "the end" if other is None else other


def _other_record(stored: StoredExport, record: Mapping[str, Any]) -> Iterator[InputError]:
    """Keys of the record that say something else than was found."""
    for key, got, expected in _differences(dict(stored.record), record, ""):
        if key.partition(".")[0] not in {"versions", "files"}:
            yield InputError(f"{stored.where}: {key}: expected {shown(expected)}, got {shown(got)}")


def _differences(got: Any, expected: Any, key: str) -> Iterator[tuple[str, Any, Any]]:
    """Places at which two records differ, with both values."""
    if isinstance(got, Mapping) and isinstance(expected, Mapping):
        for name in dict.fromkeys([*expected, *got]):
            inner = f"{key}.{name}" if key else str(name)
            if name in got and name in expected:
                yield from _differences(got[name], expected[name], inner)
            else:
                yield inner, got.get(name, "nothing"), expected.get(name, "nothing")
    elif isinstance(got, list) and isinstance(expected, list) and len(got) == len(expected):
        for place, (mine, yours) in enumerate(zip(got, expected, strict=True)):
            yield from _differences(mine, yours, f"{key}[{place}]")
    elif not _is_equal(got, expected):
        yield key, got, expected


def _is_equal(got: Any, expected: Any) -> bool:
    """Whether two values are equal, figures to six digits."""
    if type(got) is float and type(expected) is float:
        return math.isclose(got, expected, rel_tol=NOISE, abs_tol=NOISE)
    return type(got) is type(expected) and bool(got == expected)
