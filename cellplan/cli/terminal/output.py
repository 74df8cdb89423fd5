"""Standard output: results for people, or one JSON object for machines."""

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from cellplan.cli.terminal.errors import OutputError, error_lines, exit_status
from cellplan.cli.terminal.screen import is_terminal, screen_text
from cellplan.errors import ExitStatus


class Result(NamedTuple):
    """What came of a command."""

    status: ExitStatus  # exit status of the program
    lines: Sequence[str]  # for people: the verdict, and what stands below it
    record: Mapping[str, object]  # for machines
    folder: Path | None = None  # the run folder that was written; None if there is none
    is_verdict: bool = True  # whether it passes or fails


def result_of_folder(
    schema: str, status: ExitStatus, lines: Sequence[str], page: Path, *, says: str | None = None, **content: object
) -> Result:
    """The result of a command that has written a folder with a page; ``says`` is its status in the record, if any."""
    about = {"schema": schema} | ({} if says is None else {"status": says}) | {"exit": int(status)}
    place = {"folder": str(page.parent), "report_path": str(page)}
    return Result(status, lines, {**about, **place, **content}, page.parent)


def notes(remarks: Sequence[str]) -> list[str]:
    """What to know before relying on a result."""
    return [f"  note: {remark}" for remark in remarks]


def show(lines: Sequence[str], *, passed: bool | None = None) -> None:
    """Show a result to a person: styled and wrapped on a terminal, the same lines as they are elsewhere.

    Args:
        passed: The verdict; None for a result that neither passes nor fails.

    Raises:
        OutputError: Standard output is closed or cannot take the text.
    """
    if is_terminal():
        say(screen_text(lines, passed=passed, width=shutil.get_terminal_size().columns))
    else:
        say("\n".join(lines))


def say(text: str) -> None:
    """Write a result to standard output, all of it or an error.

    Raises:
        OutputError: Standard output is closed or cannot take the text.
    """
    if sys.stdout is None:
        raise OutputError("standard output: expected an open stream, got a closed one; the result was not shown")
    try:
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
    except UnicodeEncodeError:
        _say_escaped(text)
    except (OSError, ValueError) as error:
        _abandon_stdout()
        why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise OutputError(f"standard output: the result was not shown: {why.lower()}") from error


def say_json(value: Mapping[str, object], *, on_one_line: bool = False) -> None:
    """Write one JSON object to standard output; figures that are not finite are refused, for JSON has none."""
    say(json.dumps(value, indent=None if on_one_line else 2, ensure_ascii=False, allow_nan=False))


def present(result: Result, *, as_json: bool, on_one_line: bool = False) -> None:
    """Show a result to a person, or give it to a machine, which may want it on one line."""
    if as_json:
        say_json(result.record, on_one_line=on_one_line)
    else:
        show(result.lines, passed=result.status == ExitStatus.PASSED if result.is_verdict else None)


@contextlib.contextmanager
def json_failure(schema: str, *, desired: bool) -> Iterator[None]:
    """Give a machine one JSON object also when the command cannot do its work; the error is raised again."""
    try:
        yield
    except OutputError:
        raise
    except (Exception, KeyboardInterrupt) as error:
        if desired and not hasattr(error, "exit_code"):  # typer ends commands by exceptions with an exit code
            lines = error_lines(error)
            say_json({"schema": schema, "status": "error", "exit": int(exit_status(error)), "errors": lines})
        raise


def _say_escaped(text: str) -> None:
    """Write what the terminal's encoding lacks as escapes."""
    encoding = sys.stdout.encoding or "ascii"
    sys.stdout.write(text.encode(encoding, errors="backslashreplace").decode(encoding) + "\n")
    sys.stdout.flush()


def _abandon_stdout() -> None:
    """Discard the rest of the stream, as the interpreter would report another error at exit."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
