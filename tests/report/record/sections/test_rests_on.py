"""Tools that a cell leaves out: which robots the remark names, and under which key."""

from dataclasses import replace
from pathlib import Path

import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.shapes import Cylinder
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import Body
from cellplan.report.record.sections.rests_on import missing_tools, rests_on_record

BARE = "kuka works with its bare flange: state tool: {xyz_mm, geometry}, so that it is checked"


@pytest.fixture(scope="module")
def turntable(cells: Path) -> Cell:
    """A turntable that holds the part without a gripper, and an arm with a pen."""
    return load_cell(cells / "turntable.yaml")


def test_a_cell_with_tools_has_no_remark_though_a_table_holds_the_part_as_it_is(turntable: Cell) -> None:
    assert list(missing_tools(turntable)) == []


def test_an_arm_that_works_with_nothing_on_its_flange_is_named(turntable: Cell) -> None:
    bare = turntable.with_values({"robots.kuka.tool": None})

    assert list(missing_tools(bare)) == [("robots.kuka", BARE)]
    assert rests_on_record(bare, [])["lines"] == [BARE]


def test_a_tip_without_a_body_is_named(turntable: Cell) -> None:
    tip = turntable.with_values({"robots.kuka.tool": {"xyz_mm": [0, 0, 150]}})

    assert list(missing_tools(tip)) == [
        (
            "robots.kuka.tool",
            "the tool of kuka has no body: state tool.geometry or tool.bodies, so that it is checked",
        )
    ]


def test_a_gripper_in_the_robot_s_own_file_is_a_tool(turntable: Cell) -> None:
    bare = turntable.with_values({"robots.kuka.tool": None})
    kuka = bare.robot("kuka")
    finger = Body(
        name="finger",
        link=kuka.model.flange_link,
        shape=Cylinder(0.01, 0.1),
        X_BS=kuka.model.X_BF @ pose((0.0, 0.0, 0.05), (0.0, 0.0, 0.3)),
    )
    armed = replace(kuka, model=replace(kuka.model, bodies=(*kuka.model.bodies, finger)))
    robots = tuple(armed if robot.name == "kuka" else robot for robot in bare.robots)

    assert list(missing_tools(replace(bare, robots=robots))) == []
