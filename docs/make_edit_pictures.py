"""Make the pictures of the guide to the live cell: ``python docs/make_edit_pictures.py`` writes ``docs/images/edit``.

The page is that of ``cellplan edit``; headless Chromium drags along the arrows, certifies, and photographs it.
"""

import io
import sys
import tempfile
import time
from base64 import b64decode
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).resolve().parent
IMAGES = DOCS / "images" / "edit"
COLOURS = 128  # of a picture: enough for a page with few hues, and small files
SIZE = (1200, 800)  # [px]
LIMIT_S = 120.0  # [s] for a certificate, and for a first trial
sys.path.extend([str(DOCS.parent / "benchmarks"), str(DOCS.parent / "tests")])

from builders.browser import Browser  # noqa: E402 - the browser of the tests
from live_page import arrive, edited, repaired, settled  # noqa: E402


def main() -> None:
    """Make all pictures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        repair(copied("four_robots_initial", Path(folder) / "four_robots.yaml"))
        improve(copied("find_a_layout", Path(folder) / "find_a_layout.yaml"))


def copied(name: str, path: Path) -> Path:
    """A copy of a shipped cell."""
    path.write_bytes((DOCS.parent / "cells" / f"{name}.yaml").read_bytes())
    return path


def repair(cell: Path) -> None:
    """Open the cell whose layout fails, repair it, and move a base of what is certified."""
    with edited(cell) as (_, address), Browser() as browser:
        browser.visit(address, size=SIZE)
        arrive(browser)
        settled(browser)
        shoot(browser, "fails.png")
        repaired(browser)
        until(browser, "app.answer.state === 'certified'")
        browser.run("app.camera.look('oblique'); await drawn();")
        shoot(browser, "certified.png")
        place = "robots.kuka.base.y_mm"
        browser.run(f"app.switchTheme(); app.change({{ '{place}': app.desired['{place}'] + 80 }});")
        settled(browser)
        shoot(browser, "moved.png")


def improve(cell: Path) -> None:
    """Select a tool, and search a layout until one is offered."""
    with edited(cell) as (_, address), Browser() as browser:
        browser.visit(address, size=SIZE)
        arrive(browser)
        settled(browser)
        browser.run("app.handles.select(app.handles.all.find((it) => it.prefix === 'tool')); app.player.pause();")
        browser.run("app.player.goTo(1); app.camera.distance *= 0.8; app.turned();")
        shoot(browser, "handles.png")
        browser.run("app.handles.select(null); app.camera.distance /= 0.8; app.turned(); app.act('improve');")
        until(browser, "app.overlay.offer !== null")
        shoot(browser, "trial.png")


def until(browser: Browser, condition: str) -> None:
    """Wait until something holds in the page."""
    end = time.monotonic() + LIMIT_S
    while not browser.run(f"return {condition};"):
        if time.monotonic() > end:
            raise SystemExit(f"{condition}: does not hold after {LIMIT_S:g} s")
        time.sleep(0.2)


def shoot(browser: Browser, name: str) -> None:
    """Photograph the window."""
    browser.run("await drawn(); await drawn();")
    shot = b64decode(browser.command("Page.captureScreenshot", format="png")["data"])
    image = Image.open(io.BytesIO(shot)).convert("RGB")
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(IMAGES / name, optimize=True)


if __name__ == "__main__":
    main()
