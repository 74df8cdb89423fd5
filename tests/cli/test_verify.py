"""``cellplan verify`` and ``cellplan export`` from the shell: what is said, what is written, how it ends."""

import json
import shutil
from pathlib import Path

import pytest
from builders.run_defects import DEFECTS
from builders.run_edits import Copy, edit_rows

from cellplan.cli.main import run


@pytest.fixture
def copy(sound: Path, tmp_path: Path) -> Copy:
    shutil.copytree(sound, tmp_path / "copy")
    return Copy(
        cell=tmp_path / "copy" / "cell" / "small.yaml", run=tmp_path / "copy" / "run", other=tmp_path / "copy" / "run"
    )


def test_a_sound_run_is_reported_with_its_figures(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["verify", str(copy.run), "--cell", str(copy.cell)])

    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "small-pair: verified"
    unsealed = {"manifest.json", "view.html"}  # the 3-D page may come later
    files = [path for path in copy.run.rglob("*") if path.is_file() and path.name not in unsealed]
    assert lines[1] == f"  unchanged files: {len(files)}"
    assert lines[2].endswith("robots/left.yaml, robots/right.urdf, small.yaml")
    assert any(line.startswith("  largest tool error ") and line.endswith(" task path (right)") for line in lines)


def test_a_machine_gets_one_object(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["verify", str(copy.run), "--cell", str(copy.cell), "--json"])

    reported = json.loads(capsys.readouterr().out)
    assert (status, reported["schema"], reported["status"], reported["exit"]) == (0, "cellplan.verify/1", "verified", 0)
    assert reported["report"]["status"] == "passed"


def test_an_edited_table_ends_with_two_and_names_the_line(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    edit_rows(copy.table("left"), lambda i, fields: [fields[0], "nan", *fields[2:]] if i == 4 else fields)

    status = run(["verify", str(copy.run), "--cell", str(copy.cell)])

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    table = copy.table("left")
    assert err.splitlines()[0].startswith(f"{table}: changed since the run was written (")
    assert err.splitlines()[1:] == [f"{table}:16: A_deg: expected a plain decimal number such as -12.5, got 'nan'"]


def test_a_check_that_fails_ends_with_one(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    import numpy as np

    DEFECTS["just over a limit, signed"](np.random.default_rng(0), copy)

    status = run(["export", str(copy.run), "--cell", str(copy.cell), "--format", "csv"])

    out, err = capsys.readouterr()
    assert (status, out) == (1, "")
    assert "joint idle/" in err
    assert "idle robot idle: joint " in err
    assert not (copy.run / "programs").exists()

    assert run(["verify", str(copy.run), "--cell", str(copy.cell), "--json"]) == 1
    reported = json.loads(capsys.readouterr().out)
    assert (reported["status"], reported["exit"], len(reported["errors"])) == ("failed", 1, 2)


def test_a_stale_input_ends_with_two(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    copy.cell.write_text(copy.cell.read_text() + "# a remark\n", encoding="utf-8")

    status = run(["export", str(copy.run), "--cell", str(copy.cell), "--format", "csv", "--json"])

    out, err = capsys.readouterr()
    assert status == 2
    assert err == f"error: {copy.run}: 'small.yaml' has changed since the run was made; solve the cell again\n".replace(
        "error: ", ""
    )
    assert json.loads(out)["exit"] == 2


def test_the_cell_of_another_run_is_named(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    other = copy.cell.with_name("other.yaml")
    other.write_text(copy.cell.read_text() + "# a remark\n", encoding="utf-8")

    assert run(["verify", str(copy.run), "--cell", str(other)]) == 2
    assert capsys.readouterr().err == (
        f"{copy.run}: the run was made from 'small.yaml', and '{other}' differs from it; "
        "name the file of the run, or solve again\n"
    )


def test_programs_are_written_into_the_run(copy: Copy, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["export", str(copy.run), "--cell", str(copy.cell), "--format", "csv"])

    out, err = capsys.readouterr()
    place = copy.run / "programs" / "csv"
    assert (status, err, out) == (0, "", f"small-pair: exported\nprograms: {place}\n")
    assert sorted(path.name for path in place.iterdir()) == ["export.json", "idle.csv", "left.csv", "right.csv"]
    assert run(["verify", str(copy.run), "--cell", str(copy.cell)]) == 0


def test_an_export_without_the_cell_must_be_asked_for_by_name(
    copy: Copy, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["export", str(copy.run), "--format", "csv", "-o", str(tmp_path / "programs")]

    assert run(words) == 2
    err = capsys.readouterr().err
    assert "--cell: expected the cell file that was solved" in err
    assert "--without-cell" in err
    assert run([*words, "--cell", str(copy.cell), "--without-cell"]) == 2
    assert capsys.readouterr().err == "error: --without-cell: expected no --cell beside it\n"
    assert run([*words, "--without-cell"]) == 2  # files beside the cell cannot be found without it
    assert "name the cell file 'small.yaml' with --cell" in capsys.readouterr().err
    assert not (tmp_path / "programs").exists()


@pytest.mark.parametrize("name", ["krl", "rapid", "CSV", ""])
def test_other_formats_are_refused_by_name(copy: Copy, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["export", str(copy.run), "--cell", str(copy.cell), "--format", name])

    assert status == 2
    assert capsys.readouterr().err.startswith(f"error: --format: expected one of csv, wide, got '{name}'")


def test_a_rehearsal_is_no_run(copy: Copy, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rehearsal").mkdir()
    (tmp_path / "rehearsal" / "rehearsal.json").write_text("{}")

    assert run(["verify", str(tmp_path / "rehearsal")]) == 2
    assert "expected the folder of a run, got no manifest.json in it" in capsys.readouterr().err
