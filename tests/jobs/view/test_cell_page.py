"""The 3-D pages of a cell that was not solved and of a layout search."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.view_pages import body_poses, matrix, rows_of

from cellplan import load_cell
from cellplan.errors import InputError
from cellplan.geometry.transforms import pose
from cellplan.jobs.view.write import ViewRequest, view
from cellplan.scene.scene import Scene

EXCLUDED = "checks: {exclude: [{bodies: [idle/mount, idle/A], reason: its first link lies on it}]}\n"
BOX = "  crate: {box: {size_mm: [400, 400, 400]}, at: {xyz_mm: [0, 4000, 500]}}\n"  # round the idle robot


@pytest.fixture(scope="module")
def cell(sound: Path) -> Path:
    return sound / "cell" / "small.yaml"


@pytest.fixture(scope="module")
def start(cell: Path) -> dict[str, Any]:
    return dict(view(ViewRequest(path=cell))[0])


def sibling(cell: Path, name: str, text: str) -> Path:
    """Another cell file in the folder of one."""
    path = cell.with_name(name)
    path.write_text(text, encoding="utf-8")
    return path


def test_a_cell_stands_at_its_start_and_its_bases_are_as_in_the_file(start: dict[str, Any]) -> None:
    scene = start["scenes"][0]
    _, q = rows_of(scene["motion"])

    assert (start["kind"], scene["passed"], scene["failures"]) == ("cell", True, [])
    assert np.rad2deg(q[0, :3]) == pytest.approx([50.0, -85.0, 35.0], abs=1e-5)
    assert scene["bases"][1] == {"robot": 1, "xyz_mm": [1900.0, 300.0, 480.0], "rpy_deg": [0.0, 0.0, 180.0]}


def test_numbers_of_a_base_lead_to_its_pose(start: dict[str, Any]) -> None:
    scene = start["scenes"][0]
    for base in scene["bases"]:
        X_WB = pose(1e-3 * np.array(base["xyz_mm"]), np.deg2rad(base["rpy_deg"]))

        assert matrix(scene["robots"][base["robot"]]["base"]) == pytest.approx(X_WB, abs=1e-9)


def test_a_moved_base_moves_what_stands_on_it(start: dict[str, Any], cell: Path) -> None:
    moved = view(ViewRequest(path=cell, settings=["robots.idle.base.x_mm=700"]))[0]["scenes"][0]
    _, q = rows_of(dict(moved["motion"]))

    before, after = list(body_poses(start["scenes"][0], q[0])), list(body_poses(dict(moved), q[0]))
    for body, old, new in zip(moved["bodies"], before, after, strict=True):
        shift = [0.7, 0.0, 0.0] if body["name"].startswith("idle/") else [0.0, 0.0, 0.0]
        assert new[:3, 3] - old[:3, 3] == pytest.approx(shift, abs=1e-9)


def test_a_wedge_below_a_leaning_base_has_its_outline_and_its_floor(cell: Path) -> None:
    leaning = "[0, 4000, 500], rpy_deg: [0, 20, 30]}\n    mount: {tilted: {box: {size_mm: [260, 200]}}}"
    path = sibling(cell, "tilted.yaml", cell.read_text().replace("[0, 4000, 500]}", leaning) + EXCLUDED)
    record = view(ViewRequest(path=path))[0]
    bodies = {body["name"]: body for body in record["scenes"][0]["bodies"]}
    path.unlink()

    wedge = bodies["idle/mount"]
    corners = np.reshape(wedge["outline"], (4, 2))
    assert np.array_equal(np.abs(corners), [[0.13, 0.1]] * 4)
    assert len({tuple(corner) for corner in corners.tolist()}) == 4
    assert wedge["stands"] == {"floor": 0.0}
    low = record["geometries"][wedge["geometry"]]["low"]
    assert low == pytest.approx([-0.13, -0.1, 0.0])
    assert all(body["outline"] == [] for name, body in bodies.items() if name != "idle/mount")


def test_what_touches_at_the_start_is_named_once_with_its_bodies(cell: Path) -> None:
    crowded = sibling(cell, "crowded.yaml", cell.read_text().replace("motion:", f"{BOX}motion:"))
    scene = view(ViewRequest(path=crowded))[0]["scenes"][0]
    index = {body["name"]: place for place, body in enumerate(scene["bodies"])}
    crowded.unlink()

    texts = [failure["text"] for failure in scene["failures"]]
    assert scene["passed"] is False
    assert len(texts) == len(set(texts)) >= 1
    assert all("crate" in text for text in texts)
    assert all(index["crate"] in failure["bodies"] for failure in scene["failures"]), texts
    assert {body for contact in scene["contacts"] for body in contact["bodies"]} > {index["crate"]}


def test_a_cell_without_a_start_is_shown_with_the_reason(cell: Path) -> None:
    far = sibling(cell, "far.yaml", cell.read_text().replace("[1900, 300, 480]", "[9000, 300, 480]"))
    scene = view(ViewRequest(path=far))[0]["scenes"][0]
    far.unlink()

    assert scene["passed"] is False
    assert "robots.right.start_deg: no configuration within the joint lim" in scene["failures"][0]["text"]
    assert scene["robots"][1]["base"][3] == 9.0


def test_layouts_of_a_search_differ_by_their_settings(cell: Path, tmp_path: Path) -> None:
    study = write_study(
        tmp_path, [{"robots.idle.base.x_mm": x, "robots.right.start_deg": [10, 20, 30]} for x in (0, 900)]
    )

    record, place = view(ViewRequest(path=study, cell=cell))

    bases = [matrix(scene["robots"][2]["base"])[0, 3] for scene in record["scenes"]]
    assert (record["kind"], place.name, bases) == ("study", "study-view.html", [0.0, 0.9])
    assert record["scenes"][0]["facts"][1] == ["cycle", "1.5 s"]
    assert [scene["passed"] for scene in record["scenes"]] == [True, None]
    names = [body.name for body in Scene.from_cell(load_cell(cell)).bodies]
    assert [body["name"] for body in record["scenes"][1]["bodies"]] == names
    assert len(record["geometries"]) < 2 * len(names)  # shapes are shared


def test_a_search_whose_layout_does_not_fit_is_named(cell: Path, tmp_path: Path) -> None:
    study = write_study(tmp_path, [{"robots.nobody.base.x_mm": 1}])

    with pytest.raises(InputError, match=r"study\.json: top\[0\]\.settings: .*nobody"):
        view(ViewRequest(path=study, cell=cell))


def test_a_layout_with_starts_is_shown_with_its_motion(cell: Path, sound: Path, tmp_path: Path) -> None:
    starts = load_cell(sound / "run" / "cell.yaml", folder=cell.parent)
    right = {"robots.right.start_deg": np.rad2deg(starts.robot("right").start).tolist()}
    study = write_study(tmp_path, [right, {**right, "robots.idle.base.x_mm": 900}])

    scenes = view(ViewRequest(path=study, cell=cell))[0]["scenes"]

    run = view(ViewRequest(path=sound / "run", cell=cell))[0]["scenes"][0]
    times, q = rows_of(dict(run["motion"]))
    for scene in scenes:
        clock, rows = rows_of(dict(scene["motion"]))
        assert np.array_equal(clock, times)
        assert np.abs(rows - q).max() < 1e-5  # the idle robot's place does not matter to the others
        assert min(scene["nearest"]["distances"]) == pytest.approx(min(run["nearest"]["distances"]), abs=1e-2)


def write_study(folder: Path, settings: list[dict[str, Any]]) -> Path:
    """The result of a layout search as far as a page needs it."""
    figures = {"cycle_s": 1.5, "margin_deg": 12.0, "clearance_mm": 9.0, "change": 2.0, "reason": ""}
    top = [
        {
            "trial": place,
            "origin": "given",
            "status": "conforming" if place else "certified",
            "settings": setting,
            **figures,
        }
        for place, setting in enumerate(settings)
    ]
    (folder / "study.json").write_text(json.dumps({"schema": "cellplan.layout/1", "kind": "layout", "top": top}))
    return folder
