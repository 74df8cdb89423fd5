"""Sections: what one benchmark tells, on the screen and in docs/benchmarks.md alike."""

import os
import platform
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Final

WIDTH: Final = 140  # [-] characters of a line of text
ONE_THREAD: Final = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1")  # small matrices


@dataclass(frozen=True, slots=True, kw_only=True)
class Goal:
    """Something that was set out to be reached.

    Attributes:
        text: What.
        measured: What came out.
        met: Whether that is enough.
    """

    text: str
    measured: str
    met: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One benchmark, measured.

    Attributes:
        title: Its heading.
        lines: Text and tables in Markdown.
        goals: What it was to reach.
    """

    title: str
    lines: Sequence[str]
    goals: Sequence[Goal] = ()

    def text(self) -> str:
        """The section in Markdown."""
        goals = ["", *goal_table(self.goals)] if self.goals else []
        return "\n".join([f"## {self.title}", "", *(wrapped(line) for line in self.lines), *goals])


def wrapped(line: str) -> str:
    """A paragraph or an item of a list in lines that one can read; rows of tables stay as they are."""
    if line.startswith("|"):
        return line
    indent = "  " if line.startswith("- ") else ""
    return textwrap.fill(line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A table in Markdown."""
    return [_row(head), "|" + "---|" * len(head), *(_row(row) for row in rows)]


def goal_table(goals: Sequence[Goal]) -> list[str]:
    """Goals and whether they are met."""
    rows = [(goal.text, goal.measured, "met" if goal.met else "**missed**") for goal in goals]
    return table(("goal", "measured", ""), rows)


def digits(value: float, count: int = 2) -> str:
    """A number with so many digits that count, and no exponent."""
    if value == 0.0:
        return "0"
    return f"{float(f'{value:.{count - 1}e}'):.12f}".rstrip("0").rstrip(".")


def machine() -> str:
    """What the figures were measured on."""
    return (
        f"{_processor()}, {os.cpu_count()} processors, {platform.system()} {platform.machine()}, "
        f"Python {platform.python_version()}, NumPy {version('numpy')}, pinocchio {version('pin')}, "
        f"cellplan {version('cellplan')}"
    )


def _processor() -> str:
    """Name of the processor as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown processor"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown processor"


def _row(cells: Sequence[str]) -> str:
    """One line of a table."""
    return "| " + " | ".join(cells) + " |"
