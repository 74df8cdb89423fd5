"""A folder of files appears whole or not at all, and nothing is overwritten."""

import errno
from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.files.templates import write_folder

FILES = {"cell.yaml": b"cell", "robots/arm/arm.urdf": b"arm", "README.md": b"page"}


def tree(folder: Path) -> dict[str, bytes]:
    """Every file below a folder; folders without files end in a slash."""
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    empty = [p for p in folder.rglob("*") if p.is_dir() and not any(p.iterdir())]
    return files | {f"{p.relative_to(folder).as_posix()}/": b"" for p in empty}


def test_a_new_folder_holds_the_files_and_nothing_else(tmp_path: Path) -> None:
    write_folder(tmp_path / "deep" / "new", FILES)

    assert tree(tmp_path) == {f"deep/new/{name}": content for name, content in FILES.items()}


def test_an_empty_folder_is_filled_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / ".git").mkdir()
    monkeypatch.chdir(tmp_path)

    write_folder(Path(), FILES)

    assert tree(tmp_path) == FILES | {".git/": b""}


@pytest.mark.parametrize("name", ["cell.yaml", "notes.txt", "robots"])
def test_a_folder_with_something_in_it_is_refused_by_its_name(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine", encoding="utf-8")

    with pytest.raises(InputError) as refused:
        write_folder(tmp_path, FILES)

    assert (
        str(refused.value) == f"{tmp_path}: holds '{name}', and nothing is overwritten; name a new or an empty folder"
    )
    assert tree(tmp_path) == {name: b"mine"}


@pytest.mark.parametrize("place", ["file", "file/new", "link"])
def test_a_place_that_is_no_folder_is_refused(tmp_path: Path, place: str) -> None:
    (tmp_path / "file").write_text("mine", encoding="utf-8")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")

    with pytest.raises(
        InputError, match=r"expected a new or an empty folder|cannot write the template: not a directory"
    ):
        write_folder(tmp_path / place, FILES)

    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "link"]


@pytest.mark.parametrize("exists", [True, False])
@pytest.mark.parametrize("failure", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()])
@pytest.mark.parametrize("count", range(len(FILES)))
def test_nothing_remains_of_a_folder_that_was_not_finished(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int, failure: BaseException, exists: bool
) -> None:
    """The disk is full, or the user interrupts, when ``count`` files have been created."""
    folder = tmp_path / "deep" / "new"
    if exists:
        folder.mkdir(parents=True)
    before = tree(tmp_path)
    created = 0
    open_file = Path.open

    def failing(path: Path, mode: str = "r", *rest: object) -> object:
        nonlocal created
        if mode == "xb":
            created += 1
            if created > count:
                raise failure
        return open_file(path, mode, *rest)  # type: ignore[call-overload]

    monkeypatch.setattr(Path, "open", failing)
    expected = InputError if isinstance(failure, OSError) else KeyboardInterrupt
    with pytest.raises(expected, match="no space left on device" if expected is InputError else None):
        write_folder(folder, FILES)

    assert tree(tmp_path) == before
