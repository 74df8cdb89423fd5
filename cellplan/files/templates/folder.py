"""Folder of a template: the cell with its schema, what it names, and a page on what to do next; whole or not at all."""

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.robots.joint_table import bundled_names
from cellplan.files.run.drafts import hidden_folders
from cellplan.files.schema.json_schemas import json_schema, robot_table_schema
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


def refuse_unless_empty(folder: Path) -> None:
    """Refuse a place that holds something already; hidden entries such as ``.git`` and ``.venv`` may be there."""
    try:
        if not folder.is_dir():
            if folder.exists() or folder.is_symlink():
                raise InputError(f"{folder}: expected a new or an empty folder, got a file")
            return
        entry = min((entry.name for entry in folder.iterdir() if not entry.name.startswith(".")), default=None)
    except OSError as error:
        raise _cannot_write(folder, error) from error
    if entry is not None:
        raise InputError(f"{folder}: holds '{entry}', and nothing is overwritten; name a new or an empty folder")


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files; on an error or an interruption none of them remains.

    A new folder appears in one step. In a folder that exists, files are created one by one, each where there is none.

    Names are relative, with ``/`` between folders.
    """
    refuse_unless_empty(folder)
    made: list[Path] = []
    try:
        if folder.is_dir():
            _write(folder, files, made)
            return
        _make(folder.parent, made)
        draft, _ = hidden_folders(folder.absolute())
        _make(draft, made)
        _write(draft, files, made)
        draft.rename(folder)
    except BaseException as error:
        _undo(made)
        if isinstance(error, OSError):
            raise _cannot_write(folder, error) from error
        raise


def _write(folder: Path, files: Mapping[str, bytes], made: list[Path]) -> None:
    """Create files; what was made is added to the list."""
    for name, content in files.items():
        target = folder / name
        _make(target.parent, made)
        with target.open("xb") as file:
            made.append(target)
            file.write(content)


def _make(folder: Path, made: list[Path]) -> None:
    """Create a folder and those above it that are missing."""
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    for path in reversed(missing):
        path.mkdir()
        made.append(path)


def _undo(made: list[Path]) -> None:
    """Remove what was made, the last first; a folder into which others wrote meanwhile stays."""
    for path in reversed(made):
        with suppress(OSError):
            path.rmdir() if path.is_dir() else path.unlink()


def _cannot_write(folder: Path, error: OSError) -> InputError:
    return InputError(f"{folder}: cannot write the template: {(error.strerror or str(error)).lower()}")
