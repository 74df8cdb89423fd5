"""Paths along edges of a STEP file in a cell: what is read, what the tool does there, and refusals."""

from pathlib import Path

import numpy as np
import pytest
from builders.step_files import Named, box, cylinder, write_step

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.model.task.task import Task
from cellplan.planning.path.build import build_toolpath

CELL = """\
cellplan: 1
name: weld
robots:
  arm:
    model: kuka_kr6
    start_deg: [0, -90, 90, 0, 30, 0]
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 5, length_mm: 150}}}
part:
  step: {file: part.step, gap_mm: 1}
  at: {xyz_mm: [900, 0, 400]}
tasks:
  weld:
    robot: arm
    path: {PATH}
    feed_mm_s: 10
motion: {mode: simultaneous}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("edges")
    parts = [
        Named("BASE", box((0, 0, 0), (200, 100, 10))),
        Named("WEB", box((20, 46, 10.4), (180, 54, 60))),
        Named("PIN", cylinder(8, 30, (30, 20, 10))),
    ]
    write_step(place / "part.step", parts)
    return place


def task_of(folder: Path, path: str) -> Task:
    file = folder / "cell.yaml"
    file.write_text(CELL.replace("PATH", path))
    return load_cell(file).task("weld")


def refusal(folder: Path, path: str) -> str:
    with pytest.raises(InputError) as refused:
        task_of(folder, path)
    return str(refused.value).replace(f"{folder}/", "")


def test_path_along_a_seam_has_its_walls_and_stays_on_it(folder: Path) -> None:
    task = task_of(folder, "edge: WEB-BASE-3, from_mm: 30, to_mm: 130, from: BASE, work_deg: 40, push_deg: 10")

    line = task.path
    poses = build_toolpath(task, load_cell(folder / "cell.yaml").part).spread(51)
    axis = poses[:, :3, 2]
    travel = (poses[-1, :3, 3] - poses[0, :3, 3]) / 0.1

    assert isinstance(line, SeamLine)
    assert list(line.walls) == ["WEB", "BASE"]
    assert np.linalg.norm(poses[-1, :3, 3] - poses[0, :3, 3]) == pytest.approx(0.1, abs=1e-9)
    assert np.abs(poses[:, 2, 3] - 0.01).max() <= 1e-9  # the foot of the edge on the base
    assert np.degrees(np.arcsin(axis @ travel)) == pytest.approx(np.full(51, 10.0), abs=1e-6)  # push
    across = axis - np.outer(axis @ travel, travel)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    assert np.degrees(np.arccos(-across[:, 2])) == pytest.approx(np.full(51, 40.0), abs=1e-6)  # from the base


def test_without_angles_the_tool_is_halfway_between_both_walls(folder: Path) -> None:
    task = task_of(folder, "edge: WEB-BASE-3, reverse: true")

    poses = build_toolpath(task, load_cell(folder / "cell.yaml").part).spread(9)

    inclination = np.degrees(np.arccos(-poses[:, 2, 2]))
    np.testing.assert_allclose(inclination, 45.0, atol=1e-9)


def test_closed_edge_begins_at_the_point_that_is_named(folder: Path) -> None:
    task = task_of(folder, "edge: PIN-BASE-1, start_at_mm: [30, 99, 10]")

    assert isinstance(task.path, SeamLine)
    assert task.path.is_closed
    np.testing.assert_allclose(1e3 * task.path.points[0], [30.0, 28.0, 10.0], atol=1e-4)


def test_edges_are_one_path_with_corners(folder: Path) -> None:
    lines = [task_of(folder, f"edge: WEB-BASE-{k}").path for k in (1, 2, 3, 4)]
    assert all(isinstance(line, SeamLine) for line in lines)

    path = task_of(folder, "edges: [WEB-BASE-3, WEB-BASE-2, WEB-BASE-4, WEB-BASE-1]").path

    assert isinstance(path, SeamLine)
    assert path.is_closed
    assert path.behind[-1] == pytest.approx(2.0 * (0.16 + 0.008), abs=1e-7)
    assert int(np.sum(np.diff(path.behind) == 0.0)) == 3


def test_length_beyond_the_edge_is_refused(folder: Path) -> None:
    task = task_of(folder, "edge: WEB-BASE-3, to_mm: 170")

    with pytest.raises(InputError, match=r"tasks.weld.path.to_mm: expected .* 160"):
        build_toolpath(task, load_cell(folder / "cell.yaml").part)


PLACE = "cell.yaml:14: tasks.weld.path"
REFUSED = {
    "edge: WEB-BASE-9": f"{PLACE}.edge: expected an edge or seam of the STEP file, got 'WEB-BASE-9'",
    "edges: [WEB-BASE-3, PIN-BASE-1]": f"{PLACE}.edges[1]: expected an edge that begins where 'WEB-BASE-3' ends, got",
    "edges: [E1, E99]": f"{PLACE}.edges[1]: expected an edge or seam of the STEP file, got 'E99'",
    "edge: WEB-BASE-3, start_at_mm: [0, 0, 0]": f"{PLACE}.start_at_mm: unexpected key, only edges that are closed",
    "edge: WEB-BASE-3, from: RIB, work_deg: 45": f"{PLACE}.from: expected one of the walls WEB and BASE, got 'RIB'",
    "edge: WEB-BASE-3, work_deg: 45": f"{PLACE}.from: missing, expected the wall that work_deg is measured from",
    "edge: WEB-BASE-3, from: BASE": f"{PLACE}.work_deg: missing, expected the angle from the wall under from",
    "edge: WEB-BASE-3, walls: {floor: +z}": f"{PLACE}.walls: unexpected key, edges have the walls of the STEP file",
    "polyline: {points_mm: [[0, 0, 0], [9, 0, 0]]}, start_at_mm: [0, 0, 0]": f"{PLACE}.start_at_mm: unexpected",
    "edge: WEB-BASE-3, project: +z": f"{PLACE}.project: unexpected key, edges lie on the part already",
}


@pytest.mark.parametrize("path", REFUSED)
def test_what_is_wrong_with_a_path_is_said_at_its_key(folder: Path, path: str) -> None:
    assert REFUSED[path] in refusal(folder, path)


def test_edge_of_a_part_that_comes_from_no_step_file_is_refused(folder: Path) -> None:
    file = folder / "box.yaml"
    text = CELL.replace("PATH", "edge: E1").replace(
        "step: {file: part.step, gap_mm: 1}", "geometry: {sphere: {radius_mm: 50}}"
    )
    file.write_text(text)

    with pytest.raises(InputError, match=r"tasks.weld.path.edge: expected a part from a STEP file \(part.step\)"):
        load_cell(file)


@pytest.mark.parametrize(
    ("path", "keys", "spans"),
    [
        ("edge: WEB-BASE-3", "stitch: {length_mm: 30, gap_mm: 20}", [(0, 30), (50, 80), (100, 130)]),
        ("edge: WEB-BASE-3, from_mm: 20", "tacks: {length_mm: 10, pitch_mm: 60}", [(20, 30), (80, 90), (140, 150)]),
        ("edges: [WEB-BASE-3, WEB-BASE-1]", "stitch: {length_mm: 60, gap_mm: 40}", [(0, 60), (100, 160)]),
    ],
)
def test_as_many_stitches_and_tacks_are_made_as_edges_hold(
    folder: Path, path: str, keys: str, spans: list[tuple[int, int]]
) -> None:
    text = CELL.replace("PATH", f"{path}, from: BASE, work_deg: 40") + "program: {}\n"
    (folder / "cell.yaml").write_text(text.replace("    feed_mm_s", f"    {keys}\n    feed_mm_s"))
    tasks = [task for task in load_cell(folder / "cell.yaml").tasks if task.name != "weld"]
    stretches = [task.stretch for task in tasks if task.stretch is not None]

    assert [(it.begin, it.end) for it in stretches] == pytest.approx(np.array(spans) / 1e3)


def test_stitches_along_an_edge_that_is_not_in_the_file_are_refused_by_their_edge_alone(folder: Path) -> None:
    text = CELL.replace("PATH", "edge: WEB-BASE-9").replace(
        "    feed", "    stitch: {length_mm: 9, gap_mm: 9}\n    feed"
    )
    (folder / "cell.yaml").write_text(text)
    with pytest.raises(InputError) as refused:
        load_cell(folder / "cell.yaml")

    assert str(refused.value).count("\n") == 0
    assert "tasks.weld.path.edge: expected an edge or seam of the STEP file" in str(refused.value)
