"""Open tasks: who may do them, and what reads a cell that has them."""

from pathlib import Path

import pytest
import yaml

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell, load_open_cell
from cellplan.files.cell.open_tasks import open_tasks

OPEN = Path(__file__).resolve().parents[3] / "examples" / "open_tasks" / "open_frame.yaml"


def test_any_stands_for_all_robots_that_do_not_hold_the_part() -> None:
    root = {
        "robots": {"table": {}, "west": {}, "east": {}},
        "part": {"held_by": ({"robot": "table"},)},
        "tasks": {"a": {"robot": "any"}, "b": {"robot": ("east", "west")}, "c": {"robot": "west"}},
    }

    assert open_tasks(root) == {"a": ("west", "east"), "b": ("east", "west")}


def test_tasks_of_a_robot_that_is_not_available_are_open() -> None:
    root = {
        "robots": {"west": {"available": False}, "east": {}, "north": {}},
        "tasks": {
            "a": {"robot": "west"},
            "b": {"robot": "any"},
            "c": {"robot": ("west", "north")},
            "d": {"robot": "east"},
        },
    }

    assert open_tasks(root) == {"a": ("east", "north"), "b": ("east", "north"), "c": ("north",)}


def test_a_robot_may_be_called_any() -> None:
    assert open_tasks({"robots": {"any": {}}, "tasks": {"a": {"robot": "any"}}}) == {}


@pytest.mark.parametrize("root", [{}, {"tasks": 3, "robots": {}}, {"tasks": {"a": None}, "robots": {"b": {}}}])
def test_what_is_no_cell_has_no_open_tasks(root: dict[str, object]) -> None:
    assert open_tasks(root) == {}


def test_a_cell_with_open_tasks_is_read_for_an_assignment_alone() -> None:
    cell, robots = load_open_cell(OPEN)

    assert set(robots.values()) == {("west", "east")}
    assert set(robots) == {task.name for task in cell.tasks}
    assert {task.robot for task in cell.tasks} == {"west"}
    with pytest.raises(InputError) as refused:
        load_cell(OPEN)
    assert str(refused.value).endswith(
        "tasks.top_1.robot: expected the name of a robot, got 'any', as in 7 more tasks: cellplan assign chooses who "
        "does an open task"
    )
    assert len(str(refused.value).splitlines()) == 1


def test_a_list_with_an_unknown_robot_is_refused(tmp_path: Path) -> None:
    text = OPEN.read_text().replace("robot: any", "robot: [north, east]", 1)
    (tmp_path / "cell.yaml").write_text(text.replace("step_s: 0.02", "step_s: -1"))

    with pytest.raises(InputError, match=r"motion\.step_s: expected a positive number") as refused:
        load_open_cell(tmp_path / "cell.yaml")
    assert len(str(refused.value).splitlines()) == 2  # all findings at once
    with pytest.raises(InputError, match=r"tasks\.top_1\.robot\[0\]: expected one of table, west, east, got 'north'"):
        load_open_cell(tmp_path / "cell.yaml")


def test_a_list_with_a_robot_twice_is_refused(tmp_path: Path) -> None:
    text = OPEN.read_text().replace("robot: any", "robot: [west, east, west]", 1)
    (tmp_path / "cell.yaml").write_text(text)

    with pytest.raises(InputError, match=r"tasks\.top_1\.robot\[2\]: expected each robot once, got 'west' twice"):
        load_open_cell(tmp_path / "cell.yaml")


def test_tasks_without_an_available_robot_are_refused_in_one_line(tmp_path: Path) -> None:
    text = OPEN.read_text().replace("home_deg:", "available: false\n    home_deg:")
    (tmp_path / "cell.yaml").write_text(text)

    with pytest.raises(InputError) as refused:
        load_open_cell(tmp_path / "cell.yaml")
    assert str(refused.value).endswith(
        "tasks.top_1.robot: expected an available robot that does not hold the part, got none, as in 7 more tasks"
    )
    assert len(str(refused.value).splitlines()) == 1


@pytest.mark.parametrize("program", ["{}", "{together: [top_3, edge_3]}"])
def test_a_circle_of_tasks_after_one_another_is_refused_when_the_file_is_read(tmp_path: Path, program: str) -> None:
    """What begins together beside the circle is no part of it."""
    text = OPEN.read_text().replace("program: {}", f"program: {program}")
    for task, before in (("top_1", "top_2"), ("top_2", "edge_1"), ("edge_1", "top_1")):
        text = text.replace(f"  {task}:\n", f"  {task}:\n    after: [{before}]\n", 1)
    (tmp_path / "cell.yaml").write_text(text)

    with pytest.raises(InputError, match=r"after: expected an order that can be worked off, .* 'edge_1'") as refused:
        load_open_cell(tmp_path / "cell.yaml")
    assert len(str(refused.value).splitlines()) == 1


ODD = ("5", "~", "{}", "[[1]]", "[{robot: {}}]")


@pytest.mark.parametrize("value", ODD)
@pytest.mark.parametrize("place", ["robots", "part", "part.held_by", "tasks", "tasks.top_1", "tasks.top_1.robot"])
def test_other_kinds_of_values_are_refused_with_their_lines(place: str, value: str, tmp_path: Path) -> None:
    document = yaml.safe_load(OPEN.read_text())
    *path, key = place.split(".")
    section = document
    for step in path:
        section = section[step]
    section[key] = yaml.safe_load(value)
    file = tmp_path / "cell.yaml"
    file.write_text(yaml.safe_dump(document, sort_keys=False))

    with pytest.raises(InputError) as refused:
        load_open_cell(file)
    assert all(line.startswith(f"{file}:") for line in str(refused.value).splitlines())
