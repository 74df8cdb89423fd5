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


def check_for(cell: Path, formats: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, list[str]]:
    """Exit status and lines about a cell of a check for some formats."""
    status = run(["check", str(cell), "--for", formats, "-q"])
    out, err = capsys.readouterr()
    assert (out == "") is (status == 2)
    return status, (err if status else out).splitlines()


def test_all_that_formats_need_is_said_at_once(cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (cells / "in_turn.yaml").read_text(encoding="utf-8")
    bare = text.replace("kuka: 1, abb: 2, staubli: 3", "abb: 2").replace("task: T_ROB1, ", "")
    bare = bare.replace(", handshake: {output: doThere, inputs: {reis: diGo}}", "")
    (cell := tmp_path / "bare.yaml").write_text(bare, encoding="utf-8")

    status, lines = check_for(cell, "krl,val3", capsys)

    expected = [
        ("reis", ".inputs", "expected the input that 'kuka' sets, got none"),
        ("reis", ".inputs", "expected the input that 'staubli' sets, got none"),
        ("abb", "", "expected its signals, {output: …, inputs: {reis: …}}, as its program waits for other robots"),
        ("staubli", "", "expected its signals, {output: …, inputs: {reis: …}}, as its program waits for other robots"),
    ]
    assert status == 2
    assert len(lines) == 2 * len(expected)
    numbers = {name: 1 + bare.splitlines().index(f"  {name}:") for name in ("reis", "abb", "staubli")}
    for line, (form, (robot, key, words)) in zip(
        lines, [(form, it) for form in ("krl", "val3") for it in expected], strict=True
    ):
        assert f": robots.{robot}.controller.handshake{key}: for {form}: {words}" in line
        at = int(line.removeprefix(f"{cell}:").partition(":")[0])
        assert numbers[robot] < at <= numbers[robot] + 8


def test_nothing_is_missing_of_formats_that_a_cell_can_have(cells: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, lines = check_for(cells / "in_turn.yaml", "krl, rapid,val3,csv,wide", capsys)

    assert status == 0
    missing = [line.split() for line in lines if line.startswith("  programs ")]
    assert missing == [["programs", form, "nothing", "missing"] for form in ("krl", "rapid", "val3", "csv", "wide")]


def test_tasks_of_a_controller_that_moves_robots_together_are_needed(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (cells / "multimove.yaml").read_text(encoding="utf-8")
    (cell := tmp_path / "cell.yaml").write_text(text.replace(", task: T_ROB2", ""), encoding="utf-8")

    status, lines = check_for(cell, "rapid", capsys)

    where = "robots.right.controller.task: for rapid: expected one of the tasks of controller 'irc5' (T_ROB1, T_ROB2, "
    assert (status, len(lines)) == (2, 1)
    assert where in lines[0]


def test_formats_that_do_not_exist_are_refused_with_those_that_do(
    cells: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, lines = check_for(cells / "in_turn.yaml", "rapidd", capsys)

    assert (status, len(lines)) == (2, 1)
    assert lines[0].startswith("error: --for: expected one of csv, fanuc_ls, inform, json, krl, rapid, ros2, ")
    assert lines[0].endswith("got 'rapidd', did you mean 'rapid'?")


def test_names_of_a_file_count_in_place_of_those_of_the_cell(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "names.yaml"
    file.write_text("robots: {abb: {controller: {handshake: {output: do1, inputs: {kuka: di1}}}}}", encoding="utf-8")
    words = ["check", str(cells / "in_turn.yaml"), "--for", "rapid", "-q", "--controllers", str(file)]

    assert run(words) == 2

    where = f"{cells / 'in_turn.yaml'} with {file}:1: robots.abb.controller.handshake.inputs: for rapid: "
    assert capsys.readouterr().err == f"{where}expected the input that 'reis' sets, got none\n"
