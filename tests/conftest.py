"""Fixtures that every test may use."""

import gc
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import pytest
from builders import kernels
from hypothesis import settings

ROOT = Path(__file__).resolve().parent.parent
SESSION = "CELLPLAN_TEST_SESSION"  # folder that all processes of a session share
QUICK_S, SLOW_S = 300, 1800  # [s] after which quick and slow tests count as hanging, on a busy machine too
settings.register_profile("quick", max_examples=15, deadline=None, derandomize=True)
settings.register_profile("full", max_examples=200, deadline=None, derandomize=True)


def pytest_configure(config: pytest.Config) -> None:
    """Give the session a folder of its own: for caches, which are neither the user's nor left behind."""
    if SESSION not in os.environ:
        os.environ[SESSION] = tempfile.mkdtemp(prefix="cellplan-tests-")
        config.add_cleanup(lambda: shutil.rmtree(os.environ.pop(SESSION), ignore_errors=True))
    os.environ["CELLPLAN_CACHE"] = str(Path(os.environ[SESSION]) / "cache")
    settings.load_profile("quick" if config.option.markexpr == "not slow" else "full")
    if kernels.EXPECTED in os.environ:
        kernels.require_expected()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """End tests that hang; an environment without the plug-in is of an earlier day, and a test says so."""
    if config.pluginmanager.hasplugin("timeout"):
        for item in items:
            item.add_marker(pytest.mark.timeout(SLOW_S if item.get_closest_marker("slow") else QUICK_S))


def pytest_collection_finish() -> None:
    """Leave modules and tests out of the collections of garbage, which walk through all objects over and over."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


@contextmanager
def shared_solutions() -> Iterator[None]:
    """Cells that were solved before in the session are not solved again within the ``with`` statement."""
    from builders import solution_memo

    with solution_memo.stored(Path(os.environ[SESSION]) / "solutions"):
        yield


@pytest.fixture(scope="session", autouse=True)
def one_processor() -> Iterator[None]:
    """Commands do all in this process, whose solutions a session shares."""
    with mock.patch("cellplan.guard.forked.processors", return_value=1):
        yield


@pytest.fixture(scope="session", autouse=True)
def nothing_forced_to_disk() -> Iterator[None]:
    """No file of a test has to outlive a loss of power, and waiting for the disk takes seconds."""
    with mock.patch("os.fsync"):
        yield


@pytest.fixture
def two_processors(one_processor: None) -> Iterator[None]:
    """Work may be done in copies of this process."""
    with mock.patch("cellplan.guard.forked.processors", return_value=2):
        yield


@pytest.fixture(scope="module")
def trials_here() -> Iterator[None]:
    """Trials of studies run in this process: a child would import the package for each study."""
    from builders.study_trials import InThisProcess

    with mock.patch("cellplan.study.session.Workers", InThisProcess):
        yield


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


@pytest.fixture(scope="module")
def stored_solutions() -> Iterator[None]:
    """The tests of a module share solved cells with all other modules that say so."""
    with shared_solutions():
        yield


@pytest.fixture
def cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
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
    with shared_solutions():
        solve_into(write_cell(folder / "cell"), folder / "run")
    return folder
