"""Checking a cell from the shell, without solving it."""

import json
from pathlib import Path

import pytest
from builders.stored_cells import write_cell

from cellplan.cli.main import run
from cellplan.jobs.check import check_lines


def test_a_sound_cell_is_reported_with_postures_and_paths_and_nothing_is_written(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    status = run(["check", str(cells / "four_robots.yaml")])

    lines = capsys.readouterr().out.splitlines()
    assert status == 0
    assert lines[0] == "four-robots: passed"
    reis = next(line for line in lines if line.startswith("  start of reis "))
    assert reis.split(maxsplit=4)[3:] == ["given", "A1_deg 0, B1_deg -93, C1_deg 108, D1_deg 0, E1_deg -15, F1_deg 0"]
    assert any(line.startswith("  task rectangle ") and " 1224 mm " in line for line in lines)
    assert lines[-1] == f"next: cellplan solve {cells / 'four_robots.yaml'}"
    assert list(tmp_path.iterdir()) == []


def test_a_collision_at_the_start_ends_with_one(cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["check", str(cells / "four_robots_initial.yaml"), "--json"])

    reported = json.loads(capsys.readouterr().out)
    assert (status, reported["exit"], reported["status"], reported["schema"]) == (1, 1, "failed", "cellplan.check/1")
    assert any(not check["passed"] for check in reported["checks"])


def test_a_start_off_its_task_is_bad_input(cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (cells / "four_robots.yaml").read_text(encoding="utf-8")
    path = tmp_path / "off.yaml"
    path.write_text(text.replace("start_deg: [21.020925685,", "start_deg: [45.0,"), encoding="utf-8")

    status = run(["check", str(path)])

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert f"{path}:25: robots.kuka.start_deg" in err
    assert err.count("\n") == 1


def test_a_start_a_few_degrees_off_its_task_is_moved_there_and_said_so(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (cells / "four_robots.yaml").read_text(encoding="utf-8")
    path = tmp_path / "near.yaml"
    path.write_text(text.replace("start_deg: [21.020925685,", "start_deg: [23.0,"), encoding="utf-8")

    status = run(["check", str(path), "--json"])

    record = json.loads(capsys.readouterr().out)
    assert (status, record["status"]) == (0, "passed")
    (moved,) = record["moved_starts"]
    assert (moved["robot"], moved["task"], moved["run"], moved["unit"]) == ("kuka", "circle", None, "deg")
    assert 15.0 < moved["tool_mm"] < 45.0  # 1.98 deg about the first axis, the tool some 800 mm from it
    assert 1.0 < abs(moved["joint_moved"]) < 5.0
    assert next(iter(record["start"]["kuka"].values())) == pytest.approx(21.02, abs=0.5)


def test_names_that_were_read_over_are_notes_of_the_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = write_cell(tmp_path / "cell")
    urdf = cell.parent / "robots" / "right.urdf"
    urdf.write_text(urdf.read_text(encoding="utf-8").replace("effort=", "command_effort="), encoding="utf-8")

    assert run(["check", str(cell)]) == 0
    note = next(line for line in capsys.readouterr().out.splitlines() if "command_effort" in line)

    assert note.startswith(f"  note: {cell}:10: robots.right.model: right.urdf:")
    assert note.endswith("attribute 'command_effort' of <limit> is not known and was not read (and 2 more)")


def test_controllers_are_listed_with_their_robots(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    for model in ("xyz_mm: [0, 0, 500]}", "rpy_deg: [0, 0, 180]}"):
        text = text.replace(model, f"{model}\n    controller: {{id: master}}", 1)
    path = tmp_path / "one_controller.yaml"
    path.write_text(f"{text}controllers:\n  master: {{kind: other}}\n", encoding="utf-8")

    assert run(["check", str(path), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["controllers"] == {"master": {"kind": "other", "robots": ["left", "right"]}}
    assert ["controller", "master", "other", "left,", "right"] in [line.split() for line in check_lines(record)]
