"""Progress of long commands on the error stream: a bar on a terminal, occasional lines elsewhere, nothing if quiet."""

import contextlib
import logging
import os
import sys
import time
from collections.abc import Callable, Iterator

from cellplan.cli.terminal.errors import tell
from cellplan.cli.terminal.verbosity import STAGES, StageTimes

LINE_EVERY_S = 10.0  # [s] between two lines of a log
DRAW_EVERY_S = 0.1  # [s] between two drawings of a bar

Listener = Callable[[str, float], None]


@contextlib.contextmanager
def progress_listener(*, quiet: bool) -> Iterator[Listener]:
    """A callback for the progress of stages, valid within the ``with`` statement; times of stages where desired."""
    if STAGES.isEnabledFor(logging.INFO):
        times = StageTimes()
        yield lambda stage, _share: times.at(stage)
        times.end()
    elif quiet:
        yield lambda _stage, _share: None
    elif _is_screen():
        with _bar() as listener:
            yield listener
    else:
        yield _lines()


def _is_screen() -> bool:
    """Whether the error stream is a terminal that can redraw a line."""
    return sys.stderr is not None and sys.stderr.isatty() and os.environ.get("TERM", "dumb") != "dumb"


@contextlib.contextmanager
def _bar() -> Iterator[Listener]:
    """A bar that disappears at the end; colours follow NO_COLOR.

    It is drawn where progress is made, not by a thread of its own: beside threads a process may not be copied.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
    with Progress(
        *columns, TimeElapsedColumn(), console=Console(stderr=True), transient=True, auto_refresh=False
    ) as bar:
        task = bar.add_task("starting", total=1.0)
        last, shown_at = "", 0.0

        def listen(stage: str, share: float) -> None:
            nonlocal last, shown_at
            bar.update(task, description=stage, completed=share)
            if stage != last or time.monotonic() - shown_at >= DRAW_EVERY_S:
                bar.refresh()
                last, shown_at = stage, time.monotonic()

        yield listen


def _lines() -> Listener:
    """A line whenever ``LINE_EVERY_S`` has passed."""
    last = time.monotonic()

    def listen(stage: str, share: float) -> None:
        nonlocal last
        if time.monotonic() - last >= LINE_EVERY_S:
            last = time.monotonic()
            tell(f"{stage}: {100.0 * share:.0f} %")

    return listen
