"""Write the reference of the files from their formats: ``python docs/make_reference.py`` makes the pages anew."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cellplan.io.schema import errors_schema, json_schema, robot_table_schema

FOLDER = Path(__file__).resolve().parent / "reference"
PAGE, ERRORS_PAGE = FOLDER / "cell-file.md", FOLDER / "errors-file.md"
INTRODUCTION = """\
# The cell file

This page is made from the format itself by `docs/make_reference.py`; do not edit it by hand. `cellplan schema` prints
the same as a JSON Schema for editors.

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

An errors file says how a real cell differs from the written one. `cellplan rehearse CELL --errors FILE` reads it; the
guide is [Rehearse with errors](../guides/rehearse-with-errors.md). It is read as strictly as the cell file, and its
robots and joints must be those of the cell.

- **A number is fixed**: the same in every trial. `{normal: S}` is drawn for every trial from a normal distribution with
  mean zero and standard deviation S, `{uniform: H}` evenly between -H and H.
- **Poses** are those of the real frame seen from the written one: the real base in the place of the written base, the
  real tool tip in the place of the written tip, the real part in the place where the written part sits.
- **A longer link**: the vector from the axis point of the joint before to that of the named joint, at the reference
  configuration, is lengthened; the named joint and all that it carries move along. Where the two points are one, there
  is no direction, and the entry is refused. Before the first joint stands the origin of the base frame. What lies
  behind the last joint is an error of the tool.
"""


def main() -> None:
    """Write the pages."""
    FOLDER.mkdir(exist_ok=True)
    PAGE.write_text(reference(), encoding="utf-8")
    ERRORS_PAGE.write_text(errors_reference(), encoding="utf-8")


def errors_reference() -> str:
    """Text of the page about errors files."""
    return "".join([ERRORS_INTRODUCTION, *sections(errors_schema(), "Errors", set())])


def reference() -> str:
    """Text of the page."""
    cell, table = json_schema(), robot_table_schema()
    known: set[str] = set()
    parts = [INTRODUCTION, *sections(cell, CELL_TITLE, known), f"\n# Robot tables\n\n{TABLE_INTRODUCTION}"]
    return "".join([*parts, *sections(table, TABLE_TITLE, known)])


def sections(schema: dict[str, Any], title: str, known: set[str]) -> list[str]:
    """One section for each kind of entry, in the order in which they are first named."""
    found: list[tuple[str, dict[str, Any]]] = [(title, schema)]
    for _, entry in found:
        for name in references(entry.get("properties", {})):
            if name not in known:
                known.add(name)
                found.append((heading(name), schema["$defs"][name]))
    return [section(name, entry) for name, entry in found]


def references(node: Any) -> list[str]:
    """Kinds of entries that a piece of schema names."""
    if isinstance(node, list):
        return [name for item in node for name in references(item)]
    if not isinstance(node, dict):
        return []
    own = [node["$ref"].rpartition("/")[2]] if "$ref" in node else []
    return own + [name for value in node.values() for name in references(value)]


def heading(name: str) -> str:
    """Heading of a kind of entry: ``PartShapeEntry`` becomes ``Part shape``."""
    return re.sub(r"(?<!^)([A-Z])", lambda match: " " + match[1].lower(), name.removesuffix("Entry"))


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
        title = heading(field["$ref"].rpartition("/")[2])
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
        inner = field.get("additionalProperties") or next(iter(field["patternProperties"].values()))
        return f"by name: {words(inner)}"
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
