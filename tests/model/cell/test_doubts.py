"""A value that is a thousand or 57.3 times off what the others are is asked about before any larger cure."""

from pathlib import Path

import pytest

from cellplan import load_cell
from cellplan.errors import InputError, StartNotFoundError
from cellplan.model.cell.doubts import doubt_about, doubt_about_velocity
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.given import examine_given_starts
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_paths
from cellplan.scene.scene import Scene

CELL = """
cellplan: 1
name: one-arm
robots:
  kuka:
    model: kuka_kr6
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
    start_deg: auto
part: {geometry: {sphere: {radius_mm: 120}}, at: {xyz_mm: [1100, 0, 600]}}
tasks:
  ring: {robot: kuka, path: {circle: {radius_mm: 40, plane: yz}, project: [-1, 0, 1]}, tool_axis: normal, tool_x: +z}
motion: {mode: simultaneous, duration_s: 4, step_s: 0.002, time_law: quintic}
"""
RADIANS = "limits: {A2: {lower_deg: 1.5, upper_deg: 2.1}}\n    tool:"


def cell_of(folder: Path, *changes: tuple[str, str]):
    text = CELL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    return load_cell(folder / "cell.yaml")


def refusal(cell) -> str:
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    try:
        examine_given_starts(cell, toolpaths)
        choose_start(Scene.from_cell(cell), clock_paths(cell, toolpaths.values()))
    except (StartNotFoundError, InputError) as error:
        return str(error)
    return ""


def test_a_tip_behind_the_flange_asks_whether_the_tool_is_reversed(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, ("xyz_mm: [0, 0, 150]", "xyz_mm: [0, 0, -350]"))

    assert "is the tool reversed? The tip of the tool of 'kuka' is 350 mm behind its flange" in doubt_about(
        cell, cell.robots[0]
    )
    turned = cell_of(tmp_path, ("xyz_mm: [0, 0, 150]", "xyz_mm: [0, 0, -350], rpy_deg: [180, 0, 0]"))
    assert not doubt_about(turned, turned.robots[0])


def test_limits_in_radians_are_asked_about_where_a_start_is_not_found(tmp_path: Path) -> None:
    words = refusal(cell_of(tmp_path, ("tool:", RADIANS)))

    first, question, rest = words.partition("are the limits of 'A2' in radians? They are 1.5 .. 2.1 deg")
    assert question
    assert "move" not in first
    assert "gets there only beyond a limit" in rest


def test_limits_in_radians_are_asked_about_where_a_given_start_is_outside(tmp_path: Path) -> None:
    words = refusal(cell_of(tmp_path, ("tool:", RADIANS), ("auto", "[0, -90, 90, 0, 45, 0]")))

    assert "outside its limits 1.5 deg .. 2.1 deg; are the limits of 'A2' in radians?" in words


def test_a_tool_in_metres_is_asked_about(tmp_path: Path) -> None:
    cell = cell_of(tmp_path, ("xyz_mm: [0, 0, 150]", "xyz_mm: [0, 0, 0.15]"))

    assert doubt_about(cell, cell.robots[0]).startswith("is robots.kuka.tool.xyz_mm in metres?")


def test_usual_limits_tools_and_bases_raise_no_doubt(tmp_path: Path) -> None:
    for change in (("auto", "auto"), ("tool:", "limits: {A2: {lower_deg: -60, upper_deg: 60}}\n    tool:")):
        cell = cell_of(tmp_path, change)
        assert not doubt_about(cell, cell.robots[0])


@pytest.mark.parametrize(("radius", "is_refused"), [(0.04, True), (40.0, False), (2.0, False)])
def test_a_path_in_metres_asks_for_its_unit(tmp_path: Path, radius: float, is_refused: bool) -> None:
    cell = cell_of(tmp_path, ("radius_mm: 40", f"radius_mm: {radius}"))

    if not is_refused:
        assert build_toolpath(cell.tasks[0], cell.part).length > 0.0
        return
    with pytest.raises(InputError, match=r"cell.yaml:\d+: tasks.ring.path: expected a path in mm.*is it in metres\?"):
        build_toolpath(cell.tasks[0], cell.part)


def test_a_seam_in_metres_asks_for_its_unit_and_a_tack_away_from_the_origin_does_not(tmp_path: Path) -> None:
    seam = "path: {polyline: {points_mm: [[0.1, 0.02, 0.06], [-0.05, 0.02, 0.06]]}}, tool_axis: -z, tool_x: +x"
    tack = seam.replace("[0.1, 0.02, 0.06], [-0.05, 0.02, 0.06]", "[10, 0, 119], [12, 0, 119]")
    old = "path: {circle: {radius_mm: 40, plane: yz}, project: [-1, 0, 1]}, tool_axis: normal, tool_x: +z"

    cell = cell_of(tmp_path, (old, seam))
    with pytest.raises(InputError, match=r"got one of 0\.15 mm at the origin of the part: is it in metres\?"):
        build_toolpath(cell.tasks[0], cell.part)
    cell = cell_of(tmp_path, (old, tack))
    assert build_toolpath(cell.tasks[0], cell.part).length == pytest.approx(2e-3)


def test_a_velocity_limit_in_radians_is_asked_about() -> None:
    assert "in radians per second?" in doubt_about_velocity(2.27 / 57.3, [2.27, 2.3, 3.0], is_revolute=True)
    assert "in metres per second?" in doubt_about_velocity(1e-3, [1.0], is_revolute=False)
    assert not doubt_about_velocity(0.5, [2.27, 2.3, 3.0], is_revolute=True)
    assert not doubt_about_velocity(0.01, [], is_revolute=False)
