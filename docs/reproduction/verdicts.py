"""Verdicts: a published figure beside ours, and what that amounts to."""

from dataclasses import dataclass

REPRODUCED, AMBIGUOUS, NOT = "reproduced", "within the ambiguity", "**not reproduced**"
ALONE = "ours alone"  # nothing was published: shown for comparison
SAME = 0.25  # [-] of the published figure: figures are printed to two digits and read off a plot
ROOM = 4.0  # [-] factor that the layout may make, where it is not in the text: the error follows joint accelerations


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of a table: what is claimed, what is published, what we find, and the verdict."""

    what: str
    published: str
    ours: str
    difference: str
    verdict: str

    def text(self) -> str:
        """The line in Markdown."""
        return f"| {self.what} | {self.published} | {self.ours} | {self.difference} | {self.verdict} |"


def bound(what: str, ours: float, limit: float, unit: str) -> Row:
    """A figure that was published as an upper bound."""
    return Row(
        what=what,
        published=f"< {shown(limit)} {unit}",
        ours=f"{shown(ours)} {unit}",
        difference=f"{shown(limit - ours)} {unit} below" if ours < limit else f"{shown(ours - limit)} {unit} above",
        verdict=REPRODUCED if ours < limit else NOT,
    )


def figure(what: str, ours: float, published: float, unit: str) -> Row:
    """A figure that depends on a layout which is not in the text."""
    same, near = abs(ours - published) <= SAME * published, published / ROOM <= ours <= published * ROOM
    return Row(
        what=what,
        published=f"{shown(published)} {unit}",
        ours=f"{shown(ours)} {unit}",
        difference=f"{ours - published:+.2g} {unit}",
        verdict=REPRODUCED if same else AMBIGUOUS if near else NOT,
    )


def claim(what: str, published: str, ours: str, *, holds: bool, difference: str = "none") -> Row:
    """A claim in words."""
    return Row(what=what, published=published, ours=ours, difference=difference, verdict=REPRODUCED if holds else NOT)


def alone(what: str, ours: str) -> Row:
    """A figure that no paper has, for comparison."""
    return Row(what=what, published="-", ours=ours, difference="-", verdict=ALONE)


def shown(value: float) -> str:
    """A number as people write it, to three digits."""
    return f"{value:.3g}"
