"""Pictures of a run may differ from those drawn anew in figures and curves, and in nothing else."""

import pytest

from cellplan.runs.gate.picture_text import foreign_piece

PICTURE = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 100">
<path d="M0 1L2 3" fill="none" stroke="#123456"/>
<text x="1" y="2" fill="#123456">0.5</text>
<text x="3" y="4" fill="#123456">error in mm</text>
<g class="panel" data-y="0 1" data-unit="mm"><text x="1" y="9">10⁻⁵</text></g>
</svg>
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("L2 3", "L2.5 3.25 4-1e-5"),
        (">0.5<", ">−1.25e-7<"),
        ("<g ", '<path d="M1e-3 2H3V4" stroke="#123456"/><g '),
        ('data-y="0 1"', 'data-y="-1e-09 1.5"'),
        (">10⁻⁵<", ">10⁻⁶<"),
        ('<text x="3"', '<text x="3" y="9">1,000</text><text x="3"'),
        ("", ""),
    ],
)
def test_other_figures_and_curves_are_taken_for_rounding(old: str, new: str) -> None:
    assert foreign_piece(PICTURE.replace(old, new, 1), PICTURE) is None


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("error in mm", "error in um", "error in um"),
        (">0.5<", ">0.5 safe<", "0.5 safe"),
        (">0.5<", ">&#115;afe<", "afe"),
        ("</svg>", "<script>1</script></svg>", "<script>"),
        ("</svg>", "</svg><h1>0.5</h1>", "<h1>"),
        ("</svg>", "</svg><text>0.5</text>", "cannot be read"),
        ("</svg>", "</text></svg>", "cannot be read"),
        ("</svg>", "<!--><text>error in mm</text>--></svg>", "<!-->"),
        ("</svg>", "<![CDATA[0.5]]></svg>", "CDATA"),
        ("<path ", '<path onclick="1" ', "onclick"),
        ("<path ", "<path onclick='1' ", "onclick"),
        ("<path ", '<path style="display:none" ', "style"),
        ('fill="none"', 'fill="#ffffff"', "ffffff"),
        ('data-unit="mm"', 'data-unit="m"', "data-unit"),
        ("M0 1L2 3", "M0 1L2 3)url(", "url("),
        ('fill="none"', 'fill="url(//localhost/m1)"', "url("),
        ("</svg>", '<image href="#m1"/></svg>', "<image"),
        ("<svg", "<!DOCTYPE svg [<!ENTITY e 'safe'>]><svg", "DOCTYPE"),
    ],
)
def test_words_elements_and_attributes_of_others_are_named(old: str, new: str, reported: str) -> None:
    assert reported in str(foreign_piece(PICTURE.replace(old, new, 1), PICTURE))
