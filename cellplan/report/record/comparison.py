"""``study.json`` of a comparison: modes of one cell, or several cells and runs."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, TypedDict

from cellplan.report.record.columns import csv_text
from cellplan.report.record.common import Record
from cellplan.report.record.figures import KEY
from cellplan.report.record.which_pays import sentences

WORK: Final = tuple(f"work_{kind}_{part}" for kind in ("velocity", "acceleration") for part in ("ratio", "joint"))
LOADS: Final = ("positioner_load_s", "positioner_phase_load_s", "operator_load_s", "operator_work_load_s", "load_s")
SCHEMA: Final = "cellplan.study/1"
STATUSES: Final = ("passed", "failed", "no_solution", "bad_input", "crashed")
SINGLE: Final = (*KEY, *WORK, "mean_velocity_ratio", *LOADS)


class ComparedRecord(TypedDict):
    """A mode, a cell or a run, and what came of it."""

    name: Annotated[str, "the mode, or the cell or run as it was named"]
    trial: Annotated[int, "its number, from 0"]
    values: Annotated[dict[str, Any], "by address: the values that make a mode; else `cell` or `run` and where it is"]
    status: Annotated[str, "`passed`, `failed` (a check), `no_solution`, `bad_input` or `crashed`"]
    reason: Annotated[str, "first failed check, or why there is no motion; empty if passed"]
    figures: Annotated[dict[str, Any], "figures; empty if there is no motion"]


class DifferenceRecord(TypedDict):
    """An input that is not the same everywhere."""

    key: Annotated[str, "key path in the cell file, `inputs.` and a file of another content, or `tasks worked on`"]
    values: Annotated[list[Any], "its value in each cell or run; null where there is none"]


class ComparisonRecord(TypedDict):
    """A comparison."""

    schema: Annotated[str, "name and version of the format"]
    kind: Annotated[str, "`compare`"]
    of: Annotated[str, "`modes` of one cell, or `cells`: cells and runs"]
    cell: Annotated[str, "name of the cell, or of the first one"]
    settings: Annotated[dict[str, Any], "by address: values set for all"]
    task: Annotated[str | None, "the only task that is worked on; null for all"]
    sentences: Annotated[list[str], "what pays and what it costs, as the figures show it"]
    differences: Annotated[list[DifferenceRecord], "inputs that differ; none for modes"]
    counts: Annotated[dict[str, int], "by status: number of variants"]
    variants: Annotated[list[ComparedRecord], "all of them in their order"]
    inputs: Annotated[dict[str, dict[str, str]], "by cell or run: SHA-256 of every input file, by name"]
    versions: Annotated[dict[str, str], "versions of cellplan and of the packages that the numbers depend on"]


def comparison_record(
    header: Mapping[str, Any], trials: Sequence[Record], differences: Mapping[str, Sequence[Any]]
) -> ComparisonRecord:
    """The record of a comparison.

    Args:
        header: What it is about: of, cell, names, settings, task, inputs and versions.
        trials: Its trials in their order.
        differences: Values in each cell or run, by key path.
    """
    variants: list[Any] = [{"name": name, **trial} for name, trial in zip(header["names"], trials, strict=True)]
    return {
        "schema": SCHEMA,
        "kind": "compare",
        "of": header["of"],
        "cell": header["cell"],
        "settings": header["settings"],
        "task": header["task"],
        "sentences": sentences(variants),
        "differences": [{"key": key, "values": list(values)} for key, values in differences.items()],
        "counts": {status: sum(each["status"] == status for each in variants) for status in STATUSES},
        "variants": variants,
        "inputs": header["inputs"],
        "versions": header["versions"],
    }


def comparison_table(record: Record) -> str:
    """The comparison as CSV: a row for each variant, with its status, its figures and the load of every robot."""
    robots = robot_names(record)
    rows: list[list[Any]] = [
        ["name", "status", *SINGLE, *(f"load_s {robot}" for robot in robots), "not_in_program", "reason"]
    ]
    for variant in record["variants"]:
        figures = variant["figures"]
        loads = [figures["robots"].get(robot, {}).get("load_s") if figures else None for robot in robots]
        left_out = "; ".join(figures.get("not_in_program", []))
        rows.append(
            [variant["name"], variant["status"], *map(figures.get, SINGLE), *loads, left_out, variant["reason"]]
        )
    return csv_text(rows)


def robot_names(record: Record) -> list[str]:
    """Robots of all variants with a motion, each once."""
    solved = [variant["figures"]["robots"] for variant in record["variants"] if variant["figures"]]
    return list(dict.fromkeys(name for robots in solved for name in robots))
