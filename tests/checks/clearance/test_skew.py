"""Allowed skew of a run: which clocks count, what limits them, and the figure of the cell of four robots."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import fixed_part, held_part, make_cell, placed, schedule, slide_model, work

from cellplan import load_cell, solve
from cellplan.checks.clearance.skew import allowed_skew
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Part
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Report, ToolDepth
from cellplan.model.report.skew import MOST_SKEW, SkewLimit, SkewReport, has_clocks
from cellplan.model.settings.checks import ChecksEntry
from cellplan.model.settings.controllers import ControllerEntry, RobotControlEntry
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.task.task import Frame
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

SHIPPED = Path(__file__).parents[3] / "cells"
SPEED = 0.25  # [m/s] of both robots
SAMPLES = 101
LIMIT = 1e-3  # [m] of the tool


def cell_of(
    controllers: dict[str, str], *, skews: dict[str, float] | None = None, part: Part | None = None, clearance=0.01
) -> Cell:
    """A holder and an operator that slide side by side along x, 0.5 m apart; the part lies far above the holder."""
    block = slide_model(Sphere(0.05))
    robots = (
        placed("holder", block),
        placed("operator", block, base=pose((0.0, 0.5, 0.0))),
        placed("other", block, base=pose((0.0, 5.0, 0.0))),
    )
    task = replace(
        work("operator"),
        tolerance=ToleranceEntry(position_mm=1e3 * LIMIT, orientation_deg=np.degrees(1e-3)),
        tool_depth=1e-2,
    )
    return replace(
        make_cell(
            *(
                replace(robot, control=RobotControlEntry(id=controllers[robot.name]))
                if robot.name in controllers
                else robot
                for robot in robots
            ),
            part=part or held_part(Sphere(0.01), "holder", pose((0.0, 0.0, -3.0))),
            tasks=(task,),
            checks=ChecksEntry(clearance_mm=1e3 * clearance, contact_zone_mm=0.0),
        ),
        controllers={
            name: ControllerEntry(kind="other", skew_ms=(skews or {}).get(name)) for name in set(controllers.values())
        },
    )


def run_of(cell: Cell, *, frame: Frame = Frame.PART) -> tuple[Scene, Schedule, dict[str, Array]]:
    """Holder and operator move along x at one speed: the tool rests on the part, where it is desired to be."""
    times = np.linspace(0.0, 1.0, SAMPLES)
    q = {"holder": SPEED * times[:, None], "operator": SPEED * times[:, None], "other": 0.0 * times[:, None]}
    scene = Scene.from_cell(cell)
    task = replace(cell.tasks[0], relative_to=frame)
    tool = ScrewChain(cell.robot("operator")).tool_poses(q["operator"])
    X_WP = (
        cell.part.X_CP
        if cell.carrier is None
        else ScrewChain(cell.robot("holder")).tool_poses(q["holder"]) @ cell.part.X_CP
    )
    desired = np.linalg.inv(X_WP) @ tool
    clock = schedule(SAMPLES, task)
    return scene, replace(clock, tasks=(replace(clock.tasks[0], X_PT=desired),)), q


def skew_of(cell: Cell, **options: Frame) -> SkewReport:
    scene, clock, q = run_of(cell, **options)
    depth = ToolDepth(task="work_of_operator", robot="operator", depth=0.0, at_s=0.0, limit=1e-2, body="axis")
    return allowed_skew(scene, clock, q, (depth,))


APART = {"holder": "a", "operator": "b", "other": "c"}


def test_a_tool_of_constant_speed_allows_its_tolerance_by_its_speed() -> None:
    skew = skew_of(cell_of(APART))

    (tool,) = skew.tools
    assert tool.speed == pytest.approx(SPEED)
    assert tool.by_position == pytest.approx(LIMIT / SPEED)
    assert tool.by_orientation == MOST_SKEW
    pair = next(pair for pair in skew.pairs if {pair.first, pair.second} == {"holder", "operator"})
    by_kind = {limit.limit: limit.skew for limit in pair.limits}
    assert by_kind[SkewLimit.TOOL] == pytest.approx(LIMIT / SPEED)
    assert by_kind[SkewLimit.DEPTH] == pytest.approx(1e-2 / SPEED)
    assert by_kind[SkewLimit.CLEARANCE] == MOST_SKEW
    assert skew.allowed == pytest.approx(LIMIT / SPEED)
    assert skew.alone == pytest.approx(0.5 * LIMIT / SPEED)


def test_bodies_limit_the_pair_that_comes_near() -> None:
    skew = skew_of(cell_of(APART, clearance=0.399))

    pair = next(pair for pair in skew.pairs if {pair.first, pair.second} == {"holder", "operator"})
    clearance = next(limit for limit in pair.limits if limit.limit is SkewLimit.CLEARANCE)
    assert clearance.skew == MOST_SKEW  # 0.4 m apart however they are shifted
    assert skew_of(cell_of(APART, clearance=0.401)).allowed == 0.0


@pytest.mark.parametrize("stated", [1e-3, 8e-3])
def test_a_stated_skew_has_an_error_and_a_shortest_cycle(stated: float) -> None:
    skew = skew_of(cell_of(APART, skews={"a": 1e3 * stated, "b": 2e3 * stated}))

    (tool,) = skew.tools
    pair = next(pair for pair in skew.pairs if {pair.first, pair.second} == {"holder", "operator"})
    assert pair.stated == stated
    assert pair.is_met is (stated <= LIMIT / SPEED)
    assert tool.position == pytest.approx(SPEED * stated)
    assert tool.shortest_cycle == pytest.approx(stated * SPEED / LIMIT)  # the program takes 1 s


def test_robots_of_one_controller_share_a_clock() -> None:
    skew = skew_of(cell_of({"holder": "a", "operator": "a", "other": "c"}))

    assert skew.groups == (("holder", "operator"), ("other",))
    assert skew.tools == ()
    assert [(pair.first, pair.second) for pair in skew.pairs] == [("holder", "other"), ("operator", "other")]
    assert skew.allowed == MOST_SKEW


def test_a_robot_without_a_controller_has_a_clock_of_its_own() -> None:
    cell = cell_of({"holder": "a", "operator": "a"})

    assert has_clocks(cell)
    assert skew_of(cell).groups == (("holder", "operator"), ("other",))
    assert not has_clocks(cell_of(dict.fromkeys(APART, "a")))
    assert not has_clocks(cell_of({}))


def test_a_part_that_no_robot_carries_has_no_clock() -> None:
    cell = cell_of(APART, part=fixed_part(Sphere(0.01), pose((0.0, 0.0, 3.0))))

    assert skew_of(cell).tools == ()


def test_a_part_that_its_holder_keeps_at_rest_is_there_on_every_clock() -> None:
    scene, clock, q = run_of(cell_of(APART))
    still = q | {"holder": np.zeros((SAMPLES, 1))}

    assert allowed_skew(scene, clock, still, ()).tools == ()


def test_clocks_of_two_robots_of_which_one_stands_still_limit_nothing() -> None:
    scene, clock, q = run_of(cell_of(APART, clearance=0.401))  # more than they keep, which the run itself shows

    skew = allowed_skew(scene, clock, q | {"holder": np.zeros((SAMPLES, 1))}, ())

    assert skew.allowed == MOST_SKEW
    assert all(limit.subject == "" for pair in skew.pairs for limit in pair.limits)


def test_a_task_in_the_world_depends_on_no_other_clock() -> None:
    assert skew_of(cell_of(APART), frame=Frame.WORLD).tools == ()


@pytest.mark.slow
def test_the_cell_of_four_robots_costs_half_a_millimetre_for_each_millisecond() -> None:
    cell = load_cell(SHIPPED / "four_controllers.yaml")

    report = solve(cell).runs[0].report

    assert report.skew is not None
    tools = {tool.name: tool for tool in report.skew.tools}
    assert tools["circle"].speed == pytest.approx(0.53, abs=0.005)
    assert tools["circle"].by_position == pytest.approx(0.19e-3, abs=0.01e-3)
    fastest = max(_fastest(report, name) for name in tools)
    assert max(tool.speed for tool in tools.values()) == pytest.approx(fastest, rel=0.01)
    assert report.skew.allowed < 0.2e-3
    apart = {(pair.first, pair.second): pair.allowed for pair in report.skew.pairs}
    assert apart["kuka", "staubli"] == MOST_SKEW


def _fastest(report: Report, name: str) -> float:
    """Largest speed of the tool of a task in the world between two rows."""
    robot = next(accuracy.robot for accuracy in report.accuracy if accuracy.task == name)
    return report.speeds[robot].tool_peak
