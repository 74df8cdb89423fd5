"""The cache saves time and changes nothing: same bytes cold, warm, damaged and off."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cellplan.files.cell.load import load_cell

SOLVE = """
import os, sys
from pathlib import Path
from cellplan import load_cell, solve, write_run

DAMAGED = "damaged"  # run before which every file of the cache loses its last byte

for place in range(2, len(sys.argv), 2):
    run, cache = Path(sys.argv[place]), sys.argv[place + 1]
    for path in Path(cache).iterdir() if run.name == DAMAGED else ():
        path.write_bytes(path.read_bytes()[:-1])
    child = os.fork()
    if child == 0:
        os.environ["CELLPLAN_CACHE"] = cache
        write_run(solve(load_cell(sys.argv[1])), run)
        sys.exit()
    if os.waitpid(child, 0)[1] != 0:
        sys.exit(1)
"""


def solve_each(cell: Path, caches: dict[Path, str]) -> None:
    """Write runs, by folder, each with a cache and in a process that has read nothing before.

    The processes share the imports, which take long.
    """
    pairs = [text for folder, cache in caches.items() for text in (str(folder), cache)]
    subprocess.run(
        [sys.executable, "-c", SOLVE, str(cell), *pairs],
        capture_output=True,
        check=True,
        cwd=Path(__file__).resolve().parents[2],
    )


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_a_run_is_the_same_cold_warm_damaged_and_without_a_cache(sound: Path, tmp_path: Path) -> None:
    cell, cache = sound / "cell" / "small.yaml", tmp_path / "cache"
    without, cold, warm, damaged = (tmp_path / name for name in ("without", "cold", "warm", "damaged"))
    solve_each(cell, {without: "off", cold: str(cache), warm: str(cache), damaged: str(cache)})

    assert "mesh" in {path.name.partition("-")[0] for path in cache.iterdir()}
    assert files(without) == files(cold) == files(warm) == files(damaged)


def test_robots_that_say_the_same_of_the_same_file_share_what_was_read(sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound / "cell", tmp_path / "cell")
    path = tmp_path / "cell" / "small.yaml"
    text = path.read_text(encoding="utf-8").replace("model: planar_3r", "model: robots/right.urdf")

    path.write_text(text, encoding="utf-8")
    same = load_cell(path)
    path.write_text(
        text.replace(
            "right.urdf\n    base: {xyz_mm: [0,", "right.urdf\n    limits: {A: {lower_deg: -9}}\n    base: {xyz_mm: [0,"
        ),
        encoding="utf-8",
    )
    other = load_cell(path)

    assert same.robot("idle").model.bodies[0].shape is same.robot("right").model.bodies[0].shape
    assert same.robot("idle").model.lower[0] == same.robot("right").model.lower[0]
    assert other.robot("idle").model.lower[0] > other.robot("right").model.lower[0]
