"""The same cell gives the same bytes: whatever the hash seed, the working folder and the number of times."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cellplan import export_program, open_gate

ROOT = Path(__file__).resolve().parents[2]
SOLVE_AND_EXPORT = """
import sys
from cellplan.cli.main import run
run_folder = sys.argv[1]
status = run(["solve", "small.yaml", "-o", run_folder])
sys.exit(status or run(["export", run_folder, "--cell", "small.yaml", "--format", "csv"]))
"""


def tree(run: Path) -> dict[str, bytes]:
    return {path.relative_to(run).as_posix(): path.read_bytes() for path in run.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def first(sound: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Every file of the run and of its export, made in this process."""
    run = tmp_path_factory.mktemp("first") / "run"
    shutil.copytree(sound / "run", run)
    export_program(open_gate(run, cell=sound / "cell" / "small.yaml"), run / "programs" / "csv")
    return tree(run)


def differing(first: dict[str, bytes], sound: Path, run: Path, **environment: str) -> list[str]:
    """Names of the files that the commands write otherwise, from another folder and in a process of their own."""
    env = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    command = [sys.executable, "-c", SOLVE_AND_EXPORT, str(run)]
    subprocess.run(command, check=True, cwd=sound / "cell", env=env, capture_output=True)
    again = tree(run)
    return [name for name in sorted(first.keys() | again.keys()) if again.get(name) != first.get(name)]


def test_process_hash_seed_and_working_folder_change_no_byte(first, sound: Path, tmp_path: Path) -> None:
    assert differing(first, sound, tmp_path / "run", PYTHONHASHSEED="1", TZ="Asia/Tokyo", LANG="C") == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", ["0", "2", "4294967295"])
def test_no_hash_seed_changes_a_byte(first, sound: Path, tmp_path: Path, seed: str) -> None:
    assert differing(first, sound, tmp_path / "run", PYTHONHASHSEED=seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("threads", ["1", "2", "4"])
def test_the_number_of_threads_on_offer_changes_no_byte(first, sound: Path, tmp_path: Path, threads: str) -> None:
    assert differing(first, sound, tmp_path / "run", OPENBLAS_NUM_THREADS=threads, OMP_NUM_THREADS=threads) == []


def test_no_file_knows_where_or_by_whom_it_was_made(first, sound: Path) -> None:
    words = {str(sound), str(ROOT), os.uname().nodename, os.environ.get("HOME", "/home/nobody")}
    reported = [
        (name, word) for name, data in first.items() for word in words if len(word) > 5 and word.encode() in data
    ]
    assert reported == []
