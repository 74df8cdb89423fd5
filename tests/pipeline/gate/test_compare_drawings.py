"""What the gate says of drawings: rounding is none of it, a word or an element is."""

import pytest

from cellplan.pipeline.gate.compare_drawings import foreign_piece, is_same_drawing

DRAWN = (
    '<svg class="still-sheet" viewBox="0 0 7200 4600">\n<title id="a">Clearance too small at 1.250 s</title>\n'
    "<style>.still-sheet .c1{fill:#102030}</style>\n"
    '<path class="c1" d="M1217 1083l40 -12 3 80z"/>\n<circle class="ring" cx="120" cy="80" r="150"/>\n'
    '<text class="value" x="12.5" y="7">12.5 mm</text>\n</svg>\n'
)


@pytest.mark.parametrize(("old", "new"), [("M1217 1083l40", "M1218 1083l39"), ('x="12.5"', 'x="12.6"'), ("", "")])
def test_a_drawing_that_differs_by_rounding_is_the_same(old: str, new: str) -> None:
    other = DRAWN.replace(old, new)

    assert is_same_drawing(other, DRAWN)
    assert foreign_piece(other, DRAWN) is None


@pytest.mark.parametrize(
    ("old", "new"), [("M1217 1083l40", "M1317 1083l40"), ("l40 -12 3 80z", "l40 -12z"), ('cx="120"', 'cx="240"')]
)
def test_a_course_that_is_another_is_told_and_is_no_foreign_piece(old: str, new: str) -> None:
    other = DRAWN.replace(old, new)

    assert not is_same_drawing(other, DRAWN)
    assert foreign_piece(other, DRAWN) is None


@pytest.mark.parametrize(
    ("old", "new", "piece"),
    [
        ("12.5 mm", "82.5 mm", "82.5 mm"),
        ("1.250 s", "1.350 s", "1.350 s"),
        ("#102030", "#ffffff", "#ffffff"),
        ('<path class="c1"', '<path onclick="x()" class="c1"', "onclick"),
        ("</svg>", "<script>x()</script></svg>", "<script>"),
        ("</svg>", "</svg><b></b>", "<b>"),
        ("</svg>", "", "cannot be read"),
        ("</svg>", "</svg></svg>", "cannot be read"),
        ('d="M1217 1083l40 -12 3 80z"', 'd="url(x)"', "url(x)"),
        ('class="c1" d', 'class="c7" d', "c7"),
    ],
)
def test_words_elements_and_attributes_must_be_those_that_are_drawn(old: str, new: str, piece: str) -> None:
    other = DRAWN.replace(old, new)

    assert other != DRAWN
    assert piece in str(foreign_piece(other, DRAWN))
    assert not is_same_drawing(other, DRAWN)
