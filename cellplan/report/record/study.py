"""``study.json``: a study as one record, and its trials as a table."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, TypedDict

from cellplan.report.record.common import Record
from cellplan.report.record.key_figures import KeyFigures

SCHEMA: Final = "cellplan.study/1"
STATUSES: Final = ("passed", "failed", "no_solution", "bad_input", "crashed")


class TrialRecord(TypedDict):
    """One variant and what came of it."""

    trial: Annotated[int, "number of the variant, from 0"]
    values: Annotated[dict[str, Any], "by address: the values that make the variant"]
    status: Annotated[str, "`passed`, `failed` (a check), `no_solution`, `bad_input` or `crashed`"]
    reason: Annotated[str, "first failed check, or why there is no motion; empty if passed"]
    figures: Annotated[KeyFigures | dict[str, Any], "key figures; empty if there is no motion"]


class StudyRecord(TypedDict):
    """A study of one cell."""

    schema: Annotated[str, "name and version of the format"]
    kind: Annotated[str, "`sweep`"]
    cell: Annotated[str, "name of the cell"]
    settings: Annotated[dict[str, Any], "by address: values set for all variants"]
    task: Annotated[str | None, "the only task that is worked on; null for all"]
    vary: Annotated[dict[str, list[Any]], "by address: the values that were combined"]
    counts: Annotated[dict[str, int], "by status: number of variants"]
    trials: Annotated[list[TrialRecord], "all variants in their order"]
    inputs: Annotated[dict[str, str], "SHA-256 of every input file, by name"]
    versions: Annotated[dict[str, str], "versions of cellplan and of the packages that the numbers depend on"]


def study_record(header: Mapping[str, Any], trials: Sequence[Record]) -> StudyRecord:
    """The record of a study.

    Args:
        header: What the study is about: kind, cell, settings, task, vary, inputs and versions.
        trials: Its trials in their order.
    """
    counts = Counter(trial["status"] for trial in trials)
    return {
        "schema": SCHEMA,
        "kind": header["kind"],
        "cell": header["cell"],
        "settings": header["settings"],
        "task": header["task"],
        "vary": header["vary"],
        "counts": {status: counts[status] for status in STATUSES},
        "trials": [
            {
                "trial": trial["trial"],
                "values": trial["values"],
                "status": trial["status"],
                "reason": trial["reason"],
                "figures": trial["figures"],
            }
            for trial in trials
        ],
        "inputs": header["inputs"],
        "versions": header["versions"],
    }


def study_table(record: Record) -> str:
    """The trials as CSV: a row for each, with its values, its status and its figures."""
    figures = list(KeyFigures.__annotations__)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["trial", *record["vary"], "status", *figures, "reason"])
    for trial in record["trials"]:
        values = [trial["values"][address] for address in record["vary"]]
        own = [trial["figures"].get(name) for name in figures]
        writer.writerow([trial["trial"], *values, trial["status"], *own, trial["reason"]])
    return text.getvalue()
