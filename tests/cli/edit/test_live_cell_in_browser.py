"""The live cell from the page to the file: a true session behind its server, driven in headless Chromium."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from builders.browser import Browser
from builders.served_session import live, rest, shown

from cellplan.session.session import Session

pytestmark = pytest.mark.slow

CELL = Path(__file__).resolve().parents[3] / "cells" / "two_robots.yaml"
ADDRESS = "robots.pen.base.x_mm"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    (tmp_path / "cell.yaml").write_bytes(CELL.read_bytes())
    return tmp_path / "cell.yaml"


@pytest.fixture
def page(path: Path) -> Iterator[Browser]:
    with live(path) as address, Browser() as browser:
        shown(browser, address)
        yield browser


def value(browser: Browser) -> float:
    return float(browser.run(f"return app.answer.values['{ADDRESS}'];"))


def test_a_key_moves_a_base_and_the_figures_are_those_of_the_session(page: Browser, path: Path) -> None:
    before = value(page)
    page.run(
        "app.handles.select(app.handles.all.find((one) => one.subject === 'pen')); app.camera.look('front');"
        "byId('canvas').focus();"
    )
    page.key("ArrowRight", modifiers=8)
    rest(page, f"app.answer.values['{ADDRESS}'] !== {before} && app.answer.is_settled")
    shown = page.run("return app.answer.figures.map((figure) => [figure.name, figure.value]);")

    assert value(page) == pytest.approx(before + 10.0)
    assert page.console == []
    with closing(Session.open(path)) as session:
        answer = session.change({ADDRESS: value(page)})
        while (settled := session.settle()) is not None:
            answer = settled
    assert [name for name, _ in shown] == [figure["name"] for figure in answer["figures"]]
    for (_, number), figure in zip(shown, answer["figures"], strict=True):
        assert number == pytest.approx(figure["value"], abs=0.05)  # motions that began elsewhere


def test_certified_is_said_by_the_checks_of_solve_and_ends_with_the_next_change(page: Browser) -> None:
    page.run("byId('canvas').focus();")
    page.key("c")
    rest(page, "app.answer.state === 'certified'")
    assert page.text("state") == "✓ certified"
    assert page.run("return app.overlay.ghost !== null;")

    page.run(f"app.change({{ '{ADDRESS}': {value(page) + 1.0} }});")
    rest(page, "app.answer.state !== 'certified' && app.answer.is_settled")
    assert page.text("state") in {"○ planned", "✗ fails", "✗ breaks off"}
    assert page.text("outcome").startswith("of the state before the last change:")
    page.run("location.reload();")
    rest(page, "window.app?.answer?.is_settled")
    assert page.run("return app.overlay.ghostBodies(app.stage.at(0), app.overlay.ghost, FIXED_COLOUR).length;") > 0


def test_saving_writes_into_the_file_with_its_comments_and_undo_gives_the_value_back(page: Browser, path: Path) -> None:
    before = value(page)
    page.run(f"app.change({{ '{ADDRESS}': {before + 3.0} }});")
    rest(page, f"app.answer.values['{ADDRESS}'] === {before + 3.0} && app.answer.is_settled")
    assert f"--set {ADDRESS}={before + 3.0:g}" in page.run("return byId('history').value;")
    page.run("byId('canvas').focus();")
    page.key("s", modifiers=2)
    rest(page, "app.answer.is_saved")

    saved = path.read_text()
    assert f"base: {{xyz_mm: [{before + 3.0:g}, 0, 0]" in saved
    comments = [line.partition("#")[2] for line in CELL.read_text().splitlines()]
    assert [comment for comment in comments if comment not in saved] == []
    page.key("z", modifiers=2)
    rest(page, f"app.answer.values['{ADDRESS}'] === {before}")


def test_a_file_broken_in_an_editor_is_said_with_its_line_and_the_cell_stays(page: Browser, path: Path) -> None:
    text = path.read_text()
    path.write_text("cellplan: [1\n")
    rest(page, "!byId('file').hidden")
    assert "cell.yaml:1" in page.text("file-text")
    assert value(page) > 0.0

    path.write_text(text.replace("name: two-robots", "name: renamed"))
    rest(page, "byId('name').textContent === 'renamed'")
    assert page.console == []
