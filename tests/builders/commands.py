"""Commands and scripts of pages, run in this process: starting an interpreter for each would take most of the time."""

import contextlib
import io
import shlex
from collections.abc import Iterator
from pathlib import Path

from cellplan.cli.main import run

SHELL_SIGNS = frozenset("|&;<>()$`*?~{}\n")


def is_plain(line: str) -> bool:
    """Whether a line of a shell is one command of cellplan without anything that a shell would have to expand."""
    command = line.partition(" #")[0]
    return command.startswith("cellplan ") and not SHELL_SIGNS & set(command)


def run_command(line: str, folder: Path) -> tuple[int, str, str]:
    """Exit status, standard output and error stream of one command of cellplan."""
    with _in_folder(folder) as (out, err):
        status = run(shlex.split(line, comments=True)[1:])
    return int(status), out.getvalue(), err.getvalue()


def run_script(text: str, folder: Path) -> str:
    """Standard output of a Python script."""
    with _in_folder(folder) as (out, _):
        exec(compile(text, "<page>", "exec"), {"__name__": "__main__"})  # noqa: S102 - a page of this project
    return out.getvalue()


@contextlib.contextmanager
def _in_folder(folder: Path) -> Iterator[tuple[io.StringIO, io.StringIO]]:
    """Work in a folder, with streams of one's own."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        yield out, err
