"""Write the reference of the files from their formats: ``python docs/make_reference.py`` makes the pages anew."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cellplan.files.schema.json_schemas import entry_title, errors_schema, json_schema, robot_table_schema
from cellplan.jobs.layout.record import layout_schema
from cellplan.jobs.repair.record import advice_schema
from cellplan.report.record.figures import QUANTITIES
from cellplan.report.record.schema import report_schema, series_schema

FOLDER = Path(__file__).resolve().parent / "reference"
PAGE, ERRORS_PAGE, REPORT_PAGE = FOLDER / "cell-file.md", FOLDER / "errors-file.md", FOLDER / "report-json.md"
LAYOUT_PAGE = FOLDER / "layout-json.md"
INTRODUCTION = """\
# The cell file

This page is made from the format itself by `docs/make_reference.py`; do not edit it by hand. `cellplan schema` prints
the same as a JSON Schema for editors, and `cellplan schema --robot` that of robot tables; `cellplan init` writes a cell
together with them ([templates](../guides/templates.md)).

- **The version is promised**: `cellplan: 1` is frozen at the first release. From then on keys are only added, each with
  a default that changes nothing for files without it; no key, value, unit or default changes its meaning. Anything else
  gets another number, and a file with another number is refused. The same holds for robot tables, which have no number
  of their own.
- **Units are in the keys**: `_mm`, `_deg`, `_s`, `_mm_s`, `_deg_s`, `_per_s`. Everything else is a plain number.
- **Poses** are `{xyz_mm: [x, y, z], rpy_deg: [roll, pitch, yaw]}` with angles about fixed axes, as in URDF.
- **Names** have 1 to 40 letters, digits, `_` or `-` and do not start with `-`.
- **Files** are named relative to the cell file and lie below its folder, or below a folder that the user allows: with
  `--allow-dir`, for all cells with `CELLPLAN_ALLOW_DIRS` (absolute paths, parted as in `PATH`), or with
  `allow_dirs: [...]` in `~/.config/cellplan/config.yaml`.
- **YAML is read strictly**: unknown or duplicate keys, anchors, aliases, merges, tags, several documents, empty
  values, numbers that are not finite and words that readers understand in different ways (`010`, `1:30`, `1_000`,
  `0x10`, `no`, `on`, `2010-01-01`) are errors with file and line. Put such a word in quotes where it is meant as a
  text. Truth values are `true` and `false`.
- **Limits**: 2 MB, 200,000 values, 32 levels, 64 robots, 200 tasks, 2,000,000 samples, 10,000,000 samples times
  joints.
- **Bodies** are called `ROBOT/LINK`, `ROBOT/tool`, `ROBOT/tool_2`, …, `ROBOT/pedestal`, `ROBOT/NAME` for
  attachments, `part`, and by their names in the environment.

All findings about a file come at once, in the order of the file, as `FILE:LINE: key.path: what, got, allowed`.

The copy of a cell in its run folder has every default and the start postures written out. It names files as the
original does, so it loads only where these names lead to them. Its numbers read back to the values that were solved.
Tasks that the command line left out are left out.
"""
CELL_TITLE, TABLE_TITLE = "Cell", "Robot table"
TABLE_INTRODUCTION = """\
A robot may be given by the axes of its joints at the reference configuration, where all joints read zero. The
joints form one chain in the order of the file. Everything is given in the base frame at that configuration, the solids
of the links as well.
"""
ERRORS_INTRODUCTION = """\
# The errors file

This page is made from the format itself by `docs/make_reference.py`; do not edit it by hand. Its version,
`cellplan_errors: 1`, is promised as that of [the cell file](cell-file.md) is.

An errors file states how a real cell differs from the nominal one. `cellplan rehearse CELL --errors FILE` reads it; the
guide is [Rehearse with errors](../guides/rehearse-with-errors.md). It is read as strictly as the cell file, and its
robots and joints must be those of the cell.

- **A number is fixed**: the same in every trial. `{normal: S}` is drawn for every trial from a normal distribution with
  mean zero and standard deviation S, `{uniform: H}` evenly between -H and H.
- **Poses** are those of the real frame in the nominal one: the real base in the nominal base frame, the
  real tool tip in the place of the written tip, the real part in the place where the written part sits.
- **A longer link**: the vector from the axis point of the joint before to that of the named joint, at the reference
  configuration, is lengthened; the named joint and all that it carries move along. Where the two points are one, there
  is no direction, and the entry is refused. Before the first joint stands the origin of the base frame. What lies
  behind the last joint is an error of the tool.
"""
REPORT_INTRODUCTION = """\
# report.json and series.json

This page is made from the types of the records by `docs/make_reference.py`; do not edit it by hand. `cellplan schema
--report` prints the same as a JSON Schema (draft 2020-12).

The schemas are kept as files, too: [report.schema.json](report.schema.json) and
[series.schema.json](series.schema.json).

`report.json` is the result of a run for scripts; `report.html` shows the same as a page. Equal input gives equal
bytes.

- **The promise of `cellplan.report/1`**: keys are only added, and no key changes its meaning or its unit. The format
  is frozen at the first release; until then it may change, and the changelog says so. Scripts must ignore keys that
  they do not know.
- **Units are in the keys** (`_mm`, `_deg`, `_s`, `_mm_s`, `_deg_s`) or in a `unit` beside the value. Every key that
  ends with `at_s` is a time on the common clock.
- **Times of a program** count from the begin of their phase. In the `report.json` of a program each of them has its
  phase beside it, under the same key with `phase` instead of `at_s`: `phase` beside `at_s`, `margin_phase` beside
  `margin_at_s`. The report of a phase, in the folder with its name, has it once, as `phase`.
- **`null`** stands for a value that does not exist: the limit of an endless joint, a distance without a pair.
- Numbers have twelve significant digits and are taken over **all** samples. The arrays of `series.json` have seven.
- Names of robots, joints, tasks and bodies are those of the cell file.
- **`iterations`, `slack` and `resolution`** of the solver are known to the planner alone, as the joint tables hold
  samples: `cellplan verify` derives everything else from the tables again and leaves these as they are.
"""
LAYOUT_INTRODUCTION = """\
# study.json and advice.json of a layout search

This page is made from the types of the record by `docs/make_reference.py`; do not edit it by hand. `cellplan schema
--layout` prints the same as a JSON Schema (draft 2020-12).

`cellplan layout CELL -o DIR` writes `study.json` for scripts; `study.html` shows the same as a page, and `best.yaml`
is the best layout as a cell file. The guide is [Find a layout](../guides/find-a-layout.md), the method
[How a layout is searched](../concepts/layout-search.md).

- **The promise of `cellplan.layout/1`** is that of [report.json](report-json.md): keys are only added, and none changes
  its meaning or its unit. Equal cell, options, seed and number of trials give equal bytes.
- **Units are in the keys**; effects of a variable are stated for a `step` of it, in its own `unit`.
- **`null`** stands for a value that does not exist: the best layout where none is certified, a margin without limits.
- **Only `certified` is verified**: figures of other candidates are those of the search, at its nodes and keys.
- Addresses in `settings` and `variables` are those of [the cell file](cell-file.md).

`study.jsonl` beside it is the journal: a header, then one line for each finished trial in order, each written to disk
before the next. It is what `--resume` reads, and no interface: its keys may change with any version.

`cellplan layout CELL --repair` writes `advice.json` (`cellplan.advice/1`) with the record [Advice](#advice); the guide
is [Repair a cell](../guides/repair-a-cell.md).
"""
SERIES_INTRODUCTION = """
In the mode `pairwise` every task has a folder with a report of its own. The `report.json` above them is the
[summary](#summary): the worst values of all of them; its `solver` holds no effort of steps.

`series.json` (`cellplan.series/1`) of every run holds the curves behind the numbers, one line for each array. An array
has a value for each of the K kept samples; velocities, `iterations` and `slack` have one for each of the K - 1 steps
that begin at a kept sample. `cellplan schema --series` prints the JSON Schema.
"""
STEPS = """
**Steps and samples.** A velocity belongs to the step between two samples: the difference of both positions divided by
`step_s`. The k-th value of an array of length K - 1 belongs to the step that *begins* at the k-th sample. Add half of
`step_s` to plot it at the middle of its step.

**Long motions.** Up to 50,001 samples all of them are kept and `every` is 1. Beyond that every n-th is kept, and a
step is the one step of the clock after a kept sample. The numbers in `report.json` are always those of all samples,
so a peak between two kept samples is in `joints` and `tasks` and not in the series.

Seven digits are 0.00001 deg of a joint angle. The [joint tables](../concepts/conventions.md#joint-tables) have all of
them.

```python
import json
from pathlib import Path

from cellplan import load_cell, solve, write_run

folder = Path("outputs/series")
write_run(solve(load_cell(Path("cells/planar_pair.yaml"))), folder)

series = json.loads((folder / "series.json").read_text(encoding="utf-8"))
times = series["times_s"]
for name, curves in series["tasks"].items():
    errors = curves["position_error_mm"]
    worst = errors.index(max(errors))
    print(f"{name}: {errors[worst]:.4g} mm at {times[worst]:g} s")
```
"""


def main() -> None:
    """Write the pages."""
    FOLDER.mkdir(exist_ok=True)
    PAGE.write_text(reference(), encoding="utf-8")
    ERRORS_PAGE.write_text(errors_reference(), encoding="utf-8")
    REPORT_PAGE.write_text(report_reference(), encoding="utf-8")
    LAYOUT_PAGE.write_text(layout_reference(), encoding="utf-8")
    for name, text in schema_files().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


def schema_files() -> dict[str, str]:
    """JSON Schemas of the records of a run, by file name."""
    schemas = {"report.schema.json": report_schema(), "series.schema.json": series_schema()}
    return {name: json.dumps(schema, indent=2, ensure_ascii=False) + "\n" for name, schema in schemas.items()}


def errors_reference() -> str:
    """Text of the page about errors files."""
    return "".join([ERRORS_INTRODUCTION, *sections(errors_schema(), "Errors", set())])


def report_reference() -> str:
    """Text of the page about ``report.json`` and ``series.json``."""
    schema = report_schema()
    names = [name for name in schema["$defs"] if name != "SummaryRecord"]
    run = schema["$defs"]["RunRecord"]["properties"]
    summary = schema["$defs"]["SummaryRecord"]
    fields = {key: field for key, field in summary["properties"].items() if run.get(key) != field}
    parts = [record_section(name, schema["$defs"][name]) for name in names]
    curves = [record_section(name, form) for name, form in series_schema()["$defs"].items()]
    worst = record_section("SummaryRecord", {**summary, "properties": fields})
    return "".join([REPORT_INTRODUCTION, *parts, figures_section(), worst, SERIES_INTRODUCTION, *curves, STEPS])


def figures_section() -> str:
    """The quantities in the table of figures of a report."""
    head = """
## Figures

What was measured stands once, in `figures`: by phase, by quantity, and by what it was measured of, which is a robot, a
joint, a pair of bodies, a task, or `all`. Checks are figures beside their limits. `parts_per_h`, `load_ratio` and
`share_above_250_mm_s` need the cycle of the whole program: they stand in the records of `cellplan fastest`.

| quantity | over several phases | meaning |
|---|---|---|
"""
    rows = (f"| `{key}` | {it.over_phases.__name__} | {it.meaning} |\n" for key, it in QUANTITIES.items())
    return head + "".join(rows)


def layout_reference() -> str:
    """Text of the page about ``study.json`` of a layout search."""
    definitions = layout_schema()["$defs"] | advice_schema()["$defs"]
    return "".join([LAYOUT_INTRODUCTION, *(record_section(name, form) for name, form in definitions.items())])


def record_section(name: str, record: dict[str, Any]) -> str:
    """Heading, one sentence and the keys of a record."""
    lines = [f"\n## {record_title(name)}\n", record["description"], "", "| key | value | meaning |", "|---|---|---|"]
    for key, field in record["properties"].items():
        optional = "" if key in record["required"] else " (optional)"
        lines.append(f"| `{key}` | {record_value(field)} | {field['description']}{optional} |")
    return "\n".join(lines) + "\n"


def record_title(name: str) -> str:
    """Heading of a record: ``ClosestPair`` becomes ``Closest pair``."""
    return re.sub(r"(?<!^)([A-Z])", lambda match: " " + match[1].lower(), name.removesuffix("Record"))


def record_value(field: dict[str, Any]) -> str:
    """Type of the value of a key."""
    if "$ref" in field:
        title = record_title(field["$ref"].rpartition("/")[2])
        return f"[{title.lower()}](#{title.lower().replace(' ', '-')})"
    if not field.keys() - {"description"}:
        return "any value"
    if "anyOf" in field:
        arms = [record_value(arm) for arm in field["anyOf"]]
        return (", or " if any(" or " in arm for arm in arms) else " or ").join(arms)
    if field["type"] == "array":
        return f"list: {record_value(field['items'])}"
    if field["type"] == "object":
        return f"by name: {record_value(field['additionalProperties'])}"
    return {"string": "text", "integer": "whole number", "boolean": "`true`, `false`", "null": "null"}.get(
        field["type"], field["type"]
    )


def reference() -> str:
    """Text of the page."""
    cell, table = json_schema(), robot_table_schema()
    known: set[str] = set()
    parts = [INTRODUCTION, *sections(cell, CELL_TITLE, known), f"\n# Robot tables\n\n{TABLE_INTRODUCTION}"]
    return "".join([*parts, *sections(table, TABLE_TITLE, known)])


def sections(schema: dict[str, Any], title: str, known: set[str]) -> list[str]:
    """One section for each kind of entry, in the order in which they are first named."""
    results: list[tuple[str, dict[str, Any]]] = [(title, schema)]
    for _, entry in results:
        for name in references(entry.get("properties", {})):
            if name not in known:
                known.add(name)
                results.append((entry_title(name), schema["$defs"][name]))
    return [section(name, entry) for name, entry in results]


def references(node: Any) -> list[str]:
    """Kinds of entries that a piece of schema names."""
    if isinstance(node, list):
        return [name for item in node for name in references(item)]
    if not isinstance(node, dict):
        return []
    refs = [node["$ref"].rpartition("/")[2]] if "$ref" in node else []
    return refs + [name for value in node.values() for name in references(value)]


def section(title: str, entry: dict[str, Any]) -> str:
    """Heading, one sentence and the table of keys."""
    required = entry.get("required", [])
    lines = [
        f"\n## {title}\n",
        entry.get("description", ""),
        "",
        "| key | value | default | meaning |",
        "|---|---|---|---|",
    ]
    for key, field in entry["properties"].items():
        default = "required" if key in required else shown(field["default"]) if "default" in field else "–"
        lines.append(f"| `{key}` | {words(field)} | {default} | {field.get('description', 'See there.')} |")
    return "\n".join(lines) + "\n"


def shown(value: Any) -> str:
    """A default as it would be written in the file."""
    if isinstance(value, dict):
        return "all its defaults" if value else "`{}`"
    text = json.dumps(value).replace('"', "")
    whole = re.sub(r"(\d)\.0(?!\d)", r"\1", text)
    return f"`{whole}`"


def words(field: dict[str, Any]) -> str:
    """What may stand as the value of a key."""
    if "$ref" in field:
        title = entry_title(field["$ref"].rpartition("/")[2])
        return f"[{title.lower()}](#{title.lower().replace(' ', '-')})"
    for choice in ("oneOf", "anyOf"):
        if choice in field:
            return " or ".join(words(arm) for arm in field[choice])
    if "const" in field or "enum" in field:
        return ", ".join(f"`{shown(word).strip('`')}`" for word in field.get("enum", [field.get("const")]))
    return PLAIN.get(field["type"], container_words)(field)


def container_words(field: dict[str, Any]) -> str:
    """What may stand in a list or under free names."""
    if field["type"] == "object":
        arms = (
            [field["additionalProperties"]]
            if field.get("additionalProperties")
            else field["patternProperties"].values()
        )
        return f"by name: {' or '.join(words(arm) for arm in arms)}"
    if "prefixItems" in field:
        return f"list of {len(field['prefixItems'])}: {words(field['prefixItems'][0])}"
    return f"list: {words(field.get('items', {}))}"


def bounds(field: dict[str, Any]) -> str:
    """Smallest and largest number."""
    above, low, high = (field.get(key) for key in ("exclusiveMinimum", "minimum", "maximum"))
    upper = "" if high is None else f"{high:.10g}"
    if low is not None:
        return f" from {low:.10g} to {upper}" if upper else f" from {low:.10g}"
    start = "" if above is None else f" above {above:g}"
    return f"{start}, up to {upper}" if upper else start


PLAIN: dict[str, Callable[[dict[str, Any]], str]] = {
    "string": lambda _: "text",
    "boolean": lambda _: "`true`, `false`",
    "integer": lambda field: f"whole number{bounds(field)}",
    "number": lambda field: f"number{bounds(field)}",
}  # by type of value


if __name__ == "__main__":
    main()
