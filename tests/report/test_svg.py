"""Sheets as SVG: every mark where the plotting library would put it, every letter as it was given."""

import io
import re
import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest

from cellplan.report.plots_canvas import _figure, style
from cellplan.report.sheets import Line, Sheet, Words
from cellplan.report.svg import svg

NAME = "{http://www.w3.org/2000/svg}"
TIMES = np.linspace(0.0, 2.0, 50)


def elements(content: bytes, kind: str) -> list[ET.Element]:
    return list(ET.fromstring(content).iter(NAME + kind))  # noqa: S314


def empty_sheet() -> Sheet:
    sheet = Sheet("title", rows=1, columns=1, times=TIMES)
    sheet.marks.clear()
    return sheet


def second_opinion(sheet: Sheet) -> bytes:
    buffer = io.BytesIO()
    with style(), mpl.rc_context({"svg.fonttype": "none"}):
        _figure(sheet).savefig(buffer, format="svg")
    return buffer.getvalue()


def corners(path: str) -> np.ndarray:
    return np.array(re.findall(r"-?[\d.]+", path), dtype=float).reshape(-1, 2)


def test_texts_stand_where_the_plotting_library_puts_them() -> None:
    sheet = empty_sheet()
    for i, va in enumerate(("top", "bottom", "baseline", "center", "center_baseline")):
        for j, ha in enumerate(("left", "center", "right")):
            for k, size in enumerate((7.0, 10.5)):
                sheet.write(1.0 + 2.5 * j, 0.2 + 0.3 * i + 0.1 * k, f"lp{i}{j}{k}", va=va, ha=ha, size=size)

    ours = {text.text: text for text in elements(svg(sheet), "text")}
    theirs = {text.text: text for text in elements(second_opinion(sheet), "text")}

    assert set(ours) == set(theirs)
    for word, text in ours.items():
        other = theirs[word]
        assert float(text.get("x", "nan")) == pytest.approx(float(other.get("x", "nan")), abs=0.01)  # as it is written
        # letters are measured in whole pixels there: at 72 of them to the inch by up to a point
        assert float(text.get("y", "nan")) == pytest.approx(float(other.get("y", "nan")), abs=1.0)
        anchor = re.search(r"text-anchor: (\w+)", other.get("style", ""))
        assert text.get("text-anchor") == (anchor[1] if anchor else "start")


def test_lines_run_where_the_plotting_library_draws_them() -> None:
    sheet = empty_sheet()
    x, y = 1.0 + TIMES, 1.0 + np.sin(TIMES)
    sheet.marks.append(Line(x, y, {"color": "#123456", "linewidth": 1.3}))

    (path,) = elements(svg(sheet), "path")
    drawn = [other.get("d", "") for other in elements(second_opinion(sheet), "path")]

    assert (path.get("stroke"), path.get("stroke-width")) == ("#123456", "1.3")
    same = corners(path.get("d", ""))
    assert same == pytest.approx(np.stack([72.0 * x, 72.0 * (sheet.height - y)], axis=1), abs=0.0051)  # a hundredth
    # which leaves out points that would move the line by less than a ninth of a pixel: 72 of them make an inch
    ends = [corners(other)[[0, -1]] for other in drawn if "L" in other]
    assert any(np.allclose(other, same[[0, -1]], atol=0.12) for other in ends)


def test_what_is_no_number_parts_a_line_and_is_no_dot() -> None:
    sheet = empty_sheet()
    places = np.array([np.nan, 1.0, 2.0, np.nan, 3.0, np.inf, 4.0])
    sheet.marks.append(Line(places, places, {"color": "#000000", "linewidth": 1.0}))
    sheet.marks.append(Line(places, places, {"color": "#000000", "marker": "o", "markersize": 4.0}))

    (path,) = elements(svg(sheet), "path")

    assert re.findall("[ML]", path.get("d", "")) == ["M", "L", "M", "M"]
    assert len(elements(svg(sheet), "circle")) == 4
    assert b"nan" not in svg(sheet)
    assert b"inf" not in svg(sheet)


def test_marks_lie_over_one_another_as_they_say() -> None:
    sheet = Sheet("title", rows=1, columns=1, times=TIMES)
    panel = sheet.panel(0, "panel", span=(0.0, 1.0))
    sheet.curve(panel, TIMES, TIMES, colour="#111111")
    sheet.limit(panel, 0.5, label="0.5")

    kinds = [element.tag.removeprefix(NAME) for element in ET.fromstring(svg(sheet)).iter()]  # noqa: S314

    marks = kinds[3:]  # after the file, the group and the ground
    assert marks.index("rect") < marks.index("path") < marks.index("text")
    assert marks[0] == "rect"
    assert marks[-1] == "text"


@pytest.mark.parametrize("word", ["a<b>&\"c'", "$x_1$", "größe 10⁻³", "a]]>b", "<script>"])
def test_every_letter_is_kept(word: str) -> None:
    sheet = empty_sheet()
    sheet.marks.append(Words(1.0, 1.0, word, {}))

    assert [text.text for text in elements(svg(sheet), "text")] == [word]


def test_what_no_xml_file_may_hold_is_replaced() -> None:
    sheet = empty_sheet()
    sheet.marks.append(Words(1.0, 1.0, "a\x00b\x1b\ud800c", {}))

    assert [text.text for text in elements(svg(sheet), "text")] == ["a\ufffdb\ufffd\ufffdc"]
