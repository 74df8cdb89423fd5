"""Whether a picture of a run holds nothing but what cellplan draws: curves may differ by rounding, words may not."""

import re
from collections.abc import Collection, Iterator
from typing import Final
from xml.etree import ElementTree as ET

from cellplan.files.input.findings import shown

ELEMENTS: Final = frozenset({"svg", "g", "path", "rect", "text"})
SVG_START: Final = "<svg"
PIECE: Final = re.compile(r"<[^<>]*>|[^<>]+|[<>]")
TAG: Final = re.compile(r'</?([\w:]+)((?:\s+[\w:-]+="[^"<>]*")*)\s*/?>')
ATTRIBUTE: Final = re.compile(r'([\w:-]+)="([^"]*)"')
FIGURE: Final = re.compile(r"[-−+]?[\d.,]+(?:e[-−+]?\d+)?|10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+")
MEASURES: Final = frozenset({"x", "y", "width", "height", "d", "data-y"})  # attributes whose values are measures alone
MEASURE: Final = re.compile(r"[-\d.e MLHVZhvl]*")


def foreign_piece(got: str, expected: str) -> str | None:
    """The first piece of a picture that cellplan does not draw: an element, an attribute, a word; None without any.

    Figures at the axes and the courses of curves are not compared: where a curve shows nothing but the noise of the
    arithmetic, they are others on every processor.
    """
    head, _, body = got.partition(SVG_START)
    other_head, _, other_body = expected.partition(SVG_START)
    if head != other_head:
        return shown(" ".join(head.split()) or "nothing")
    known = frozenset(PIECE.findall(SVG_START + other_body))
    words = frozenset(piece.strip() for piece in known)
    attributes = frozenset(ATTRIBUTE.findall(SVG_START + other_body))
    for piece in PIECE.findall(SVG_START + body):
        if piece not in known and piece.strip() not in words and _is_foreign(piece, attributes):
            return shown(" ".join(piece.split()))
    return next(unbalanced(got, "picture"), None)


def _is_foreign(piece: str, known: Collection[tuple[str, str]]) -> bool:
    """Whether a piece that the picture drawn anew does not hold is more than a figure or a course of its own.

    Args:
        piece: A tag, or the text between two.
        known: Name and value of all attributes that were drawn.
    """
    if not piece.startswith(("<", ">")):
        return not FIGURE.fullmatch(piece.strip())
    tag = TAG.fullmatch(piece)
    if tag is None or tag[1] not in ELEMENTS:
        return True
    return any(
        (name, value) not in known and not (name in MEASURES and MEASURE.fullmatch(value))
        for name, value in ATTRIBUTE.findall(tag[2])
    )


def unbalanced(got: str, what: str) -> Iterator[str]:
    """What keeps a picture, of which every piece is drawn here, from being one whole element."""
    try:
        ET.fromstring(got)  # noqa: S314 - its head, where entities would be declared, is the one that is drawn here
    except ET.ParseError as error:
        yield f"a {what} that cannot be read ({error})"
