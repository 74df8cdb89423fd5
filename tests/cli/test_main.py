"""The program as a shell sees it: streams and exit statuses."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import cellplan
from cellplan.cli.main import run

PROGRAM = [sys.executable, "-m", "cellplan"]


def test_the_version_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["--version"])

    assert (status, capsys.readouterr().out) == (0, f"cellplan {cellplan.__version__}\n")


def test_help_names_every_command_and_nothing_unfinished(capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["--help"])

    reported = capsys.readouterr().out
    assert status == 0
    commands = re.findall(r"^  (\w+) ", reported.partition("Begin:")[2], re.MULTILINE)
    expected = (
        "init robots seams check explain schema solve view floorplan verify export edit assign layout map fastest"
    )
    assert commands == [*expected.split(), "sweep", "compare", "rehearse", "recover"]


@pytest.mark.parametrize(
    "arguments",
    [[], ["slove"], ["solve"], ["solve", "a.yaml", "b.yaml"], ["solve", "a.yaml", "--duration", "long"], ["--bad"]],
    ids=" ".join,
)
def test_wrong_usage_ends_with_two(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    status = run(arguments)

    out, err = capsys.readouterr()
    assert status == 2
    assert "Usage: cellplan" in out + err
    assert "Traceback" not in err


def test_a_missing_cell_file_is_one_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status = run(["solve", str(tmp_path / "absent.yaml")])

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert "absent.yaml" in err


def test_a_reader_that_goes_away_is_reported_in_one_line() -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)

    ended = subprocess.run([*PROGRAM, "--version"], stdout=write_end, stderr=subprocess.PIPE, text=True, check=False)

    os.close(write_end)
    assert ended.returncode == 4
    assert ended.stderr == "error: standard output: the result was not shown: broken pipe\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_a_full_disk_is_reported_in_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run([*PROGRAM, "--version"], stdout=full, stderr=subprocess.PIPE, text=True, check=False)

    assert ended.returncode == 4
    assert ended.stderr == "error: standard output: the result was not shown: no space left on device\n"


@pytest.mark.parametrize(
    "number",
    [signal.SIGINT, *(pytest.param(number, marks=pytest.mark.slow) for number in (signal.SIGTERM, signal.SIGHUP))],
    ids=lambda number: number.name,
)
def test_an_interrupt_ends_with_130_and_leaves_nothing(cells: Path, tmp_path: Path, number: signal.Signals) -> None:
    folder = tmp_path / "run"
    command = [*PROGRAM, "solve", str(cells / "four_robots.yaml"), "-o", str(folder), "--duration", "60"]

    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),  # noqa: PLW1509 - background jobs inherit SIG_IGN
    )
    helpers = started_helpers(process.pid)
    process.send_signal(number)
    out, err = process.communicate(timeout=10)

    assert process.returncode == 130
    assert out == ""
    assert err.splitlines()[-1] == "interrupted: no incomplete run folder was left behind"
    assert list(tmp_path.iterdir()) == []
    assert not any(lives(helper) for helper in helpers)


@pytest.mark.slow
def test_a_program_that_is_killed_leaves_no_process_behind(cells: Path, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [*PROGRAM, "solve", str(cells / "four_robots.yaml"), "-q", "-o", str(tmp_path / "run"), "--duration", "60"]
    )
    helpers = started_helpers(process.pid)
    process.kill()
    process.wait()

    assert holds_within(20.0, lambda: not any(lives(helper) for helper in helpers))  # a helper ends its work first


def started_helpers(process: int) -> list[int]:
    """The processes that a command has started once it is at work: after more processor time than the imports take."""
    assert holds_within(60.0, lambda: processor_time(process) > 3.0)  # [s] a motion of a minute takes longer
    return children(process)


def processor_time(process: int) -> float:
    """Processor time of a process in [s]."""
    return sum(float(ticks) for ticks in state(process)[11:13]) / os.sysconf("SC_CLK_TCK")


def holds_within(seconds: float, condition: Callable[[], bool]) -> bool:
    """Whether a condition comes true before a time limit."""
    deadline, again = time.monotonic() + seconds, threading.Event()
    while not (holds := condition()) and time.monotonic() < deadline:
        again.wait(0.1)
    return holds


def children(process: int) -> list[int]:
    """Processes that a process has started, where the system tells; no other system is asked."""
    processes = [int(folder.name) for folder in Path("/proc").glob("[0-9]*")]
    return [number for number in processes if state(number)[1:2] == [str(process)]]


def lives(process: int) -> bool:
    """Whether a process runs; one that is dead and not yet taken note of does not."""
    return state(process)[:1] not in ([], ["Z"], ["X"])


def state(process: int) -> list[str]:
    """What the system tells of a process: its state and its parent first; nothing when it is gone."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
    return []


def test_a_folder_that_does_not_exist_cannot_be_allowed(cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["check", str(cells / "turntable.yaml"), "--allow-dir", "absent"])

    assert status == 2
    assert "'absent' does not exist" in capsys.readouterr().err


LOSING = """
import signal, sys, time, weakref
from cellplan.cli import main

signal.signal(signal.SIGINT, signal.{sigint})
signal.signal(signal.SIGTERM, signal.{sigterm})

class Thing:
    pass

def interrupted(_):
    raise KeyboardInterrupt

sys.unraisablehook = main._repeat_interruption
thing = Thing()
callback = weakref.ref(thing, interrupted)
del thing
try:
    time.sleep(20)
except KeyboardInterrupt:
    print("heard")
"""


@pytest.mark.parametrize(
    ("sigint", "sigterm"), [("default_int_handler", "SIG_DFL"), ("SIG_IGN", "default_int_handler")]
)
def test_an_interruption_that_python_loses_in_a_callback_is_repeated(sigint: str, sigterm: str) -> None:
    """Also in a background job, which ignores the interruptions of the terminal."""
    script = LOSING.format(sigint=sigint, sigterm=sigterm)
    run = subprocess.run([sys.executable, "-c", script], check=False, capture_output=True, text=True, timeout=15)

    assert (run.stdout.strip(), run.stderr) == ("heard", "")
