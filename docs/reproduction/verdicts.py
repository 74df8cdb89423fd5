"""Verdicts: a published figure beside ours, and what that amounts to."""

from dataclasses import dataclass, replace

REPRODUCED, NOT = "reproduced", "**not reproduced**"
CHOSEN = "chosen"  # what the text leaves open was chosen so that this comes out: it proves nothing
CIRCULAR = "circular"  # the figure is the stopping rule of the method itself: it proves that the method ended, no more
ALONE = "ours alone"  # nothing was published: shown for comparison


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of a table: what is claimed and where, what is published, what we find, and the verdict."""

    what: str
    published: str
    ours: str
    difference: str
    verdict: str

    def text(self, where: str) -> str:
        """The line in Markdown, with the place in the paper."""
        return f"| {self.what} | {where} | {self.published} | {self.ours} | {self.difference} | {self.verdict} |"


def bound(what: str, ours: float, limit: float, unit: str) -> Row:
    """A figure that was published as an upper bound."""
    return Row(
        what=what,
        published=f"< {shown(limit)} {unit}",
        ours=f"{shown(ours)} {unit}",
        difference=f"{shown(limit - ours)} {unit} below" if ours < limit else f"{shown(ours - limit)} {unit} above",
        verdict=REPRODUCED if ours < limit else NOT,
    )


def circular(what: str, ours: float, limit: float, unit: str) -> Row:
    """A published bound that is the tolerance at which the method stops: kept by every run that ends."""
    row = bound(what, ours, limit, unit)
    return row if row.verdict == NOT else replace(row, verdict=CIRCULAR)


def chosen(what: str, published: str, ours: str, difference: str) -> Row:
    """A figure or claim for which a setting that is not in the text was chosen."""
    return Row(what=what, published=published, ours=ours, difference=difference, verdict=CHOSEN)


def claim(what: str, published: str, ours: str, *, holds: bool, difference: str = "none") -> Row:
    """A claim in words."""
    return Row(what=what, published=published, ours=ours, difference=difference, verdict=REPRODUCED if holds else NOT)


def alone(what: str, ours: str) -> Row:
    """A figure that no paper has, for comparison."""
    return Row(what=what, published="-", ours=ours, difference="-", verdict=ALONE)


def shown(value: float) -> str:
    """A number as people write it, to three digits."""
    return f"{value:.3g}"
