"""Files of a template: the cell with its schema, the files that it names, and a page on what to do next."""

import json
from pathlib import Path
from typing import Final

from cellplan.files.robots.bundled import bundled_names
from cellplan.files.schema import json_schema, robot_table_schema
from cellplan.files.templates.catalogue import Template

PACKAGE: Final = Path(__file__).resolve().parents[2]
INSTALLED: Final = PACKAGE / "templates"  # where a wheel has the shipped cells
CHECKOUT: Final = PACKAGE.parent / "cells"  # where a checkout has them
CELL, CELL_SCHEMA, TABLE_SCHEMA, README = "cell.yaml", "cell.schema.json", "robot.schema.json", "README.md"

PAGE: Final = """\
# {name}

In this cell {summary}.
`cell.yaml` describes it; its comments name further choices.

```sh
cellplan check cell.yaml
cellplan solve cell.yaml --view
```

The first command reads the cell and finds its start. The second plans the motion, checks it, and writes
`outputs/{name}/`: the report `report.html`, the motion in 3-D as `view.html`, and the joint tables of the robots. Both
pages open in a browser.

Change a value in `cell.yaml`, or try one without writing it. This is {meaning}:

```sh
cellplan solve cell.yaml --set {setting}
```
{more}
Editors that use the YAML language server (VS Code with the extension "YAML", Neovim, Emacs, …) complete and explain the
keys: the first line of `cell.yaml` names `{schema}`. After an update of cellplan, write it anew:
`cellplan schema > {schema}`.
"""


def shipped_cells() -> Path:
    """Folder of the shipped cells."""
    return INSTALLED if INSTALLED.is_dir() else CHECKOUT


def template_files(template: Template) -> dict[str, bytes]:
    """Content of every file of a template by its name, relative to the folder."""
    folder = shipped_cells()
    files = {CELL: _with_schema((folder / template.source).read_bytes(), f"./{CELL_SCHEMA}")}
    files[CELL_SCHEMA] = _json(json_schema(bundled_names()))
    for name in template.files:
        content = (folder / name).read_bytes()
        if name.endswith(".yaml"):
            content = _with_schema(content, "../" * name.count("/") + TABLE_SCHEMA)
            files[TABLE_SCHEMA] = _json(robot_table_schema())
        files[name] = content
    return files | {README: _page(template).encode()}


def _with_schema(content: bytes, schema: str) -> bytes:
    """A YAML file with the line that names its schema to editors."""
    return f"# yaml-language-server: $schema={schema}\n".encode() + content


def _json(schema: dict[str, object]) -> bytes:
    """A schema as ``cellplan schema`` prints it."""
    return (json.dumps(schema, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _page(template: Template) -> str:
    """What to do next."""
    more = f"\n{template.more}\n" if template.more else ""
    return PAGE.format(
        name=template.name,
        summary=template.summary,
        setting=template.setting,
        meaning=template.meaning,
        more=more,
        schema=CELL_SCHEMA,
    )
