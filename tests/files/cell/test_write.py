"""The resolved cell: it loads again to the same cell, with every default and start posture written out."""

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import as_written, render_cell, written_document
from cellplan.files.robots.joint_table import load_bundled
from cellplan.files.yaml.reader import parse_yaml
from cellplan.files.yaml.writer import yaml_text
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.settings.solver import SolverEntry

Load = Callable[..., Cell]
KUKA = load_bundled("kuka_kr6")


def same(a: object, b: object) -> bool:
    """Whether two pieces of a cell are equal to the last bit, apart from where they were read from.

    A copy names the integrator that ``auto`` stands for.
    """
    if isinstance(a, SolverEntry) and isinstance(b, SolverEntry) and a.integrator == "auto":
        return same(a.changed(integrator="accurate" if a.is_accurate else "euler"), b)
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and np.array_equal(a, b)
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    if dataclasses.is_dataclass(a):
        names = [field.name for field in dataclasses.fields(a) if field.name not in {"origin", "inputs"}]
        return type(a) is type(b) and all(same(getattr(a, name), getattr(b, name)) for name in names)
    return a == b


def reload(cell: Cell, folder: Path, starts: dict[str, np.ndarray] | None = None) -> Cell:
    path = folder / "again.yaml"
    path.write_text(render_cell(cell, starts), encoding="utf-8")
    return load_cell(path)


@pytest.mark.parametrize(
    "file", ["four_robots.yaml", "four_robots_initial.yaml", "load_sharing.yaml", "load_sharing_planar.yaml"]
)
def test_a_written_cell_loads_to_the_same_cell_and_writes_the_same_text(cells: Path, tmp_path: Path, file: str) -> None:
    cell = load_cell(cells / file)

    again = reload(cell, tmp_path)

    assert same(cell, again)
    assert render_cell(again) == render_cell(cell)


def test_a_csv_that_is_named_only_is_written_with_its_defaults(cells: Path, tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x_mm,y_mm,z_mm,i,j,k\n0,0,0,0,0,-1\n10,0,0,0,0,-1\n", encoding="utf-8")
    text = (cells / "four_robots.yaml").read_text(encoding="utf-8")
    circle = "{circle: {center_mm: [0, 0], radius_mm: 100, plane: xy}, project: +z}"
    assert circle in text
    (tmp_path / "cell.yaml").write_text(text.replace(circle, "{csv: path.csv}"), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")

    again = reload(cell, tmp_path)

    assert "csv: {file: path.csv, smooth: true, closed: false}" in render_cell(cell)
    assert same(cell, again)


@pytest.mark.parametrize(
    "change",
    [
        ("plane: xy}", "plane: xy, direction: clockwise, start_at: [3, -1]}"),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "rhombus: {diagonals_mm: [200, 100], plane: xy, direction: clockwise, start_at: -y, angle_deg: 30}",
        ),
        ("tool_axis: normal", "tool_depth_mm: 2.5"),
        ("tool_axis: normal", "standoff_mm: [0.3, 33.3]\n    off_part: [run_in, cut]"),
        ("environment:", "checks: {tool_depth_mm: 0.3, contact_zone_mm: 50}\nenvironment:"),
        ("tool_axis: normal", "axes: [x, y]\n    tool_axis: [0, 0.3, -0.7]\n    tool_turn_deg: 33.3"),
        ("tool_axis: normal", "time_law: {trapezoid: {ramp: 0.3}}\n    corners: {blend_mm: 2.5}\n    feed_mm_s: 33.3"),
        ("tool_axis: normal", "start_s: 0.1\n    free: [spin]\n    tolerance: {position_mm: 0.03}"),
        ("tool_axis: normal", "approach_mm: 33.3\n    retract_mm: 50\n    retract_s: 0.7"),
        ("tool: {xyz_mm: [0, 0, 100]}", "tool: {geometry: {capsule: {radius_mm: 3.3, length_mm: 70}}}"),
        ("tool: {xyz_mm: [0, 0, 100]}", "tool: {bodies: [{box: {size_mm: [1, 2, 3.3]}, at: {rpy_deg: [1, 2, 3]}}]}"),
        (
            "weights: [1, 1, 1, 1, 1, 1]",
            "limits: {A3: {lower_deg: -33.3, acceleration_deg_s2: 350}}\n    weights: [1, 2, 3, 0.1, 1e-3, 7]",
        ),
        ("  floor: {plane: {z_mm: 0}}", '  floor: {plane: {z_mm: -7}}\n  "no": {sphere: {radius_mm: 5}}'),
        (
            "environment:",
            'checks: {exclude: [{bodies: [worker/foot, floor], reason: "it stands: there, #1"}]}\nenvironment:',
        ),
        ("environment:", "solver: {damping: 1e-5, seed: 7}\nenvironment:"),
        ("environment:", "layout: {vary: {worker.base: {x_mm: [0, 1.5]}, holder.start_deg: true}}\nenvironment:"),
        (
            "circle: {radius_mm: 100, plane: xy}",
            "polyline: {points_mm: [[0, 0], [10, 0], [10, 10]], plane: xy, closed: true}",
        ),
    ],
)
def test_every_kind_of_entry_survives_being_written(load: Load, tmp_path: Path, change: tuple[str, str]) -> None:
    cell = load(change)

    again = reload(cell, tmp_path)

    assert same(cell, again)
    assert render_cell(again) == render_cell(cell)


def test_a_usual_ramp_is_written_as_if_it_were_stated(load: Load) -> None:
    usual, stated, with_runs = (
        written_document(load(("tool_axis: normal", f"tool_axis: normal\n    process: {{feed_mm_s: 8{more}}}")))[
            "tasks"
        ]
        for more in ("", ", ramp_s: 0.1", ", run_in_mm: 5, run_out_mm: 5")
    )

    assert yaml_text(usual) == yaml_text(stated)
    assert all("ramp_s" in task["process"] for task in usual.values())
    assert not any("ramp_s" in task["process"] for task in with_runs.values())


def test_planar_work_keeps_its_made_up_tool_axis(load: Load, tmp_path: Path) -> None:
    cell = load(("plane: xy}, project: +z", "plane: yz}"), ("tool_axis: normal", "axes: [y, z]"))

    assert same(cell, reload(cell, tmp_path))


def test_a_found_start_is_written_and_a_given_one_stays(load: Load, tmp_path: Path) -> None:
    cell = load()
    start = as_written(cell.robot("worker").model, np.array([0.1, -0.2, 0.3, 1.0, -1.1, 3.0]))

    again = reload(cell, tmp_path, {"worker": start, "holder": np.zeros(6)})

    np.testing.assert_array_equal(again.robot("worker").start, start)
    np.testing.assert_array_equal(again.robot("holder").start, cell.robot("holder").start)


def test_changes_by_the_command_line_are_written(load: Load, tmp_path: Path) -> None:
    cell = load()
    longer = dataclasses.replace(cell.tasks[0], duration=5.5)
    motion = dataclasses.replace(cell.motion, mode=Mode.PAIRWISE, duration=6.0)

    again = reload(dataclasses.replace(cell, motion=motion, tasks=(longer,)), tmp_path)

    assert again.motion.mode is Mode.PAIRWISE
    assert again.motion.duration == 6.0
    assert again.tasks[0].duration == 5.5


def test_a_task_that_fills_the_clock_fills_it_again(load: Load, tmp_path: Path) -> None:
    cell = load()

    again = reload(dataclasses.replace(cell, motion=dataclasses.replace(cell.motion, duration=6.0)), tmp_path)

    assert (again.motion.duration, again.tasks[0].duration) == (6.0, None)


def test_a_clock_that_follows_the_tasks_follows_them_again(load: Load, tmp_path: Path) -> None:
    cell = load()
    timed = dataclasses.replace(cell.tasks[0], duration=5.5)
    motion = dataclasses.replace(cell.motion, duration=None)

    again = reload(dataclasses.replace(cell, motion=motion, tasks=(timed,)), tmp_path)

    assert (again.motion.duration, again.tasks[0].duration) == (None, 5.5)


def test_a_moved_base_is_written_as_moved(load: Load, tmp_path: Path) -> None:
    cell = load()
    X_WB = cell.robots[0].X_WB.copy()
    X_WB[:3, 3] = [0.1, 0.2, 0.3]
    robots = (dataclasses.replace(cell.robots[0], X_WB=X_WB), *cell.robots[1:])

    again = reload(dataclasses.replace(cell, robots=robots), tmp_path)

    np.testing.assert_array_equal(again.robots[0].X_WB, X_WB)


def test_a_cell_made_in_memory_has_no_words(load: Load) -> None:
    cell = load()
    bare = dataclasses.replace(cell, origin=dataclasses.replace(cell.origin, document={}))

    with pytest.raises(ValueError, match="no words to write"):
        render_cell(bare)


@given(st.lists(st.floats(-7.0, 7.0), min_size=6, max_size=6))
def test_writing_a_posture_twice_changes_nothing_more(values: list[float]) -> None:
    once = as_written(KUKA, np.array(values))

    np.testing.assert_array_equal(as_written(KUKA, once), once)
    # two roundings of a quotient and a product
    np.testing.assert_allclose(once, values, rtol=4e-16, atol=1e-300)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_written_so_that_they_read_back(number: float) -> None:
    read = float(parse_yaml(yaml_text({"a": number}).encode(), file="f").root["a"])

    assert read == number
    assert math.copysign(1.0, read) == math.copysign(1.0, number)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=0xFF, exclude_categories=["Cc", "Cs"]), max_size=20))
def test_texts_are_written_so_that_they_stay_texts(text: str) -> None:
    assert parse_yaml(yaml_text({"a": text}).encode(), file="f").root["a"] == text


@pytest.mark.parametrize("text", ["no", "010", "1:30", "null", "", "1e5", "-", "a: b", "# x", "true", "~", '"', "\\"])
def test_words_with_a_meaning_of_their_own_are_quoted(text: str) -> None:
    assert parse_yaml(yaml_text({"a": [text], "b": {text or "x": text}}).encode(), file="f").root["a"] == (text,)


def test_secondary_goals_are_written_with_their_defaults(cells: Path, tmp_path: Path) -> None:
    text = (cells / "four_robots.yaml").read_text(encoding="utf-8")
    goals = "gain_per_s: 650, secondary: {manipulability: {}, joint_limits: {}, obstacles: {}, posture: {}}}"
    assert "gain_per_s: 650}" in text
    (tmp_path / "cell.yaml").write_text(text.replace("gain_per_s: 650}", goals), encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")

    again = reload(cell, tmp_path)

    assert [goal.gain for goal in cell.solver.secondary.goals.values()] == [1.0, 100.0, 0.1, 1.0]
    assert "obstacles: {gain: 0.1, within_mm: 200}" in render_cell(cell)
    assert same(cell.solver, again.solver)
