"""Rules of a program for its tasks: every finding about them, word for word."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cellplan.files.cell.load import load_cell, load_open_cell
from cellplan.model.cell.cell import Cell

Refuse = Callable[..., list[str]]

PATH = "path: {circle: {radius_mm: 50, plane: xy}, project: +z}"
OPEN = Path(__file__).resolve().parents[4] / "examples" / "open_tasks" / "open_frame.yaml"


def changes(program: str, *, order: str = "", second: str = "", third: str = "") -> list[tuple[str, str]]:
    """The small cell with three tasks, the third one of another robot, in a program."""
    tasks = f"  second: {{robot: worker, {second}{PATH}}}\n  third: {{robot: other, {third}{PATH}}}\n"
    other = "  other: {model: abb_irb1600, base: {xyz_mm: [0, 2000, 0]}, tool: {xyz_mm: [0, 0, 100]}}\n"
    return [
        ("motion: {duration_s: 4}", f"{tasks}motion: {{duration_s: 4}}"),
        ("    weights: [1, 1, 1, 1, 1, 1]\n", (f"    order: {order}\n" if order else "") + other),
        ("environment:", f"program: {program}\nenvironment:"),
    ]


@pytest.mark.parametrize(
    ("changed", "messages"),
    [
        (
            {"program": "{same_robot: [ring, secnd]}"},
            [
                "program.same_robot[1]: expected a task of this cell (ring, second, third), got 'secnd', did you mean "
                "'second'?"
            ],
        ),
        (
            {"program": "{together: [[ring, third], [third, second]]}"},
            ["program.together[1][0]: expected each task once, got 'third' twice"],
        ),
        (
            {"program": "{together: [ring, [second, third]]}"},
            ["program.together: expected either tasks or lists of tasks, got both"],
        ),
        ({"program": "{same_robot: [ring]}"}, ["program.same_robot: expected at least two tasks, got one"]),
        (
            {"program": "{same_robot: [ring, third]}"},
            ["program.same_robot: expected tasks that one robot may do, got 'ring' worker; 'third' other"],
        ),
        (
            {"program": "{together: [[ring, second]]}"},
            ["program.together[0]: expected tasks of different robots, got 'ring' worker; 'second' worker"],
        ),
        (
            {"program": "{together: [ring, third]}", "third": "approach_s: 0.7, "},
            [
                "program.together: expected paths that begin equally long after their block, got 'ring' 0.5 s, 'third' "
                "0.7 s: give one approach_s to all"
            ],
        ),
        (
            {"program": "{order: {alternate: [[ring, second], [third]]}}", "third": "after: second, "},
            [
                "program.order.alternate: expected rules that some order keeps, with after and the orders of the "
                "robots, got 'second' before 'third' before 'second'"
            ],
        ),
        (
            {"program": "{tacks_first: true}", "second": "tack: true, ", "order": "[ring, second]"},
            [
                "program.tacks_first: expected rules that some order keeps, with after and the orders of the robots, "
                "got 'ring' before 'second' before 'ring'"
            ],
        ),
        (
            {"program": "{together: [ring, third]}", "third": "after: second, ", "second": "after: ring, "},
            [
                "program.together: expected rules that some order keeps, with after and the orders of the robots, got "
                "'ring with third' before 'second' before 'ring with third'"
            ],
        ),
        (
            {"program": "{apart_mm: 30}"},
            ["program.apart_mm: unexpected key without rest_s, the rest between tasks that are nearer"],
        ),
        ({"program": "{tacks_first: true}"}, ["program.tacks_first: expected tasks with tack: true, got none"]),
        (
            {"program": "{order: {alternate: [[ring]]}}"},
            ["program.order.alternate: expected at least 2 entries, got 1"],
        ),
    ],
)
def test_a_rule_that_no_program_keeps_is_named(refuse: Refuse, changed: dict[str, str], messages: list[str]) -> None:
    assert [line.split(": ", 1)[1] for line in refuse(*changes(**changed))] == messages


def test_rules_that_a_program_can_keep_are_read(load: Callable[..., Cell]) -> None:
    program = "{same_robot: [ring, second], together: [[second, third]], tacks_first: true}"

    cell = load(*changes(program, second="tack: true, ", third="tack: true, "))

    assert cell.program.same_robot == ("ring", "second")
    assert [task.name for task in cell.tasks if task.is_tack] == ["second", "third"]
    assert list(cell.program.in_order(["second", "third"], [task.name for task in cell.tasks])) == [
        ("second", "ring", "tacks_first"),
        ("third", "ring", "tacks_first"),
    ]


def test_open_tasks_may_be_given_to_robots_that_keep_the_rules(tmp_path: Path) -> None:
    """Also when a value of the cell is changed, whose open tasks have their first robots meanwhile."""
    text = OPEN.read_text().replace("program: {}", "program: {same_robot: [top_1, top_2], together: [top_3, edge_1]}")
    text = text.replace("  top_2:\n    robot: any", "  top_2:\n    robot: east")
    (tmp_path / "cell.yaml").write_text(text)

    cell, robots = load_open_cell(tmp_path / "cell.yaml")

    assert robots["top_1"] == ("west", "east")
    assert cell.with_values({"checks.clearance_mm": 4}).program.same_robot == ("top_1", "top_2")
    (tmp_path / "cell.yaml").write_text(text.replace("  top_1:\n    robot: any", "  top_1:\n    robot: [west]"))
    with pytest.raises(Exception, match=r"program\.same_robot: expected tasks that one robot may do"):
        load_open_cell(tmp_path / "cell.yaml")
    with pytest.raises(Exception, match="cellplan assign chooses who does an open task"):
        load_cell(tmp_path / "cell.yaml")
