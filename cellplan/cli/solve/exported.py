"""What came of exports, for people and for machines."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from cellplan.cli.terminal.errors import error_lines, exit_status
from cellplan.cli.terminal.output import Result, notes
from cellplan.errors import ExitStatus, InputError

if TYPE_CHECKING:
    from cellplan.model.report.verified_run import ReadRun, VerifiedRun
    from cellplan.programs.export.refusals import Exported

SCHEMA: Final = "cellplan.exported/1"


def result_of_one(
    run: "VerifiedRun", folder: Path, form: str, *, files: Sequence[str], record: Mapping[str, Any]
) -> Result:
    """What to say of one format."""
    about = {"schema": SCHEMA, "status": "exported", "exit": int(ExitStatus.PASSED), "folder": str(folder)}
    what = {"format": form, "run": run.digest, "files": list(files), "remarks": list(run.remarks), "export": record}
    lines = [f"{run.cell.name}: exported", *promise_lines(record), *notes(run.remarks), f"programs: {folder}"]
    return Result(ExitStatus.PASSED, lines, {**about, **what})


def result_of_several(
    run: "VerifiedRun | ReadRun", folder: Path, exports: "Sequence[Exported]", remarks: Sequence[str] = ()
) -> Result:
    """What to say of several formats, each in a folder within one."""
    status, written = _status(exports), [export.form for export in exports if export.refusal is None]
    word = "exported" if status == ExitStatus.PASSED else "refused"
    about = {"schema": SCHEMA, "status": word, "exit": int(status), "folder": str(folder) if written else None}
    what = {"run": run.digest, "remarks": list(remarks), "exports": [_record(export) for export in exports]}
    lines = [f"{run.cell.name}: exported {', '.join(written) or 'nothing'}"]
    for export in exports:
        lines += [f"  {export.form}: {'refused' if export.refusal else export.folder}"]
        if export.refusal is not None:
            lines += [f"    {line.removeprefix('error: ')}" for line in error_lines(export.refusal)]
        else:
            lines += [f"  {line}" for line in promise_lines(export.record or {"files": ()})]
    place = [f"programs: {folder}"] if written else []
    return Result(status, [*lines, *notes(remarks), *place], {**about, **what})


def _status(exports: "Sequence[Exported]") -> ExitStatus:
    """How the command ends: what was named must be written, and something of all."""
    refused = [export.refusal for export in exports if export.refusal is not None]
    if len(refused) < len(exports) and not any(export.is_named and export.refusal for export in exports):
        return ExitStatus.PASSED
    if len(refused) == len(exports) and all(isinstance(refusal, InputError) for refusal in refused):
        return ExitStatus.BAD_INPUT
    return ExitStatus.CHECK_FAILED


def _record(export: "Exported") -> dict[str, Any]:
    """What came of one format among several, for machines."""
    if export.refusal is not None:
        refused = {"status": "refused", "exit": int(exit_status(export.refusal)), "errors": error_lines(export.refusal)}
        return {"format": export.form, "folder": None, **refused}
    about = {"format": export.form, "folder": str(export.folder), "status": "exported", "exit": 0}
    return {**about, "files": list(export.files), "export": export.record}


def promise_lines(record: Mapping[str, Any]) -> Iterator[str]:
    """What is promised of exported programs by their ``export.json``, why not more, and what was found in them."""
    if "promise" in record:
        yield f"  promise: {record['promise']}"
        yield from (f"    {reason}" for reason in [*record["reasons"], *record["remarks"]])
        if record["allowed_skew"] is not None:
            yield f"  {record['allowed_skew']['line']}"
        if record["marks"]:
            count = sum(len(marks["times_s"]) for marks in record["marks"])
            yield f"  marks: all robots of the cell wait for one another at {count}"
        yield f"  {record['deviation']}"
        yield from (f"  not judged: {text}" for text in record["not_judged"])
    yield f"  files: {len(record['files'])}"
