"""What a notebook shows of a result: verdict, key figures, pictures and short tables, without scripts.

A piece of a page, not a page: styles stand at the elements, so that they touch nothing else in the notebook, and
pictures are images, whose texts and names stay within them.
"""

import math
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from cellplan.report.page.render import template
from cellplan.report.record.common import Entries, Record
from cellplan.report.record.phases import instant_text

MOST_ROWS: Final = 10  # [-] of a table
DIGITS: Final = 4  # [-] significant, of numbers in tables
MOST_LINES: Final = 5  # [-] of findings


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """A short table."""

    caption: str  # what it shows
    columns: Mapping[str, Sequence[Any]]  # values of each column by its name; numbers are shown with four digits
    more: str = ""  # where all of it is found, as Python; empty where nothing is left out

    @property
    def rows(self) -> list[list[Any]]:
        """The first rows."""
        return [list(row) for row in zip(*self.columns.values(), strict=True)][:MOST_ROWS]

    @property
    def sides(self) -> list[str]:
        """Side to which each column is aligned: numbers to the right, texts and the first column to the left."""
        has_text = [any(isinstance(value, str) for value in column) for column in self.columns.values()]
        return ["left" if is_text or place == 0 else "right" for place, is_text in enumerate(has_text)]

    @property
    def left_out(self) -> int:
        """Number of rows that are not shown."""
        return max(0, max(map(len, self.columns.values()), default=0) - MOST_ROWS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Card:
    """What is shown of a result."""

    kind: str  # what it is, in a word or two
    name: str  # name of the cell
    verdict: str = ""  # the verdict in a few words; empty without one
    passed: bool | None = None  # whether it is a good one; None where it is neither good nor bad
    findings: Sequence[str] = ()  # what is wrong, a line each
    figures: Entries = field(default_factory=list)  # key figures, each as ``figure`` gives it
    pictures: Mapping[str, str] = field(default_factory=dict)  # pictures as SVG by what they show
    grids: Sequence[Grid] = ()  # short tables


def card_html(card: Card) -> str:
    """A card as a piece of a page."""
    pictures = {
        title: f"data:image/svg+xml;base64,{b64encode(svg.encode()).decode()}" for title, svg in card.pictures.items()
    }
    texts = {"shown": _shown, "detail": _detail, "most": MOST_LINES}
    return template("notebook.html").render(card=card, pictures=pictures, **texts)


def _detail(figure: Record) -> str:
    """Where and when a key figure is found, and what else there is to say."""
    place = " ".join(part for part in (figure["where"], instant_text(figure)) if part)
    return "; ".join(part for part in (place, figure["note"]) if part)


def _shown(value: Any) -> str:
    """A value in a table."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float) and math.isnan(value):
        return "–"
    if isinstance(value, float):
        return f"{float(f'{value:.{DIGITS}g}'):.9f}".rstrip("0").rstrip(".").replace("-", "−")
    return "–" if value is None else str(value)
