"""``--watch``: another result after each save, errors that are waited out, and a clean end."""

import json
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
from builders.editor import Editor, coarse_pair

from cellplan.cli.terminal.output import Result
from cellplan.cli.watch.watch import InputsChangedError, watch
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
    return coarse_pair(cells, tmp_path)


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


@pytest.fixture
def editor(pair: Path, monkeypatch: pytest.MonkeyPatch) -> Editor:
    editor = Editor(pair)
    monkeypatch.setattr("cellplan.files.cell.watched_files.time", editor)
    return editor


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
