"""Pictures of a run may differ from those drawn anew in figures and curves, and in nothing else."""

import pytest

from cellplan.pipeline.gate.picture_text import foreign_piece

DRAWN = """<?xml version="1.0" encoding="utf-8"?>
<svg xmlns:xlink="http://www.w3.org/1999/xlink" xmlns="http://www.w3.org/2000/svg" width="720pt">
 <defs><style type="text/css">*{stroke-linejoin: round}</style></defs>
 <g id="line2d_1"><path d="M 0 1
L 2 3" style="fill: none"/></g>
 <g id="text_1"><text style="font: 8px 'DejaVu Sans'" transform="rotate(-0 1 2)">0.5</text></g>
 <g id="text_2"><text style="font: 8px 'DejaVu Sans'" x="3" y="4">error in mm</text></g>
 <defs><path id="m1" d="M 0 0"/></defs><use xlink:href="#m1" x="1"/>
</svg>
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("L 2 3", "L 2.5 3.25\nL 4 -1e-5"),
        (">0.5<", ">−1.25e-7<"),
        ('<use xlink:href="#m1" x="1"/>', '<use xlink:href="#m1" x="1"/><use xlink:href="#m2" x="7" y="1"/>'),
        ('<g id="text_2">', '<g id="text_3"><text x="3" y="9">1,000</text></g><g id="text_2">'),
        ("", ""),
    ],
)
def test_other_figures_and_curves_are_taken_for_rounding(old: str, new: str) -> None:
    assert foreign_piece(DRAWN.replace(old, new, 1), DRAWN) is None


@pytest.mark.parametrize(
    ("old", "new", "reported"),
    [
        ("error in mm", "error in um", "error in um"),
        (">0.5<", ">0.5 safe<", "0.5 safe"),
        (">0.5<", ">&#115;afe<", "afe"),
        ("</svg>", "<script>1</script></svg>", "<script>"),
        ("</svg>", "</svg><h1>0.5</h1>", "<h1>"),
        ("</svg>", "</svg><text>0.5</text>", "cannot be read"),
        ("</svg>", "</g></svg>", "cannot be read"),
        ("</svg>", "<!--><text>error in mm</text>--></svg>", "<!-->"),
        ("</svg>", "<![CDATA[0.5]]></svg>", "CDATA"),
        ("<path ", '<path onclick="1" ', "onclick"),
        ("<path ", "<path onclick='1' ", "onclick"),
        ('"#m1"', '"http://localhost/m1"', "localhost"),
        ("fill: none", "fill: url(//localhost/m1)", "url("),
        ("</svg>", '<image xlink:href="#m1"/></svg>', "<image"),
        ("<?xml", "<!DOCTYPE svg [<!ENTITY e 'safe'>]><?xml", "DOCTYPE"),
        ("stroke-linejoin: round", "display: none", "display"),
    ],
)
def test_words_elements_and_attributes_of_others_are_named(old: str, new: str, reported: str) -> None:
    assert reported in str(foreign_piece(DRAWN.replace(old, new, 1), DRAWN))
