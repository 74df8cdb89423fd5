"""Rehearsing a cell from the shell: what is said, what is written, how it ends."""

import json
from pathlib import Path

import pytest

from cellplan.cli.main import run

pytestmark = pytest.mark.usefixtures("stored_solutions")

FIXED = """\
cellplan_errors: 1
robots:
  left: {joint_offsets_deg: {B: 0.05}}
  right: {base: {xyz_mm: [1, 0, 0]}}
"""
SPREAD = FIXED.replace("[1, 0, 0]", "[{normal: 1}, 0, 0]")


@pytest.fixture
def pair(cells: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The planar pair on a clock of 50 ms; the folder is the one that the test works in."""
    monkeypatch.chdir(tmp_path)
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8").replace("step_s: 0.001", "step_s: 0.05")
    text = text.replace("position_mm: 0.003, orientation_deg: 0.001", "position_mm: 0.1, orientation_deg: 0.01")
    Path("pair.yaml").write_text(text, encoding="utf-8")
    Path("errors.yaml").write_text(FIXED, encoding="utf-8")
    Path("spread.yaml").write_text(SPREAD, encoding="utf-8")
    return "pair.yaml"


def everything_in(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_cell_out_of_tolerance_is_reported_by_how_much(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["rehearse", pair, "--errors", "errors.yaml"])

    out, err = capsys.readouterr()
    folder = Path("outputs/planar-pair/rehearsal")
    assert (status, err) == (1, "")
    lines = out.splitlines()
    assert lines[0] == "planar-pair: failed"
    assert lines[1] == "  mode simultaneous, 12 s, rehearsed on one real cell, seed 0"
    assert any(line.startswith("  FAILED true position error of task 'circle': ") for line in lines)
    assert lines[-1] == f"report: {folder / 'rehearsal.html'}"
    assert not (folder / "tables").exists()
    assert (folder / "plots" / "before_circle.svg").is_file()


def test_feedback_brings_it_back_and_hands_over_corrected_tables(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["rehearse", pair, "--errors", "errors.yaml", "--feedback", "--in-pass", "-o", "out"])

    out = capsys.readouterr().out
    assert status == 0
    assert "planar-pair: passed" in out
    assert "  feedback converged\n    round 0: largest true error " in out
    assert out.endswith("tables: out/tables\n")
    assert "# remark: corrected for measured errors" in Path("out/tables/right.csv").read_text(encoding="utf-8")
    page = Path("out/rehearsal.html").read_text(encoding="utf-8")
    assert "<svg" in page
    assert "http://" not in page.replace("http://www.w3.org", "")  # no network
    assert {path.name for path in Path("out/plots").glob("*.svg")} == {
        "before_circle.svg",
        "after_circle.svg",
        "in_pass_circle.svg",
        "rounds_circle.svg",
    }


def test_a_machine_gets_one_object(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["rehearse", pair, "--errors", "spread.yaml", "--trials", "3", "--seed", "4", "-o", "out", "--json"])

    reported = json.loads(capsys.readouterr().out)
    record = reported["rehearsal"]
    assert (status, reported["exit"], reported["schema"]) == (1, 1, "cellplan.rehearse/1")
    assert record == json.loads(Path("out/rehearsal.json").read_text(encoding="utf-8"))
    assert (record["schema"], record["trials"], record["seed"]) == ("cellplan.rehearsal/1", 3, 4)
    task = record["tasks"]["circle"]
    assert task["before"]["max_position_error_mm"] >= task["before"]["rms_position_error_mm"] > 0.0
    assert task["after"] is None
    assert task["iso_9283"]["before"]["RT_p_mm"] > 0.0
    samples = [trial["drawn"]["robots"]["right"]["base"]["xyz_mm"][0] for trial in record["runs"][0]["trials"]]
    assert len(set(samples)) == 3
    assert Path("out/plots/envelope_before_circle.svg").is_file()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(pair: str) -> None:
    for folder in ("one", "two"):
        run(["rehearse", pair, "--errors", "spread.yaml", "--trials", "2", "--feedback", "-o", folder, "-q"])

    one, two = everything_in(Path("one")), everything_in(Path("two"))
    assert one == two
    assert "rehearsal.json" in one


def test_findings_about_the_errors_come_all_at_once(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("errors.yaml").write_text(FIXED.replace("left", "lefft").replace("xyz_mm", "xzy_mm"), encoding="utf-8")

    status = run(["rehearse", pair, "--errors", "errors.yaml"])

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.splitlines() == [
        "errors.yaml:3: robots.lefft: expected a robot of this cell (left, right), got 'lefft', did you mean 'left'?",
        "errors.yaml:4: robots.right.base.xzy_mm: unknown key, did you mean 'xyz_mm'?; allowed: xyz_mm, rpy_deg",
    ]
    assert not Path("outputs").exists()


@pytest.mark.parametrize(
    ("option", "finding"),
    [
        ("--trials=0", "error: --trials: expected a whole number of at least 1, got 0\n"),
        ("--seed=-1", "error: --seed: expected a whole number of at least 0, got -1\n"),
        ("--rounds=0", "error: --rounds: expected a whole number of at least 1, got 0\n"),
    ],
)
def test_a_wrong_number_is_refused(pair: str, capsys: pytest.CaptureFixture[str], option: str, finding: str) -> None:
    status = run(["rehearse", pair, "--errors", "errors.yaml", "--feedback", option])

    assert (status, capsys.readouterr().err) == (2, finding)


def test_errors_must_be_stated(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["rehearse", pair]) == 2
    assert "--errors" in capsys.readouterr().err


def test_a_folder_with_other_things_in_it_is_never_replaced(pair: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine").mkdir()
    Path("mine/thesis.tex").write_text("years of work", encoding="utf-8")

    status = run(["rehearse", pair, "--errors", "errors.yaml", "-o", "mine"])

    assert status == 2
    assert "thesis.tex" in capsys.readouterr().err
    assert Path("mine/thesis.tex").read_text(encoding="utf-8") == "years of work"


@pytest.mark.slow
def test_a_rehearsal_does_not_stand_in_the_way_of_a_solve(pair: str) -> None:
    assert run(["rehearse", pair, "--errors", "errors.yaml"]) == 1
    assert run(["solve", pair]) in {0, 1}
    assert Path("outputs/planar-pair/report.json").is_file()

    assert run(["rehearse", pair, "--errors", "errors.yaml"]) == 1
    assert run(["rehearse", pair, "--errors", "errors.yaml", "--feedback"]) == 0
    assert run(["solve", pair]) in {0, 1}


def test_a_part_between_several_holders_is_refused_with_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = Path(__file__).parents[3] / "cells" / "load_sharing_planar.yaml"
    errors = tmp_path / "errors.yaml"
    errors.write_text("cellplan_errors: 1\nrobots:\n  left: {base: {xyz_mm: [1, 0, 0]}}\n", encoding="utf-8")

    status = run(["rehearse", str(cell), "--errors", str(errors), "-o", str(tmp_path / "out")])

    err = capsys.readouterr().err
    assert status == 2
    assert ": part.held_by: expected one robot that holds the part, got 2: the pose of a part between several" in err
    assert not (tmp_path / "out").exists()
