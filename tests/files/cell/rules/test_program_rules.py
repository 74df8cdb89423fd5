"""Programs from home to home: every finding about their keys, word for word, and cells that are read and written."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.settings.program import MarkEntry
from cellplan.model.task.task import StraightMove
from cellplan.planning.sequence.arrangement import with_only_task

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]

PATH = "path: {circle: {radius_mm: 50, plane: xy}, project: +z}"
CURE = "add program: {} for a program from home to home"


def changes(*, program: str = "{}", order: str = "", second: str = "", motion: str = "") -> list[tuple[str, str]]:
    """The small cell with a second task of its worker, in a program; all keys on lines of their own."""
    keys = "".join(f"    {key}\n" for key in second.splitlines())
    return [
        (
            "motion: {duration_s: 4}",
            f"  second:\n    robot: worker\n{keys}    {PATH}\nmotion: {{duration_s: 4{motion}}}",
        ),
        ("    weights: [1, 1, 1, 1, 1, 1]\n", f"    order: {order}\n" if order else ""),
        ("environment:", f"program: {program}\nenvironment:" if program else "environment:"),
    ]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (
            {"program": "", "order": "[ring, second]"},
            f"c:11: robots.worker.order: unexpected key without program: {CURE}\n"
            "c:22: tasks.second.robot: expected a robot without another task, got 'worker', which does 'ring': add "
            "program: {} for a sequence of tasks",
        ),
        (
            {"program": "", "motion": ", mode: semi_coordinated"},
            "c:21: tasks.second.robot: expected a robot without another task, got 'worker', which does 'ring': add "
            "program: {} for a sequence of tasks\n"
            "c:23: motion.mode: expected simultaneous, pairwise or part_at_rest without program, got "
            f"'semi_coordinated': {CURE}",
        ),
        (
            {"order": "[ring, secnd]"},
            "c:11: robots.worker.order[1]: expected a task of 'worker' or a mark (ring, second), got 'secnd', did you "
            "mean 'second'?\n"
            "c:11: robots.worker.order: expected every task of 'worker', got none of the name 'second': add it",
        ),
        (
            {"order": "[ring, second, ring]"},
            "c:11: robots.worker.order[2]: expected each name once, got 'ring' twice",
        ),
        (
            {"order": "[ring, m1, second]", "program": "{marks: [m1, {name: ring}, m1, m2]}"},
            "c:25: program.marks[1].name: expected a name that no task has, got 'ring', a task: rename the mark\n"
            "c:25: program.marks[2]: expected each mark once, got 'm1' twice\n"
            "c:25: program.marks[3]: expected a mark in the order of some robot, got 'm2' in none: add it to "
            "robots.ROBOT.order",
        ),
        (
            {"program": "{marks: [7]}"},
            "c:24: program.marks[0]: expected a name or {name: m1, dwell_s: 0.5}, got 7",
        ),
        (
            {"order": "[ring, second, m1]", "second": "after: [second, m1, rnig]", "program": "{marks: [m1]}"},
            "c:23: tasks.second.after[0]: expected another task than 'second' itself, got 'second'\n"
            "c:23: tasks.second.after[1]: expected a task, got the mark 'm1': put marks into robots.worker.order\n"
            "c:23: tasks.second.after[2]: expected a task of this cell (ring, second), got 'rnig', did you mean "
            "'ring'?",
        ),
        (
            {"second": "start_deg: [0, 0, 0, 0, 0]\nholder_deg: [0, -93, 300, 0, -15, 0]"},
            "c:22: tasks.second.start_deg: expected 6 angles, one per joint (A3, B3, C3, D3, E3, F3), got 5\n"
            "c:23: tasks.second.holder_deg: expected 'C2' within its limits -130 .. 154 deg, got 300",
        ),
        (
            {"second": "start: {A3_deg: 0}\nholder: {rail_mm: 0}"},
            "c:22: tasks.second.start: missing, expected one value per joint: add B3_deg, C3_deg, D3_deg, E3_deg, "
            "F3_deg\n"
            "c:23: tasks.second.holder.rail_mm: unknown key; allowed: A2_deg, B2_deg, C2_deg, D2_deg, E2_deg, F2_deg\n"
            "c:23: tasks.second.holder: missing, expected one value per joint: add A2_deg, B2_deg, C2_deg, D2_deg, "
            "E2_deg, F2_deg",
        ),
        (
            {"second": "via: {after: [service]}"},
            "c:22: tasks.second.via.after[0]: expected a robot with a service, got 'worker' without: add it",
        ),
        (
            {"order": "[ring, second]\n    service: {at: [0, 0, 0, 0, 0, 999], takes_s: 8, every: {seams: 0}}"},
            "c:12: robots.worker.service.every.seams: expected a positive number, got 0",
        ),
        (
            {"order": "[ring, second]\n    service: {at: [0, 0, 0, 0, 0, 999], takes_s: 8, every: {seams: 2}}"},
            "c:12: robots.worker.service.at: expected 'F3' within its limits -400 .. 400 deg, got 999",
        ),
        (
            {"second": "via: {before: [[0, 0], [400, 0, 0, 0, 0, 0], {rail_mm: 0}, park], after: home}"},
            "c:22: tasks.second.via.before[3]: expected home, service, a list of joint angles or a mapping with one "
            "key per joint (a1_deg, rail_mm), got 'park'\n"
            "c:22: tasks.second.via.after: expected a list of entries, got 'home'",
        ),
        (
            {"second": "via: {before: [[0, 0], [400, 0, 0, 0, 0, 0], {rail_mm: 0}, home]}"},
            "c:22: tasks.second.via.before[0]: expected 6 angles, one per joint (A3, B3, C3, D3, E3, F3), got 2\n"
            "c:22: tasks.second.via.before[1]: expected 'A3' within its limits -180 .. 180 deg, got 400\n"
            "c:22: tasks.second.via.before[2].rail_mm: unknown key; allowed: A3_deg, B3_deg, C3_deg, D3_deg, E3_deg, "
            "F3_deg\n"
            "c:22: tasks.second.via.before[2]: missing, expected one value per joint: add A3_deg, B3_deg, C3_deg, "
            "D3_deg, E3_deg, F3_deg",
        ),
        (
            {"second": "start_deg: auto\nstart: auto"},
            "c:23: tasks.second.start: expected either start_deg or start, got both",
        ),
        (
            {"second": "start_s: 0.2"},
            "c:22: tasks.second.start_s: expected at least approach_s = 0.5 in a program, got 0.2: remove it, or add "
            "approach_mm: 0",
        ),
        (
            {"second": "settle_s: 0.2"},
            "c:22: tasks.second.settle_s: expected no time to settle in a program, in which the tool comes to its path "
            "by an approach: remove it, or add approach_mm: 0",
        ),
        (
            {"motion": ", locked_joints: [{robot: worker, joint: A3, from_s: 1}]"},
            "c:23: motion.locked_joints[0].from_s: expected 0 in a cell with program, got 1: remove it",
        ),
        (
            {"program": "{cycles: 2, attach: {at: {}, rests_on: flor}}"},
            "c:24: program.attach.rests_on: expected a body of the environment (floor), got 'flor', did you mean "
            "'floor'?\n"
            "c:24: program.attach: expected attach and detach, or none of them, in a program of 2 cycles, got attach "
            "only: add detach, or set cycles: 1",
        ),
        (
            {"program": "{attach: {at: {}, rests_on: [floor, flor, floor]}}"},
            "c:24: program.attach.rests_on[1]: expected a body of the environment (floor), got 'flor', did you mean "
            "'floor'?\n"
            "c:24: program.attach.rests_on[2]: expected each body once, got 'floor' twice",
        ),
        (
            {"program": "{attach: {at: {}, rests_on: 7, rest_gap_mm: 11, clamped: maybe, contact_mm: -1}}"},
            "c:24: program.attach.rests_on: expected the name of a body or a list of them, got 7\n"
            "c:24: program.attach.rest_gap_mm: expected a number of millimetres of at most 10, got 11\n"
            "c:24: program.attach.clamped: expected true or false, got 'maybe'\n"
            "c:24: program.attach.contact_mm: expected a number of millimetres of at least 0, got -1",
        ),
        ({"program": "{detach: {}}"}, "c:24: program.detach.at: missing, expected pose of the part frame in the world"),
        (
            {"program": "[]"},
            "c:24: program: expected a mapping with keys out of cycles, marks, attach, detach, transfer, same_robot, "
            "together, order, tacks_first, rest_s, apart_mm, "
            "arcs_apart_mm, got a list of 0",
        ),
    ],
)
def test_a_mistake_in_a_program_is_named_with_its_line_key_and_cure(
    refuse: Refuse, changed: dict[str, str], message: str
) -> None:
    assert refuse(*changes(**changed)) == message.splitlines()


def test_a_part_that_nobody_holds_is_neither_gripped_nor_moved(refuse: Refuse) -> None:
    held = "  held_by:\n    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}\n"
    program = "{attach: {at: {}}}"

    assert refuse(
        (held, "  at: {}\n"),
        *changes(program=program, second="holder_deg: [0, 0, 0, 0, 0, 0]", motion=", mode: semi_coordinated"),
    ) == [
        "c:21: tasks.second.holder_deg: unexpected key, no robot holds the part (part.held_by): remove it",
        "c:23: motion.mode: expected a part that a robot holds, got one that is fixed in the world: choose "
        "simultaneous",
        "c:24: program.attach: unexpected key, no robot holds the part (part.held_by): remove it, or let a robot hold "
        "the part",
    ]


def test_the_holder_moves_during_tasks_only_where_it_rests_otherwise(refuse: Refuse, load: Load) -> None:
    key = "holder_moves: true"

    assert refuse(*changes(second=key)) == [
        "c:22: tasks.second.holder_moves: expected the mode semi_coordinated, in which the part rests otherwise, got "
        "simultaneous"
    ]
    cell = load(*changes(second=key, motion=", mode: semi_coordinated"))
    assert [task.holder_moves for task in cell.tasks] == [False, True]
    assert "holder_moves: true" in render_cell(cell)


def test_a_task_of_the_holder_begins_at_its_own_start(refuse: Refuse) -> None:
    turns = "holder_deg: [0, 0, 0, 0, 0, 0]\nrelative_to: world\naxes: [x]\ntool_axis: -z"
    program = changes(second=turns)
    program[0] = (program[0][0], program[0][1].replace("robot: worker", "robot: holder").replace(", project: +z", ""))

    assert refuse(*program) == [
        "c:22: tasks.second.holder_deg: unexpected key, 'holder' itself holds the part: give start_deg"
    ]


def test_what_holds_a_part_where_it_lies_survives_being_written(load: Load, tmp_path: Path) -> None:
    place = "{at: {}, rests_on: [floor], rest_gap_mm: 3, clamped: true, contact_mm: 30}"
    cell = load(*changes(program=f"{{attach: {place}}}"))
    (tmp_path / "again").write_text(render_cell(cell), encoding="utf-8")

    for one in (cell, load_cell(tmp_path / "again")):
        assert one.program is not None
        lying = one.program.attach
        assert lying is not None
        assert (lying.supports, lying.clamped, lying.rest_gap_mm, lying.contact_mm) == (("floor",), True, 3.0, 30.0)


def test_an_empty_program_makes_a_sequence_with_room_round_the_part(load: Load) -> None:
    cell = load(*changes(second="after: ring\nretract_mm: 0"))

    assert cell.program is not None
    assert (cell.program.cycles, cell.program.marks, cell.program.attach) == (1, (), None)
    assert [robot.order for robot in cell.robots] == [(), ("ring", "second")]
    assert [(task.after, task.start) for task in cell.tasks] == [((), 0.5), (("ring",), 0.5)]
    assert [task.approach for task in cell.tasks] == [StraightMove(distance=0.03, duration=0.5)] * 2
    assert [task.retract for task in cell.tasks] == [StraightMove(distance=0.03, duration=0.5), None]


def test_a_task_in_the_world_keeps_its_stand_off(load: Load) -> None:
    moved = changes(second="relative_to: world\naxes: [x]\ntool_axis: -z")
    moved[0] = (moved[0][0], moved[0][1].replace(", project: +z", ""))

    assert [task.approach is None for task in load(*moved).tasks] == [False, True]


def test_a_written_program_loads_to_the_same_program(load: Load, tmp_path: Path) -> None:
    place = "{at: {xyz_mm: [100, 0, 333.3], rpy_deg: [0, 0, 33.3]}, rests_on: floor, lift_mm: 70}"
    cell = load(
        *changes(
            program=f"{{cycles: 3, marks: [m1, {{name: m2, dwell_s: 0.5}}], attach: {place}, detach: {place}}}",
            order="[ring, m2, second, m1]",
            second="after: [ring]\nstart_deg: [1, 2, 3, 4, 5, 6.6]\nholder: "
            "{A2_deg: 0, B2_deg: -93, C2_deg: 108.3, D2_deg: 0, E2_deg: -15, F2_deg: 0}",
            motion=", mode: semi_coordinated",
        )
    )
    (tmp_path / "again").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell(tmp_path / "again")

    assert render_cell(again) == render_cell(cell)
    assert again.motion.mode is Mode.SEMI_COORDINATED
    assert again.robot("worker").order == ("ring", "m2", "second", "m1")
    for one in (cell, again):
        assert one.program is not None
        assert one.program.attach is not None
        assert one.program.all_marks == (MarkEntry(name="m1"), MarkEntry(name="m2", dwell_s=0.5))
        assert (one.program.cycles, one.program.attach.rests_on, one.program.attach.lift_mm) == (3, "floor", 70.0)
        np.testing.assert_allclose(one.program.attach.X_WP[:3, 3], [0.1, 0.0, 0.3333], rtol=1e-15)
        np.testing.assert_array_equal(one.tasks[1].start_posture, cell.tasks[1].start_posture)
        np.testing.assert_array_equal(one.tasks[1].holder_posture, cell.tasks[1].holder_posture)
    np.testing.assert_allclose(np.degrees(cell.tasks[1].start_posture), [1, 2, 3, 4, 5, 6.6], rtol=1e-14)


def test_found_starts_of_later_tasks_are_written(load: Load, tmp_path: Path) -> None:
    cell = load(*changes())
    result = np.radians([10, 20, 30, 40, 50, 60])

    assert "start_deg: auto" in render_cell(cell).partition("second:")[2]
    cell = replace(cell, tasks=(cell.tasks[0], replace(cell.tasks[1], start_posture=result)))
    (tmp_path / "again").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell(tmp_path / "again")

    np.testing.assert_allclose(again.tasks[1].start_posture, result, rtol=1e-15)
    assert again.tasks[0].start_posture is None


def test_a_task_that_is_left_out_is_in_no_order_of_the_copy(load: Load, tmp_path: Path) -> None:
    cell = load(*changes(order="[ring, m1, second]", second="after: ring", program="{marks: [m1]}"))

    (tmp_path / "again").write_text(render_cell(with_only_task(cell, "second")), encoding="utf-8")
    again = load_cell(tmp_path / "again")

    assert again.robot("worker").order == ("m1", "second")
    assert [(task.name, task.after) for task in again.tasks] == [("second", ())]


def test_values_of_a_program_are_set_by_address(load: Load) -> None:
    cell = load(*changes()).with_values({"program.cycles": 4, "robots.worker.order": ["second", "ring"]})

    assert cell.program is not None
    assert cell.program.cycles == 4
    assert cell.robot("worker").order == ("second", "ring")
