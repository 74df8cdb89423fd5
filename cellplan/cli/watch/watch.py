"""``--watch``: do the work of a command again whenever the cell or one of its files is saved."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, NoReturn

from cellplan.cli.terminal.errors import (
    InterruptedWorkError,
    OutputError,
    error_lines,
    exit_status,
    report_failure,
    tell,
)
from cellplan.cli.terminal.output import Result, present, say_json
from cellplan.cli.terminal.progress import Listener, progress_listener
from cellplan.files.cell.watched_files import WatchedFiles
from cellplan.model.cell.cell import Cell

Work = Callable[[Callable[[Cell], None], Listener], Result]  # called with what to tell of the cell, and of progress
ASK_EVERY_S: Final = 0.3  # [s] between two polls during a computation


def watch(work: Work, cell: Path, *, schema: str, as_json: bool, quiet: bool) -> NoReturn:
    """Do the work, wait until a file is saved, and so on until Ctrl-C.

    What is wrong with a cell is said, and its files are watched further. Work during which a file is saved is given up
    and begun anew.

    Args:
        as_json: Whether each round gives one JSON object on a line of its own, instead of text.

    Raises:
        InterruptedWorkError: Always, at the end.
    """
    files, number = WatchedFiles(cell), 0
    try:
        while True:
            number += 1
            _round(work, files, schema=schema, as_json=as_json, quiet=quiet)
            if not quiet:
                count = "1 file" if files.count == 1 else f"{files.count} files"
                tell(f"watching {count}: save one for another round, Ctrl-C ends")
            saved = files.next_saved()
            if not quiet:
                tell(f"round {number + 1}: {saved} was saved")
    except KeyboardInterrupt:
        raise InterruptedWorkError(f"watching ended in round {number}") from None


def _round(work: Work, files: WatchedFiles, *, schema: str, as_json: bool, quiet: bool) -> None:
    """One round; saved files begin it anew."""
    while True:
        files.begin()
        try:
            with progress_listener(quiet=quiet) as listener:
                result = work(files.follow, _interruptible(files, listener))
        except InputsChangedError:
            files.settle()
            continue
        except OutputError:
            raise
        except Exception as error:  # noqa: BLE001 - the next save may mend whatever it is
            if files.rewritten() is not None:  # half a save was read
                files.settle()
                continue
            _refuse(error, files, schema=schema, as_json=as_json)
            return
        present(result, as_json=as_json, on_one_line=True)
        return


def _interruptible(files: WatchedFiles, listener: Listener) -> Listener:
    """The listener, which also polls the files now and then, and stops the work once one of them was saved."""
    last_look = 0.0

    def listen(stage: str, share: float) -> None:
        nonlocal last_look
        if time.monotonic() - last_look >= ASK_EVERY_S:
            last_look = time.monotonic()
            if files.changed() is not None:
                raise InputsChangedError
        listener(stage, share)

    return listen


def _refuse(error: Exception, files: WatchedFiles, *, schema: str, as_json: bool) -> None:
    """Say why a round has no result, and watch for files that the cell lacks."""
    files.follow_neighbours()
    if as_json:
        status = int(exit_status(error))
        say_json({"schema": schema, "status": "error", "exit": status, "errors": error_lines(error)}, on_one_line=True)
    report_failure(error)


class InputsChangedError(Exception):
    """A file of the cell was saved while it was being worked on."""
