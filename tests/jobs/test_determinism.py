"""The same cell gives the same bytes: whatever the hash seed, the working folder and the number of times."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from builders import kernels
from builders.stored_cells import write_cell

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


SOLVE = """
import sys
from cellplan.cli.main import run
sys.exit(run(["solve", sys.argv[1], "-o", sys.argv[2]]))
"""
JOINTS_DEG = 1e-8  # by which joints may differ between kernels; measured 6e-10


def solved_under(kernel: str, cell: Path, run: Path) -> tuple[str, dict[str, bytes]]:
    """What is printed and every file of the run, by a process that runs a kernel."""
    env = {**kernels.environment(kernel), "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    code = f"from builders.kernels import require_expected; require_expected()\n{SOLVE}"
    command = [sys.executable, "-c", code, str(cell), run.name]
    done = subprocess.run(command, check=True, cwd=run.parent, env=env, capture_output=True, text=True, timeout=600)
    return done.stdout, tree(run)


# An error that is rounding only, and where it is largest; and which of several instants has the smallest distance.
ROUNDING = re.compile(r"\d(\.\d+)?e-(0[7-9]|[1-9]\d) (mm|deg)( of the tool .*?)? at \d+\.\d+ s")

NEAREST = re.compile(r"(clearance \S+: .* mm) at \d+\.\d+ s")


def said(value: object) -> object:
    """What a report says, without digits beyond those that are printed, and without digests."""
    if isinstance(value, dict):
        return {name: said(entry) for name, entry in value.items() if name != "digests"}
    if isinstance(value, list):
        return [said(entry) for entry in value]
    if isinstance(value, str):
        return NEAREST.sub(r"\1", ROUNDING.sub("rounding", value))
    return None if isinstance(value, float) else value


def differing_words(one: object, other: object) -> list[tuple[object, object]]:
    """Where two reports say something else."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        return [pair for name in one for pair in differing_words(one[name], other[name])]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return [pair for pair in zip(one, other, strict=True) for pair in differing_words(*pair)]
    return [] if one == other else [(one, other)]


def table(data: bytes) -> tuple[list[str], np.ndarray]:
    """Words and figures above a table of joints, and its numbers: lengths in [mm] or angles in [deg]."""
    head, numbers = [], []
    for line in re.sub(rb"(?m)^# .* digest: .*\n", b"", data).decode().splitlines():
        is_row = line[0].isdigit()
        (numbers if is_row else head).append([float(word) for word in line.split(",")] if is_row else line)
    return head, np.array(numbers)


def require_the_same_motion(cell: Path, folder: Path, names: list[str]) -> None:
    """Same bytes for the same kernel; for another one the same words, and joints that nobody can tell apart."""
    usable = [name for name in names if kernels.hindrance(name) is None]
    if len(usable) < 2:
        pytest.skip("this machine runs one kernel of the linear algebra only")
    first, *others = usable
    for place in (first, "again", *others):
        (folder / place).mkdir()
    text, files = solved_under(first, cell, folder / first / "run")
    assert solved_under(first, cell, folder / "again" / "run") == (text, files)
    report = said(json.loads(files["report.json"]))
    for name in others:
        other_text, other = solved_under(name, cell, folder / name / "run")
        assert other_text == text
        assert differing_words(said(json.loads(other["report.json"])), report) == []
        assert other.keys() == files.keys()
        tables = [name for name in files if name.startswith("tables/") and b"# cellplan joint table" in files[name]]
        assert tables
        for file in tables:
            (head, joints), (other_head, other_joints) = table(files[file]), table(other[file])
            assert other_head == head
            np.testing.assert_allclose(other_joints, joints, rtol=0.0, atol=JOINTS_DEG, err_msg=file)


@pytest.mark.slow
def test_kernels_of_the_linear_algebra_change_no_verdict_and_no_printed_figure(tmp_path: Path) -> None:
    require_the_same_motion(write_cell(tmp_path / "cell"), tmp_path, ["Haswell", "Sandybridge"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["four_robots", "three_tasks_each", "gripper", "papers/nicolato_ellipse"])
def test_no_kernel_and_no_feature_changes_a_verdict_or_a_printed_figure(cells: Path, name: str, tmp_path: Path) -> None:
    require_the_same_motion(cells / f"{name}.yaml", tmp_path, [*kernels.KERNELS, kernels.BASELINE])


def test_no_file_knows_where_or_by_whom_it_was_made(first, sound: Path) -> None:
    words = {str(sound), str(ROOT), os.uname().nodename, os.environ.get("HOME", "/home/nobody")}
    reported = [
        (name, word) for name, data in first.items() for word in words if len(word) > 5 and word.encode() in data
    ]
    assert reported == []
