"""Whether the drawings of a run on disk are those of what was found: figures may differ by rounding, words may not."""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from cellplan.files.input.findings import shown
from cellplan.files.run.stored import StoredRun
from cellplan.runs.gate.picture_text import PIECE, unbalanced

CellDrawings = Mapping[str, Mapping[str, str]]

COURSE: Final = re.compile(r'(?<= d=")[MLHVlhvz\d. -]*(?=")')  # of a line
LETTER: Final = re.compile("[A-Za-z]")  # of a course, which is set apart from its figures
FIGURE: Final = re.compile(r"(?<![\w#-])-?\d+(?:\.\d+)?(?![\w])")  # no part of a name
ROUNDING: Final = 3.0  # units of a sheet, each at most a tenth of a millimetre: what rounding to a whole one can do


def stored_drawings(stored: StoredRun, place: str, names: Iterable[str]) -> dict[str, str]:
    """Drawings as they are on disk, by their names.

    Raises:
        InputError: One is missing, or was changed meanwhile.
    """
    return {name: stored.content(place, name).decode("utf-8", "replace") for name in names}


def _pairs(stored: StoredRun, expected: CellDrawings) -> Iterator[tuple[str, str, str, str]]:
    """Place and name of each drawing with the one on disk and the one drawn anew."""
    for place, drawings in expected.items():
        on_disk = stored_drawings(stored, place, drawings)
        yield from ((place, name, on_disk[name], text) for name, text in drawings.items())


def foreign_drawings(stored: StoredRun, expected: CellDrawings) -> Iterator[str]:
    """Drawings that hold something that cellplan does not draw there: an element, an attribute, a word."""
    for place, name, got, text in _pairs(stored, expected):
        foreign = foreign_piece(got, text)
        if foreign is not None:
            file = stored.file(place, name)
            yield f"{file}: unexpected {foreign}, which cellplan does not draw; solve the cell again"


def other_drawings(stored: StoredRun, expected: CellDrawings) -> Iterator[str]:
    """Drawings of the run that are not those drawn anew, apart from rounding."""
    for place, name, got, text in _pairs(stored, expected):
        if not is_same_drawing(got, text):
            yield f"{place}/{name}" if place else name


def foreign_piece(got: str, expected: str) -> str | None:
    """The first piece of a drawing that the one drawn anew has nowhere, whatever its figures; None without any."""
    known = {_without_figures(piece) for piece in PIECE.findall(expected)}
    foreign = next((piece for piece in PIECE.findall(got) if _without_figures(piece) not in known), None)
    return next(unbalanced(got, "drawing"), None) if foreign is None else shown(" ".join(foreign.split()))


def is_same_drawing(got: str, expected: str) -> bool:
    """Whether two drawings are the same, but for figures of tags that differ by rounding."""
    pieces, others = PIECE.findall(got), PIECE.findall(expected)
    return len(pieces) == len(others) and all(map(_is_same_piece, pieces, others))


def _is_same_piece(got: str, expected: str) -> bool:
    """Whether two pieces are the same; figures of tags may differ by rounding."""
    if got == expected:
        return True
    one, other = (COURSE.sub(lambda course: LETTER.sub(r" \g<0> ", course[0]), piece) for piece in (got, expected))
    if not expected.startswith("<") or FIGURE.split(one) != FIGURE.split(other):
        return False
    figures = zip(FIGURE.findall(one), FIGURE.findall(other), strict=True)
    return all(abs(float(first) - float(second)) <= ROUNDING for first, second in figures)


def _without_figures(piece: str) -> str:
    """A piece without the figures of a tag; words as they are."""
    return FIGURE.sub("0", COURSE.sub("", piece)) if piece.startswith("<") else piece.strip()
