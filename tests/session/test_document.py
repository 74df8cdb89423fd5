"""The open cell file: saving, and every order in which this program and an editor save."""

import stat
from collections.abc import Callable
from pathlib import Path

import pytest
from builders.editor import Editor

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.session.document import Document, Record

X = "robots.pen.base.x_mm"
Look = Callable[[Document], Record | None]


@pytest.fixture
def pair(cells: Path, tmp_path: Path) -> Path:
    """A pair that is cheap to read."""
    path = tmp_path / "pair.yaml"
    path.write_bytes((cells / "two_robots.yaml").read_bytes())
    return path


@pytest.fixture
def look(pair: Path, monkeypatch: pytest.MonkeyPatch) -> Look:
    """Looks for saves on a simulated clock, until there is news or five seconds have passed."""
    editor = Editor(pair)
    for module in ("cellplan.files.cell.watched_files", "cellplan.session.document"):
        monkeypatch.setattr(f"{module}.time", editor)

    def look(document: Document) -> Record | None:
        for _ in range(100):
            editor.sleep(0.05)
            if (record := document.look()) is not None:
                return record
        return None

    return look


def _saved_by_editor(path: Path, x: float, mark: str = "") -> None:
    """Save the file with another place of the pen, and a comment at the end."""
    text = path.read_text(encoding="utf-8")
    before = text[text.index("pen:") :].split("[", 1)[1].split(",", 1)[0]
    path.write_text(text.replace(f"base: {{xyz_mm: [{before}, ", f"base: {{xyz_mm: [{x:g}, ") + mark, encoding="utf-8")


def _state(record: Record | None) -> str:
    assert record is not None
    assert record["event"] == "file"
    return str(record["state"])


def test_what_is_saved_is_read_back_and_can_be_undone(pair: Path, look: Look) -> None:
    document = Document(pair, ["motion.duration_s=5"])
    document.changes.set({X: 1950.5})
    assert document.history == ["--set motion.duration_s=5", f"--set {X}=1950.5"]

    assert _state(document.save()) == "saved"

    read = load_cell(pair)
    assert read.origin.document == document.cell.origin.document
    assert (read.motion.duration, document.history) == (5.0, [])
    assert look(document) is None
    document.changes.undo()
    assert document.settings == [f"{X}=2000"]
    document.save()
    assert "base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}   # half a turn" in pair.read_text(encoding="utf-8")


def test_a_save_leaves_rights_and_links_as_they_are(pair: Path, tmp_path: Path) -> None:
    pair.chmod(0o640)
    link = tmp_path / "link.yaml"
    link.symlink_to(pair)
    document = Document(link)
    document.changes.set({X: 1990})

    document.save()

    assert link.is_symlink()
    assert stat.S_IMODE(pair.stat().st_mode) == 0o640
    assert "1990" in pair.read_text(encoding="utf-8")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.yaml", "pair.yaml"]


def test_another_file_is_a_new_one_each_time(pair: Path) -> None:
    document, before = Document(pair), pair.read_bytes()
    document.changes.set({X: 1990})

    texts = [document.save(as_another=True)["text"] for _ in range(2)]

    assert texts[1] == "saved as pair-edited-2.yaml; pair.yaml is as it was"
    assert pair.read_bytes() == before
    assert document.history == [f"--set {X}=1990"]
    for name in ("pair-edited.yaml", "pair-edited-2.yaml"):
        assert load_cell(pair.with_name(name)).origin.document == document.cell.origin.document


def test_a_file_that_another_program_saved_is_not_replaced(pair: Path) -> None:
    document = Document(pair)
    document.changes.set({X: 1990})
    _saved_by_editor(pair, 1980)

    with pytest.raises(InputError, match="was saved by another program since it was read"):
        document.save()

    assert "1980" in pair.read_text(encoding="utf-8")


def test_a_save_without_changes_here_is_read(pair: Path, look: Look) -> None:
    document = Document(pair, ["motion.duration_s=5"])

    _saved_by_editor(pair, 1980)

    assert _state(look(document)) == "changed"
    assert document.cell.origin.document["robots"]["pen"]["base"]["xyz_mm"][0] == 1980  # type: ignore[index]
    assert document.cell.motion.duration == 5.0


@pytest.mark.parametrize(("mine", "theirs", "state"), [(1990, 1990, "changed"), (1990, 1980, "conflict")])
def test_only_other_values_are_a_conflict(pair: Path, look: Look, mine: float, theirs: float, state: str) -> None:
    document = Document(pair)
    document.changes.set({X: mine})

    _saved_by_editor(pair, theirs, "# a word more\n")

    assert _state(look(document)) == state
    assert document.history == ([f"--set {X}=1990"] if state == "conflict" else [])
    assert look(document) is None


@pytest.mark.parametrize("is_taken", [True, False])
def test_a_conflict_is_decided_without_a_loss(pair: Path, look: Look, is_taken: bool) -> None:
    document = Document(pair)
    document.changes.set({X: 1990})
    _saved_by_editor(pair, 1980, "# a word more\n")
    assert _state(look(document)) == "conflict"
    assert document.changes.value(X) == 1990
    with pytest.raises(InputError, match="was saved by another program"):
        document.save()

    record = document.reload() if is_taken else document.keep()

    assert _state(record) == "changed"
    assert document.changes.value(X) == (1980 if is_taken else 1990)
    if is_taken:
        document.changes.undo()
    assert document.settings == [f"{X}=1990"]
    document.save()
    assert "1990" in pair.read_text(encoding="utf-8")
    assert pair.read_text(encoding="utf-8").endswith("# a word more\n")


@pytest.mark.parametrize("has_changes", [True, False])
def test_while_the_file_is_broken_the_last_cell_stays(pair: Path, look: Look, has_changes: bool) -> None:
    document, sound = Document(pair), pair.read_text(encoding="utf-8")
    if has_changes:
        document.changes.set({X: 1990})
    before = document.cell.origin.document

    pair.write_text(sound.replace("duration_s: 4", "duration_s: -4"), encoding="utf-8")
    broken = look(document)

    assert _state(broken) == "broken"
    assert broken is not None
    assert f"{pair}:" in broken["text"]
    assert "motion.duration_s" in broken["text"]
    assert document.cell.origin.document == before
    with pytest.raises(InputError):
        document.save()
    with pytest.raises(InputError, match=r"motion\.duration_s"):
        document.reload()
    pair.write_text(sound, encoding="utf-8")
    assert _state(look(document)) == "changed"
    assert document.cell.origin.document == before
    document.save()


def test_a_file_that_is_gone_comes_back_or_is_written_anew(pair: Path, look: Look) -> None:
    document, sound = Document(pair), pair.read_bytes()
    document.changes.set({X: 1990})

    pair.unlink()
    assert _state(look(document)) == "gone"
    pair.write_bytes(sound)
    assert _state(look(document)) == "changed"
    assert document.history == [f"--set {X}=1990"]
    pair.unlink()
    assert _state(look(document)) == "gone"
    document.save()

    assert load_cell(pair).origin.document == document.cell.origin.document


def test_half_a_save_is_no_news(pair: Path, look: Look) -> None:
    document, text = Document(pair), pair.read_text(encoding="utf-8")

    pair.write_text("", encoding="utf-8")
    assert document.look() is None
    pair.write_text(text, encoding="utf-8")

    assert look(document) is None


def test_values_that_do_not_go_with_the_saved_file_are_a_conflict(pair: Path, look: Look) -> None:
    document, text = Document(pair), pair.read_text(encoding="utf-8")
    document.changes.set({X: 1990})

    pair.write_text(text.replace("pen:", "pencil:").replace("robot: pen", "robot: pencil"), encoding="utf-8")
    assert _state(look(document)) == "conflict"
    with pytest.raises(InputError, match="got 'pen'"):
        document.keep()
    document.save(as_another=True)
    document.reload()

    assert [robot.name for robot in document.cell.robots] == ["holder", "pencil"]
    assert not document.changes.can_undo
    assert "1990" in pair.with_name("pair-edited.yaml").read_text(encoding="utf-8")
