"""Standard output: results for people, or one JSON object for machines."""

import contextlib
import json
import os
import re
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from cellplan.cli.terminal.errors import OutputError, error_lines, exit_status
from cellplan.errors import CellplanError, ExitStatus

if TYPE_CHECKING:
    from rich.text import Text

SIGNS: Final = {True: "✓", False: "✗", None: ""}  # of a verdict: passed, failed, or neither
COLOURS: Final = {True: "bold green", False: "bold red", None: "bold"}
WHOLE: Final = re.compile(r"next: |[A-Za-z0-9-]+( page)?: \S+$")  # commands and paths to copy are not broken
STYLES: Final = (  # of a whole line, by what it begins with; the first that fits counts
    (re.compile(r"\s+FAILED "), "red"),
    (re.compile(r"\s+note: "), "yellow"),
    (
        re.compile(
            r"\s+(not checked in full|((payload|torques) )?not judged|torques and base reactions not known|grip): "
        ),
        "dim",
    ),
    (re.compile(r"next: "), "bold cyan"),
    (re.compile(r"[A-Za-z0-9-]+( page)?: \S+$"), "cyan"),
)
COLUMN_GAP: Final = re.compile(r"\S {2,}(?=\S)")
MAX_HANGING: Final = 0.6  # [-] fraction of the width at which further lines may begin, at most
TABLE_GAPS: Final = 3  # [-] gaps from which a line is a row of a table, which would be harder to read if wrapped
NARROW: Final = 20  # [columns] of a terminal below which nothing is wrapped


class Result(NamedTuple):
    """What came of a command."""

    status: ExitStatus  # exit status of the program
    lines: Sequence[str]  # for people: the verdict, and what stands below it
    record: Mapping[str, object]  # for machines
    is_verdict: bool = True  # whether it passes or fails


def result_of_folder(
    schema: str, status: ExitStatus, lines: Sequence[str], page: Path, *, says: str | None = None, **content: object
) -> Result:
    """The result of a command that has written a folder with a page; ``says`` is its status in the record, if any."""
    about = {"schema": schema} | ({} if says is None else {"status": says}) | {"exit": int(status)}
    place = {"folder": str(page.parent), "report_path": str(page)}
    return Result(status, lines, {**about, **place, **content})


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
    """Write a result to standard output, all of it or an error."""
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
            record = {"schema": schema, "status": "error", "exit": int(exit_status(error)), "errors": lines}
            say_json({**record, **(error.details if isinstance(error, CellplanError) else {})})
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


def is_terminal() -> bool:
    """Whether standard output is a terminal that shows colours and signs."""
    if sys.stdout is None or not sys.stdout.isatty() or os.environ.get("TERM", "dumb") == "dumb":
        return False
    return (sys.stdout.encoding or "").lower().startswith("utf")


def screen_text(lines: Sequence[str], *, passed: bool | None, width: int) -> str:
    """Lines with signs and colours, wrapped at a width; colours are left out if NO_COLOR is set.

    Args:
        passed: The verdict; None for a result that neither passes nor fails.
    """
    from rich.console import Console
    from rich.text import Text

    console = Console(width=width, force_terminal=True, highlight=False, no_color=None)
    plain = bool(os.environ.get("NO_COLOR"))
    with console.capture() as capture:
        for number, line in enumerate(lines):
            styled = _verdict(line, passed) if number == 0 else _styled(line)
            for piece in _wrapped(styled, width):
                shown = Text(piece.plain) if plain else piece
                console.print(shown, soft_wrap=True)
    return capture.get().removesuffix("\n")


def _verdict(line: str, passed: bool | None) -> "Text":
    """The first line, with its sign."""
    from rich.text import Text

    return Text(f"{SIGNS[passed]} {line}".lstrip(), style=COLOURS[passed])


def _styled(line: str) -> "Text":
    """A further line in the style of its kind; FAILED becomes the sign."""
    from rich.text import Text

    style = next((style for pattern, style in STYLES if pattern.match(line)), "")
    return Text(re.sub(r"^(\s+)FAILED ", rf"\1{SIGNS[False]} ", line), style=style)


def _wrapped(line: "Text", width: int) -> "list[Text]":
    """The line in pieces of at most ``width`` columns; a word that is longer, such as a path, is left whole."""
    from rich.text import Text

    if len(line.plain) <= width or width < NARROW or _is_whole(line.plain):
        return [line]
    hanging = " " * _hanging_indent(line.plain, width)
    pieces, start, left = [], 0, width
    while len(line.plain) - start > left:
        text = line.plain[start:]
        first = len(text) - len(text.lstrip())
        end = text.rfind(" ", first, left + 1)
        if end <= first:
            end = text.find(" ", left)
        if end <= first:
            break
        pieces.append(line[start : start + end])
        start = len(line.plain) - len(text[end:].lstrip())
        left = width - len(hanging)
    pieces.append(line[start:])
    for piece in pieces:
        piece.rstrip()
    return pieces[:1] + [Text.assemble(hanging, piece) for piece in pieces[1:]]


def _is_whole(text: str) -> bool:
    """Whether a line stands on one line whatever the width: something to copy, or a row of a table."""
    return WHOLE.match(text) is not None or len(COLUMN_GAP.findall(text)) >= TABLE_GAPS


def _hanging_indent(text: str, width: int) -> int:
    """Where the further pieces of a line begin: below its last column, or a little right of its beginning."""
    gaps = [match.end() for match in COLUMN_GAP.finditer(text)]
    begin = len(text) - len(text.lstrip())
    below = [gap for gap in gaps if gap <= MAX_HANGING * width]
    return below[-1] if below else begin + 2
