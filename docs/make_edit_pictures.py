"""Make the pictures of the guide to the live cell: ``python docs/make_edit_pictures.py`` writes ``docs/images/edit``.

The page is that of ``cellplan edit``; headless Chromium drags along the arrows, certifies, and photographs it.
"""

import io
import sys
import tempfile
from base64 import b64decode
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).resolve().parent
IMAGES = DOCS / "images" / "edit"
COLOURS = 48  # of a picture: enough for a page with few hues, and small files
SIZE = (1200, 800)  # [px]
sys.path.extend([str(DOCS.parent / "benchmarks"), str(DOCS.parent / "tests")])

from builders.browser import Browser  # noqa: E402 - the browser of the tests
from live_page import arrive, edited, repaired, settled  # noqa: E402


def main() -> None:
    """Open the cell whose layout fails, repair it, and move a base of what is certified."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "four_robots.yaml"
        cell.write_bytes((DOCS.parent / "cells" / "four_robots_initial.yaml").read_bytes())
        with edited(cell) as (_, address), Browser() as browser:
            browser.visit(address, size=SIZE)
            arrive(browser)
            settled(browser)
            shoot(browser, "fails.png")
            repaired(browser)
            browser.run("app.camera.look('oblique'); await drawn();")
            shoot(browser, "certified.png")
            place = "robots.kuka.base.y_mm"
            browser.run(f"app.switchTheme(); app.change({{ '{place}': app.desired['{place}'] + 80 }});")
            settled(browser)
            shoot(browser, "moved.png")


def shoot(browser: Browser, name: str) -> None:
    """Photograph the window."""
    browser.run("await drawn(); await drawn();")
    shot = b64decode(browser.command("Page.captureScreenshot", format="png")["data"])
    image = Image.open(io.BytesIO(shot)).convert("RGB")
    image.quantize(COLOURS, dither=Image.Dither.NONE).save(IMAGES / name, optimize=True)


if __name__ == "__main__":
    main()
