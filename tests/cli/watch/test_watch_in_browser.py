"""The page of a watched cell in headless Chromium: each result is loaded by itself, the 3-D page keeps its instant."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.browser import Browser

from cellplan.cli.main import run
from cellplan.jobs.view.write import ViewRequest, view, write_view

pytestmark = pytest.mark.slow

PICTURE = np.s_[60:600, 5:900]  # of a window of 1280 by 800
LIMIT_S = 60.0  # [s] for a round on a slow machine
PHASE = "return document.getElementById('phase').textContent;"


@pytest.fixture
def cell(cells: Path, tmp_path: Path) -> Path:
    path = tmp_path / "pair.yaml"
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    path.write_text(text.replace("step_s: 0.001", "step_s: 0.01"), encoding="utf-8")
    return path


@pytest.fixture
def program(cell: Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "cellplan", "solve", cell.name, "--view", "--watch"]
    process = subprocess.Popen(
        command,
        cwd=cell.parent,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - of background jobs
    )
    yield process
    process.kill()
    process.wait()


@pytest.fixture
def browser() -> Iterator[Browser]:
    with Browser() as browser:
        yield browser


def until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + LIMIT_S
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.2)


def in_frame(browser: Browser, page: str, script: str) -> Any:
    """What a script gives in the frame that shows a page of the run; None while there is none."""
    frames = browser.command("Page.getFrameTree")["frameTree"].get("childFrames", [])
    frame = next((frame["frame"] for frame in frames if frame["frame"]["url"].partition("#")[0].endswith(page)), None)
    if frame is None:
        return None
    world = browser.command("Page.createIsolatedWorld", frameId=frame["id"])["executionContextId"]
    reply = browser.command("Runtime.evaluate", expression=script, contextId=world, returnByValue=True)
    return reply["result"].get("value")


def shows_cycle(browser: Browser, seconds: int) -> bool:
    """Whether the report in the frame has this cycle time."""
    text = in_frame(browser, "report.html", "document.body.innerText")
    return re.search(rf"\b{seconds}(\.0+)?\s*s\b", str(text)) is not None


def test_both_pages_follow_each_save_and_the_run_is_whole_in_the_end(
    cell: Path, program: subprocess.Popen[str], browser: Browser, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound, page = cell.read_text(encoding="utf-8"), cell.parent / "outputs" / "pair-watch.html"
    until(page.is_file, "no page")
    browser.open(page)
    until(lambda: browser.run(PHASE) == "✓ passed", "no first result")
    until(lambda: shows_cycle(browser, 12), "no report")
    until(lambda: in_frame(browser, "view.html", "document.body.dataset.ready") == "true", "no 3-D page")
    in_frame(browser, "view.html", "location.hash = 't=0.5'")
    in_frame(browser, "report.html", "scrollTo({top: 400, behavior: 'instant'})")

    cell.write_text("cellplan: 1\nname: <b>\n", encoding="utf-8")
    until(lambda: browser.run(PHASE) == "✗ no new result; the last result is shown", "no error")
    said = browser.text("lines")
    cell.write_text(sound.replace("duration_s: 12,", "duration_s: 15,"), encoding="utf-8")
    until(lambda: browser.run(PHASE) == "✓ passed", "no second result")
    until(lambda: shows_cycle(browser, 15), "the old report")
    until(lambda: in_frame(browser, "view.html", "document.body.dataset.ready") == "true", "no second 3-D page")
    until(lambda: in_frame(browser, "report.html", "scrollY") == 400, "the report is not at its place")
    hash_after = in_frame(browser, "view.html", "location.hash")
    last = in_frame(browser, "view.html", "document.getElementById('time').max")

    program.send_signal(signal.SIGINT)
    assert program.wait(timeout=LIMIT_S) == 130
    until(lambda: browser.run(PHASE) == "watching has ended; the last result is shown", "the end is not said")
    assert "pair.yaml" in said
    assert hash_after.startswith("#t=0.5")
    assert float(last) == pytest.approx(15.0)
    assert sorted(path.name for path in page.parent.iterdir()) == ["planar-pair"]
    monkeypatch.chdir(cell.parent)
    assert run(["verify", "outputs/planar-pair", "--cell", "pair.yaml", "-q"]) == 0
    assert [json.loads(line) for line in browser.console if "ERR_FILE_NOT_FOUND" not in line] == []


def share_of_change(one: np.ndarray, other: np.ndarray) -> float:
    """Share of the values of the picture that differ visibly."""
    return float(np.mean(np.abs(one - other)[PICTURE] > 0.05))


def test_a_3d_page_keeps_its_camera_when_it_is_refreshed(sound: Path, tmp_path: Path, browser: Browser) -> None:
    page = tmp_path / "view.html"
    write_view(view(ViewRequest(path=sound / "run", cell=sound / "cell" / "small.yaml"))[0], page)
    browser.open(page)
    first = browser.picture()
    for kind, x in (("mousePressed", 300), ("mouseMoved", 380), ("mouseReleased", 380)):
        browser.command("Input.dispatchMouseEvent", type=kind, x=x, y=300, button="left", buttons=1, clickCount=1)
    browser.run("await drawn();")
    turned = browser.picture()

    browser.run("document.body.dataset.ready = 'old'; postMessage('cellplan:reload', '*');")
    until(lambda: browser.run("return document.body?.dataset.ready;") == "true", "not loaded again")
    browser.run("await drawn();")

    assert share_of_change(first, turned) > 1e-2
    assert share_of_change(browser.picture(), turned) < 1e-4  # angles in the address are rounded
    assert "camera" not in browser.run("return location.hash;")
