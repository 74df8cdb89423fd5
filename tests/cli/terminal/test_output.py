"""Results reach standard output whole, or the command says that they did not."""

import io
import json
import os
import pty
import re
import struct
import sys
import termios
from collections.abc import Callable
from fcntl import ioctl
from pathlib import Path

import pytest

from cellplan.cli.terminal.errors import OutputError
from cellplan.cli.terminal.output import json_failure, say, say_json, screen_text, show
from cellplan.errors import InputError, NoSolutionError

LINES = [
    "pair: failed",
    "  1 of 9 checks failed; mode simultaneous, 4 s",
    "  collisions: 1 failed",
    "    FAILED collision: left/forearm touches the part from 0.250 s to 1.500 s while the right arm is at its seam",
    "  smallest clearance   0 mm, certified            left/forearm - part at 0.250 s",
    "  largest joint speed  35.1 % of its limit        right B1 at 2.500 s",
    "  not checked in full: 12 pairs (3 grip, 9 contact only); all in the report",
    "report: outputs/a-folder-with-quite-a-long-name/of-several-parts/pair/report.html",
    "next: cellplan layout cells/a-cell-with-quite-a-long-name.yaml --repair --set motion.duration_s=4",
]
ESCAPE = re.compile("\x1b\\[[0-9;]*m")


def test_json_is_one_object(capsys: pytest.CaptureFixture[str]) -> None:
    say_json({"schema": "x/1", "name": "Grüße"})

    assert json.loads(capsys.readouterr().out) == {"schema": "x/1", "name": "Grüße"}


def test_figures_that_are_not_finite_are_no_json() -> None:
    with pytest.raises(ValueError, match="Out of range float"):
        say_json({"value": float("nan")})


def test_a_machine_gets_an_object_also_when_nothing_could_be_done(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(NoSolutionError), json_failure("cellplan.solve/1", desired=True):
        raise NoSolutionError("no posture")

    assert json.loads(capsys.readouterr().out) == {
        "schema": "cellplan.solve/1",
        "status": "error",
        "exit": 3,
        "errors": ["error: no posture"],
    }


def test_people_get_no_json(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError), json_failure("cellplan.solve/1", desired=False):
        raise InputError("x")

    assert capsys.readouterr().out == ""


def test_a_full_disk_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full")
    with full.open("w") as stream:
        monkeypatch.setattr("sys.stdout", stream)
        with pytest.raises(OutputError, match=r"^standard output: the result was not shown: no space left on device$"):
            say("x")


def test_a_closed_stream_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout", None)

    with pytest.raises(OutputError, match="got a closed one"):
        say("x")


def test_letters_that_a_terminal_lacks_are_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(raw, encoding="ascii"))

    say("90°")

    assert raw.getvalue() == b"90\\xb0\n"


def words(text: str) -> list[str]:
    """The words of a screen without colours, with the sign as the word that it stands for."""
    return ESCAPE.sub("", text).replace("✗ pair", "pair").replace("✗", "FAILED").split()


@pytest.mark.parametrize("width", [40, 60, 100, 200])
def test_a_screen_holds_every_word_within_its_width(width: int) -> None:
    screen = screen_text(LINES, passed=False, width=width)

    shown = ESCAPE.sub("", screen).split("\n")
    assert words(screen) == " ".join(LINES).split()
    assert shown[0] == "✗ pair: failed"
    assert all(len(line) <= width for line in shown if not line.startswith(("report: ", "next: ")))
    assert set(LINES[-2:]) <= set(shown)  # to be copied in one piece


def test_further_lines_of_a_column_stand_below_it() -> None:
    shown = ESCAPE.sub("", screen_text(["pair", f"{LINES[4]} and until 0.300 s"], passed=None, width=90)).split("\n")[
        1:
    ]

    assert shown[1].lstrip() == "0.300 s"
    assert shown[1].index("0.300") == LINES[4].index("left/forearm")


def test_rows_of_tables_are_not_wrapped() -> None:
    row = "  simultaneous  passed  12.34  56.7  89.01  10.16"

    assert ESCAPE.sub("", screen_text(["pair", row], passed=None, width=30)).split("\n") == ["pair", row]


def test_without_colours_there_is_no_escape(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")

    assert "\x1b" not in screen_text(LINES, passed=True, width=80)


@pytest.mark.parametrize(("passed", "begin"), [(True, "\x1b[1;32m✓ pair"), (False, "\x1b[1;31m✗ pair")])
def test_the_verdict_has_a_sign_and_a_colour(passed: bool, begin: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")

    assert screen_text(LINES, passed=passed, width=80).startswith(begin)


def test_what_is_piped_is_the_lines_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    show(LINES, passed=False)

    assert capsys.readouterr().out == "\n".join(LINES) + "\n"


def on_terminal(work: Callable[[], None], width: int) -> str:
    """What work writes to standard output when that is a terminal of a width; in a child of this process."""
    child, end = pty.fork()
    if child == 0:
        try:
            ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
            with open(1, "w", encoding="utf-8", closefd=False) as sys.stdout:
                work()
        finally:
            os._exit(0)
    text = b""
    while True:
        try:
            more = os.read(end, 4096)
        except OSError:  # the child has ended
            break
        if not more:
            break
        text += more
    os.close(end)
    os.waitpid(child, 0)
    return text.decode("utf-8").replace("\r\n", "\n")


@pytest.mark.parametrize("width", [60, 100])
def test_the_width_is_that_of_the_terminal(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")

    shown = on_terminal(lambda: show(LINES, passed=False), width)

    assert shown == screen_text(LINES, passed=False, width=width) + "\n"


def test_a_terminal_that_cannot_move_its_cursor_gets_plain_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")

    assert on_terminal(lambda: show(LINES, passed=False), 60) == "\n".join(LINES) + "\n"
