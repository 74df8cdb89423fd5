"""Times on a page: each may be chosen there, and leads to the 3-D page."""

from dataclasses import dataclass
from html import escape
from typing import Final

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import fixed

DIGITS: Final = 4  # decimals of an instant in an address, in [s]


@dataclass(frozen=True, slots=True)
class TimeLink:
    """An instant that may be chosen."""

    text: str  # what is printed
    at: float  # the instant in [s] on the clock of the page
    address: str  # address of the 3-D page at that instant

    def __html__(self) -> str:
        """The element; templates take it as it is."""
        return f'<a class="at" data-at="{self.at}" href="{escape(self.address)}">{self.text}</a>'


@dataclass(frozen=True, slots=True)
class TimeLinks:
    """Writer of times that may be chosen, ``at(1.626)`` in templates.

    Attributes:
        begin: Time in [s] at which the clock of the page begins on that of the whole program, which the 3-D page has.
    """

    view: str  # where the 3-D page lies from the page
    begin: float = 0.0

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


class Shifts:
    """Times from which those of figures count on a page's clock, ``shift("clearance", "self", 2.2)``.

    In a run that is always 0. The figures of a program are the worst of its phases, on the clock of a phase each; the
    check that says the same tells which one it was.
    """

    def __init__(self, record: Record) -> None:
        """Index the checks of a program.

        Args:
            record: Of a run or of a program.
        """
        self._is_run = "runs" not in record
        self._begins: dict[tuple[str, str, float | None], float] = {}
        begins = {} if self._is_run else phase_begins(record)
        for check in record["checks"]:
            if check.get("run") in begins:
                name = check["name"].removesuffix("_assumed")
                self._begins.setdefault((name, check["subject"], check["at_s"]), begins[check["run"]])

    def __call__(self, name: str, subject: str, at: float | None) -> float | None:
        """The time in [s]; None if it is not known.

        Args:
            name: Name of the check that the figure is from.
            subject: Its subject.
            at: The instant in [s].
        """
        return 0.0 if self._is_run else self._begins.get((name, subject, at))
