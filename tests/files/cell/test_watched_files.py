"""Files of a cell that are watched: which ones, and when a save is complete."""

import os
from pathlib import Path

import pytest
from builders.editor import Editor, coarse_pair
from builders.stored_cells import write_cell

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.watched_files import WatchedFiles


@pytest.fixture
def pair(cells: Path, tmp_path: Path) -> Path:
    """The planar pair, which is cheap."""
    return coarse_pair(cells, tmp_path)


@pytest.fixture
def editor(pair: Path, monkeypatch: pytest.MonkeyPatch) -> Editor:
    editor = Editor(pair)
    monkeypatch.setattr("cellplan.files.cell.watched_files.time", editor)
    return editor


def test_every_file_that_a_cell_was_read_from_is_watched(tmp_path: Path) -> None:
    path = write_cell(tmp_path / "cell")
    files = WatchedFiles(path)
    files.follow(load_cell(path))

    for name in ("small.yaml", "meshes/block.stl", "paths/bow.csv", "robots/elbow.stl", "robots/right.urdf"):
        assert files.changed() is None
        file = path.parent / name
        file.write_bytes(file.read_bytes() + b"\n")
        assert files.changed() == file
        files.begin()


def test_a_save_without_a_change_is_none(pair: Path) -> None:
    files = WatchedFiles(pair)
    pair.write_bytes(pair.read_bytes())
    os.utime(pair, ns=(1, 1))

    assert files.changed() is None


@pytest.mark.parametrize(("count", "pause_s"), [(1, 1.0), (5, 0.15)])  # empty for long; half of it for a moment
def test_half_a_save_is_none(pair: Path, editor: Editor, count: int, pause_s: float) -> None:
    files, text = WatchedFiles(pair), pair.read_text(encoding="utf-8") + "# saved\n"
    size = -(-len(text) // count)

    editor.save(*(text[at : at + size] for at in range(0, len(text), size)), pause_s=pause_s)

    assert files.next_saved() == pair
    assert pair.read_text(encoding="utf-8") == text


def test_a_file_that_was_emptied_and_got_its_old_content_was_not_saved(pair: Path, editor: Editor) -> None:
    files, text = WatchedFiles(pair), pair.read_text(encoding="utf-8")

    editor.save(text, pause_s=0.7)
    editor.save("", text + "#", pause_s=0.7)

    assert files.next_saved() == pair
    assert pair.read_text(encoding="utf-8") == text + "#"


def test_a_file_that_stays_empty_is_taken_as_it_is(pair: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.files.cell.watched_files.EMPTIED_S", 0.4)
    files = WatchedFiles(pair)

    pair.write_bytes(b"")

    assert files.next_saved() == pair
    files.begin()
    assert files.changed() is None


def test_a_file_that_was_saved_while_it_was_read_is_noticed(pair: Path) -> None:
    files, cell = WatchedFiles(pair), load_cell(pair)
    pair.write_bytes(pair.read_bytes() + b"\n")
    files.begin()

    files.follow(cell)

    assert files.changed() == pair


def test_a_file_that_a_broken_cell_lacks_is_noticed_when_it_comes(tmp_path: Path) -> None:
    path = write_cell(tmp_path / "cell")
    mesh = path.parent / "meshes" / "block.stl"
    content = mesh.read_bytes()
    mesh.unlink()
    files = WatchedFiles(path)
    with pytest.raises(InputError):
        load_cell(path)
    files.follow_neighbours()

    mesh.write_bytes(content)

    assert files.changed() == mesh
