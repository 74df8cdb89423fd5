"""Completion of commands, options and values by the protocol of the shells."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.cli.options import completion
from cellplan.files.robots.joint_table import bundled_names
from cellplan.model.cell.cell import Mode
from cellplan.model.report.exported import Moves
from cellplan.model.solver import METHODS, Integrator
from cellplan.programs.export.exporters import EXPORTERS
from cellplan.search.programs.objective import CycleTiming, Objective


@pytest.fixture
def folder(cells: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with cells, a run and other things."""
    for name in ("four_robots", "planar_pair"):
        (tmp_path / "cells").mkdir(exist_ok=True)
        shutil.copy(cells / f"{name}.yaml", tmp_path / "cells")
    (tmp_path / "outputs" / "run").mkdir(parents=True)
    (tmp_path / "outputs" / "run" / "report.json").write_text("{}", encoding="utf-8")
    (tmp_path / "notes.txt").write_text("", encoding="utf-8")
    (tmp_path / "arm.urdf").write_text("", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("so", ["solve"]),
        ("solve --int", ["--integrator"]),
        ("solve ", ["cells/", "outputs/"]),
        ("solve cel", ["cells/four_robots.yaml", "cells/planar_pair.yaml"]),
        ("solve cells/p", ["cells/planar_pair.yaml"]),
        ("verify out", ["outputs/run"]),
        ("verify outputs/run --cell cells/f", ["cells/four_robots.yaml"]),
        ("solve cells/four_robots.yaml --mode p", ["pairwise", "part_at_rest"]),
        ("solve cells/four_robots.yaml --method filtered_inverse_", ["filtered_inverse_ii"]),
        ("solve cells/four_robots.yaml --task r", ["rhombus", "rectangle"]),
        ("solve cells/absent.yaml --task r", []),
        ("map cells/four_robots.yaml --robot k", ["kuka"]),
        ("robots kuka_kr6", ["kuka_kr6", "kuka_kr6_maker_zero"]),
        ("robots ar", ["arm.urdf"]),
        ("export outputs/run --format ", [*EXPORTERS, "all"]),
        ("export outputs/run --moves ", [str(kind) for kind in Moves]),
        ("export outputs/run --promise ", ["timed", "synchronised", "paced", "sequence"]),
        ("solve cells/four_robots.yaml --mode ", [str(mode) for mode in Mode]),
        ("solve cells/four_robots.yaml --method ", list(METHODS)),
        ("solve cells/four_robots.yaml --integrator ", ["auto", *map(str, Integrator)]),
        ("layout cells/four_robots.yaml --timing ", [str(timing) for timing in CycleTiming]),
        ("layout cells/four_robots.yaml --objective ", [str(objective) for objective in Objective]),
        ("layout cells/four_robots.yaml --objective c", ["conforming", "cycle", "clearance", "change"]),
        ("--install-completion ", ["bash", "zsh", "fish"]),
    ],
)
@pytest.mark.usefixtures("folder")
def test_a_shell_is_offered(
    line: str, offered: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    words = f"cellplan {line}"
    monkeypatch.setenv("_CELLPLAN_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split(" ")) - 1))

    assert run([]) == 0

    assert capsys.readouterr().out.split() == offered


def test_the_bundled_robots_come_first() -> None:
    assert completion.robot_models("")[: len(bundled_names())] == list(bundled_names())


@pytest.mark.skipif(shutil.which("bash") is None, reason="this system has no bash")
def test_bash_itself_completes_with_the_script_that_is_shown(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--show-completion", "bash"]) == 0
    (folder / "completion.sh").write_text(capsys.readouterr().out, encoding="utf-8")
    program = folder / "cellplan"
    program.write_text(f"#!/bin/sh\nexec '{sys.executable}' -m cellplan \"$@\"\n", encoding="utf-8")
    program.chmod(0o755)
    typed = 'COMP_WORDS=(cellplan solve cells/p); COMP_CWORD=2; _cellplan_completion cellplan; echo "${COMPREPLY[@]}"'

    completion = subprocess.run(
        ["bash", "--norc", "-c", f"source completion.sh; {typed}"],
        check=True,
        capture_output=True,
        text=True,
        env={**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"},
    )

    assert completion.stdout.split() == ["cells/planar_pair.yaml"]


@pytest.mark.parametrize("shell", completion.SHELLS)
def test_completion_is_installed_for_a_shell_that_is_named(
    shell: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))

    status = run(["--install-completion", shell])

    assert (status, f"{shell} completion installed" in capsys.readouterr().out) == (0, True)
    written = [path.read_text(encoding="utf-8") for path in tmp_path.rglob("*") if path.is_file()]
    assert any("_CELLPLAN_COMPLETE=complete_" in text for text in written)


def test_another_shell_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--install-completion", "tcsh"]) == 2
    assert "expected one of bash, zsh, fish, got 'tcsh'" in capsys.readouterr().err
