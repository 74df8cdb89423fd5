"""A file that leads a browser to the page with the token of the session, which no other user can read.

The address itself would be an argument of the browser's process, and those are visible to all users of a machine. The
file is removed once the page has loaded, so that a program that is killed leaves none with its dead token.
"""

import contextlib
import os
import stat
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from html import escape
from pathlib import Path
from typing import Final

from cellplan.errors import InputError

FOLDER: Final = Path("outputs")  # browsers in a sandbox of their own open pages there, but none in the system's /tmp
REDIRECT: Final = """\
<!DOCTYPE html>
<meta charset="utf-8">
<meta name="referrer" content="no-referrer">
<meta http-equiv="refresh" content="0; url={address}">
<title>cellplan edit</title>
<p><a href="{address}">the live cell</a></p>
"""


@contextlib.contextmanager
def redirect_file(address: str) -> Iterator[Path]:
    """A page that leads to an address, readable and writable by this user alone; it goes with the ``with`` statement.

    It is below the working folder where that has such rights, else in the folder for temporary files.
    """
    path = _private_file(FOLDER) or _private_file(Path(tempfile.gettempdir()))
    if path is None:
        raise InputError("TMPDIR: expected a folder that keeps files from other users, got none that does")
    path = path.resolve()
    try:
        path.write_text(REDIRECT.format(address=escape(address)), encoding="utf-8")
        yield path
    finally:
        _remove(path)


def remove_when(is_loaded: threading.Event, path: Path, within_s: float | None) -> None:
    """Remove a file in the background once its page has loaded, or after a time in [s]; None for however long."""

    def wait() -> None:
        is_loaded.wait(within_s)
        _remove(path)

    threading.Thread(target=wait, daemon=True).start()


def _remove(path: Path) -> None:
    """Remove a file, and its folder if nothing else is in it."""
    path.unlink(missing_ok=True)
    if path.parent.name == FOLDER.name:
        with contextlib.suppress(OSError):
            path.parent.rmdir()


def _private_file(folder: Path) -> Path | None:
    """An empty file with a name that cannot be guessed; None where rights of files are not kept, or none is written."""
    try:
        folder.mkdir(0o755, exist_ok=True)
        about = folder.stat()
        if about.st_uid not in (0, os.getuid()) or about.st_mode & (stat.S_IWOTH | stat.S_ISVTX) == stat.S_IWOTH:
            return None  # others may put a page of theirs in its place
        number, name = tempfile.mkstemp(dir=folder, prefix="cellplan-edit-", suffix=".html")  # mode 0600, no links
        os.close(number)
        path = Path(name)
        if path.stat().st_mode & 0o077 == 0:
            return path
        path.unlink()
    except OSError:
        pass
    return None


def can_open_browser() -> bool:
    """Whether a browser would have a screen; one in the terminal would take it over."""
    names = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
    return sys.platform == "darwin" or any(os.environ.get(name) for name in names)


def open_browser(path: Path) -> None:
    """Let the browser of the user show a file; some of its programs return only when it is closed."""
    threading.Thread(target=webbrowser.open, args=[path.as_uri()], daemon=True).start()
