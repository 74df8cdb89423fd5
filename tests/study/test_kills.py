"""Studies that are killed or interrupted at any moment: nothing finished is lost, nothing runs on."""

import os
import random
import re
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from builders.study_trials import halved, rounds

from cellplan.study.folder import AHEAD, JOURNAL
from cellplan.study.study import Stop
from cellplan.study.workers import Workers

TRIALS = 40


def driver(folder: Path, workers: int) -> subprocess.Popen[str]:
    """A study that is begun or continued in a process of its own."""
    pids = folder.parent / "pids"
    pids.mkdir(exist_ok=True)
    return subprocess.Popen(
        [sys.executable, "-m", "builders.study_driver", str(folder), str(TRIALS), str(workers), str(pids)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )


def recorded(folder: Path) -> set[bytes]:
    """Whole lines of the trials that are on the disk."""
    files = [folder / JOURNAL, folder / AHEAD]
    texts = [path.read_bytes() for path in files if path.exists()]
    return {line for text in texts for line in text.split(b"\n")[:-1] if line.startswith(b'{"trial"')}


def running_on(folder: Path) -> list[int]:
    """Worker processes that have not ended 10 s after their parent."""
    results = []
    for path in (folder.parent / "pids").iterdir():
        try:
            handle = os.pidfd_open(int(path.name))
        except ProcessLookupError:
            continue
        if not select.select([handle], [], [], 10.0)[0]:
            results.append(int(path.name))
        os.close(handle)
        path.unlink()
    return results


def undisturbed(folder: Path, trials: int = TRIALS) -> bytes:
    """The journal of a study that is left alone."""
    with Workers(1) as workers:
        rounds(folder, size=8).run(halved, workers=workers, stop=Stop(trials=trials))
    return (folder / JOURNAL).read_bytes()


def kill_at_random(folder: Path, moment: random.Random, workers: int) -> bool:
    """Kill a study once; False when it had ended before."""
    earlier = recorded(folder) if folder.exists() else set()
    process = driver(folder, workers)
    try:
        said, errors = process.communicate(timeout=moment.uniform(0.0, 1.2))
        assert process.returncode == 0, errors
        is_killed = False
    except subprocess.TimeoutExpired:
        process.kill()
        said, _ = process.communicate()
        is_killed = True
    now = recorded(folder) if folder.exists() else set()
    counts = [int(number) for number in re.findall(r"^trial (\d+) of .*\n", said, re.MULTILINE)]
    assert earlier <= now
    assert len(now) >= max(counts, default=0)
    assert running_on(folder) == []
    return is_killed


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, pytest.param(50, marks=pytest.mark.slow)])
def test_kills_at_random_moments_lose_no_finished_trial(tmp_path: Path, count: int) -> None:
    whole, moment, kills, study = undisturbed(tmp_path / "whole"), random.Random(count), 0, 0
    while kills < count:
        folder = tmp_path / f"study{study}"
        if kill_at_random(folder, moment, workers=1 + kills % 3):
            kills += 1
            continue
        assert (folder / JOURNAL).read_bytes() == whole
        assert [path.name for path in folder.iterdir()] == [JOURNAL]
        study += 1
    last = driver(tmp_path / f"study{study}", 2)
    _, errors = last.communicate()
    assert (last.returncode, errors) == (0, "")
    assert (tmp_path / f"study{study}" / JOURNAL).read_bytes() == whole


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interruption_records_everything_and_ends_all_processes(tmp_path: Path, number: signal.Signals) -> None:
    folder = tmp_path / "study"
    process = driver(folder, 2)
    assert process.stdout is not None
    assert process.stdout.readline().startswith("trial 1 of 40, best length ")
    process.send_signal(number)
    said, errors = process.communicate()
    assert (process.returncode, errors) == (130, "")
    count = len(recorded(folder))
    assert said.splitlines()[-1] == (
        f"interrupted: {count} of {TRIALS} trials are recorded in {folder}; --resume goes on from there"
    )
    assert running_on(folder) == []


@pytest.mark.slow
@pytest.mark.parametrize("workers", [2, 4])
def test_any_number_of_worker_processes_gives_the_same_bytes(tmp_path: Path, workers: int) -> None:
    process = driver(tmp_path / "study", workers)
    _, errors = process.communicate()
    assert (process.returncode, errors) == (0, "")
    assert (tmp_path / "study" / JOURNAL).read_bytes() == undisturbed(tmp_path / "one")
