"""``cellplan floorplan`` from the shell: what is said, what is written, how it ends."""

import json
import sys
from pathlib import Path

import pytest

from cellplan.cli.main import run


def test_a_run_gets_the_drawing_that_its_folder_holds(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drawing, cell = tmp_path / "plan.svg", str(sound / "cell" / "small.yaml")

    status = run(["floorplan", str(sound / "run"), "--cell", cell, "-o", str(drawing)])

    out, err = capsys.readouterr()
    assert (status, err) == (0, "")
    assert out.startswith(f"small-pair: {drawing} (")
    shown, stored = (path.read_text().splitlines() for path in (drawing, sound / "run" / "floor_plan.svg"))
    assert [line for line in shown if "path r" not in line] == [line for line in stored if "path r" not in line]


def test_a_cell_that_was_not_solved_gets_a_drawing_of_its_start(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drawing = tmp_path / "plan.dxf"

    status = run(["floorplan", str(sound / "cell" / "small.yaml"), "-o", str(drawing), "--json"])

    record = json.loads(capsys.readouterr().out)
    assert (status, record["status"], record["format"]) == (0, "written", "dxf")
    assert record["bytes"] == drawing.stat().st_size
    assert "Robots at the start;" in drawing.read_text()
    assert run(["floorplan", str(sound / "cell" / "small.yaml"), "-o", str(drawing)]) == 0  # a drawing is replaced


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["{folder}/none"], "error: {folder}/none: no such file"),
        (["{cell}", "--format", "pdf"], "error: --format: expected svg or dxf, got 'pdf'"),
        (
            ["{cell}", "-o", "plan.pdf"],
            "error: -o: expected a file that ends with .svg or .dxf, or --format with it, got 'plan.pdf'",
        ),
        (["{cell}", "-o", "plan.svg", "--format", "dxf"], "error: --format: expected svg for 'plan.svg', got 'dxf'"),
        (["{cell}", "--cell", "{cell}"], "error: --cell: expected a run with it, got '{cell}'"),
        (["{run}", "--set", "name=x"], "error: --set: expected a cell file with it, got the folder '{run}'"),
        (
            ["{cell}", "-o", "{folder}/mine.svg"],
            "error: {folder}/mine.svg: holds something that is no floor plan; choose another file with -o",
        ),
    ],
)
def test_what_cannot_be_drawn_ends_with_one_line(
    arguments: list[str], message: str, sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine.svg").write_text("<svg>mine</svg>")
    places = {"folder": tmp_path, "cell": sound / "cell" / "small.yaml", "run": sound / "run"}

    status = run(["floorplan", *(argument.format(**places) for argument in arguments)])

    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.splitlines() == [message.format(**places)]
    assert (tmp_path / "mine.svg").read_text() == "<svg>mine</svg>"


def test_without_the_package_for_dxf_the_message_says_how_to_get_it(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf.filemanagement", None)

    status = run(["floorplan", str(sound / "cell" / "small.yaml"), "-o", str(tmp_path / "plan.dxf")])

    assert status == 2
    assert capsys.readouterr().err == (
        "error: --format dxf: expected the package ezdxf, got none: pip install 'cellplan[dxf]', or use --format svg\n"
    )
    assert list(tmp_path.iterdir()) == []
