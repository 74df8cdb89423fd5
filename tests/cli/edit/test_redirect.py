"""The way of the token to the browser: by a file of this user alone."""

import os
import stat
import threading
import time
from pathlib import Path

import pytest

from cellplan.cli.edit import redirect
from cellplan.cli.edit.redirect import redirect_file, remove_when

ADDRESS = "http://127.0.0.1:4711/#token=secret"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "tmp").mkdir()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(redirect.tempfile, "tempdir", str(tmp_path / "tmp"))
    return tmp_path


def test_the_file_is_private_from_its_first_byte_and_goes_in_the_end(folder: Path) -> None:
    old = os.umask(0)  # what the mode would be without care
    try:
        with redirect_file(ADDRESS) as path:
            assert stat.S_IMODE(path.stat().st_mode) == 0o600
            assert path.parent == folder / "outputs"
            assert f'content="0; url={ADDRESS}"' in path.read_text(encoding="utf-8")
    finally:
        os.umask(old)

    assert sorted(folder.iterdir()) == [folder / "tmp"]


@pytest.mark.parametrize("within_s", [None, 0.01])
def test_the_file_goes_when_its_page_has_loaded_or_after_a_time(folder: Path, within_s: float | None) -> None:
    is_loaded = threading.Event()
    with redirect_file(ADDRESS) as path:
        remove_when(is_loaded, path, within_s)
        if within_s is None:
            time.sleep(0.05)
            assert path.exists()
            is_loaded.set()
        deadline = time.monotonic() + 10.0
        while (folder / "outputs").exists() and time.monotonic() < deadline:
            time.sleep(0.005)

        assert sorted(folder.iterdir()) == [folder / "tmp"]


def test_two_sessions_have_two_files_and_other_outputs_stay(folder: Path) -> None:
    (folder / "outputs").mkdir()
    (folder / "outputs" / "run").mkdir()

    with redirect_file(ADDRESS) as first, redirect_file(ADDRESS) as second:
        assert first != second

    assert list((folder / "outputs").iterdir()) == [folder / "outputs" / "run"]


def test_a_folder_where_others_may_write_is_not_used(folder: Path) -> None:
    (folder / "outputs").mkdir()
    (folder / "outputs").chmod(0o777)

    with redirect_file(ADDRESS) as path:
        assert path.parent == folder / "tmp"
