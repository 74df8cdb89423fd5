"""Values set at addresses of a cell file: as if they stood in the file, with located findings."""

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellplan import Cell, load_cell
from cellplan.errors import InputError
from cellplan.files.cell.write import render_cell

Write = Callable[..., Cell]
CELL = """\
cellplan: 1
name: pen
robots:
  arm:
    model: planar_3r
    base: {xyz_mm: [10, 0, 0]}
    start_deg: [0, 30, 30]
part:
  geometry: {box: {size_mm: [300, 300, 10]}}
  at: {xyz_mm: [700, 200, -100]}
tasks:
  circle:
    robot: arm
    path: {circle: {radius_mm: 100, plane: xy}, project: +z}
    tool_axis: normal
    axes: [x, y]
motion: {duration_s: 2}
solver: {integrator: euler}
"""


class Word(StrEnum):
    DAMPED = "damped_least_squares"


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Cell:
    monkeypatch.chdir(tmp_path)
    Path("c").write_text(CELL, encoding="utf-8")
    return load_cell("c")


def refusal(cell: Cell, values: dict[str, Any]) -> list[str]:
    with pytest.raises(InputError) as caught:
        cell.with_values(values)
    return str(caught.value).splitlines()


def from_text(old: str, new: str, folder: Path) -> Cell:
    assert old in CELL
    (folder / "other").write_text(CELL.replace(old, new), encoding="utf-8")
    return load_cell(folder / "other")


@pytest.mark.parametrize(
    ("values", "old", "new"),
    [
        ({"motion.duration_s": 2.5}, "duration_s: 2}", "duration_s: 2.5}"),
        ({"robots.arm.base.x_mm": 900}, "xyz_mm: [10, 0, 0]", "xyz_mm: [900, 0, 0]"),
        ({"robots.arm.base.xyz_mm.1": -3.5}, "xyz_mm: [10, 0, 0]", "xyz_mm: [10, -3.5, 0]"),
        ({"robots.arm.base.xyz_mm[2]": 7}, "xyz_mm: [10, 0, 0]", "xyz_mm: [10, 0, 7]"),
        ({"robots.arm.base.yaw_deg": 30}, "xyz_mm: [10, 0, 0]}", "xyz_mm: [10, 0, 0], rpy_deg: [0, 0, 30]}"),
        ({"robots.arm.tool.z_mm": 50}, "    start_deg", "    tool: {xyz_mm: [0, 0, 50]}\n    start_deg"),
        ({"solver.method": Word.DAMPED}, "{integrator: euler}", "{integrator: euler, method: damped_least_squares}"),
        ({"solver.integrator": None}, "{integrator: euler}", "{}"),
        ({"checks.clearance_mm": np.float64(7)}, "solver:", "checks: {clearance_mm: 7}\nsolver:"),
        ({"robots.arm.start_deg": np.array([0.0, 20.0, 40.0])}, "[0, 30, 30]", "[0, 20, 40]"),
        ({"tasks.circle.axes": ("x", "y", "rz")}, "[x, y]", "[x, y, rz]"),
        (
            {"environment.box": {"box": {"size_mm": [5, 5, 5]}}},
            "solver:",
            "environment: {box: {box: {size_mm: [5, 5, 5]}}}\nsolver:",
        ),
        ({"robots.arm.limits.A.upper_deg": 90}, "    start_deg", "    limits: {A: {upper_deg: 90}}\n    start_deg"),
        ({"motion.duration_s": 9, "motion.step_s": 0.002}, "duration_s: 2}", "duration_s: 9, step_s: 0.002}"),
    ],
)
def test_a_changed_cell_is_the_cell_of_the_edited_file(
    cell: Cell, tmp_path: Path, values: dict[str, Any], old: str, new: str
) -> None:
    assert render_cell(cell.with_values(values)) == render_cell(from_text(old, new, tmp_path))


def test_the_cell_itself_is_not_changed(cell: Cell) -> None:
    before = render_cell(cell)

    cell.with_values({"motion.duration_s": 5, "robots.arm.base.x_mm": 1})

    assert (render_cell(cell), dict(cell.origin.changes)) == (before, {})


def test_changes_add_up_and_the_last_value_of_an_address_counts(cell: Cell) -> None:
    once = cell.with_values({"motion.duration_s": 3, "checks.clearance_mm": 6})

    again = once.with_values({"motion.duration_s": 4})

    assert (again.motion.duration, again.checks.clearance_mm) == (4.0, 6.0)
    assert dict(again.origin.changes) == {"checks.clearance_mm": 6, "motion.duration_s": 4}
    assert once.motion.duration == 3.0


def test_the_digest_of_the_file_stays_that_of_the_file(cell: Cell) -> None:
    assert cell.with_values({"motion.duration_s": 3}).inputs == cell.inputs


@pytest.mark.parametrize(
    ("values", "findings"),
    [
        (
            {"motion.duration_s": -1},
            ["c with motion.duration_s = -1: motion.duration_s: expected a positive number of seconds, got -1"],
        ),
        (
            {"motion.duraton_s": 1},
            [
                "c with motion.duraton_s = 1: motion.duraton_s: unknown key, did you mean 'duration_s'?; allowed: "
                "mode, duration_s, step_s, grid_ms, timing, jerk_build_up_s, greatest_feeds, controller_cycle_ms, "
                "time_law, corners, cyclic, locked_joints"
            ],
        ),
        (
            {"motoin.duration_s": 1},
            [
                "c with motoin.duration_s = 1: motoin: unknown key, did you mean 'motion'?; allowed: cellplan, name, "
                "robots, controllers, part, tasks, environment, motion, program, assign, acceleration, solver, checks, "
                "layout"
            ],
        ),
        (
            {"robots.amr.base.x_mm": 3},
            ["c with robots.amr.base.x_mm = 3: expected one of arm, got 'amr', did you mean 'arm'?"],
        ),
        (
            {"robots.arm.base.xyz_mm[3]": 3},
            ["c with robots.arm.base.xyz_mm[3] = 3: expected an index from 0 to 2, got '3'"],
        ),
        (
            {"robots.arm.base.xyz_mm.x": 3},
            ["c with robots.arm.base.xyz_mm.x = 3: expected an index from 0 to 2, got 'x'"],
        ),
        (
            {"part.held_by.0.depth_mm": 3},
            ["c with part.held_by.0.depth_mm = 3: expected a list with entries, got '0'"],
        ),
        (
            {"robots.arm.base.xyz_mm[0]": None},
            [
                "c with robots.arm.base.xyz_mm[0] left out: expected a value, as an element of a list cannot be left "
                "out, got nothing"
            ],
        ),
        (
            {"motion.duration_s.s": 3},
            [
                "c with motion.duration_s.s = 3: expected an address such as motion.duration_s, got 's' "
                "below the value 2"
            ],
        ),
        (
            {"motion..step_s": 3},
            ["c with motion..step_s = 3: expected an address such as motion.duration_s, got 'motion..step_s'"],
        ),
        ({"motion.duration_s": float("inf")}, ["c with motion.duration_s = inf: expected finite numbers, got inf"]),
        (
            {"name": b"x"},
            ["c with name = b'x': expected a number, a text, true, false, a list or a mapping, got \"b'x'\""],
        ),
        (
            {"name": "a\tb"},
            [
                "c with name = \"a\\x09b\": name: expected a name of 1 to 40 letters, digits, '_' or '-' that does not "
                "start with '-', got 'a\\tb'"
            ],
        ),
        ({"name": "a\x00b"}, ['c with name = "a\\x00b": expected printable text, got control character U+0000']),
        (
            {"solver.gain_per_s": 1999, "motion.step_s": 0.01},
            [
                "c with solver.gain_per_s = 1999: solver.gain_per_s: expected a gain below 200 (2 / step_s), got "
                "1999; the error feedback would be unstable"
            ],
        ),
        (
            {"part": {"geometry": {"box": {"size_mm": [300, 300, 10]}}}},
            [
                "c with part = {geometry: {box: {size_mm: [300, 300, 10]}}}: part.at: missing, expected the pose of "
                "the part in the world, or a robot under held_by"
            ],
        ),
        (
            {"motion.mode": "part_at_rest", "tasks.circle.relative_to": "world"},
            [
                "c:14 with motion.mode = part_at_rest, tasks.circle.relative_to = world: tasks.circle.path.project: "
                "unexpected key, a path in the world is not projected onto the part"
            ],
        ),
    ],
)
def test_a_bad_change_is_refused_as_in_the_file(cell: Cell, values: dict[str, Any], findings: list[str]) -> None:
    assert refusal(cell, values) == findings


def test_a_consequence_elsewhere_is_found_at_its_line_with_the_change(cell: Cell) -> None:
    longer = cell.with_values({"tasks.circle.duration_s": 2})

    assert refusal(longer, {"motion.duration_s": 1}) == [
        "c with tasks.circle.duration_s = 2: tasks.circle.duration_s: expected an end within the clock "
        "(motion.duration_s = 1), got start_s + duration_s = 2"
    ]
    assert refusal(cell, {"tasks.circle.axes": ["x", "y", "z", "rx"], "tasks.circle.path.project": None}) == [
        "c:15 with tasks.circle.axes = [x, y, z, rx], tasks.circle.path.project left out: tasks.circle.tool_axis: "
        "tool_axis: normal requires a path that is projected onto the part: add project: +z (or another side), or give "
        "tool_axis a direction"
    ]


def test_later_findings_name_the_change(cell: Cell) -> None:
    changed = cell.with_values({"motion.duration_s": 3, "robots.arm.base.x_mm": 4})

    assert changed.origin.at("motion.duration_s") == "c with motion.duration_s = 3: motion.duration_s"
    assert changed.origin.at("robots.arm.base") == "c:6 with robots.arm.base.x_mm = 4: robots.arm.base"
    assert changed.origin.at("tasks.circle") == "c:12: tasks.circle"


def test_a_cell_built_in_python_has_no_values_to_set(cell: Cell) -> None:
    bare = replace(cell, origin=replace(cell.origin, source=None))

    assert refusal(bare, {"motion.duration_s": 3}) == [
        "cell 'pen': expected a cell that was read from a file, got one built in Python"
    ]


def test_a_cell_changed_in_python_is_refused_rather_than_undone(cell: Cell) -> None:
    other = replace(cell, motion=replace(cell.motion, duration=7.0))

    assert refusal(other, {"solver.seed": 3}) == [
        "cell 'pen': expected the cell as it was read, got one whose motion was changed in Python; call "
        "with_values first"
    ]
