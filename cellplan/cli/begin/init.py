"""``cellplan init``: a folder with a cell to begin with."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cellplan.cli.options import shared
from cellplan.cli.options.request import Options, argument, option
from cellplan.cli.terminal.output import Result, say, say_json
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.files.templates import Template

NOTES = {
    "cell.yaml": "the cell, with comments",
    "cell.schema.json": "lets editors complete and explain its keys",
    "robot.schema.json": "the same for robot tables",
    "README.md": "what to do next",
}


def _names() -> list[str]:
    """Names that a shell may complete."""
    from cellplan.files.templates import TEMPLATES

    return [template.name for template in TEMPLATES]


@dataclass(frozen=True, slots=True, kw_only=True)
class InitOptions(Options):
    """What is written, and where."""

    SCHEMA = "cellplan.init/1"

    folder: Annotated[Path | None, argument("DIR", "New or empty folder for the cell and its files.")] = None
    template: Annotated[
        str | None, option("--template, -t NAME", "What to begin with (default: two-robots).", autocompletion=_names)
    ] = None
    show_list: Annotated[bool, option("--list", "List the templates, one line each, and write nothing.")] = False
    as_json: shared.AsJson = False


def init(options: InitOptions) -> Result | None:
    """Write a cell to begin with into a new folder.

    The cell is commented and passes check and solve at once. Beside it come its JSON Schema, which lets editors
    complete and explain every key, and a page on what to do next. Existing files are never overwritten.
    """
    from cellplan.files.templates import TEMPLATES, template_files, template_named, write_folder

    folder = options.folder
    if options.show_list == (folder is not None) or (options.show_list and options.template is not None):
        raise typer.BadParameter("expected either a folder, or --list alone")
    if folder is None:
        _show_list(TEMPLATES, as_json=options.as_json)
        return None
    template = template_named(TEMPLATES[0].name if options.template is None else options.template)
    files = template_files(template)
    write_folder(folder, files)
    about = {"schema": options.schema, "status": "written", "exit": int(ExitStatus.PASSED), "folder": str(folder)}
    what = {"template": template.name, "files": sorted(files), "next": _commands(folder), "page": _page(template)}
    lines = _summary(folder, template, sorted(files, key=_rank))
    return Result(ExitStatus.PASSED, lines, {**about, **what}, is_verdict=False)


def _show_list(templates: "tuple[Template, ...]", *, as_json: bool) -> None:
    if as_json:
        say_json(
            {"schema": InitOptions.SCHEMA, "templates": [{"name": t.name, "summary": t.summary} for t in templates]}
        )
        return
    width = max(len(template.name) for template in templates)
    say("\n".join(f"{template.name:<{width}}  {template.summary}" for template in templates))


def _summary(folder: Path, template: "Template", names: list[str]) -> list[str]:
    """What was written, and the next commands."""
    width = max(map(len, names))
    files = [f"  {name:<{width}}  {NOTES.get(name, 'named by the cell')}" for name in names]
    steps = [f"  {step}" for step in (*_commands(folder), f"open {_page(template)} in a browser")]
    return [f"{folder}: {template.summary}", *files, "next:", *steps]


def _rank(name: str) -> tuple[bool, int, str]:
    """The cell first, then what belongs to every template, then the files that the cell names."""
    return name not in NOTES, list(NOTES).index(name) if name in NOTES else 0, name


def _commands(folder: Path) -> list[str]:
    from shlex import quote

    enter = [] if folder.resolve() == Path.cwd() else [f"cd {quote(str(folder))}"]
    return [*enter, "cellplan check cell.yaml", "cellplan solve cell.yaml --view"]


def _page(template: "Template") -> str:
    """The 3-D page that these write, relative to the folder."""
    return f"outputs/{template.name}/view.html"
