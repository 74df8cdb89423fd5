"""The wheel alone has all that the first hour takes."""

import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from cellplan.files.templates import TEMPLATES, Template

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent


def ran(arguments: list[str | Path], folder: Path, **variables: str) -> str:
    """Standard output of a program that succeeds."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    run = subprocess.run(
        arguments, check=False, cwd=folder, env=environment | variables, capture_output=True, text=True, timeout=300
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder that the wheel is unpacked into; it is built in an environment of its own, from the package index."""
    place = tmp_path_factory.mktemp("wheel")
    venv.create(place / "venv", with_pip=True)
    python = place / "venv" / "bin" / "python"
    ran([python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", place / "dist", ROOT], place)
    (wheel,) = (place / "dist").glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(place / "site")
    return place / "site"


def test_the_first_hour_needs_the_wheel_only(installed: Path, tmp_path: Path) -> None:
    def cellplan(*arguments: str, folder: Path) -> str:
        return ran([sys.executable, "-m", "cellplan", *arguments], folder, PYTHONPATH=str(installed))

    where = ran(
        [sys.executable, "-c", "import cellplan; print(cellplan.__file__)"], tmp_path, PYTHONPATH=str(installed)
    )
    assert Path(where.strip()).is_relative_to(installed)
    cellplan("init", "demo", folder=tmp_path)
    cell = tmp_path / "demo" / "cell.yaml"
    assert cellplan("check", "cell.yaml", folder=cell.parent).startswith("two-robots: passed\n")
    text = cell.read_text(encoding="utf-8")
    cell.write_text(text.replace("circle: {radius_mm: 80,", "circle: {radius_mm: 100,"), encoding="utf-8")
    assert cellplan("solve", "cell.yaml", "--view", folder=cell.parent).startswith("two-robots: passed\n")
    assert (cell.parent / "outputs" / "two-robots" / "view.html").stat().st_size > 1e5
    assert cell.read_text(encoding="utf-8") != text


@pytest.mark.parametrize("template", TEMPLATES, ids=lambda template: template.name)
def test_every_template_is_in_the_wheel(installed: Path, tmp_path: Path, template: Template) -> None:
    ran([sys.executable, "-m", "cellplan", "init", "new", "-t", template.name], tmp_path, PYTHONPATH=str(installed))
    ran([sys.executable, "-m", "cellplan", "init", "same", "-t", template.name], tmp_path, PYTHONPATH=str(ROOT))

    def content(folder: str) -> dict[str, bytes]:
        files = [path for path in (tmp_path / folder).rglob("*") if path.is_file()]
        return {path.relative_to(tmp_path / folder).as_posix(): path.read_bytes() for path in files}

    assert content("new") == content("same")
