"""Fixtures that every test may use."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

os.environ["CELLPLAN_CACHE"] = "off"  # tests neither use nor fill the cache of whoever runs them

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def repository() -> Path:
    """The folder that holds the package, the cells and the docs."""
    return ROOT


@pytest.fixture(scope="session")
def cells() -> Path:
    """The shipped cell files."""
    return ROOT / "cells"


@pytest.fixture(scope="session")
def shared_robots() -> Path:
    """Real robot descriptions; they are not part of the project, so tests that need them may be skipped."""
    folder = ROOT.parent / "shared" / "robots"
    if not folder.is_dir():
        pytest.skip("the real robot descriptions (../shared/robots) are not on this machine")
    return folder


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Folder of a cache that only this test uses, empty at first."""
    from cellplan.cache.store import forget

    monkeypatch.setenv("CELLPLAN_CACHE", str(tmp_path / "cache"))
    forget()
    yield tmp_path / "cache"
    forget()


@pytest.fixture(scope="session")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a small cell below ``cell`` and its run in ``run``; not to be changed."""
    from builders.stored_cells import solve_into, write_cell

    folder = tmp_path_factory.mktemp("sound")
    solve_into(write_cell(folder / "cell"), folder / "run")
    return folder
