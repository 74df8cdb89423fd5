"""Cells as a whole, parts and settings: every finding about them, word for word."""

from collections.abc import Callable
from pathlib import Path

import pytest

Refuse = Callable[..., list[str]]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "cellplan: 1",
            "cellplan: 2",
            "c:1: cellplan: expected 1, the version that this program reads, got 2",
        ),
        (
            "cellplan: 1\n",
            "",
            "c:1: cellplan: missing, expected version of the file format",
        ),
        (
            "name: pair",
            "name: -pair",
            "c:2: name: expected a name of 1 to 40 letters, digits, '_' or '-' that does not start with '-', got "
            "'-pair'",
        ),
        (
            "name: pair",
            "name: ../pair",
            "c:2: name: expected a name of 1 to 40 letters, digits, '_' or '-' that does not start with '-', got "
            "'../pair'",
        ),
        (
            "    tool: {xyz_mm: [0, 0, 100]}",
            "    tool: {xyz_mm: [0, 0, 100000]}",
            "c:10: robots.worker.tool.xyz_mm: expected a tool of at most 10 m, got 100 m; is the unit right?",
        ),
        (
            "length_mm: 500",
            "length_mm: 50000",
            "c:13: part.geometry: expected a part of 1 to 20000 mm, got 50000 mm; is the unit right?",
        ),
        (
            "{radius_mm: 250, length_mm: 500, axis: x}",
            "{radius_mm: 0.25, length_mm: 0.5, axis: x}",
            "c:13: part.geometry: expected a part of 1 to 20000 mm, got 0.5 mm; is the unit right?",
        ),
        (
            "axis: x",
            "axis: w",
            "c:13: part.geometry.cylinder.axis: expected x, y or z, got 'w'",
        ),
        (
            "{cylinder: {radius_mm: 250, length_mm: 500, axis: x}}",
            "{mesh: part.stl, unit: cm}",
            "c:13: part.geometry.unit: expected mm, m or inch, got 'cm'",
        ),
        (
            "motion: {",
            "checks: {contact_zone_mm: 10000}\nmotion: {",
            "c:21: checks.contact_zone_mm: expected a number of millimetres of at most 50, got 10000",
        ),
        (
            "{robot: holder,",
            "{robot: hodler,",
            "c:15: part.held_by[0].robot: expected a robot of this cell (holder, worker), got 'hodler', did you "
            "mean 'holder'?",
        ),
        (
            "    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}",
            "    - {robot: holder}\n    - {robot: holder}",
            "c:16: part.held_by[1].robot: expected a robot that does not hold the part already, got 'holder' twice",
        ),
        (
            "    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}",
            "    - {robot: holder, axes: [x, y, rz]}",
            "c:15: part.held_by[0].axes: unexpected key, the first holder carries the part frame; further holders may "
            "leave axes open",
        ),
        (
            "    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}",
            "    - {robot: holder}\n    - {robot: worker, axes: [x, x]}",
            "c:16: part.held_by[1].axes[1]: expected each word once, got 'x' twice\n"
            "c:19: tasks.ring.robot: expected a robot that does not hold the part, got the positioner 'worker'",
        ),
        (
            "    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}",
            "    - {robot: holder}\n    - {robot: worker}",
            "c:19: tasks.ring.robot: expected a robot that does not hold the part, got the positioner 'worker'",
        ),
        (
            "    tool_axis: normal",
            "    relative_to: world\n    tool_axis: -z",
            "c:19: tasks.ring.path.project: unexpected key, a path in the world is not projected onto the part",
        ),
        (
            "plane: xy}, project: +z}",
            "plane: xy}}\n    relative_to: world",
            "c:21: tasks.ring.tool_axis: tool_axis: normal requires a path that is projected onto the part: give "
            "tool_axis a direction",
        ),
        (
            "  held_by:\n    - {robot: holder, at: {xyz_mm: [-250, 0, 0]}}\n",
            "",
            "c:12: part.at: missing, expected the pose of the part in the world, or a robot under held_by",
        ),
        (
            "  held_by:\n",
            "  at: {xyz_mm: [0, 0, 0]}\n  held_by:\n",
            "c:14: part.at: unexpected key, the part is placed by the robot that holds it",
        ),
        (
            "duration_s: 4",
            "duration_s: 1e400",
            "c:21: motion.duration_s: expected a finite number, got 1e400",
        ),
        (
            "duration_s: 4",
            "duration_s: 4, step_s: 1e-6",
            "c:21: motion.step_s: expected at most 2000000 samples (duration_s / step_s), got 4000000",
        ),
        (
            "duration_s: 4",
            "duration_s: 4, step_s: 1e-300",
            "c:21: motion.step_s: expected at most 2000000 samples (duration_s / step_s), got 4e+300",
        ),
        (
            "duration_s: 4",
            "duration_s: 4, step_s: 5",
            "c:21: motion.step_s: expected a step of at most duration_s = 4, got 5",
        ),
        (
            "duration_s: 4",
            "duration_s: 4, mode: simultanous",
            "c:21: motion.mode: expected simultaneous, pairwise, part_at_rest or semi_coordinated, got 'simultanous', "
            "did you mean 'simultaneous'?",
        ),
        (
            "environment:",
            "solver: {method: wieghted_pseudo_inverse}\nenvironment:",
            "c:22: solver.method: expected weighted_pseudo_inverse, damped_least_squares, jacobian_transpose, "
            "filtered_inverse, filtered_inverse_ii, heuristic_search, recursive_search or quadratic_program, "
            "got 'wieghted_pseudo_inverse', did you mean 'weighted_pseudo_inverse'?",
        ),
        (
            "environment:",
            "solver: {gain_per_s: 2000}\nenvironment:",
            "c:22: solver.gain_per_s: expected a gain below 2000 (2 / step_s), got 2000; the error feedback "
            "would be unstable",
        ),
        (
            "environment:",
            "solver: {damping: -1}\nenvironment:",
            "c:22: solver.damping: expected a number of at least 0, got -1",
        ),
        (
            "environment:",
            "solver: {search: {sequence: [{robot: worker, joint: A3}, {robot: worker, joint: A3}]}}\nenvironment:",
            "c:22: solver.search.sequence[1]: expected every joint once, got 'worker/A3' again",
        ),
        (
            "environment:",
            "solver: {search: {sequence: []}}\nenvironment:",
            "c:22: solver.search.sequence: expected at least 1 entry, got 0",
        ),
        (
            "environment:",
            "solver: {seed: 1.5}\nenvironment:",
            "c:22: solver.seed: expected a whole number, got 1.5",
        ),
        (
            "environment:",
            "checks: {exclude: [{bodies: [holder/foot, worker/foto], reason: near}]}\nenvironment:",
            "c:22: checks.exclude[0].bodies[1]: expected a body of this cell, got 'worker/foto', did you mean "
            "'worker/foot'?",
        ),
        (
            "environment:",
            'checks: {exclude: [{bodies: [holder/foot, floor], reason: " "}]}\nenvironment:',
            "c:22: checks.exclude[0].reason: expected some text, got an empty one",
        ),
        (
            "environment:",
            "checks: {exclude: [{bodies: [holder/foot, floor], reason: <<}]}\nenvironment:",
            "c:22: checks.exclude[0].reason: expected a reason in words, got '<<'",
        ),
        (
            "environment:",
            "checks: {exclude: [{bodies: [floor, floor], reason: near}]}\nenvironment:",
            "c:22: checks.exclude[0].bodies[1]: expected two different bodies, got the same twice",
        ),
        (
            "environment:",
            "layout: {vary: {holdr.base: {x_mm: [0, 1]}}}\nenvironment:",
            "c:22: layout.vary.holdr.base: expected a robot of this cell (holder, worker), got 'holdr', did you "
            "mean 'holder'?",
        ),
        (
            "environment:",
            "layout: {vary: {holder.base: {x_mm: [1, 0]}}}\nenvironment:",
            "c:22: layout.vary.holder.base.x_mm[1]: expected a number above 1, got 0",
        ),
        (
            "  floor: {plane: {z_mm: 0}}",
            "  floor: {plane: {z_mm: 0}, at: {xyz_mm: [0, 0, 0]}}",
            "c:23: environment.floor.at: unexpected key, a plane is placed by z_mm only",
        ),
        (
            "  floor: {plane: {z_mm: 0}}",
            "  part: {plane: {z_mm: 0}}",
            "c:23: environment.part: expected another name, 'part' means the workpiece",
        ),
        (
            "  floor: {plane: {z_mm: 0}}",
            "  - 1",
            "c:22: environment: expected a mapping, got a list of 1",
        ),
        (
            "environment:",
            "enviroment: {}\nenvironment:",
            "c:22: enviroment: unknown key, did you mean 'environment'?; allowed: cellplan, name, robots, controllers, "
            "part, tasks, environment, motion, program, assign, acceleration, solver, checks, layout",
        ),
    ],
)
def test_a_mistake_in_a_cell_is_named_with_its_line_key_and_cure(
    refuse: Refuse, old: str, new: str, message: str
) -> None:
    assert refuse((old, new)) == message.splitlines()


def test_all_findings_come_at_once_in_the_order_of_the_file(refuse: Refuse) -> None:
    reported = refuse(
        ("start_deg: [0, -93, 108, 0, -15, 0]", "start_deg: [0, 010, 108]"),
        ("weights: [1, 1, 1, 1, 1, 1]", "weights: [1, 1]"),
        ("radius_mm: 250, length", "radius_mm: -250, length"),
        ("robot: worker", "robot: wroker"),
        ("duration_s: 4", "duratoin_s: 4"),
    )

    assert reported == [
        "c:6: robots.holder.start_deg[1]: expected a number without leading zeros, got 010; it can be read as octal",
        "c:11: robots.worker.weights: expected 6 weights, one per joint (A3, B3, C3, D3, E3, F3), got 2",
        "c:13: part.geometry.cylinder.radius_mm: expected a positive number of millimetres, got -250",
        "c:18: tasks.ring.robot: expected a robot of this cell (holder, worker), got 'wroker', did you mean 'worker'?",
        "c:21: motion.duratoin_s: unknown key, did you mean 'duration_s'?; allowed: mode, duration_s, step_s, grid_ms, "
        "timing, jerk_build_up_s, greatest_feeds, controller_cycle_ms, time_law, corners, cyclic, locked_joints",
    ]


def test_a_flood_of_findings_is_cut_short(refuse: Refuse) -> None:
    reported = refuse(("name: pair\n", "name: pair\n" + "".join(f"key_{k}: 1\n" for k in range(150))))

    assert len(reported) == 101
    assert reported[-1] == "c: and more than 49 other findings"


def test_the_robot_limit_is_named(refuse: Refuse) -> None:
    more = "".join(f"  r{k}: {{model: kuka_kr6}}\n" for k in range(63))

    assert refuse(("robots:\n", "robots:\n" + more)) == ["c:3: robots: expected at most 64 entries, got 65"]


def test_findings_about_a_robot_table_follow_those_about_the_cell(refuse: Refuse, tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text("robot: arm\nflange: {}\njoints: {A: {type: revolute}}\n", encoding="utf-8")

    reported = refuse(("model: abb_irb1600", "model: arm.yaml"), ("duration_s: 4", "duration_s: -4"))

    assert reported == [
        "c:21: motion.duration_s: expected a positive number of seconds, got -4",
        "arm.yaml:3: joints.A.axis: missing, expected unit direction of the axis",
    ]


def test_names_that_do_not_exist_are_reported_beside_other_mistakes_of_the_same_entry(refuse: Refuse) -> None:
    findings = refuse(
        ("model: kuka_kr6", "model: kuka_kr7\n    bse: {}"),
        ("radius_mm: 250", "radius_mm: -250"),
        ("{robot: holder, at", "{robot: hodler, at"),
        ("    robot: worker", "    robot: wroker\n    start_s: soon"),
    )
    assert [finding.split(": ")[1] for finding in findings] == [
        "robots.holder.model",
        "robots.holder.bse",
        "part.geometry.cylinder.radius_mm",
        "part.held_by[0].robot",
        "tasks.ring.robot",
        "tasks.ring.start_s",
    ]
