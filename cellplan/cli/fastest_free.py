"""``cellplan fastest --free``: the options of a search with bases and tools as they are."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cellplan.cli.layout import SCHEMA
from cellplan.cli.output import json_failure
from cellplan.errors import InputError


def read_words(text: str) -> tuple[str, ...]:
    """The words of ``--free``, with commas between them.

    Raises:
        InputError: There is no word.
    """
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise InputError("--free: expected some of start, weights, path, spin, got none")
    return words


def search_free(
    cell: Path,
    output: Path | None,
    options: Mapping[str, Any],
    work: tuple[str | None, int | None, int | None, bool],
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    """Search, write the study folder, say what came of it, and leave with the exit status.

    Args:
        cell: The cell file.
        output: The study folder; None for the usual one.
        options: What is searched for, by name.
        work: Budget, number of trials, number of processes, and whether an earlier search goes on.
        as_json: Whether the record is printed.
        quiet: Whether progress is kept to itself.

    Raises:
        Exit: Always, at the end.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.cli.layout_options import Work, read_request, read_stop, read_workers, search_and_say

        budget, trials, workers, resume = work
        request = read_request(cell, objective="cycle", **options)
        by = Work(read_stop(budget, trials), read_workers(workers, None), resume)
        search_and_say(request, output, by, as_json=as_json, quiet=quiet)
