"""What a notebook shows: no script, nothing loaded; names stay text; it is small and has the figures of the report."""

import re
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from builders.browser import Browser
from builders.records import phase_record

from cellplan import Cell, Report, Solution, load_cell, open_gate, solve, to_html
from cellplan.errors import InputError
from cellplan.report.page.figures import key_figures
from cellplan.report.page.notebook import Card, Grid, card_html
from cellplan.report.record.common import Provenance

pytestmark = pytest.mark.usefixtures("stored_solutions")

LARGEST = 200_000  # [bytes]
ALLOWED = {"div", "span", "table", "caption", "thead", "tbody", "tr", "th", "td", "ul", "li", "img", "code"}
HOSTILE = "<script>alert(1)</script>\"'&<img src=x onerror=alert(2)>{{ 7 * 7 }}"
VOID = {"img"}


class Piece(HTMLParser):
    """A piece of HTML as an untrusting notebook reads it."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.attributes: dict[str, list[str]] = {}
        self.open: list[str] = []
        self.words: list[str] = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.open += [] if tag in VOID else [tag]
        for name, value in attrs:
            self.attributes.setdefault(name, []).append(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


@pytest.fixture(scope="module")
def solution(sound: Path) -> Solution:
    return solve(load_cell(sound / "cell" / "small.yaml"))


@pytest.fixture(scope="module")
def pieces(sound: Path, solution: Solution) -> dict[str, str]:
    """What is shown of each kind of result."""
    verified = open_gate(sound / "run", cell=sound / "cell" / "small.yaml")
    results: dict[str, Cell | Report | Solution | Any] = {
        "cell": solution.cell,
        "solution": solution,
        "report": solution.runs[0].report,
        "verified": verified,
    }
    return {name: result._repr_html_() for name, result in results.items()} | {"folder": to_html(sound / "run")}


def test_nothing_of_it_acts_loads_or_styles_anything_else(pieces: dict[str, str]) -> None:
    for html in pieces.values():
        piece = Piece(html)
        assert piece.open == []
        assert piece.tags <= ALLOWED
        assert piece.attributes.keys() <= {"style", "scope", "src", "alt"}
        assert all(source.startswith("data:image/svg+xml;base64,") for source in piece.attributes.get("src", ()))
        assert "url(" not in " ".join(piece.attributes["style"])
        assert len(html.encode()) < LARGEST


def test_pictures_are_svg_that_say_what_they_show(pieces: dict[str, str]) -> None:
    piece = Piece(pieces["solution"])
    assert len(piece.attributes["src"]) == 2
    for source, alternative in zip(piece.attributes["src"], piece.attributes["alt"], strict=True):
        root = ElementTree.fromstring(b64decode(source.partition(",")[2]))  # noqa: S314 - written by this test
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert alternative.startswith("small-pair: ")


def test_the_figures_are_those_of_the_report_page(solution: Solution, pieces: dict[str, str]) -> None:
    (run,) = solution.runs
    origin = Provenance(versions={}, digests={})
    figures = key_figures(phase_record(run.report, cell=solution.cell, provenance=origin))
    for name in ("solution", "verified", "folder"):
        text = Piece(pieces[name]).text
        for figure in figures:
            assert f"{figure['label']} {figure['value']} {figure['unit']}" in text
    assert f"small-pair ✓ passed: {len(run.report.checks)} checks" in Piece(pieces["solution"]).text


def test_equal_results_give_equal_bytes(solution: Solution, pieces: dict[str, str]) -> None:
    assert solution._repr_html_() == pieces["solution"]


def test_a_failed_report_says_what_fails(failed_run: Any) -> None:
    piece = Piece(failed_run.report._repr_html_())
    failed = [check.message for check in failed_run.report.checks if not check.passed]
    assert f"✗ failed: {len(failed)} of {len(failed_run.report.checks)} checks" in piece.text
    assert failed[0] in piece.text
    assert len(failed) <= 5 or f"and {len(failed) - 5} more" in piece.text


def test_hostile_names_stay_text(passed_run: Any) -> None:
    check = replace(passed_run.report.checks[0], passed=False, message=HOSTILE, subject=HOSTILE)
    piece = Piece(replace(passed_run.report, cell=HOSTILE, mode=HOSTILE, checks=(check,))._repr_html_())
    card = Piece(
        card_html(
            Card(
                kind=HOSTILE,
                name=HOSTILE,
                verdict=HOSTILE,
                pictures={HOSTILE: f"<svg>{HOSTILE}</svg>"},
                grids=[Grid(caption=HOSTILE, columns={HOSTILE: [HOSTILE]}, more=HOSTILE)],
            )
        )
    )
    for text in (piece, card):
        assert text.tags <= ALLOWED
        assert text.attributes.keys() <= {"style", "scope", "src", "alt"}
        assert " ".join(HOSTILE.split()) in text.text
    assert "49" not in card.text
    assert card.attributes["alt"] == [HOSTILE]


def test_long_tables_say_how_much_is_left_out() -> None:
    grid = Grid(
        caption="Numbers", columns={"n": list(range(25)), "x": [0.123456, None, float("nan"), -3.0] * 6 + [1e4]}
    )
    text = Piece(card_html(Card(kind="", name="", grids=[grid]))).text
    assert "Numbers (the first 10; 15 more)" in text
    assert " 0 0.1235 1 – 2 – 3 −3 " in text


def test_what_is_no_result_is_refused() -> None:
    with pytest.raises(InputError, match="to_html: expected a result, a record or a path, got int"):
        to_html(1)


@pytest.mark.slow
def test_it_is_drawn_in_a_browser_without_a_word_on_the_console(pieces: dict[str, str], tmp_path: Path) -> None:
    page = tmp_path / "notebook.html"
    page.write_text(
        f"<!doctype html><meta charset=utf-8><body data-ready=true>{'<hr>'.join(pieces.values())}", encoding="utf-8"
    )
    with Browser() as browser:
        for theme in ("light", "dark"):
            for width in (1280, 390):
                browser.open(page, size=(width, 900), theme=theme)
                widths = browser.run("return [...document.images].map(each => each.naturalWidth);")
                assert len(widths) == len(re.findall("<img", "".join(pieces.values()))) > 0
                assert min(widths) > 0
                assert browser.console == []
