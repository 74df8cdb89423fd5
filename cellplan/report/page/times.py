"""Times on a page: each may be chosen there, and leads to the 3-D page."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from html import escape
from typing import Final

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import fixed
from cellplan.report.record.phases import AT, phase_key

DIGITS: Final = 4  # decimals of an instant in an address, in [s]


@dataclass(frozen=True, slots=True)
class TimeLink:
    """An instant that may be chosen."""

    text: str  # what is printed
    at: float  # the instant in [s] on the clock of the page
    address: str  # address of the 3-D page at that instant
    after: str = ""  # what follows in the line, as HTML

    def __html__(self) -> str:
        """The element; templates take it as it is."""
        return f'<a class="at" data-at="{self.at}" href="{escape(self.address)}">{self.text}</a>{self.after}'


@dataclass(frozen=True, slots=True)
class TimeLinks:
    """Writer of times that may be chosen, ``at(1.626)`` in templates."""

    view: str  # where the 3-D page lies from the page
    begin: float = 0.0  # in [s] at which the page's clock begins on that of the program, which the 3-D page has
    begins: Mapping[str, float] = field(default_factory=dict)  # time in [s] of each phase on the page's clock

    def __call__(self, at: float | None, shift: float | None = 0.0) -> str | TimeLink:
        """An instant that may be chosen.

        Args:
            at: What is printed, in [s]; None gives a dash.
            shift: Time in [s] on the page's clock from which it counts; None where that is not known, for plain text.
        """
        if at is None or shift is None:
            return fixed(at, 3)
        chosen = round(shift + at, DIGITS)
        return TimeLink(fixed(at, 3), chosen, self.address(chosen))

    def of(self, entry: Record, key: str = AT) -> str | TimeLink:
        """An instant in a table, with its phase where the record is that of a program."""
        phase = self._phase(entry, key)
        return self._followed(entry, key, f' <span class="soft">{escape(phase)}</span>' if phase else "")

    def said(self, entry: Record, key: str = AT) -> str | TimeLink:
        """The same in a sentence: ``1.626 s of work-2``."""
        phase = self._phase(entry, key)
        return self._followed(entry, key, f" s of {escape(phase)}" if phase else " s")

    def _phase(self, entry: Record, key: str) -> str:
        """Name of the phase of an instant; empty where its clock is that of the page."""
        return entry.get(phase_key(key)) or ""

    def _followed(self, entry: Record, key: str, after: str) -> str | TimeLink:
        """An instant with what follows it."""
        phase = self._phase(entry, key)
        link = self(entry[key], self.begins.get(phase) if phase else 0.0)
        return replace(link, after=after) if isinstance(link, TimeLink) else link

    def address(self, t: float) -> str:
        """Address of the 3-D page at an instant of the page's clock in [s]."""
        return f"{self.view}#t={round(self.begin + t, DIGITS)}"


def page_begin(record: Record) -> float:
    """Time in [s] on the clock of the whole program at which the phase of a run begins; 0 for a whole program."""
    return phase_begins(record).get(record.get("phase") or "", 0.0)


def phase_begins(record: Record) -> dict[str, float]:
    """Time in [s] on the clock of the whole program at which each phase begins, in its first cycle."""
    begins: dict[str, float] = {}
    for phase in record["phases"]:
        begins.setdefault(phase["name"], phase["begin_s"])
    return begins
