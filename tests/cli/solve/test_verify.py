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
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "small-pair: exported",
        "  promise: timed",
        "    timed for one controller; several controllers agree only to their start skew",
        "  largest deviation from the run: joints below 1e-06 deg, tools below 1e-06 mm, tools below 1e-06 deg",
        "  files: 3",
        f"programs: {place}",
    ]
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


def test_exported_programs_are_verified_against_the_run_around_them(
    copy: Copy, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    place, cell = copy.run / "programs" / "csv", ["--cell", str(copy.cell)]
    assert run(["export", str(copy.run), *cell, "--format", "csv", "--robot", "right", "--json"]) == 0
    exported = json.loads(capsys.readouterr().out)
    assert (exported["files"], exported["export"]["promise"]) == (["right.csv"], "timed")

    assert run(["verify", str(place), *cell]) == 0
    assert capsys.readouterr().out.splitlines()[:3] == [
        "small-pair: programs verified (csv)",
        f"  run: {copy.run}",
        "  promise: timed",
    ]
    shutil.copytree(place, tmp_path / "elsewhere")
    assert run(["verify", str(tmp_path / "elsewhere"), *cell]) == 2
    assert "--run: expected the run folder that the programs in" in capsys.readouterr().err
    assert run(["verify", str(tmp_path / "elsewhere"), *cell, "--run", str(copy.run), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["export"]["robots"] == ["right"]
    assert run(["verify", str(copy.run), *cell, "--run", str(copy.run)]) == 2
    assert "--run: expected a folder of exported programs with it" in capsys.readouterr().err
    (place / "right.csv").write_text((place / "right.csv").read_text().replace("\n0.050000000,", "\n0.05,"))
    assert run(["verify", str(place), *cell]) == 2
    assert f"{place / 'right.csv'}:4: expected 4 numbers with 9 decimals" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--robot", "other"], "--robot: expected one of left, right, idle, got 'other'"),
        (["--moves", "tools"], "--moves: expected one of joints, linear, auto, got 'tools'"),
        (["--moves", "linear"], "--moves: expected joints with csv, got linear"),
        (["--split", "7"], "--split: expected no --split with csv"),
        (["--thin-mm", "0.1"], "--thin-mm: expected no thinning with csv"),
    ],
)
def test_what_a_format_cannot_do_is_refused(
    copy: Copy, words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["export", str(copy.run), "--cell", str(copy.cell), "--format", "csv", *words]) == 2

    assert message in capsys.readouterr().err
    assert not (copy.run / "programs").exists()


@pytest.mark.parametrize("name", ["apt", "KRL", "CSV", ""])
def test_other_formats_are_refused_by_name(copy: Copy, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["export", str(copy.run), "--cell", str(copy.cell), "--format", name])

    assert status == 2
    assert capsys.readouterr().err.startswith("error: --format: expected one of csv, ")


def test_a_rehearsal_is_no_run(copy: Copy, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "rehearsal").mkdir()
    (tmp_path / "rehearsal" / "rehearsal.json").write_text("{}")

    assert run(["verify", str(tmp_path / "rehearsal")]) == 2
    assert "expected the folder of a run, got no manifest.json in it" in capsys.readouterr().err


def test_several_formats_have_a_folder_each_and_what_was_not_named_may_be_refused(
    copy: Copy, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["export", str(copy.run), "--cell", str(copy.cell)]

    status = run([*words, "--format", "all", "--robot", "right"])

    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "small-pair: exported csv, json, ros2, stream"
    place = lines.index("  krl: refused")
    assert lines[place + 1] == "    robots.right.controller: expected the controller that plays krl, got none"
    assert lines[-1] == f"programs: {copy.run / 'programs'}"
    assert sorted(path.name for path in (copy.run / "programs").iterdir()) == ["csv", "json", "ros2", "stream"]
    for name in ("csv", "stream"):
        assert run(["verify", str(copy.run / "programs" / name), "--run", str(copy.run), "--cell", str(copy.cell)]) == 0


@pytest.mark.parametrize(("names", "status"), [(["csv", "krl"], 1), (["all", "krl"], 1), (["val3", "krl"], 2)])
def test_a_format_that_was_named_and_is_refused_is_an_error(
    names: list[str], status: int, copy: Copy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word for name in names for word in ("--format", name)]

    given = run(["export", str(copy.run), "--cell", str(copy.cell), *words, "-o", str(tmp_path / "out"), "--json"])

    reported = json.loads(capsys.readouterr().out)
    by_name = {export["format"]: export for export in reported["exports"]}
    assert (given, reported["exit"], reported["status"]) == (status, status, "refused")
    assert by_name["krl"]["status"] == "refused"
    assert by_name["krl"]["errors"] == [
        f"robots.{robot}.controller: expected the controller that plays krl, got none"
        for robot in ("left", "right", "idle")
    ]
    for name, export in by_name.items():
        assert (tmp_path / "out" / name / "export.json").exists() is (export["status"] == "exported")
