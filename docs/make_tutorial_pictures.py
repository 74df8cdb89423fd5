"""Make the pictures of the tutorial: ``python docs/make_tutorial_pictures.py`` writes ``docs/images/tutorial``.

The pages are those that the commands of the tutorial write; headless Chromium photographs them.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).resolve().parent
IMAGES = DOCS / "images" / "tutorial"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
)
COLOURS = 48  # of a picture: enough for a page with few hues, and small files
WIDTH = 1100  # [px]
COMMANDS = {  # exit status of each
    "init my-cell": 0,
    "solve my-cell/cell.yaml --view --quiet": 0,
    "solve my-cell/cell.yaml --duration 0.8 -o too-fast --quiet": 1,
}
PICTURES = {  # name: page, part of the address that says what to show, height of the window in [px]
    "report.png": ("outputs/two-robots/report.html", "", 760),
    "view.png": ("outputs/two-robots/view.html", "#t=1.2", 700),
    "failed.png": ("too-fast/report.html", "", 760),
}


def main() -> None:
    """Run the commands and take the pictures."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for command, status in COMMANDS.items():
            run = subprocess.run([sys.executable, "-m", "cellplan", *command.split()], cwd=folder, check=False)  # noqa: S603
            if run.returncode != status:
                raise SystemExit(f"cellplan {command}: expected exit status {status}, got {run.returncode}")
        for picture, (page, address, height) in PICTURES.items():
            shoot(folder / page, address, height, folder / picture)
            image = Image.open(folder / picture).convert("RGB")
            image.quantize(COLOURS, dither=Image.Dither.NONE).save(IMAGES / picture, optimize=True)


def shoot(page: Path, address: str, height: int, target: Path) -> None:
    """Photograph the window of a page."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit("no Chromium found: install it with 'apt-get install chromium', or your system's own way")
    with tempfile.TemporaryDirectory() as profile:
        options = [f"--user-data-dir={profile}", f"--window-size={WIDTH},{height}", "--virtual-time-budget=6000"]
        command = [browser, *FLAGS, *options, f"--screenshot={target}", f"file://{page}{address}"]
        subprocess.run(command, check=True, capture_output=True, timeout=120)  # noqa: S603


if __name__ == "__main__":
    main()
