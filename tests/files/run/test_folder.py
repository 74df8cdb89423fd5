"""Run folders: they appear whole or not at all, and nothing of anybody else's is ever lost."""

import errno
import json
import os
import resource
import shutil
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.files.run import drafts
from cellplan.files.run import folder as run_folder
from cellplan.files.run.folder import RunFolder

REPORT = '{\n  "schema": "cellplan.report/1",\n  "status": "passed"\n}\n'


def write_run(path: Path, tables: str = "rows") -> None:
    with RunFolder(path) as folder:
        folder.write_text("report.json", REPORT)
        folder.write_text("tables/arm.csv", tables)


def write_half_a_run(path: Path, failure: type[BaseException]) -> None:
    with RunFolder(path) as folder:
        folder.write_text("report.json", REPORT)
        raise failure


def everything_in(path: Path) -> list[str]:
    return sorted(str(entry.relative_to(path)) for entry in path.rglob("*"))


def names_in(path: Path) -> list[str]:
    return sorted(entry.name for entry in path.iterdir())


def test_run_appears_with_all_its_files_and_nothing_else(tmp_path: Path) -> None:
    write_run(tmp_path / "outputs" / "bench", tables="a\nb\n")
    assert everything_in(tmp_path) == [
        "outputs",
        "outputs/bench",
        "outputs/bench/report.json",
        "outputs/bench/tables",
        "outputs/bench/tables/arm.csv",
    ]
    assert (tmp_path / "outputs/bench/tables/arm.csv").read_bytes() == b"a\nb\n"


def test_nothing_is_visible_before_the_end(tmp_path: Path) -> None:
    with RunFolder(tmp_path / "bench") as folder:
        folder.write_text("report.json", REPORT)
        assert not (tmp_path / "bench").exists()
        assert all(name.startswith(".") for name in names_in(tmp_path))


def test_folder_is_readable_as_the_user_mask_says(tmp_path: Path) -> None:
    before = os.umask(0o022)
    try:
        write_run(tmp_path / "bench")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "bench").stat().st_mode) == 0o755


def test_new_run_replaces_the_old_one_whole(tmp_path: Path) -> None:
    write_run(tmp_path / "bench")
    with RunFolder(tmp_path / "bench") as folder:
        folder.write_text("report.json", REPORT)
        folder.write_bytes("plots/a.png", b"\x89")
    assert everything_in(tmp_path / "bench") == ["plots", "plots/a.png", "report.json"]
    assert names_in(tmp_path) == ["bench"]


def test_run_with_runs_inside_it_can_be_replaced(tmp_path: Path) -> None:
    with RunFolder(tmp_path / "bench") as folder:
        folder.write_text("report.json", REPORT)
        folder.write_text("circle/report.json", REPORT)
    write_run(tmp_path / "bench")
    assert everything_in(tmp_path / "bench") == ["report.json", "tables", "tables/arm.csv"]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt, SystemExit])
def test_failure_leaves_nothing_behind_and_the_old_run_as_it_was(tmp_path: Path, failure: type[BaseException]) -> None:
    write_run(tmp_path / "old", tables="old")
    for name in ("old", "outputs/deep/new"):
        with pytest.raises(failure):
            write_half_a_run(tmp_path / name, failure)
    assert names_in(tmp_path) == ["old"]
    assert (tmp_path / "old/tables/arm.csv").read_text() == "old"


@pytest.mark.parametrize("fails_at", [1, 2])
def test_failing_swap_leaves_the_old_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fails_at: int) -> None:
    write_run(tmp_path / "bench", tables="old")
    monkeypatch.setattr(run_folder, "exchange", lambda *_: False)
    real, calls = Path.rename, 0

    def failing(self: Path, target: Path) -> Path:
        nonlocal calls
        calls += 1
        if calls == fails_at:
            raise OSError(errno.EIO, "Input/output error")
        return real(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(InputError, match="bench: cannot write the output: input/output error"):
        write_run(tmp_path / "bench", tables="new")
    assert names_in(tmp_path) == ["bench"]
    assert (tmp_path / "bench/tables/arm.csv").read_text() == "old"


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught, RunFolder(path):
        pass
    return str(caught.value)


def test_folder_with_other_things_is_refused(tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    (tmp_path / "photos/cat.jpg").write_bytes(b"cat")
    (tmp_path / "photos/report.json").write_text('{"schema": "other/1"}')
    path = tmp_path / "photos"
    assert refusal(path) == (
        f"{path}: holds 'cat.jpg', which cellplan did not write; choose another folder or empty this one"
    )
    assert everything_in(path) == ["cat.jpg", "report.json"]


def test_notes_put_into_a_run_are_not_lost(tmp_path: Path) -> None:
    write_run(tmp_path / "bench")
    (tmp_path / "bench/notes.txt").write_text("keep")
    assert "holds 'notes.txt', which cellplan did not write" in refusal(tmp_path / "bench")
    assert (tmp_path / "bench/notes.txt").read_text() == "keep"


def test_empty_folder_is_used(tmp_path: Path) -> None:
    (tmp_path / "bench").mkdir()
    write_run(tmp_path / "bench")
    assert (tmp_path / "bench/report.json").is_file()


def test_file_in_the_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bench").write_text("mine")
    assert refusal(tmp_path / "bench") == f"{tmp_path / 'bench'}: expected a folder for the output, got a file"
    assert refusal(tmp_path / "bench" / "run").endswith("bench' is not a folder")


def test_symbolic_links_are_refused(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    for name in ("link", "dangling", "link/run"):
        assert "never written through a symbolic link" in refusal(tmp_path / name)
    assert names_in(tmp_path / "real") == []


def test_working_folder_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    for path in (Path(), Path("../here"), tmp_path):
        assert "needs a folder of its own" in refusal(path)


@pytest.mark.skipif(os.geteuid() == 0, reason="the administrator may write everywhere")
def test_folder_without_the_right_to_write_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    try:
        assert "no right to write" in refusal(tmp_path / "bench")
    finally:
        tmp_path.chmod(0o755)


@pytest.mark.parametrize("name", ["/etc/x", "../x", "a/../../x", ""])
def test_file_outside_the_folder_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(ValueError, match="does not lie inside the folder"), RunFolder(tmp_path / "bench") as folder:
        folder.write_text(name, "x")
    assert names_in(tmp_path) == []


def test_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    """A limit on the size of files stands in for a full disk: the write itself fails."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))
        with pytest.raises(InputError) as caught:
            write_run(tmp_path / "bench", tables="x" * 5000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)
    assert str(caught.value) == f"{tmp_path / 'bench/tables/arm.csv'}: cannot write the output: file too large"
    assert names_in(tmp_path) == []


def test_names_that_are_not_utf8_are_written_as_escapes(tmp_path: Path) -> None:
    """The name of a cell file may hold any byte; Python keeps it as a lone surrogate."""
    write_run(tmp_path / "bench", tables="# from bad\udcffname.yaml\n")
    assert (tmp_path / "bench/tables/arm.csv").read_bytes() == b"# from bad\\udcffname.yaml\n"


@pytest.mark.parametrize("number", [1, 2, 3])
def test_an_interruption_between_the_renames_leaves_one_whole_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """The interruption comes right after the first or second rename, or while the older run is removed."""
    write_run(tmp_path / "bench", tables="old")
    monkeypatch.setattr(run_folder, "exchange", lambda *_: False)
    rename, calls = Path.rename, []

    def rename_then_stop(source: Path, target: Path) -> Path:
        moved = rename(source, target)
        calls.append(source)
        if len(calls) == number:
            raise KeyboardInterrupt
        return moved

    def stop_once(path: str, _rmtree: object = shutil.rmtree, **words: object) -> None:
        calls.append(Path(path))
        if len(calls) == 4 and number == 3:
            raise KeyboardInterrupt
        _rmtree(path, **words)

    monkeypatch.setattr(Path, "rename", rename_then_stop)
    monkeypatch.setattr(shutil, "rmtree", stop_once)
    with pytest.raises(KeyboardInterrupt):
        write_run(tmp_path / "bench", tables="new")

    assert names_in(tmp_path) == ["bench"]
    assert (tmp_path / "bench/tables/arm.csv").read_text() == ("old" if number == 1 else "new")


def write_rehearsal(path: Path) -> None:
    with RunFolder(path) as folder:
        folder.write_text("rehearsal.json", REPORT.replace("report/1", "rehearsal/1"))


def test_a_run_takes_the_place_of_a_folder_that_holds_its_rehearsal_alone(tmp_path: Path) -> None:
    write_rehearsal(tmp_path / "cell" / "rehearsal")

    write_run(tmp_path / "cell")

    assert names_in(tmp_path / "cell") == ["report.json", "tables"]


def test_a_rehearsal_beside_other_things_keeps_its_place(tmp_path: Path) -> None:
    write_rehearsal(tmp_path / "cell" / "rehearsal")
    (tmp_path / "cell" / "notes.txt").write_text("mine", encoding="utf-8")

    with pytest.raises(InputError, match=r"holds 'notes\.txt', which cellplan did not write"):
        write_run(tmp_path / "cell")


def test_a_folder_of_that_name_with_other_things_in_it_is_never_replaced(tmp_path: Path) -> None:
    (tmp_path / "cell" / "rehearsal").mkdir(parents=True)
    (tmp_path / "cell" / "rehearsal" / "score.pdf").write_text("mine", encoding="utf-8")

    with pytest.raises(InputError, match="holds 'rehearsal', which cellplan did not write"):
        write_run(tmp_path / "cell")


def test_a_rehearsal_replaces_an_older_one(tmp_path: Path) -> None:
    write_rehearsal(tmp_path / "rehearsal")
    write_rehearsal(tmp_path / "rehearsal")

    assert names_in(tmp_path / "rehearsal") == ["rehearsal.json"]


@pytest.mark.parametrize("exchanges", [True, False], ids=["at once", "one after the other"])
@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("tables/notes.txt", "tables/notes.txt"),
        ("plots/deep/photo.jpg", "plots/deep/photo.jpg"),
        ("mine/notes.txt", "mine"),
        ("circle/tables/own.csv", "circle/tables/own.csv"),
        ("programs/mine.src", "programs/mine.src"),
    ],
)
def test_notes_anywhere_in_a_run_are_not_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, shown: str, exchanges: bool
) -> None:
    with RunFolder(tmp_path / "bench") as folder:
        for place in ("", "circle/"):
            folder.write_text(f"{place}report.json", REPORT)
            folder.write_text(f"{place}tables/arm.csv", "rows")
        listed = {name: {} for name in folder.written}
        folder.write_text("manifest.json", json.dumps({"schema": "cellplan.manifest/1", "files": listed}))
    note = tmp_path / "bench" / name
    note.parent.mkdir(parents=True, exist_ok=True)
    note.write_text("mine")
    assert f"holds '{shown}', which cellplan did not write" in refusal(tmp_path / "bench")
    before = everything_in(tmp_path / "bench")

    if not exchanges:
        monkeypatch.setattr(run_folder, "exchange", lambda *_: False)
    monkeypatch.setattr(run_folder, "refuse_unless_replaceable", lambda _, **__: None)  # it came after the question
    with pytest.raises(InputError, match="which cellplan did not write"):
        write_run(tmp_path / "bench")

    assert everything_in(tmp_path / "bench") == before
    assert names_in(tmp_path) == ["bench"]


def test_a_run_is_never_missing_while_it_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_run(tmp_path / "bench", tables="old")
    monkeypatch.setattr(Path, "rename", None)  # nothing is put aside

    write_run(tmp_path / "bench", tables="new")

    assert (tmp_path / "bench/tables/arm.csv").read_text() == "new"
    assert names_in(tmp_path) == ["bench"]


def left_behind(folder: Path, kind: str, *, by: str = "dead") -> Path:
    """A hidden folder of a process that is no more, of this one, or of another system."""
    path = drafts.hidden_folders(folder / "bench")[kind == ".replaced"]
    suffix = f"-{os.getpid()}-{drafts._start(os.getpid())}"
    assert suffix in path.name
    system = drafts._system()
    names = {
        "dead": path.name.replace(suffix, "-999999999-123abc"),
        "reused": path.name.replace(suffix, f"-{os.getpid()}-123abc"),
        "living": path.name,
        "elsewhere": path.name.replace(suffix, "-999999999-123abc").replace(system, "abcdef"),
    }
    left = folder / names[by]
    left.mkdir(parents=True)
    (left / "report.json").write_text(REPORT)
    return left


@pytest.mark.parametrize("by", ["dead", "reused"])
def test_a_draft_of_a_dead_process_is_removed(tmp_path: Path, by: str) -> None:
    left_behind(tmp_path, ".partial", by=by)

    write_run(tmp_path / "other")

    assert names_in(tmp_path) == ["other"]


@pytest.mark.parametrize("by", ["living", "elsewhere"])
def test_a_draft_of_a_process_that_may_live_is_left_alone(tmp_path: Path, by: str) -> None:
    left = left_behind(tmp_path, ".partial", by=by)

    write_run(tmp_path / "other")

    assert names_in(tmp_path) == [left.name, "other"]


def test_an_older_run_that_a_dead_process_put_aside_comes_back(tmp_path: Path) -> None:
    left_behind(tmp_path, ".replaced")

    run_folder.refuse_unless_replaceable(tmp_path / "bench")

    assert everything_in(tmp_path) == ["bench", "bench/report.json"]


def test_a_study_is_not_replaced_by_a_run(tmp_path: Path) -> None:
    (tmp_path / "placed").mkdir()
    (tmp_path / "placed" / "study.jsonl").write_text("{}")

    assert refusal(tmp_path / "placed") == (
        f"{tmp_path / 'placed'}: holds a study, which no run replaces; choose another folder or empty this one"
    )


def test_an_older_run_that_was_replaced_is_removed_unless_it_holds_something_foreign(tmp_path: Path) -> None:
    write_run(tmp_path / "bench", tables="new")
    left = left_behind(tmp_path, ".replaced")
    (left / "notes.txt").write_text("mine")
    run_folder.refuse_unless_replaceable(tmp_path / "bench")
    assert (left / "notes.txt").read_text() == "mine"

    (left / "notes.txt").unlink()
    run_folder.refuse_unless_replaceable(tmp_path / "bench")

    assert names_in(tmp_path) == ["bench"]
    assert (tmp_path / "bench/tables/arm.csv").read_text() == "new"


def test_a_killed_process_leaves_nothing_for_long(tmp_path: Path) -> None:
    program = (
        "import os, signal, sys; from pathlib import Path; from cellplan.files.run.folder import RunFolder\n"
        "with RunFolder(Path(sys.argv[1])) as run:\n"
        "    run.write_text('report.json', ''), os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path / "bench")], check=False)
    assert [name.endswith(".partial") for name in names_in(tmp_path)] == [True]

    write_run(tmp_path / "bench")

    assert names_in(tmp_path) == ["bench"]
