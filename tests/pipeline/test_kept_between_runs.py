"""The cache saves time and changes nothing: same bytes cold, warm, damaged and off."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from cellplan.io.cell.load import load_cell

SOLVE = """
import sys
from pathlib import Path
from cellplan import load_cell, solve, write_run

class Blank:
    def pictures(self, report, *, cell):
        return dict

write_run(solve(load_cell(sys.argv[1])), Path(sys.argv[2]), plots=Blank())
"""


def solved(cell: Path, folder: Path, *, cache: str) -> dict[str, bytes]:
    """Files of a run that a process of its own solves; pictures show nothing that is not in the report."""
    subprocess.run(
        [sys.executable, "-c", SOLVE, str(cell), str(folder)],
        env={**os.environ, "CELLPLAN_CACHE": cache},
        capture_output=True,
        check=True,
        cwd=Path(__file__).resolve().parents[2],
    )
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_run_is_the_same_cold_warm_damaged_and_without_a_cache(sound: Path, tmp_path: Path) -> None:
    cell, cache = sound / "cell" / "small.yaml", tmp_path / "cache"
    without = solved(cell, tmp_path / "run", cache="off")
    assert not cache.exists()

    cold = solved(cell, tmp_path / "run", cache=str(cache))
    kinds = {path.name.partition("-")[0] for path in cache.iterdir()}
    warm = solved(cell, tmp_path / "run", cache=str(cache))
    for path in cache.iterdir():
        path.write_bytes(path.read_bytes()[:-1])
    damaged = solved(cell, tmp_path / "run", cache=str(cache))

    assert "mesh" in kinds
    assert without == cold == warm == damaged


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
