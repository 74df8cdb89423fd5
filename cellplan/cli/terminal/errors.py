"""Failure of a command: lines on the error stream and one exit status."""

import contextlib
import os
import re
import sys
import traceback
from collections.abc import Iterator

from cellplan.errors import CellplanError, ExitStatus, ImpossibleTasksError, InvalidFileError, NotVerifiedError

DEBUG_VARIABLE = "CELLPLAN_DEBUG"  # set to 1 to see the traceback of an internal error
DETAIL = "  "  # before a detail of the finding before it
LOCATED = re.compile(r".+?:\d+: ")  # a message that begins with file and line needs no prefix


class OutputError(CellplanError):
    """The result of a command could not be written to its standard output."""


class InterruptedWorkError(CellplanError):
    """A command was interrupted and can go on from where it stopped."""

    status = ExitStatus.INTERRUPTED


@contextlib.contextmanager
def resumable() -> Iterator[None]:
    """Say of an interruption that the work can go on."""
    try:
        yield
    except KeyboardInterrupt as error:
        raise InterruptedWorkError(str(error) or "interrupted") from None


def exit_status(error: BaseException) -> ExitStatus:
    """Exit status that an exception ends the program with."""
    if isinstance(error, KeyboardInterrupt):
        return ExitStatus.INTERRUPTED
    return error.status if isinstance(error, CellplanError) else ExitStatus.INTERNAL


def error_lines(error: BaseException) -> list[str]:
    """The findings, one per line, details indented; a finding about a line of a file begins with ``FILE:LINE:``."""
    if isinstance(error, KeyboardInterrupt):
        return ["interrupted: no incomplete run folder was left behind"]
    if isinstance(error, ImpossibleTasksError | InvalidFileError | NotVerifiedError):
        return [_indented(str(finding)) for finding in error.findings]
    if isinstance(error, CellplanError):
        line = _one_line(str(error))
        is_plain = LOCATED.match(line) or isinstance(error, InterruptedWorkError)
        return [line if is_plain else f"error: {line}"]
    what = _one_line(str(error)) or "no message"
    return [f"internal error: {type(error).__name__}: {what} (set {DEBUG_VARIABLE}=1 to see the traceback)"]


def tell(line: str) -> None:
    """Write one line to the error stream; nothing happens if that stream is closed."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        sys.stderr.write(f"{line}\n")
        sys.stderr.flush()


def report_failure(error: BaseException) -> ExitStatus:
    """Print why the command ends; returns the exit status."""
    if not isinstance(error, CellplanError | KeyboardInterrupt) and os.environ.get(DEBUG_VARIABLE) == "1":
        tell("".join(traceback.format_exception(error)).rstrip())
    for line in error_lines(error):
        tell(line)
    return exit_status(error)


def _indented(finding: str) -> str:
    """A finding as one line; a detail of the one before it keeps its indentation."""
    return f"{DETAIL if finding.startswith(DETAIL) else ''}{_one_line(finding)}"


def _one_line(text: str) -> str:
    """The text with line breaks and control characters made visible, so that a message stays one harmless line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text.strip())
