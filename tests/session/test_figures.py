"""Figures of a live cell about tools at work, and where answers say that things are."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellplan import edit, load_cell, solve
from cellplan.checks.tools.weld_position import check_weld_positions
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import joint_at
from cellplan.model.settings.task import TorchEntry, WeldPositionEntry
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.session.blocks import LiveCell
from cellplan.session.motion import follow
from cellplan.session.seams import branch_figures, seam_figures
from cellplan.session.session import Session

CELLS = Path(__file__).resolve().parents[2] / "cells"
PAIR = CELLS / "planar_pair.yaml"
SETTINGS = ("robots.left.start_deg=[50, -85, 35]", "motion.step_s=0.01", "solver.integrator=accurate")


@pytest.fixture(scope="module")
def pair() -> Iterator[Session]:
    with edit(PAIR, settings=SETTINGS) as session:
        yield session


def settled(session: Session) -> Any:
    """The last answer at rest."""
    answer = session.answer()
    while (more := session.settle()) is not None:
        answer = more
    return answer


def figure(answer: Any, name: str) -> Any:
    """A figure of an answer."""
    return next(it for it in answer["figures"] if it["name"] == name)


@pytest.mark.slow
def test_demands_of_a_weld_are_judged_while_things_move_as_the_checks_judge_them() -> None:
    [live] = LiveCell.of(load_cell(CELLS.parent / "examples" / "seams" / "ring_on_table.yaml")).planned()
    block = live.blocks[0]
    motion = follow(block, live.variables.layout.given)
    [scheduled], times, cell = block.schedule.tasks, block.schedule.times, block.cell
    rows = np.column_stack([np.interp(times, motion.times, column) for column in motion.q.T])
    q = {robot.name: rows[:, cell.columns(robot.name)] for robot in cell.robots}
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    passed = set[bool]()
    for torch, slope, rotation in ((20.0, (-80.0, 5.0), (-180.0, 100.0)), (170.0, (-90.0, -60.0), (-170.0, 90.0))):
        weld = WeldPositionEntry(slope_deg=slope, rotation_deg=rotation)
        task = replace(scheduled.task, torch=TorchEntry(within_deg=torch), weld_position=weld)
        schedule = replace(block.schedule, tasks=(replace(scheduled, task=task),))
        figures = {it.name: it for it in seam_figures(replace(block, schedule=schedule), motion)}

        checks = list(check_weld_positions(schedule, chains, q, part_poses(cell, chains, q)))
        assert [it.name for it in checks] == ["torch_angle", "weld_slope", "weld_rotation"]
        for check, name in zip(checks, ("torch", "weld slope", "weld rotation"), strict=True):
            assert figures[name].is_met == check.passed
            assert figures[name].limit == pytest.approx(check.limit)
            if name != "weld rotation":  # which turns fast where the weld stands upright, and nodes are 1 s apart
                assert figures[name].value == pytest.approx(check.value, abs=3.0)
            passed.add(check.passed)
    assert passed == {True, False}


def test_tool_depth_is_judged_at_rest_and_says_so_until_then(pair: Session) -> None:
    moving = figure(pair.change({"robots.right.base.x_mm": 1901.0}), "tool depth")
    resting = figure(settled(pair), "tool depth")
    passed = solve(pair.document.cell)
    depths = [depth for run in passed.runs for depth in run.report.depths]

    assert (moving["value"], moving["binds"], moving["is_met"]) == (None, "judged at rest", True)
    deepest = max(depths, key=lambda it: it.depth - it.limit)
    assert resting["value"] == pytest.approx(1e3 * deepest.depth, abs=1e-2)
    assert (resting["limit"], resting["binds"]) == (1e3 * deepest.limit, deepest.task)


def test_a_robot_that_begins_on_another_branch_is_named_with_its_joint(pair: Session) -> None:
    block = pair._engine.given.blocks[0]
    motion = follow(block, pair._engine.given.variables.layout.given)
    q = motion.q.copy()
    q[0, [0, 4]] += np.radians([100.0, -95.0])

    figures = list(branch_figures(block, replace(motion, q=q)))

    names = ["/".join(joint_at(block.cell, joint)) for joint in (0, 4)]
    assert [it.binds for it in figures] == names
    assert [it.value for it in figures] == pytest.approx([100.0, -95.0], abs=1.0)
    assert not list(branch_figures(block, motion))


@pytest.mark.slow
def test_positions_of_a_weld_and_its_push_are_in_the_figures() -> None:
    [live] = LiveCell.of(load_cell(CELLS / "step_frame.yaml")).planned()
    block = next(it for it in live.blocks if it.stage.move is None)
    motion = follow(block, live.variables.layout.given)

    figures = [*seam_figures(block, motion)]
    welds = [it for it in figures if it.name == "weld rotation"]
    assert len(welds) == len(block.tasks)
    assert all(it.binds.endswith("PB") for it in welds)  # fillets, as the guide has them
    assert [it.value for it in figures if it.name == "push"] == pytest.approx(
        [0.0] * len(welds), abs=1e-3
    )  # accuracy of the nodes


def test_what_was_moved_and_saved_stays_where_it_is_for_pages_that_opened_before(tmp_path: Path) -> None:
    post = "environment:\n  post: {box: {size_mm: [90, 90, 90]}, at: {xyz_mm: [0, 2000, 50]}}\n"
    path = tmp_path / "cell.yaml"
    path.write_text(PAIR.read_text(encoding="utf-8").replace("environment:\n", post), encoding="utf-8")
    with edit(path, settings=("motion.step_s=0.01",)) as session:
        names = [body["name"] for body in session.open_record()["view"]["scenes"][0]["bodies"]]
        moved = session.change({"environment.post.at.x_mm": 300.0})["poses"]["bodies"]
        saved = session.do("save")["poses"]["bodies"]

    assert saved == moved
    assert [names[int(place)] for place in saved] == ["post"]
    assert saved[str(names.index("post"))][3:12:4] == [0.3, 2.0, 0.05]
