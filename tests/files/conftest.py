"""Fixtures for tests of files: a small sound cell that each test spoils or changes in its own way."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cellplan.errors import InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell

BASE = """\
cellplan: 1
name: pair
robots:
  holder:
    model: kuka_kr6
    start_deg: [0, -93, 108, 0, -15, 0]
  worker:
    model: abb_irb1600
    base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}
    tool: {xyz_mm: [0, 0, 100]}
    weights: [1, 1, 1, 1, 1, 1]
part:
  geometry: {cylinder: {radius_mm: 250, length_mm: 500, axis: x}}
  held_by:
    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}
tasks:
  ring:
    robot: worker
    path: {circle: {radius_mm: 100, plane: xy}, project: +z}
    tool_axis: normal
motion: {duration_s: 4}
environment:
  floor: {plane: {z_mm: 0}}
"""


@pytest.fixture
def base_cell() -> str:
    """Text of the small sound cell."""
    return BASE


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Cell]:
    """Loads the small cell after replacing pieces of its text; the file is called ``c``."""
    monkeypatch.chdir(tmp_path)

    def load_changed(*changes: tuple[str, str], allow_dirs: tuple[Path, ...] = ()) -> Cell:
        text = BASE
        for old, new in changes:
            assert text.count(old) == 1, f"{old!r} must occur once"
            text = text.replace(old, new)
        Path("c").write_text(text, encoding="utf-8")
        return load_cell("c", allow_dirs=allow_dirs)

    return load_changed


@pytest.fixture
def refuse(load: Callable[..., Cell]) -> Callable[..., list[str]]:
    """Findings about the small cell after replacing pieces of its text, one line each."""

    def findings(*changes: tuple[str, str]) -> list[str]:
        with pytest.raises(InvalidFileError) as caught:
            load(*changes)
        return str(caught.value).splitlines()

    return findings
