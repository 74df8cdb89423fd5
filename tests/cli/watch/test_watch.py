"""``--watch``: another result after each save, errors that are waited out, and a clean end."""

import json
import os
import queue
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from builders.stored_cells import write_cell

from cellplan.cli.terminal.output import Result
from cellplan.cli.watch.watch import InputsChangedError, WatchedFiles, watch
from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell

PROGRESS = re.compile(r"[\w -]+: \d+ %")
LIMIT_S = 60.0  # [s] for a line to come on a slow machine


class Watching:
    """A watching program whose lines are read as they come."""

    def __init__(self, arguments: list[str], folder: Path) -> None:
        self._lines: queue.Queue[str] = queue.Queue()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cellplan", *arguments],
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            bufsize=1,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # noqa: PLW1509 - of background jobs
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if not PROGRESS.fullmatch(line.rstrip("\n")):  # on a slow machine only
                self._lines.put(line.rstrip("\n"))

    def until(self, begin: str) -> list[str]:
        """Lines up to and with the first one that begins so."""
        lines: list[str] = []
        while not lines or not lines[-1].startswith(begin):
            lines.append(self._lines.get(timeout=LIMIT_S))
        return lines

    def end(self) -> tuple[int, list[str]]:
        """Exit status after Ctrl-C, and the last lines."""
        self.process.send_signal(signal.SIGINT)
        status = self.process.wait(timeout=LIMIT_S)
        return status, self.until("watching ended")


@pytest.fixture
def pair(cells: Path, tmp_path: Path) -> Path:
    """The planar pair, which is cheap."""
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    path = tmp_path / "pair.yaml"
    path.write_text(text.replace("step_s: 0.001", "step_s: 0.01"), encoding="utf-8")
    return path


@pytest.fixture
def started() -> Iterator[Any]:
    """Starts watching programs, none of which outlives its test."""
    programs: list[Watching] = []

    def start(arguments: list[str], folder: Path) -> Watching:
        programs.append(Watching(arguments, folder))
        return programs[-1]

    yield start
    for program in programs:
        program.process.kill()
        program.process.wait()


def test_a_cell_is_checked_again_after_each_save(pair: Path, started: Any) -> None:
    program, sound = started(["check", "pair.yaml", "--watch"], pair.parent), pair.read_text(encoding="utf-8")

    assert program.until("watching")[0] == "planar-pair: passed"
    pair.write_text("cellplan: 1\nname: [\n", encoding="utf-8")
    broken = program.until("watching")
    pair.write_text(sound.replace("name: planar-pair", "name: renamed"), encoding="utf-8")
    mended = program.until("watching")
    status, last = program.end()

    assert broken[0] == "round 2: pair.yaml was saved"
    assert len(broken) == 3
    assert broken[1].startswith("pair.yaml:")
    assert mended[:2] == ["round 3: pair.yaml was saved", "renamed: passed"]
    assert (status, last) == (130, ["watching ended in round 3"])


@pytest.mark.slow
def test_a_machine_gets_an_object_on_a_line_for_each_round(pair: Path, started: Any) -> None:
    program = started(["solve", "pair.yaml", "--watch", "--json", "-q"], pair.parent)

    first = json.loads(program.until("{")[-1])
    pair.write_text("cellplan: 1\n", encoding="utf-8")
    second = json.loads(program.until("{")[-1])
    status, _ = program.end()

    assert (first["schema"], first["status"], first["exit"]) == ("cellplan.solve/1", "passed", 0)
    assert (second["status"], second["exit"], status) == ("error", 2, 130)
    assert sorted(path.name for path in (pair.parent / "outputs").iterdir()) == ["planar-pair"]


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


class Editor:
    """An editor on a simulated clock: each save empties the file first and then writes it piece by piece."""

    def __init__(self, path: Path) -> None:
        self._path, self._now = path, 0.0
        self._steps: list[tuple[float, str, str]] = []  # time in [s], mode in which the file is opened, text

    def save(self, *pieces: str, pause_s: float) -> None:
        """Save once more after what is still to be saved, with a pause before each piece."""
        at = self._steps[-1][0] if self._steps else self._now
        self._steps.append((at, "w", ""))
        self._steps += [(at + pause_s * count, "a", piece) for count, piece in enumerate(pieces, start=1)]
        self.sleep(0.0)

    def monotonic(self) -> float:
        """Simulated time in [s]."""
        return self._now

    def sleep(self, duration_s: float) -> None:
        """Let time pass, and with it what is saved meanwhile."""
        self._now += duration_s
        while self._steps and self._steps[0][0] <= self._now:
            _, mode, text = self._steps.pop(0)
            with self._path.open(mode, encoding="utf-8") as file:
                file.write(text)


@pytest.fixture
def editor(pair: Path, monkeypatch: pytest.MonkeyPatch) -> Editor:
    editor = Editor(pair)
    monkeypatch.setattr("cellplan.cli.watch.watch.time", editor)
    return editor


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
    monkeypatch.setattr("cellplan.cli.watch.watch.EMPTIED_S", 0.4)
    files = WatchedFiles(pair)

    pair.write_bytes(b"")

    assert files.next_saved() == pair
    files.begin()
    assert files.changed() is None


def test_what_half_a_save_made_wrong_is_not_said(
    pair: Path, editor: Editor, capsys: pytest.CaptureFixture[str]
) -> None:
    texts: list[str] = []

    def work(follow: Any, _: Any) -> Result:
        texts.append(pair.read_text(encoding="utf-8")[-1:])
        if len(texts) == 1:
            editor.save("name: whole", pause_s=0.5)
            load_cell(pair)
        raise KeyboardInterrupt

    with pytest.raises(Exception, match="watching ended in round 1"):
        watch(work, pair, schema="x/1", as_json=False, quiet=True)

    assert texts == ["\n", "e"]
    assert capsys.readouterr().err == ""


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


def test_work_on_a_cell_that_is_saved_meanwhile_begins_anew(pair: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.cli.watch.watch.ASK_EVERY_S", 0.0)
    texts: list[str] = []

    def work(follow: Any, progress: Any) -> Result:
        follow(load_cell(pair))
        texts.append(pair.read_text(encoding="utf-8")[-1:])
        if len(texts) == 1:
            pair.write_text(pair.read_text(encoding="utf-8") + "#", encoding="utf-8")
            with pytest.raises(InputsChangedError):
                progress("working", 0.5)
            progress("working", 0.6)
        raise KeyboardInterrupt

    with pytest.raises(Exception, match="watching ended in round 1"):
        watch(work, pair, schema="x/1", as_json=False, quiet=True)

    assert texts == ["\n", "#"]
