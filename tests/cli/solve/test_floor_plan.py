"""``cellplan floorplan`` from the shell: what is said, what is written, how it ends."""

import json
import re
import shutil
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest
from builders.stored_cells import solve_into

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


def connect(folder: Path, source: Path) -> Path:
    """A copy of the cell whose worker is on a FANUC controller and whose holder is on the same one, and its run."""
    shutil.copytree(source, folder / "cell")
    cell = folder / "cell" / "small.yaml"
    text = cell.read_text()
    for name, model, control in (
        ("left", "robots/left.yaml", "{id: r30, tool_frame: {rpy_deg: [0, 0, 90]}}"),
        ("right", "robots/right.urdf", "{id: r30, base: {xyz_mm: [0, 0, 450]}, tool_frame: {}, frames: [7]}"),
    ):
        text = text.replace(f"    model: {model}\n", f"    model: {model}\n    controller: {control}\n")
        assert name in text
    cell.write_text(text.replace("part:\n", "controllers: {r30: {kind: fanuc}}\npart:\n", 1))
    solve_into(cell, folder / "run")
    return cell


def test_frames_are_printed_drawn_and_told_as_the_maker_writes_them(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = connect(tmp_path, sound / "cell")
    given = ["floorplan", str(tmp_path / "run"), "--cell", str(cell), "--frames"]

    assert run([*given, "-o", str(tmp_path / "plan.svg")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert run([*given, "-o", str(tmp_path / "plan.dxf"), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert run(["floorplan", str(cell), "--frames", "-o", str(tmp_path / "cell.svg")]) == 0
    of_cell = capsys.readouterr().out.splitlines()

    right = lines[lines.index("right, r30 (fanuc): X Y Z in mm, W P R in deg") + 1 :][:3]
    assert [" ".join(line.split()) for line in right] == [
        "base in floor X 1900.000 Y 300.000 Z 930.000 W 0.000 P 0.000 R 180.000 where it stands",
        "UTOOL ? in flange X 0.000 Y 0.000 Z 40.000 W 0.000 P 0.000 R 0.000 tip of the tool",
        "UFRAME 7 in flange of left X 0.000 Y -120.000 Z 45.000 W 180.000 P 0.000 R -90.000 path",
    ]  # the grasp is (120, 0, 5) mm from the tip upside down, the tip 40 mm from the flange, which is turned by 90 deg
    assert "(model)" not in "".join(right)
    (told,) = [robot for robot in record["frames"] if robot["robot"] == "right"]
    assert told["remarks"] == []
    assert told["frames"][2] == {
        "name": "UFRAME 7",
        "in": "flange of left",
        "numbers": {"X": "0.000", "Y": "-120.000", "Z": "45.000", "W": "180.000", "P": "0.000", "R": "-90.000"},
        "for": "path",
    }
    svg, dxf = ((tmp_path / f"plan.{form}").read_text() for form in ("svg", "dxf"))
    assert 'width="297mm" height="420mm"' in svg
    assert "on A3," in svg
    for line in lines[1:]:
        assert line in unescape(svg)
        assert line.strip() in dxf
    assert "  frames of the part follow from a run: solve the cell, and name the folder of the run" not in lines
    assert not any("UFRAME" in line for line in of_cell)
    assert [*svg_frames(svg)] == []  # the part goes with the flange of the holder: no fixed frame is drawn

    (names := tmp_path / "names.yaml").write_text("robots: {right: {controller: {frames: [5]}}}\n")
    assert run([*given, "--controllers", str(names), "-o", str(tmp_path / "plan.svg")]) == 0
    assert "  UFRAME 5 in flange of left" in capsys.readouterr().out


def test_a_run_that_failed_has_no_frames_to_type(
    sound: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(sound / "cell", tmp_path / "cell")
    cell = tmp_path / "cell" / "small.yaml"
    cell.write_text(f"{cell.read_text()}checks: {{clearance_mm: 900}}\n")
    solve_into(cell, tmp_path / "run")
    given = ["floorplan", str(tmp_path / "run"), "--cell", str(cell), "-o", str(tmp_path / "plan.svg")]

    assert run([*given, "--frames"]) == 1
    out, err = capsys.readouterr()
    assert (out, "the run failed: clearance" in err) == ("", True)
    assert not (tmp_path / "plan.svg").exists()
    assert run(given) == 0


def svg_frames(svg: str) -> Iterator[str]:
    """Names at fixed frames of the part in a drawing."""
    yield from re.findall(r'<text class="thing"[^>]*>([^<]*(?:UFRAME|BASE_DATA|frame)[^<]*)<', svg)


def test_frames_of_a_cell_that_was_not_solved_are_those_that_no_run_decides(
    cells: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["floorplan", str(cells / "in_turn.yaml"), "--frames", "-o", str(tmp_path / "plan.svg")]) == 0

    lines = capsys.readouterr().out.splitlines()
    kuka = lines.index("kuka, krc (kuka): X Y Z in mm, A B C in deg")
    assert lines[kuka + 1].startswith("  base (model) in floor           X 582.000  Y 2173.000  Z 500.000  A -105.0000")
    assert lines[kuka + 3 : kuka + 6] == [
        "  robots.kuka.controller.base is not stated: (model) counts from the base of the model",
        "  robots.kuka.controller.tool_frame is not stated: (model) counts from the flange of the model",
        "  frames of the part follow from a run: solve the cell, and name the folder of the run",
    ]
