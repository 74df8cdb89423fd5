"""Progress never disturbs results."""

import re

import pytest

from cellplan.cli.terminal import progress as progress_module
from cellplan.cli.terminal.progress import progress_listener


def test_a_quiet_command_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_listener(quiet=True) as listen:
        listen("planning", 0.5)

    assert capsys.readouterr() == ("", "")


def test_a_log_hears_nothing_of_a_short_job(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_listener(quiet=False) as listen:
        for k in range(100):
            listen("planning", k / 100)

    assert capsys.readouterr() == ("", "")


def test_a_log_gets_a_line_now_and_then(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress_module, "LINE_EVERY_S", 0.0)

    with progress_listener(quiet=False) as listen:
        listen("planning", 0.25)

    assert capsys.readouterr() == ("", "planning: 25 %\n")


def test_a_terminal_sees_a_bar_on_the_error_stream(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", "1")

    with progress_listener(quiet=False) as listen:
        listen("planning [here]", 0.5)

    out, err = capsys.readouterr()
    assert out == ""
    assert "planning [here]" in err
    assert not re.search(r"\x1b\[[0-9;]*3[0-9]m", err), "NO_COLOR means no colours"
