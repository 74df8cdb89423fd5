"""The 3-D page of a run: what it holds agrees with the run, to the digit where figures are shown."""

import json
import shutil
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
import trimesh
from builders.view_pages import body_poses, data_of, rows_of

from cellplan import load_cell, solve, write_run
from cellplan.errors import InputError
from cellplan.files.run.joint_tables import parse_table
from cellplan.files.run.stored import StoredRun, read_stored_run
from cellplan.geometry.shapes import Mesh
from cellplan.jobs.view import geometries
from cellplan.jobs.view.result import ViewRecord, view_page
from cellplan.jobs.view.run_scene import MOST_NUMBERS, motion_record, run_scene
from cellplan.jobs.view.write import ViewRequest, view, write_view
from cellplan.runs.gate.open_gate import open_gate
from cellplan.runs.overrides import with_overrides
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def record(sound: Path) -> ViewRecord:
    return view(ViewRequest(path=sound / "run", cell=sound / "cell" / "small.yaml"))[0]


@pytest.fixture(scope="module")
def scene(sound: Path) -> Scene:
    return Scene.from_cell(load_cell(sound / "cell" / "small.yaml"))


def test_the_rows_are_those_of_the_tables(record: ViewRecord, sound: Path) -> None:
    times, q = rows_of(record["scenes"][0]["motion"])
    tables = [sound / "run" / "tables" / f"{name}.csv" for name in ("left", "right", "idle")]
    parsed = [parse_table(table.read_text(), str(table)) for table in tables]

    assert np.array_equal(times, parsed[0].times)
    assert np.abs(q - np.concatenate([table.q for table in parsed], axis=1)).max() < 1e-6  # seven digits of a degree


def test_bodies_are_where_the_kinematics_of_the_checks_put_them(record: ViewRecord, scene: Scene) -> None:
    page = record["scenes"][0]
    _, q = rows_of(page["motion"])
    rows = [0, 17, len(q) - 1]
    poses = scene.body_poses(q[rows])

    assert [body["name"] for body in page["bodies"]] == [body.name for body in scene.bodies]
    for place, row in enumerate(rows):
        for index, pose in enumerate(
            list(body_poses(page, q[row]))[: len(scene.bodies) - 1]
        ):  # the last one is the floor
            assert np.abs(pose[:3, :3] - poses.R[index, place]).max() < 1e-7
            assert np.abs(pose[:3, 3] - poses.p[index, place]).max() < 1e-7


def test_meshes_lie_where_their_files_do(record: ViewRecord, scene: Scene) -> None:
    meshes = {body.name: body.shape for body in scene.bodies if isinstance(body.shape, Mesh)}
    page = record["scenes"][0]
    for name, mesh in meshes.items():
        shape = record["geometries"][next(body["geometry"] for body in page["bodies"] if body["name"] == name)]
        points = np.frombuffer(b64decode(shape["points"]), "<u2").reshape(-1, 3) / 65535 * shape["size"] + shape["low"]
        corners = points[np.frombuffer(b64decode(shape["triangles"]), "<u2").reshape(-1, 3)]
        shown, given = (
            triangles[np.lexsort(triangles.reshape(len(triangles), -1).T)]
            for triangles in (corners, mesh.vertices[mesh.faces])
        )

        assert np.abs(np.sort(shown.ravel()) - np.sort(given.ravel())).max() <= shape["deviation"]
    assert {"right/b", "block"} <= meshes.keys()


def test_the_closest_pair_is_as_far_as_its_points_and_as_the_report_says(record: ViewRecord, sound: Path) -> None:
    page, report = record["scenes"][0], json.loads((sound / "run" / "report.json").read_text())
    times, q = rows_of(page["motion"])
    nearest = page["nearest"]
    for at, pair, distance, points in zip(
        nearest["times"], nearest["pairs"], nearest["distances"], nearest["points"], strict=True
    ):
        poses = list(body_poses(page, q[int(np.argmin(np.abs(times - at)))]))
        ends = [poses[pair[i]] @ [*points[3 * i : 3 * i + 3], 1.0] for i in (0, 1)]
        assert 1e3 * np.linalg.norm(ends[0] - ends[1]) == pytest.approx(distance, abs=1e-2)

    certified = report["clearance"]["whole"]
    assert min(nearest["distances"]) == pytest.approx(certified["minimum_mm"], abs=0.2)  # certified within 0.1 mm
    assert nearest["step"] <= 0.025


def test_paths_lie_on_the_part_and_the_part_where_its_holder_has_it(record: ViewRecord) -> None:
    page = record["scenes"][0]
    points = np.array(page["tasks"][0]["points"]).reshape(-1, 3)

    assert points[0] == pytest.approx([0.04, 0.0, 0.005], abs=1e-6)
    assert np.abs(points[:, 2] - 0.005).max() < 1e-6  # the face of the part
    assert (page["part"][0]["robot"], page["part"][0]["begin"]) == (0, 0.0)


def test_pairs_that_are_not_checked_are_listed_with_their_reason(record: ViewRecord, scene: Scene) -> None:
    page = record["scenes"][0]
    listed = {(tuple(pair), entry["reason"]) for entry in page["excluded"] for pair in entry["pairs"]}

    assert {((entry.first, entry.second), entry.reason) for entry in scene.excluded} <= listed


def test_the_same_run_gives_the_same_bytes_and_stays_sound(record: ViewRecord, sound: Path, tmp_path: Path) -> None:
    shutil.copytree(sound / "run", tmp_path / "run")
    write_view(record, tmp_path / "run" / "view.html")
    first = (tmp_path / "run" / "view.html").read_bytes()
    cell = sound / "cell" / "small.yaml"
    write_view(view(ViewRequest(path=tmp_path / "run", cell=cell))[0], tmp_path / "run" / "view.html")

    assert (tmp_path / "run" / "view.html").read_bytes() == first
    assert open_gate(tmp_path / "run", cell=cell).cell.name == "small-pair"


def test_phases_follow_one_another_on_the_clock_of_the_program(sound: Path, tmp_path: Path) -> None:
    cell = load_cell(sound / "cell" / "small.yaml")
    write_run(solve(with_overrides(cell, mode="pairwise")), tmp_path / "run")

    record = view(ViewRequest(path=tmp_path / "run", cell=sound / "cell" / "small.yaml"))[0]

    times, _ = rows_of(record["scenes"][0]["motion"])
    assert np.all(np.diff(times) > 0.0)
    assert times[-1] == pytest.approx(1.0)


def test_a_long_motion_is_thinned_and_keeps_its_last_row() -> None:
    q = np.zeros((MOST_NUMBERS // 2, 4))
    record = motion_record(np.arange(len(q), dtype=float), q, [])

    times, rows = rows_of(dict(record))
    assert (record["total"], times[0], times[-1]) == (len(q), 0.0, len(q) - 1.0)
    assert rows.size <= MOST_NUMBERS + 8


def test_meshes_share_the_triangles_of_a_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(geometries, "MESH_TRIANGLES", 2000)
    balls = [trimesh.creation.icosphere(subdivisions=4, radius=r) for r in (0.1, 0.2, 0.3)]
    meshes = [Mesh(np.array(b.vertices), np.array(b.faces), "ball.stl", is_closed=True) for b in balls]
    page = geometries.Geometries()
    page.announce([*meshes])

    places = [page.place(mesh) for mesh in (*meshes, *meshes)]

    counts = [len(b64decode(record["triangles"])) // 6 for record in page.records]
    assert places == [0, 1, 2, 0, 1, 2]
    assert 500 < sum(counts) <= 2000
    assert all(0.0 < record["deviation"] < 0.1 for record in page.records)  # 300 points on a ball are 6 cm apart


def test_names_never_become_markup(record: ViewRecord) -> None:
    hostile = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&\u2028"
    page = view_page({**record, "cell": hostile, "caution": hostile})

    assert "alert(1)</script>" not in page.replace("&lt;script&gt;", "")
    assert "<img" not in page
    assert data_of(page)["cell"] == hostile


def test_the_page_asks_for_nothing(record: ViewRecord) -> None:
    page = view_page(record).replace("http://www.w3.org/2000/svg", "")  # a name, not a place

    assert "default-src 'none'" in page
    assert not any(word in page for word in ("http:", "https:", "fetch(", "XMLHttpRequest", "@import", " src="))


DAMAGED_SERIES = {
    "joints: expected positions of all joints of the cell": {"times_s": [0.0], "joints": {}},
    "clearance: expected times and as many distances": {"clearance": {"times_s": [0.0, 1.0], "part_mm": [1.0]}},
    "clearance: expected times and": {"clearance": {"times_s": ["x"]}},
    "clearance: expected": {"clearance": [1.0]},
}


@pytest.mark.parametrize("message", DAMAGED_SERIES)
def test_a_series_that_does_not_fit_is_named(sound: Path, message: str) -> None:
    class Damaged(StoredRun):
        def series(self, place: str) -> dict[str, object]:
            return {**StoredRun.series(self, place), **DAMAGED_SERIES[message]}

    stored = read_stored_run(sound / "run")
    names = ("folder", "digest", "manifest", "record", "records", "tables", "clock")
    damaged = Damaged(**{name: getattr(stored, name) for name in names})

    with pytest.raises(InputError, match=rf"series\.json: {message}"):
        run_scene(damaged, load_cell(sound / "cell" / "small.yaml"), geometries.Geometries())


def test_the_curve_over_the_time_line_is_what_the_report_certifies(record: ViewRecord, sound: Path) -> None:
    curve, whole = record["scenes"][0]["certified"], read_stored_run(sound / "run").record["clearance"]["whole"]
    known = [distance for distance in curve["distances"] if distance is not None]

    assert len(curve["times"]) == len(curve["distances"]) > 40
    assert min(known) == pytest.approx(whole["minimum_mm"], abs=1e-4)
    assert curve["times"][curve["distances"].index(min(known))] == pytest.approx(whole["at_s"], abs=1e-6)
    nearest = record["scenes"][0]["nearest"]
    for at, distance in zip(nearest["times"], nearest["distances"], strict=True):
        before = max(i for i, time in enumerate(curve["times"]) if time <= at + 1e-9)
        about = [distance for distance in curve["distances"][max(before - 1, 0) : before + 3] if distance is not None]
        assert min(about) <= distance + 0.1  # a block is never kept better than in one of its rows
