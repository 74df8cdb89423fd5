"""``cellplan seams``: what is listed of a STEP file, tasks that can be pasted, the page, and refusals."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from builders.step_files import Named, box, cylinder, write_step

from cellplan.cli.main import run


@pytest.fixture
def step_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    parts = [
        Named("BASE", box((0, 0, 0), (200, 100, 10))),
        Named("WEB", box((20, 46, 10), (180, 54, 60)), {0: "TOP 1"}),
    ]
    return write_step(tmp_path / "tee.step", parts).relative_to(tmp_path)


def test_fillets_are_listed_with_tasks_to_paste(step_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["seams", str(step_file), "--fillets"])

    lines = capsys.readouterr().out.splitlines()
    listed, _, block = "\n".join(lines).partition("tasks to paste, with a robot for each:\n")
    assert status == 0
    assert lines[:2] == ["tee.step: 2 solids, 12 faces", "seams (4)"]
    assert "  WEB-BASE-3  T joint, concave, line of 160.000 mm, 90 deg between WEB and BASE" in listed.splitlines()
    tasks = yaml.safe_load(block)["tasks"]
    assert list(tasks) == [f"WEB-BASE-{k}" for k in (1, 2, 3, 4)]
    assert tasks["WEB-BASE-3"]["path"] == {"edge": "WEB-BASE-3", "from": "WEB", "work_deg": 45}


def test_record_has_all_edges_and_faces(step_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["seams", str(step_file), "--json"]) == 0

    record = json.loads(capsys.readouterr().out)
    assert record["schema"] == "cellplan.seams/1"
    assert record["parts"] == ["BASE", "WEB"]
    assert len(record["faces"]) == 12
    assert len(record["edges"]) == 24 + 4
    assert "TOP_1" in [edge["name"] for edge in record["edges"]]


def test_page_names_every_edge_and_is_the_same_again(step_file: Path) -> None:
    for name in ("one.html", "two.html"):
        assert run(["seams", str(step_file), "-o", name]) == 0

    text = Path("one.html").read_text()
    assert text == Path("two.html").read_text()
    assert all(f"<td>{name}</td>" in text for name in ("E1", "TOP_1", "WEB-BASE-4"))
    assert "http" not in text  # nothing is loaded


def test_page_has_the_directions_that_angles_are_drawn_in(step_file: Path) -> None:
    assert run(["seams", str(step_file), "-o", "page.html"]) == 0
    text = Path("page.html").read_text()
    edges = json.loads(text.split("const part = ", 1)[1].split(";\n", 1)[0])["edges"]

    for edge in edges:
        travel, normals = np.array(edge["travel"]), np.array(edge["normals"])
        assert np.abs(np.linalg.norm([travel, *normals], axis=1) - 1.0).max() <= 1e-5
        assert np.abs(normals @ travel).max() <= 1e-5  # work angles are across the seam, travel angles along it
        assert np.linalg.norm(np.array(edge["middle"]) - edge["from_mm"]) <= edge["length_mm"]


@pytest.mark.parametrize(("depth_mm", "is_said"), [(-0.4, False), (0.0, False), (0.005, False), (0.5, True)])
def test_solids_that_penetrate_each_other_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], depth_mm: float, is_said: bool
) -> None:
    low = 10.0 - depth_mm
    parts = [
        Named("BASE", box((0, 0, 0), (200, 100, 10))),
        Named("WEB", box((20, 46, low), (180, 54, 60))),
        Named("TUBE", cylinder(8, 30, (30, 20, 10))),
    ]
    write_step(tmp_path / "part.step", parts)

    assert run(["seams", str(tmp_path / "part.step"), "--fillets", "--gap-mm", "1"]) == 0
    assert ("BASE and WEB penetrate each other" in capsys.readouterr().out) == is_said


def test_tube_through_a_plate_without_a_hole_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_step(
        tmp_path / "p.step",
        [Named("BASE", box((0, 0, 0), (90, 90, 10))), Named("TUBE", cylinder(8, 80, (45, 45, -30)))],
    )

    assert run(["seams", str(tmp_path / "p.step"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["penetrating"] == [["BASE", "TUBE"]]


def test_other_files_are_refused_and_left_alone(step_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("notes.html").write_text("<p>mine</p>")
    Path("cut.step").write_text(step_file.read_text()[:2000])

    assert run(["seams", str(step_file), "-o", "notes.html"]) == 2
    assert run(["seams", "none.step"]) == 2
    assert run(["seams", "cut.step"]) == 2

    errors = capsys.readouterr().err.splitlines()
    assert Path("notes.html").read_text() == "<p>mine</p>"
    assert len(errors) == 3
    assert "none.step: expected an existing STEP file" in errors[1]
    assert "cut.step:" in errors[2]
    assert "is the file cut off?" in errors[2]
