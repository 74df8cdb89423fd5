"""What the commands print, compared whole with the texts in ``golden/``.

After an intended change, ``CELLPLAN_WRITE_GOLDEN=1 python -m pytest tests/cli/test_golden.py`` writes the texts anew;
review their difference before it is committed. Paths are shortened; numbers agree when they do up to the rounding of
the arithmetic, which differs between processors.
"""

import math
import os
import shutil
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.runs.gate.equal_text import first_difference

pytestmark = pytest.mark.usefixtures("stored_solutions")

GOLDEN = Path(__file__).parent / "golden"
COMMANDS = (
    "assign",
    "check",
    "compare",
    "edit",
    "explain",
    "export",
    "fastest",
    "floorplan",
    "init",
    "layout",
    "map",
    "rehearse",
    "robots",
    "seams",
    "schema",
    "solve",
    "sweep",
    "verify",
    "view",
)
ERRORS = """\
cellplan_errors: 1
seed: 3
trials: 1
robots:
  right:
    joint_offsets_deg: {A: 0.02}
"""


@pytest.fixture
def place(sound: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Working folder with the small cell below ``cell`` and its run in ``run``."""
    for name in ("cell", "run"):
        shutil.copytree(sound / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("cellplan.cli.terminal.progress.LINE_EVERY_S", math.inf)  # however slow the machine is
    return tmp_path


def printed(arguments: list[str], place: Path, cells: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Command line, standard output, error stream and exit status of a command."""
    status = run(arguments)
    out, err = capsys.readouterr()
    text = f"$ cellplan {' '.join(arguments)}\n{out}{err}exit {int(status)}\n"
    return text.replace(str(place), "<folder>").replace(str(cells), "cells")


def compare(name: str, text: str) -> None:
    """Compare a text with the golden one, or write it."""
    file = GOLDEN / f"{name}.txt"
    if os.environ.get("CELLPLAN_WRITE_GOLDEN") == "1":
        file.write_text(text, encoding="utf-8")
    golden = file.read_text(encoding="utf-8")
    assert text == golden or first_difference(text, golden) is None, f"differs from {file}:\n{text}"


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_the_help_of_every_command(place: Path, cells: Path, capsys: pytest.CaptureFixture[str], command: str) -> None:
    arguments = [*([command] if command else []), "--help"]
    compare(f"help_{command or 'cellplan'}", printed(arguments, place, cells, capsys))


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("solve_passed", ["solve", "cell/small.yaml"]),
        ("solve_pairwise", ["solve", "cell/small.yaml", "--mode", "pairwise", "-o", "pairwise"]),
        ("solve_failed", ["solve", "cell/small.yaml", "-o", "failed", "--clearance-mm", "200"]),
        ("solve_kept", ["solve", "cell/small.yaml", "-o", "kept", "--clearance-mm", "200", "--keep-rejected"]),
        ("solve_method", ["solve", "cell/small.yaml", "-o", "method", "--method", "quadratic_program"]),
        ("solve_unknown_task", ["solve", "cell/small.yaml", "--task", "pat"]),
        ("check_sound", ["check", "cell/small.yaml"]),
        ("check_missing", ["check", "cell/large.yaml"]),
        ("explain", ["explain", "cell/small.yaml"]),
        ("verify", ["verify", "run", "--cell", "cell/small.yaml"]),
        ("verify_without_cell", ["verify", "run"]),
        ("export", ["export", "run", "--format", "csv", "--cell", "cell/small.yaml"]),
        ("export_no_choice", ["export", "run", "--format", "csv"]),
        ("export_unknown_format", ["export", "run", "--format", "krl", "--without-cell"]),
        ("repair_passes", ["layout", "cell/small.yaml", "--repair", "-o", "repair"]),
        (
            "repair_refused",
            ["layout", "cell/small.yaml", "--repair", "--set", "motion.mode=pairwise", "-o", "repair"],
        ),
        ("robots", ["robots"]),
        ("init", ["init", "new", "--template", "turntable"]),
        ("init_list", ["init", "--list"]),
        ("init_refused", ["init", "cell"]),
        ("unknown_command", ["slove"]),
    ],
)
def test_what_a_command_prints(
    place: Path, cells: Path, capsys: pytest.CaptureFixture[str], name: str, arguments: list[str]
) -> None:
    compare(name, printed(arguments, place, cells, capsys))


@pytest.mark.parametrize("name", ["planar_pair", "load_sharing_planar", "four_robots"])
def test_the_structure_of_shipped_cells(
    place: Path, cells: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    compare(f"explain_{name}", printed(["explain", str(cells / f"{name}.yaml")], place, cells, capsys))


def test_a_collision_at_the_start(place: Path, cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compare("check_collision", printed(["check", str(cells / "four_robots_initial.yaml")], place, cells, capsys))


@pytest.mark.parametrize(("name", "options"), [("rehearse", []), ("rehearse_feedback", ["--feedback", "--in-pass"])])
def test_a_rehearsal(
    place: Path, cells: Path, capsys: pytest.CaptureFixture[str], name: str, options: list[str]
) -> None:
    (place / "errors.yaml").write_text(ERRORS, encoding="utf-8")
    arguments = ["rehearse", "cell/small.yaml", "--errors", "errors.yaml", "-o", "rehearsal", *options]
    compare(name, printed(arguments, place, cells, capsys))


def test_every_golden_text_is_compared() -> None:
    source = Path(__file__).read_text(encoding="utf-8")
    named = {f"help_{command}" for command in ("cellplan", *COMMANDS)}
    named |= {f"explain_{name}" for name in ("planar_pair", "load_sharing_planar", "four_robots")}
    unused = [file.stem for file in GOLDEN.glob("*.txt") if file.stem not in named and f'"{file.stem}"' not in source]
    assert unused == []
