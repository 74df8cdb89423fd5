"""The page beside a run folder that shows its latest result while the cell is watched.

A page that is opened from disk may not read other files, but it may run scripts that lie beside it: the page runs a
small script again and again, whose number changes with each round.
"""

import contextlib
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from urllib.parse import quote

from cellplan.errors import InputError
from cellplan.files.run.whole_file import write_whole
from cellplan.report.page.render import template

MARK: Final = '<meta name="generator" content="cellplan watch">'  # stands in the first lines of every such page
RELOAD_MESSAGE: Final = "cellplan:reload"  # asks a page in a frame to load itself again, at its place and instant
MARK_WITHIN: Final = 400  # [bytes]


class WatchPage:
    """A page and its script; both go when watching ends, and nothing of them is in the run folder."""

    def __init__(self, path: Path, pages: Sequence[tuple[str, str]]) -> None:
        """Name the page after what it stands beside, and the pages of a run that it shows by title and file name."""
        self.path = path.with_name(f"{path.name}-watch.html")
        self._script = self.path.with_suffix(".js")
        self._title, self._pages, self._number, self._run = path.name, pages, 0, ""

    def open(self) -> None:
        """Write the page."""
        for path, mark in ((self.path, MARK), (self._script, "cellplanState(")):
            if path.is_symlink() or (path.exists() and mark not in _begin(path)):
                raise InputError(f"{path}: holds something that watching did not write; choose another folder with -o")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            page = watch_page(self._title, pages=self._pages, state=quote(self._script.name))
            write_whole(self.path, page.encode())
        except OSError as error:
            raise InputError(f"{self.path}: cannot write the page: {(error.strerror or str(error)).lower()}") from error
        self.show("working")

    def show(self, phase: str, lines: Sequence[str] = (), *, run: Path | None = None) -> None:
        """Tell the page the phase: working, passed, failed or error; a disk that refuses leaves the page as it was."""
        if run is not None:
            self._number += 1
            self._run = quote(Path(os.path.relpath(run, self.path.parent)).as_posix())
        state = state_script(number=self._number, run=self._run, phase=phase, lines=lines)
        with contextlib.suppress(OSError):
            write_whole(self._script, state.encode())

    def close(self) -> None:
        """Remove the page and its script."""
        for path in (self.path, self._script):
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)


def _begin(path: Path) -> str:
    """The first lines of a file."""
    try:
        with path.open("rb") as file:
            return file.read(MARK_WITHIN).decode("utf-8", "replace")
    except OSError:
        return ""


def watch_page(title: str, *, pages: Sequence[tuple[str, str]], state: str) -> str:
    """The page as text: titles and file names of the pages of a run, and of the script of ``state_script``."""
    return template("watch.html").render(title=title, pages=pages, state=state, mark=MARK, message=RELOAD_MESSAGE)


def state_script(*, number: int, run: str, phase: str, lines: Sequence[str]) -> str:
    """The script that tells the page what came of the last round.

    Args:
        number: Number of the results so far; the pages are loaded again when it changes.
        run: Where the run folder lies from the page, as a part of its address.
        phase: One of working, passed, failed and error.
        lines: What to say about it.
    """
    state = {"number": number, "run": run, "phase": phase, "lines": list(lines)}
    return f"cellplanState({json.dumps(state)});\n"
