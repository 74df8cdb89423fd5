"""What a shell completes: files of the right kind, run folders, bundled robots, and words of options."""

from collections.abc import Callable, Iterator
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Final

import typer
from typer.completion import install_callback, show_callback

SHELLS: Final = ("bash", "zsh", "fish")
CELL_SUFFIXES: Final = (".yaml", ".yml")
ROBOT_SUFFIXES: Final = (".urdf", ".xacro", *CELL_SUFFIXES)
LARGEST_CELL: Final = 2_000_000  # [bytes] of a cell file that is read for its names
REPORT: Final = "report.json"  # in every run folder
ROBOT_FOLDER: Final = Path(__file__).resolve().parents[2] / "robots"

Completer = Callable[[str], list[str]]


def one_of(*choices: str) -> Completer:
    """Completes one of some words, or the first word of a member of an enumeration: ``cellplan.model.cell.cell:Mode``.

    Enumerations are read when a shell asks: help texts load no engine.
    """

    def complete(incomplete: str) -> list[str]:
        members = (member for choice in choices for member in (resolve_name(choice) if ":" in choice else [choice]))
        words = (str(member).split()[0] for member in members)
        return [word for word in words if word.startswith(incomplete)]

    return complete


def cell_files(incomplete: str) -> list[str]:
    """Cell files, run folders, and folders that they may be in."""
    return list(_paths(incomplete, lambda path: path.suffix in CELL_SUFFIXES))


def run_folders(incomplete: str) -> list[str]:
    """Run folders, and folders that they may be in."""
    return list(_paths(incomplete, lambda _path: False))


def robot_models(incomplete: str) -> list[str]:
    """Bundled robots, and files that describe one."""
    bundled = sorted(path.stem for path in ROBOT_FOLDER.glob("*.yaml"))
    names = [name for name in bundled if name.startswith(incomplete)]
    return [*names, *_paths(incomplete, lambda path: path.suffix in ROBOT_SUFFIXES)]


def task_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Tasks of the cell that is named on the line."""
    return _names_in_cell(ctx, "tasks", incomplete)


def robot_names(ctx: typer.Context, incomplete: str) -> list[str]:
    """Robots of the cell that is named on the line."""
    return _names_in_cell(ctx, "robots", incomplete)


def _names_in_cell(ctx: typer.Context, key: str, incomplete: str) -> list[str]:
    """Keys below a key of the cell file; none if it cannot be read."""
    from cellplan.errors import CellplanError
    from cellplan.files.yaml.reader import read_yaml

    words = [ctx.params.get("cell"), *ctx.args]  # the option without its value ends the parsing: the rest is in args
    path = next((Path(word) for word in words if word and Path(word).suffix in CELL_SUFFIXES), None)
    try:
        if path is None or path.stat().st_size > LARGEST_CELL:
            return []
        entries: Any = read_yaml(path, file=str(path)).root.get(key)
    except (OSError, CellplanError):
        return []
    return [name for name in entries if name.startswith(incomplete)] if isinstance(entries, dict) else []


def _paths(incomplete: str, accepts: Callable[[Path], bool]) -> Iterator[str]:
    """Files that are accepted, run folders, and folders; what is in the only folder, so that no space follows it."""
    above, _, begin = incomplete.rpartition("/")
    folder = Path(f"{above}/") if above or incomplete.startswith("/") else Path()
    paths: list[str] = []
    for entry in _entries(folder.expanduser()):
        if entry.name.startswith(begin) and (begin.startswith(".") or not entry.name.startswith(".")):
            text = f"{incomplete[: len(incomplete) - len(begin)]}{entry.name}"
            if entry.is_dir():
                paths.append(text if (entry / REPORT).is_file() else f"{text}/")
            elif accepts(entry):
                paths.append(text)
    if len(paths) == 1 and paths[0].endswith("/") and paths[0] != incomplete:
        yield from list(_paths(paths[0], accepts)) or paths
    else:
        yield from paths


def _entries(folder: Path) -> list[Path]:
    """What is in a folder; nothing if it cannot be read."""
    try:
        return sorted(folder.iterdir())
    except OSError:
        return []


def install(ctx: typer.Context, param: typer.CallbackParam, value: str | None) -> str | None:
    """Install the completion of a shell and end."""
    return install_callback(ctx, param, _known_shell(value))


def show(ctx: typer.Context, param: typer.CallbackParam, value: str | None) -> str | None:
    """Print the completion of a shell and end."""
    return show_callback(ctx, param, _known_shell(value))


def _known_shell(value: str | None) -> str | None:
    """The name of a shell.

    Raises:
        BadParameter: It is another one.
    """
    if value is not None and value not in SHELLS:
        raise typer.BadParameter(f"expected one of {', '.join(SHELLS)}, got '{value}'")
    return value
