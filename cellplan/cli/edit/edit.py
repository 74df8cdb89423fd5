"""``cellplan edit``: the live cell in a browser, where bases are dragged and the whole job answers at once."""

import secrets
import sys
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from socket import socket
from typing import TYPE_CHECKING, Annotated, Final

from cellplan.cli.options import shared
from cellplan.cli.options.request import Options, option
from cellplan.cli.terminal.errors import InterruptedWorkError, tell
from cellplan.cli.terminal.output import Result
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.report.record.common import Record

LOADED_WITHIN_S: Final = 60.0  # [s] a browser that was opened has to load the page


@dataclass(frozen=True, slots=True, kw_only=True)
class EditOptions(Options):
    """What is edited, and where the page is served."""

    cell: shared.CellFile
    port: Annotated[
        int | None, option("--port PORT", "Port on the loopback address (default: a free one).", min=1024, max=65535)
    ] = None
    no_browser: Annotated[
        bool, option("--no-browser", "Open no browser; the terminal names the file that leads one to the page.")
    ] = False
    settings: shared.Settings = ()
    allow_dirs: shared.AllowDirs = ()


def edit(options: EditOptions) -> Result:
    """Edit a cell in a browser: drag bases, and see at once what becomes of the whole job.

    The page is served to this user on this machine alone. Exit status: 0 ended in the page, 2 bad input, 4 internal
    error, 130 ended by Ctrl-C; changes that were not saved are printed as options.
    """
    from cellplan.cli.edit.server import loopback_listener

    with loopback_listener(options.port or 0) as listener:  # before what takes longer
        return _served(options, listener)


def _served(options: EditOptions, listener: socket) -> Result:
    """Serve the page until the session is ended."""
    from cellplan.cli.edit.owner import Owner
    from cellplan.cli.edit.page.texts import page_texts
    from cellplan.cli.edit.redirect import redirect_file, remove_when
    from cellplan.cli.edit.server import Server
    from cellplan.session.executor import ProcessExecutor
    from cellplan.session.session import Session

    executor = ProcessExecutor()  # before what takes longer
    assets = {path: (f"{kind}; charset=utf-8", text.encode()) for path, (kind, text) in page_texts().items()}
    place, token = f"http://127.0.0.1:{listener.getsockname()[1]}", secrets.token_urlsafe(32)
    server = Server(listener, token, assets)
    session = Session.open(options.cell, settings=options.settings, allow_dirs=options.allow_dirs, executor=executor)
    with closing(session):
        owner = Owner(session, server.publish)
        with redirect_file(f"{place}/#token={token}") as path, server.serving(owner.submit):
            remove_when(owner.is_open, path, _introduce(options, place, token, path))
            try:
                owner.run()
                owner.end("the session was ended in a page")
            except KeyboardInterrupt:
                owner.end("the session was ended in its terminal")
                raise InterruptedWorkError("; ".join(["editing ended", *_unsaved(owner.answer)])) from None
    return Result(ExitStatus.PASSED, ["editing ended", *_unsaved(owner.answer)], {}, is_verdict=False)


def _introduce(options: EditOptions, place: str, token: str, path: Path) -> float | None:
    """Say where the page is and open it; the token is shown on a terminal only, and only where no browser is opened.

    Returns the time in [s] after which the file that leads to the page has served; None where a person opens it.
    """
    from cellplan.cli.edit.redirect import can_open_browser, open_browser

    tell(f"editing {options.cell} at {place}: Ctrl-C ends")
    tell(f"open {path} in a browser: only you can read it, and it is removed once the page has loaded")
    if not options.no_browser and can_open_browser():
        open_browser(path)
        return LOADED_WITHIN_S
    if sys.stderr.isatty():
        tell(f"or paste, as it would be visible to others in a command: {place}/#token={token}")
    return None


def _unsaved(answer: "Record") -> Iterator[str]:
    """What was changed and not saved, as options."""
    if not answer.get("is_saved", True):
        yield " ".join(["not saved:", *answer["history"]])
