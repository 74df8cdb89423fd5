"""``cellplan view`` from the shell: what is said, what is written, how it ends."""

import json
import shlex
import shutil
from pathlib import Path

import pytest

from cellplan.cli.main import run
from cellplan.report.page.view import unmade_view_page


def test_a_run_gets_its_page_beside_its_report(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(sound / "run", tmp_path / "run")

    status = run(["view", str(tmp_path / "run"), "--cell", str(sound / "cell" / "small.yaml")])

    out, err = capsys.readouterr()
    page = tmp_path / "run" / "view.html"
    assert (status, err) == (0, "")
    assert out.splitlines()[0].startswith(f"small-pair: {page} (0.")
    assert out.splitlines()[-1] == f"open {page} in a browser"
    assert page.stat().st_size < 500_000


def test_a_machine_gets_one_object(sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"

    status = run(["view", str(sound / "cell" / "small.yaml"), "-o", str(page), "--json"])

    record = json.loads(capsys.readouterr().out)
    assert (status, record["status"], record["kind"], record["failures"]) == (0, "written", "cell", [])
    assert record["bytes"] == page.stat().st_size


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{folder}/none"], "error: {folder}/none: no such file"),
        (["{folder}"], "error: {folder}: expected a run, a layout search or a cell file, got a folder that holds none"),
        (["{cell}", "--cell", "{cell}"], "error: --cell: expected a run or a layout search with it, got '{cell}'"),
        (["{run}", "--set", "name=x"], "error: --set: expected a cell file with it, got the folder '{run}'"),
        (
            ["{cell}", "-o", "{folder}/mine.txt"],
            "error: {folder}/mine.txt: holds something that is no 3-D page; choose another file with -o",
        ),
        (
            ["{run}"],
            "error: {run}: the run depends on files beside its cell file ({files}): "
            "name the cell file 'small.yaml' with --cell, so that they can be compared",
        ),
        (
            ["{study}"],
            "error: {study}/study.json: expected the study of a layout search, got one of the kind 'sweep': "
            "view one of its runs instead",
        ),
    ],
)
def test_what_cannot_be_shown_ends_with_one_line(
    arguments: list[str], message: str, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "study.json").write_text('{"schema": "cellplan.study/1", "kind": "sweep"}')
    places = {
        "folder": str(tmp_path),
        "study": str(tmp_path / "study"),
        "files": "meshes/block.stl, paths/bow.csv, robots/elbow.stl, robots/left.yaml, robots/right.urdf",
        "run": str(sound / "run"),
        "cell": str(sound / "cell" / "small.yaml"),
    }

    status = run(["view", *(argument.format(**places) for argument in arguments)])

    out, err = capsys.readouterr()
    assert (status, out, err) == (2, "", f"{message.format(**places)}\n")
    assert (tmp_path / "mine.txt").read_text() == "mine"


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_solved_cell_brings_its_page_and_a_page_made_later_stands_in_the_same_run(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = sound / "cell" / "small.yaml"
    monkeypatch.chdir(tmp_path)

    assert run(["solve", str(cell), "--view", "-q", "-o", "at-once"]) == 0
    assert "3-D page: at-once/view.html" in capsys.readouterr().out
    assert run(["solve", str(cell), "-q", "-o", "later"]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("next: cellplan view"))
    before = contents(Path("later"))
    assert run([*shlex.split(line.removeprefix("next: cellplan ")), "-q"]) == 0
    after = contents(Path("later"))

    assert {name for name, content in after.items() if content != before[name]} == {"view.html"}
    assert after == contents(Path("at-once"))
    assert b'<a class="go" href="view.html#t=' in after["report.html"]
    for made_later in ("at-once", "later"):
        assert run(["verify", made_later, "--cell", str(cell), "-q"]) == 0
    capsys.readouterr()


def test_until_the_page_is_made_the_place_of_it_says_how(sound: Path) -> None:
    page = (sound / "run" / "view.html").read_text()

    assert "<code>cellplan view RUN --cell CELL</code>" in page
    assert "small.yaml" in page
    assert "<script" not in page
    assert "&lt;b&gt;" in unmade_view_page("<b>", cell_file="")
    assert "<code>cellplan view RUN</code>" in unmade_view_page("four-robots", cell_file="")


def test_the_folder_of_a_repair_leads_to_its_cell(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "advice.json").write_text("{}", encoding="utf-8")

    assert run(["view", str(tmp_path)]) == 2
    assert capsys.readouterr().err == (
        f"error: {tmp_path}: expected a run, a layout search or a cell file, got a repair: "
        f"show '{tmp_path / 'best.yaml'}'\n"
    )
