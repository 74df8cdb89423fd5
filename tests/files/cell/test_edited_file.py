"""A cell file with changed values in place: the same cell is read back, and all else stays as it was."""

from pathlib import Path

import pytest

from cellplan.errors import InputError
from cellplan.files.cell.edited_file import edited_file
from cellplan.files.cell.load import load_cell

CHANGES: list[tuple[str, dict[str, object]]] = [
    ("two_robots.yaml", {"robots.pen.base.x_mm": 1900.125, "robots.pen.base.yaw_deg": 170}),
    ("two_robots.yaml", {"part.held_by[0].at.yaw_deg": 12.5}),  # of a pose that states no angles
    ("two_robots.yaml", {"motion.duration_s": 5, "robots.holder.weights": [2, 2, 2, 1, 1, 1]}),
    ("two_robots.yaml", {"robots.holder.weights": [2, 2, 2, 1, 1, 1], "robots.holder.weights[1]": 3}),
    ("two_robots.yaml", {"checks.clearance_mm": None}),
    ("four_robots.yaml", {"robots.kuka.base.roll_deg": 0.25, "robots.abb.tool.xyz_mm[2]": 301}),
    ("three_tasks_each.yaml", {"motion.step_s": 0.004}),
]


def _changed(path: Path, values: dict[str, object]) -> tuple[bytes, bytes]:
    """The content of a file before and after changes."""
    before = path.read_bytes()
    return before, edited_file(load_cell(path).with_values(values), before)


@pytest.mark.parametrize(("name", "values"), CHANGES)
def test_the_cell_that_is_read_back_is_the_changed_one(
    cells: Path, tmp_path: Path, name: str, values: dict[str, object]
) -> None:
    changed = load_cell(cells / name).with_values(values)
    path = tmp_path / name

    path.write_bytes(edited_file(changed, (cells / name).read_bytes()))
    read = load_cell(path)

    assert read.origin.document == changed.origin.document
    assert not read.origin.changes


@pytest.mark.parametrize(("name", "values"), CHANGES)
def test_comments_and_lines_without_a_change_stay(cells: Path, name: str, values: dict[str, object]) -> None:
    before, after = _changed(cells / name, values)
    old, new = (data.decode().splitlines() for data in (before, after))

    others = [line for line in new if line not in old]
    assert len(others) <= len(values)
    comments = [line[line.index(" #") :] for line in old if " #" in line]
    assert all(any(comment in line for line in new) for comment in comments)


def test_nothing_is_rewritten_without_a_change(cells: Path) -> None:
    before, after = _changed(cells / "two_robots.yaml", {"robots.pen.base.x_mm": 2000.0})

    assert after == before


def test_line_ends_and_the_mark_of_some_editors_stay(cells: Path, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    text = (cells / "two_robots.yaml").read_text(encoding="utf-8")
    path.write_bytes("\ufeff".encode() + text.replace("\n", "\r\n").encode())

    before, after = _changed(path, {"robots.pen.base.x_mm": 1950})

    assert after == before.replace(b"[2000, 0, 0]", b"[1950, 0, 0]")


def test_numbers_of_a_list_on_lines_of_their_own_keep_their_comments(cells: Path, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    text = (cells / "two_robots.yaml").read_text(encoding="utf-8")
    listed = "base:\n      xyz_mm:\n        - 2000  # x\n        - 0  # y\n        - 0\n      rpy_deg: [0, 0, 180]"
    path.write_text(text.replace("base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}", listed), encoding="utf-8")

    before, after = _changed(path, {"robots.pen.base.y_mm": 25})

    assert after == before.replace(b"- 0  # y", b"- 25  # y")


def test_a_value_of_a_part_of_a_task_has_no_place_in_the_file(cells: Path, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    text = (cells / "two_robots.yaml").read_text(encoding="utf-8")
    path.write_text(
        text.replace("tasks:", "program: {}\ntasks:").replace("    tool_axis", "    passes: [{}, {}]\n    tool_axis"),
        encoding="utf-8",
    )
    cell = load_cell(path).with_values({"tasks.ring_2.tolerance.position_mm": 0.5})

    with pytest.raises(InputError, match=r"changes of tasks\.ring_2\.tolerance\.position_mm; write them by hand"):
        edited_file(cell, path.read_bytes())
