"""What the gate says of drawings: rounding is none of it, a word or an element is."""

import shutil
from pathlib import Path

import pytest
from builders.run_edits import Copy, seal

from cellplan import open_gate
from cellplan.errors import InputError
from cellplan.runs.gate.compare_drawings import foreign_piece, is_same_drawing

SVG = (
    '<svg class="still-sheet" viewBox="0 0 7200 4600">\n<title id="a">Clearance too small at 1.250 s</title>\n'
    "<style>.still-sheet .c1{fill:#102030}</style>\n"
    '<path class="c1" d="M1217 1083l40 -12 3 80z"/>\n<circle class="ring" cx="120" cy="80" r="150"/>\n'
    '<text class="value" x="12.5" y="7">12.5 mm</text>\n</svg>\n'
)


@pytest.mark.parametrize(("old", "new"), [("M1217 1083l40", "M1218 1083l39"), ('x="12.5"', 'x="12.6"'), ("", "")])
def test_a_drawing_that_differs_by_rounding_is_the_same(old: str, new: str) -> None:
    other = SVG.replace(old, new)

    assert is_same_drawing(other, SVG)
    assert foreign_piece(other, SVG) is None


@pytest.mark.parametrize(
    ("old", "new"), [("M1217 1083l40", "M1317 1083l40"), ("l40 -12 3 80z", "l40 -12z"), ('cx="120"', 'cx="240"')]
)
def test_a_course_that_is_another_is_told_and_is_no_foreign_piece(old: str, new: str) -> None:
    other = SVG.replace(old, new)

    assert not is_same_drawing(other, SVG)
    assert foreign_piece(other, SVG) is None


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
    other = SVG.replace(old, new)

    assert other != SVG
    assert piece in str(foreign_piece(other, SVG))
    assert not is_same_drawing(other, SVG)


def forged(sound: Path, folder: Path, name: str, old: str, new: str) -> Copy:
    """A copy of a run in which a drawing says something else, in its file and on the page alike."""
    shutil.copytree(sound, folder / "all")
    copy = Copy(cell=folder / "all" / "cell" / "small.yaml", run=folder / "all" / "run", other=folder)
    drawing, page = (copy.run / file for file in (name, "report.html"))
    text = drawing.read_text(encoding="utf-8")
    other = text.replace(old, new, 1)
    assert other != text
    drawing.write_text(other, encoding="utf-8")
    page.write_text(page.read_text(encoding="utf-8").replace(text, other), encoding="utf-8")
    seal(copy)
    return copy


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [("still.svg", "</title>", " and released</title>"), ("floor_plan.svg", "</svg>", "<script>x()</script></svg>")],
)
def test_a_run_with_words_of_others_in_a_drawing_is_refused(
    name: str, old: str, new: str, sound: Path, tmp_path: Path
) -> None:
    copy = forged(sound, tmp_path, name, old, new)

    with pytest.raises(InputError, match=rf"{name}: unexpected .*, which cellplan does not draw"):
        open_gate(copy.run, cell=copy.cell)


def test_a_run_with_another_course_in_a_drawing_is_verified_with_a_remark(sound: Path, tmp_path: Path) -> None:
    copy = forged(sound, tmp_path, "floor_plan.svg", 'd="M', 'd="M9')

    remarks = open_gate(copy.run, cell=copy.cell).remarks

    assert any("some pictures differ" in remark and "floor_plan.svg" in remark for remark in remarks)
