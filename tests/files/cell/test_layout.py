"""The section ``layout`` of a cell file: what it becomes, and every finding about it, word for word."""

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell, written_document
from cellplan.geometry.shapes import Box, Capsule, Cylinder
from cellplan.model.cell.cell import Cell, Mode
from cellplan.model.cell.layout import ChoiceKind

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
ROD = "{rod: {length_mm: 200, tilt_deg: 30, roll_deg: -90, radius_mm: 12, holder: {radius_mm: 40, length_mm: 60}}}"
TOOL = "tool: {xyz_mm: [0, 0, 100]}"


def with_layout(text: str) -> tuple[str, str]:
    return "environment:", f"layout: {text}\nenvironment:"


def test_addresses_work_with_and_without_their_section(load: Load) -> None:
    bare = load(with_layout("{vary: {worker.base: {x_mm: [0, 2500]}, holder.start_deg: true}}"))
    full = load(with_layout("{vary: {robots.worker.base: {x_mm: [0, 2500]}, robots.holder.start_deg: true}}"))
    assert bare.layout is not None
    assert full.layout is not None
    assert bare.layout.ranges == full.layout.ranges
    first = bare.layout.ranges[0]
    assert (first.address, first.lower, first.upper, first.given) == ("robots.worker.base.x_mm", 0.0, 2.5, 2.0)
    joints = bare.robot("holder").model.joints
    assert [(range_.lower, range_.upper) for range_ in bare.layout.ranges[1:]] == [
        (it.lower, it.upper) for it in joints
    ]


def test_a_single_number_may_be_named(load: Load) -> None:
    layout = load(with_layout("{vary: {worker.base.yaw_deg: [90, 270], 'holder.start_deg[2]': [100, 110]}}")).layout
    assert layout is not None
    assert [range_.address for range_ in layout.ranges] == ["robots.worker.base.yaw_deg", "robots.holder.start_deg[2]"]
    assert layout.ranges[0].lower == pytest.approx(math.pi / 2)


def test_without_ranges_the_operators_and_the_first_start_vary(load: Load) -> None:
    layout = load().layout
    assert layout is not None
    assert layout.is_default
    result = {range_.address: (range_.lower, range_.upper) for range_ in layout.ranges}
    assert result["robots.worker.base.x_mm"] == (1.0, 3.0)
    assert "robots.worker.base.z_mm" not in result  # it stands on the floor
    assert sum(address.startswith("robots.holder.start_deg") for address in result) == 6
    raised = load(("xyz_mm: [2000, 0, 0]", "xyz_mm: [2000, 0, 700]")).layout
    assert raised is not None
    assert {it.address: (it.lower, it.upper) for it in raised.ranges}["robots.worker.base.z_mm"] == (0.0, 0.7)


def test_without_ranges_a_holder_that_grips_the_part_at_a_place_moves_too(load: Load) -> None:
    gripping = load_cell(Path(__file__).resolve().parents[3] / "cells" / "three_tasks_each.yaml").layout
    held = load().layout
    assert gripping is not None
    assert held is not None
    moved = [it.address for it in gripping.ranges if it.address.startswith("robots.holder.base")]
    assert moved == [f"robots.holder.base.{key}" for key in ("x_mm", "y_mm", "yaw_deg")]
    assert not any(it.address.startswith("robots.holder.base") for it in held.ranges)


def test_without_ranges_a_base_far_away_may_come_to_the_holder(load: Load) -> None:
    layout = load(("xyz_mm: [2000, 0, 0]", "xyz_mm: [-4000, 2400, 0]")).layout
    assert layout is not None
    result = {range_.address: (range_.lower, range_.upper) for range_ in layout.ranges}
    assert result["robots.worker.base.x_mm"] == (-5.0, -0.5)
    assert result["robots.worker.base.y_mm"] == (1.4, 3.4)


@pytest.mark.parametrize("size", ["[800, 400]", "[800, 400, 10]"])
def test_the_height_of_an_area_kept_out_of_is_read_and_counts_for_nothing(size: str, load: Load) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cell = load(with_layout("{keep_out: {aisle: {box: {size_mm: " + size + "}}}}"))

    assert cell.layout is not None
    (aisle,) = cell.layout.keep_out
    assert isinstance(aisle.shape, Box)
    assert aisle.shape.size[:2] == (0.8, 0.4)


def test_what_stands_beside_the_ranges(load: Load) -> None:
    cell = load(
        (TOOL, f"tool: {ROD}"),
        with_layout(
            "{vary: {worker.base: {x_mm: [0, 2500], z_mm: [0, 600]}, holder.base: {x_mm: [-500, 500], z_mm: [0, 300]}, "
            "worker.tool: {length_mm: [150, 250]}, holder.path: {coefficients: 20}, worker.branch: true, "
            "tasks.ring.robot: [worker], motion.mode: [pairwise, simultaneous]}, fixed: [holder.base.x_mm], "
            "equal: [[worker.base.z_mm, holder.base.z_mm]], floor: {x_mm: [100, 2200]}, margin_deg: 15, "
            "keep_out: {aisle: {box: {size_mm: [800, 400]}, at: {xyz_mm: [1000, 0, 0]}}}, "
            "cost: {worker: 1, worker.base: 2, worker.base.z_mm: 5}}".replace("worker: 1, ", "")
        ),
    )
    layout = cell.layout
    assert layout is not None
    assert [range_.address for range_ in layout.ranges] == [
        "robots.worker.base.x_mm",
        "robots.worker.base.z_mm",
        "robots.holder.base.z_mm",
        "robots.worker.tool.rod.length_mm",
    ]
    assert (layout.ranges[0].lower, layout.ranges[0].upper) == (0.1, 2.2)
    assert layout.equal == (("robots.worker.base.z_mm", "robots.holder.base.z_mm"),)
    assert (layout.paths[0].robot, layout.paths[0].coefficients, layout.paths[0].degree) == ("holder", 20, 5)
    assert [choice.kind for choice in layout.choices] == [ChoiceKind.BRANCH, ChoiceKind.ROBOT, ChoiceKind.MODE]
    assert layout.margin == pytest.approx(math.radians(15.0))
    assert layout.keep_out[0].shape == Box((0.8, 0.4, 1.0))
    assert (layout.cost["robots.worker.base.x_mm"], layout.cost["robots.worker.base.z_mm"]) == (2.0, 5.0)


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        (
            "{vary: {worker.bse: {x_mm: [0, 1]}}}",
            "vary.worker.bse: expected one of ROBOT.base, ROBOT.tool, ROBOT.start_deg, ROBOT.start, ROBOT.weights, "
            "ROBOT.path, ROBOT.branch, tasks.TASK.spin_deg, tasks.TASK.robot, part.held_by[0].at, part.at, "
            "motion.mode, null_space, got 'worker.bse'",
        ),
        (
            "{vary: {worker.base: {xx_mm: [0, 1]}}}",
            "vary.worker.base.xx_mm: unknown key, did you mean 'x_mm'?; allowed: x_mm, y_mm, z_mm, roll_deg, "
            "pitch_deg, yaw_deg",
        ),
        ("{vary: {worker.base: true}}", None),
        (
            "{vary: {worker.base: [0, 1]}}",
            "vary.worker.base: expected a mapping of ranges (x_mm, y_mm, z_mm, roll_deg, pitch_deg, yaw_deg), got a "
            "list of 2",
        ),
        ("{vary: {worker.base: {x_mm: 3}}}", "vary.worker.base.x_mm: expected a range [low, high], got 3"),
        (
            "{vary: {worker.tool: {length_mm: [100, 250]}}}",
            "vary.worker.tool: expected a tool with a rod, got one whose tip is given by its pose; write "
            "robots.worker.tool: {rod: {length_mm: …, tilt_deg: …, roll_deg: …, radius_mm: …}}, so that its solids "
            "follow",
        ),
        (
            "{vary: {worker.start_deg: true}}",
            "vary.worker.start_deg: expected a robot that holds the part, or one with more joints than its task "
            "prescribes: the start of 'worker' follows from its task; write worker.branch: true to try all branches "
            "of it",
        ),
        (
            "{vary: {holder.start_deg: [[0, 1]]}}",
            "vary.holder.start_deg: expected 6 ranges [low, high], one per joint, got 1",
        ),
        (
            "{vary: {'holder.start_deg[0]': [0, 190]}}",
            "vary.holder.start_deg[0]: expected a range within the limits of the joint 'A2', -185 to 185 deg",
        ),
        (
            "{vary: {holder.start: true}}",
            "vary.holder.start: expected holder.start_deg, as all joints of 'holder' turn",
        ),
        (
            "{vary: {holder.weights: [0, 1]}}",
            "vary.holder.weights: expected weights from 1e-06 to 1e+06",
        ),
        (
            "{vary: {tasks.ring.spin: [0, 1]}}",
            "vary.tasks.ring.spin: expected tasks.TASK.spin_deg or tasks.TASK.robot, got 'tasks.ring.spin'",
        ),
        (
            "{vary: {part.at: {x_mm: [0, 1]}}}",
            "vary.part.at: expected part.held_by[0].at, as the part is held, got part.at",
        ),
        (
            "{vary: {tasks.ring.robot: [holder]}}",
            "vary.tasks.ring.robot[0]: expected a robot that does not hold the part (worker), got 'holder'",
        ),
        (
            "{vary: {motion.mode: [pairwise]}}",
            "vary.motion.mode: expected a list with the present choice 'simultaneous', got pairwise",
        ),
        ("{vary: {worker.path: true}}", "vary.worker.path: expected the first holder of the part, got 'worker'"),
        ("{vary: {holder.path: {degree: 4}}}", "vary.holder.path.degree: expected 3 or 5, got 4"),
        (
            "{vary: {worker.base: {x_mm: [0, 1]}, robots.worker.base.x_mm: [0, 2]}}",
            "vary.robots.worker.base.x_mm: expected each variable once, got 'robots.worker.base.x_mm' twice",
        ),
        (
            "{equal: [[worker.base.x_mm, worker.base.yaw_deg]]}",
            "equal[0]: expected variables of one unit, got robots.worker.base.x_mm and robots.worker.base.yaw_deg",
        ),
        (
            "{equal: [[worker.base.x_mm, holder.base.x_mm]]}",
            "equal[0][1]: expected a variable with a range under layout.vary, got 'holder.base.x_mm', which stays",
        ),
        (
            "{mirrored: [{bases: [worker.base, holder.base], plane: xz}]}",
            "mirrored[0].bases: expected ranges of the same components of both under layout.vary, got x_mm, y_mm, "
            "yaw_deg of the first and none of the second",
        ),
        (
            "{floor: {x_mm: [5000, 6000]}}",
            "floor.x_mm: expected bounds that overlap the range of robots.worker.base.x_mm, 1000 to 3000 mm, got 5000 "
            "to 6000",
        ),
        ("{floor: {x_mm: [1, 0]}}", "floor.x_mm[1]: expected a number above 1, got 0"),
        (
            "{keep_out: {aisle: {box: {size_mm: [800, 400]}, at: {rpy_deg: [0, 5, 0]}}}}",
            "keep_out.aisle.at.rpy_deg[1]: expected 0, as an area of the floor has no pitch",
        ),
        ("{cost: {worker.bas: 1}}", None),
    ],
)
def test_mistakes_are_one_located_line(refuse: Refuse, layout: str, message: str | None) -> None:
    result = refuse(with_layout(layout))
    assert len(result) == 1
    assert result[0].startswith("c:22: layout.")
    if message is not None:
        assert result[0] == f"c:22: layout.{message}"


def test_a_pedestal_keeps_its_robot_upright(refuse: Refuse) -> None:
    message = refuse(
        ("    weights: [1, 1, 1, 1, 1, 1]", "    pedestal: {cylinder: {radius_mm: 200}, floor_z_mm: -300}"),
        with_layout("{vary: {worker.base: {roll_deg: [-5, 5]}}}"),
    )
    assert message == [
        "c:22: layout.vary.worker.base.roll_deg: expected no range of roll or pitch for a base so mounted; to tilt it, "
        "use mount: {tilted: …}"
    ]


HAND = (
    "tool: {xyz_mm: [0, -100, 173.205080757], rpy_deg: [0, 30, -90], bodies: [{cylinder: {radius_mm: 40, "
    "length_mm: 60}, at: {xyz_mm: [0, 0, 30]}}, {capsule: {radius_mm: 12, length_mm: 146.0}, "
    "at: {xyz_mm: [0.0, -57.5, 99.592921435], rpy_deg: [0, 30, -90]}}]}"
)


def test_a_rod_is_the_tool_that_one_would_write_by_hand(load: Load) -> None:
    stick_out = ROD.replace("radius_mm: 12,", "radius_mm: 12, stick_out_mm: 12,", 1)
    rod, hand = (load((TOOL, text)).robot("worker").tool for text in (f"tool: {stick_out}", HAND))
    assert np.abs(rod.X_FT - hand.X_FT).max() <= 1e-12
    assert [body.name for body in rod.bodies] == [body.name for body in hand.bodies] == ["tool", "tool_2"]
    assert rod.bodies[0].shape == hand.bodies[0].shape == Cylinder(0.04, 0.06)
    shape, other = rod.bodies[1].shape, hand.bodies[1].shape
    assert isinstance(shape, Capsule)
    assert isinstance(other, Capsule)
    assert (shape.radius, shape.length) == pytest.approx((other.radius, other.length))
    assert max(np.abs(a.X_BS - b.X_BS).max() for a, b in zip(rod.bodies, hand.bodies, strict=True)) <= 1e-12


def test_a_rod_ends_at_the_tip(load: Load) -> None:
    tool = load((TOOL, f"tool: {ROD}")).robot("worker").tool
    shape, X_FS = tool.bodies[1].shape, tool.bodies[1].X_BS
    assert isinstance(shape, Capsule)
    end = X_FS[:3, 3] + (0.5 * shape.length + shape.radius) * X_FS[:3, 2]
    assert np.abs(end - tool.X_FT[:3, 3]).max() <= 1e-15


def test_a_rod_and_a_layout_are_written_and_read_again(load: Load) -> None:
    cell = load((TOOL, f"tool: {ROD}"), with_layout("{vary: {worker.tool: {length_mm: [150, 250]}}, margin_deg: 5}"))
    Path("written").write_text(render_cell(cell), encoding="utf-8")
    again = load_cell("written")
    assert again.robot("worker").tool.rod == cell.robot("worker").tool.rod
    assert again.layout is not None
    assert cell.layout is not None
    assert (again.layout.ranges, again.layout.margin) == (cell.layout.ranges, cell.layout.margin)
    longer = cell.with_values({"robots.worker.tool.rod.length_mm": 250}).robot("worker").tool
    assert float(np.linalg.norm(longer.X_FT[:3, 3])) == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("tool", "message"),
    [
        (
            "{rod: {length_mm: 60, radius_mm: 12, holder: {radius_mm: 40, length_mm: 60}}}",
            "rod.length_mm: expected more than 66 mm (two radii, stick_out_mm, half the holder and one radius), got 60",
        ),
        (
            "{xyz_mm: [0, 0, 100], rod: {length_mm: 160, radius_mm: 12}}",
            "xyz_mm: unexpected key, rod says where the tool tip is: leave out one of them",
        ),
        (
            "{rod: {length_mm: 16000, radius_mm: 12}}",
            "rod.length_mm: expected a tool of at most 10 m, got 16 m; is the unit right?",
        ),
    ],
)
def test_wrong_rods_are_one_located_line(refuse: Refuse, tool: str, message: str) -> None:
    assert refuse((TOOL, f"tool: {tool}")) == [f"c:10: robots.worker.tool.{message}"]


def test_spin_and_free_spin_exclude_each_other(refuse: Refuse) -> None:
    message = refuse(("    tool_axis: normal", "    spin_deg: 10\n    free: [spin]"))
    assert message == ["c:20: tasks.ring.spin_deg: unexpected key, the spin is free: leave out one of them"]


def test_a_layout_is_not_written_for_other_tasks_or_modes(load: Load) -> None:
    cell = load(with_layout("{vary: {motion.mode: [simultaneous, pairwise]}}"))
    other = replace(cell, motion=replace(cell.motion, mode=Mode.PART_AT_REST))
    assert "layout" in written_document(cell)
    assert "layout" not in written_document(other)
