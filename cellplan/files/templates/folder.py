"""A new folder with all files of a template, or nothing."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from cellplan.errors import InputError
from cellplan.files.run.drafts import hidden_folders


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
