"""Every call that writes fails once: no cut file stands under a final name, an older run is whole, and it is told."""

import errno
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from fuzz.failing_disk import faulty

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.run.folder import RunFolder
from cellplan.files.templates import write_folder
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve
from cellplan.runs.write_run import write_run

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = [sys.executable, "-m", "cellplan"]
SLOWER = [
    pytest.param(arguments, marks=pytest.mark.slow) for arguments in ("solve --help", "robots", "check CELL --json")
]
ERRORS = [errno.ENOSPC, errno.EIO, errno.EACCES, errno.EROFS, errno.EDQUOT]
FILES = {
    "report.json": b'{\n  "schema": "cellplan.report/1"\n}\n',
    "report.html": b"<p>a page</p>",
    "plots/a.svg": b"<svg/>",
    "tables/one.csv": b"1\n2\n",
    "tables/two.csv": b"3\n4\n",
    "circle/report.json": b'{"schema": "cellplan.report/1"}\n',
    "circle/tables/one.csv": b"5\n6\n",
}


def content(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def write_files(folder: Path) -> None:
    with RunFolder(folder) as target:
        for name, data in FILES.items():
            target.write_bytes(name, data)


def every_call_fails_once(
    place: Path, write: Callable[[Path], None], *, number: int, older: bool, step: int = 1
) -> int:
    """Let one call after the other fail; the folder is then as it was, or whole. Gives the number of calls."""
    run = place / "deep" / "run"
    if older:
        write(run)
    before = content(place)
    with faulty(place, fails_at=0, number=number) as faults:
        write(run)
    whole, calls = content(place), len(faults.calls)
    for fails_at in range(1, calls + 1, step):
        if not older:
            for path in sorted(place.rglob("*"), reverse=True):
                path.rmdir() if path.is_dir() else path.unlink()
        with faulty(place, fails_at=fails_at, number=number) as faults, pytest.raises(InputError) as caught:
            write(run)
        reported = f"call {fails_at}: {faults.calls[-1]}: {caught.value}"
        assert str(caught.value).startswith(str(run)), reported
        assert "\n" not in str(caught.value)
        assert content(place) in ((before, whole) if older else ({}, whole)), reported
        assert not list(place.rglob(".*")), reported
    return calls


@pytest.mark.parametrize("older", [False, True], ids=["no older run", "an older run"])
@pytest.mark.parametrize("number", ERRORS, ids=lambda number: errno.errorcode[number])
def test_no_failing_call_leaves_a_cut_file_or_goes_unreported(tmp_path: Path, number: int, older: bool) -> None:
    assert every_call_fails_once(tmp_path, write_files, number=number, older=older) > 4 * len(FILES)


@pytest.mark.parametrize("number", ERRORS, ids=lambda number: errno.errorcode[number])
def test_no_failing_call_leaves_a_part_of_a_template_or_goes_unreported(tmp_path: Path, number: int) -> None:
    def write(folder: Path) -> None:
        write_folder(folder, FILES)

    assert every_call_fails_once(tmp_path, write, number=number, older=False) > len(FILES)


@pytest.fixture(scope="module")
def solution() -> Solution:
    text = (ROOT / "cells/planar_pair.yaml").read_text(encoding="utf-8")
    assert "step_s" not in text or "step_s: 0.001" in text
    return solve(load_cell(ROOT / "cells/planar_pair.yaml"))


@pytest.mark.slow
def test_no_failing_call_of_a_solve_leaves_a_cut_file_or_goes_unreported(tmp_path: Path, solution: Solution) -> None:
    def write(folder: Path) -> None:
        write_run(solution, folder)

    assert every_call_fails_once(tmp_path, write, number=errno.ENOSPC, older=True, step=3) > 30


def limited_files() -> None:
    """A disk on which no file can be larger than 20 kB; the signal is left to the system call."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


def ended(*arguments: str, folder: Path, **how: object) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [*PROGRAM, *arguments], capture_output=True, text=True, cwd=folder, env=environment, check=False, **how
    )


@pytest.mark.slow
@pytest.mark.parametrize("command", ["solve", "rehearse"])
def test_a_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path, command: str) -> None:
    cell = str(ROOT / "cells/planar_pair.yaml")
    (tmp_path / "errors.yaml").write_text("cellplan_errors: 1\n", encoding="utf-8")
    named = ["--errors", "errors.yaml"] if command == "rehearse" else []

    run = ended(command, cell, *named, "-o", "run", "--quiet", folder=tmp_path, preexec_fn=limited_files)

    assert run.returncode not in {0, 130}
    assert run.stdout == ""
    assert run.stderr.count("\n") == 1, run.stderr
    assert "file too large" in run.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["errors.yaml"]


@pytest.mark.parametrize("arguments", ["--help", "schema", *SLOWER])
def test_a_closed_pipe_is_one_line(tmp_path: Path, arguments: str) -> None:
    words = arguments.replace("CELL", str(ROOT / "cells/planar_pair.yaml")).split()
    read_end, write_end = os.pipe()
    os.close(read_end)

    run = subprocess.run(
        [*PROGRAM, *words],
        stdout=write_end,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=False,
    )

    os.close(write_end)
    assert run.returncode == 4
    assert run.stderr == "error: standard output: the result was not shown: broken pipe\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_an_interruption_at_any_moment_leaves_a_whole_run_or_none(tmp_path: Path, number: signal.Signals) -> None:
    """Moments spread over the whole life of the program, most of them near its end, where it writes."""
    cell = str(ROOT / "cells/planar_pair.yaml")
    began = time.monotonic()
    assert ended("solve", cell, "-o", "run", "--quiet", folder=tmp_path).returncode == 0
    lasting = time.monotonic() - began
    whole = set(content(tmp_path))
    for share in (0.05, 0.15, 0.3, 0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0):
        process = subprocess.Popen(
            [*PROGRAM, "solve", cell, "-o", "run", "--quiet"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )
        time.sleep(share * lasting)
        process.send_signal(number)
        _, err = process.communicate(timeout=30)

        before_it_listened, by_python = -number, -signal.SIGINT  # where foreign code was met; shells read it as 130
        assert process.returncode in {0, 130, before_it_listened, by_python}, err
        assert "Traceback" not in err or process.returncode == -number, err
        assert set(content(tmp_path)) == whole, share
        assert [path.name for path in tmp_path.iterdir()] == ["run"], share
