"""The cache is where the user wants it, and only where nobody else can put anything into it."""

import os
import sys
from pathlib import Path

import pytest

from cellplan.cache.store import cache_folder

needs_posix = pytest.mark.skipif(os.name == "nt", reason="owners and rights are those of Linux and macOS")
needs_xdg = pytest.mark.skipif(sys.platform != "linux", reason="the place of Linux")


@pytest.fixture(autouse=True)
def nothing_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CELLPLAN_CACHE", raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)


@pytest.mark.parametrize("word", ["off", "OFF", " off ", "0", "no", "false"])
def test_a_word_turns_it_off(monkeypatch: pytest.MonkeyPatch, word: str) -> None:
    monkeypatch.setenv("CELLPLAN_CACHE", word)

    assert cache_folder() is None


def test_a_named_folder_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CELLPLAN_CACHE", str(tmp_path / "a" / "b"))

    assert cache_folder() == tmp_path / "a" / "b"
    assert (tmp_path / "a" / "b").is_dir()


@needs_xdg
@pytest.mark.parametrize(
    ("xdg", "place"), [("{}/xdg", "xdg/cellplan"), (None, ".cache/cellplan"), ("rel", ".cache/cellplan")]
)
def test_otherwise_it_is_where_the_system_keeps_such_things(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, xdg: str | None, place: str
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    if xdg is not None:
        monkeypatch.setenv("XDG_CACHE_HOME", xdg.format(tmp_path))

    assert cache_folder() == tmp_path / place


@needs_posix
@pytest.mark.parametrize("rights", [0o777, 0o775, 0o702])
def test_a_folder_that_others_may_write_to_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rights: int
) -> None:
    folder = tmp_path / "open"
    folder.mkdir()
    folder.chmod(rights)
    monkeypatch.setenv("CELLPLAN_CACHE", str(folder))

    assert cache_folder() is None


def test_a_place_that_cannot_be_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("not a folder", encoding="utf-8")
    monkeypatch.setenv("CELLPLAN_CACHE", str(tmp_path / "file"))
    assert cache_folder() is None
    monkeypatch.setenv("CELLPLAN_CACHE", str(tmp_path / "file" / "below"))
    assert cache_folder() is None
