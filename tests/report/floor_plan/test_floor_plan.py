"""The floor plan as SVG and as DXF: to scale, with the coordinates and dimensions of its cell."""

import re
from dataclasses import replace
from io import StringIO
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import ezdxf
import numpy as np
import pytest
from ezdxf.audit import Auditor

from cellplan import load_cell
from cellplan.geometry.shapes import HalfSpace
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Obstacle
from cellplan.model.robot.base_reaction import BaseReaction, PeakLoad
from cellplan.report.floor_plan.dxf import floor_plan_dxf
from cellplan.report.floor_plan.pendants import PlanFrame, PlanPendant
from cellplan.report.floor_plan.plan import FloorPlan
from cellplan.report.floor_plan.sheet import UNIT, floor_plan_svg, laid_out
from cellplan.runs.drawings.floor_plan import floor_plan
from cellplan.scene.kinematics.reach import arm_reach

NS = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def cell(cells: Path) -> Cell:
    loaded = load_cell(cells / "four_robots.yaml")
    wall = Obstacle(name="wall", shape=HalfSpace(), X_WS=pose((0.0, 1.6, 0.0), (np.pi / 2, 0.0, 0.0)))
    return replace(loaded, obstacles=(*loaded.obstacles, wall))


@pytest.fixture(scope="module")
def plan(cell: Cell) -> FloorPlan:
    start = {robot.name: robot.start for robot in cell.robots}
    turned = {name: np.linspace(q, q + np.eye(6)[0] * 0.5, 40) for name, q in start.items()}
    path = {"circle": np.array([[0.0, 0.0, 0.25], [0.1, 0.0, 0.25], [0.1, 0.1, 0.25]])}
    return floor_plan(cell, start, [turned], path, state="Robots at the start")


def drawing(plan: FloorPlan) -> ezdxf.document.Drawing:
    return ezdxf.read(StringIO(floor_plan_dxf(plan)))


def test_dimensions_are_the_differences_of_the_coordinates_of_the_bases(plan: FloorPlan) -> None:
    result = {(dimension.axis, dimension.row): [] for dimension in plan.dimensions}
    for dimension in plan.dimensions:
        result[dimension.axis, dimension.row].append(dimension.length)

    assert result == {
        (0, 0): [1175.0, 200.0, 875.0],
        (0, 1): [2250.0],
        (1, 0): [1025.0, 225.0, 550.0],
        (1, 1): [1800.0],
    }


def test_the_sheet_is_to_scale(plan: FloorPlan) -> None:
    sheet, root = laid_out(plan), ET.fromstring(floor_plan_svg(plan))  # noqa: S314 - our own text

    circles = root.findall(f"{NS}circle")
    centres = np.array([[float(circle.get("cx")), float(circle.get("cy"))] for circle in circles])
    bases = np.array([robot.base[:2] for robot in plan.robots])
    apart = UNIT / sheet.scale * (bases - bases[0]) * (1.0, -1.0)
    np.testing.assert_allclose(centres - centres[0], apart, atol=0.11)  # first axes stand above the bases
    radii = [float(circle.get("r")) * sheet.scale / UNIT for circle in circles]
    np.testing.assert_allclose(radii, [robot.reach for robot in plan.robots], atol=0.05 * sheet.scale / UNIT + 1e-9)
    assert (root.get("width"), root.get("viewBox").split()[2]) == (
        "297mm",
        "2970",
    )  # ten units are a millimetre of paper


def test_everything_is_on_the_paper(plan: FloorPlan) -> None:
    root = ET.fromstring(floor_plan_svg(plan))  # noqa: S314 - our own text

    for path in root.iter(f"{NS}path"):
        for x, y in re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", path.get("d")):
            assert 0.0 <= float(x) <= 2970.0
            assert 0.0 <= float(y) <= 2100.0
    assert {"kuka", "1175", "2250", "1800"} <= {"".join(entry.itertext()) for entry in root.iter(f"{NS}text")}


def test_a_swept_area_holds_the_outlines_at_both_ends(plan: FloorPlan) -> None:
    for robot in plan.robots:
        covered = np.concatenate(robot.swept)
        for outline in plan.outlines:
            if outline.robot == robot.name and not outline.is_base:
                assert (outline.corners.min(axis=0) >= covered.min(axis=0) - 20.0).all()  # to a square
                assert (outline.corners.max(axis=0) <= covered.max(axis=0) + 20.0).all()


def test_the_drawing_has_no_faults_and_is_in_millimetres(plan: FloorPlan) -> None:
    document = drawing(plan)
    auditor = Auditor(document)
    auditor.run()

    assert not auditor.errors
    assert not auditor.fixes
    assert document.header["$INSUNITS"] == 4
    layers = {layer.dxf.name for layer in document.layers}
    assert {"robots", "reach", "swept", "part", "surroundings", "dimensions", "paths", "names"} <= layers


def test_the_drawing_read_back_has_the_bases_reaches_and_dimensions_of_the_cell(plan: FloorPlan, cell: Cell) -> None:
    space = drawing(plan).modelspace()

    points = [tuple(entry.dxf.location) for entry in space.query("POINT[layer=='robots']")]
    np.testing.assert_allclose(points, [1e3 * robot.X_WB[:3, 3] for robot in cell.robots], atol=1e-3)
    circles = space.query("CIRCLE[layer=='reach']")
    reaches = [1e3 * arm_reach(robot.model) for robot in cell.robots]
    np.testing.assert_allclose(
        [circle.dxf.radius for circle in circles], reaches, rtol=2e-3
    )  # of a search with few rounds
    dimensions = space.query("DIMENSION[layer=='dimensions']")
    assert sorted(dimension.dxf.actual_measurement for dimension in dimensions) == sorted(
        dimension.length for dimension in plan.dimensions
    )
    for dimension in dimensions:
        along = np.array([np.cos(np.radians(dimension.dxf.angle)), np.sin(np.radians(dimension.dxf.angle)), 0.0])
        apart = np.array(dimension.dxf.defpoint3) - np.array(dimension.dxf.defpoint2)
        assert float(along @ apart) == pytest.approx(dimension.dxf.actual_measurement)
        assert dimension.get_geometry_block().query("TEXT").first.dxf.text == f"{dimension.dxf.actual_measurement:g}"


def test_a_wall_is_a_line_where_it_stands(plan: FloorPlan) -> None:
    (line,) = drawing(plan).modelspace().query("LINE[layer=='surroundings']")

    assert line.dxf.start.y == pytest.approx(1600.0)
    assert line.dxf.end.y == pytest.approx(1600.0)
    assert 'class="wall"' in floor_plan_svg(plan)


def test_equal_plans_give_equal_bytes(plan: FloorPlan) -> None:
    assert floor_plan_dxf(plan) == floor_plan_dxf(plan)


def test_names_and_numbers_of_the_table_leave_each_other_room(plan: FloorPlan) -> None:
    """Widths of letters are those of a wide type, by their height."""
    width = {"-": 0.37, ".": 0.33, "°": 0.5}
    base = np.array([-2598.1, -12598.1, 1500.5])
    robots = tuple(replace(robot, base=base, yaw_deg=-150.5, reach=10303.0) for robot in plan.robots)
    named = replace(robots[0], name="N" * 40)
    outlines = tuple(replace(outline, robot=None) for outline in plan.outlines)
    whole = replace(plan, robots=(named, *robots[1:]), outlines=outlines, paths=())

    rows: dict[str, list[tuple[float, float]]] = {}
    for entry in ET.fromstring(floor_plan_svg(whole)).iter(f"{NS}text"):  # noqa: S314 - our own text
        if entry.get("class") in {"key", "key right"} and float(entry.get("y")) > 400.0:
            x, across = float(entry.get("x")), 27.0 * sum(width.get(letter, 0.64) for letter in entry.text)
            box = (x - across, x) if "right" in entry.get("class") else (x, x + across)
            rows.setdefault(entry.get("y"), []).append(box)
    assert sorted(map(len, rows.values()))[-4:] == [5, 6, 6, 6]  # the long name has a line for itself
    assert all(left[1] <= right[0] for row in rows.values() for left, right in pairwise(sorted(row)))


def with_frames(plan: FloorPlan, count: int) -> FloorPlan:
    """The plan with frames of the part to type, at two places in turns."""
    frames = tuple(
        PlanFrame(
            name=f"UFRAME {number}",
            seen_from="base",
            numbers=(f"{number}.000",),
            purpose="seam & more" * 20,
            X_W=pose((0.5 * (number % 2), 0.25, 0.1), (0.0, 0.0, np.pi / 2)),
        )
        for number in range(1, count + 1)
    )
    pendant = PlanPendant(robot="kuka", title="kuka", labels=("X",), frames=frames, remarks=("mind this",))
    return replace(plan, pendants=(pendant,))


def test_frames_to_type_make_the_sheet_longer_and_leave_the_plan_as_it_is(plan: FloorPlan) -> None:
    plain, few, many = (floor_plan_svg(with_frames(plan, n) if n else plan) for n in (0, 4, 90))

    heights = [float(ET.fromstring(text).get("viewBox").split()[3]) for text in (plain, few, many)]  # noqa: S314
    assert heights[:2] == [2100.0, 4200.0]
    for text, height in ((few, heights[1]), (many, heights[2])):
        ends = [float(entry.get("y")) for entry in ET.fromstring(text).iter(f"{NS}text")]  # noqa: S314 - our own text
        assert 2100.0 < max(ends) < height - 80.0
    assert heights[2] > 4200.0
    rows = {entry.text for entry in ET.fromstring(few).iter(f"{NS}text")}  # noqa: S314 - our own text
    assert f"  UFRAME 1 in base  X 1.000  {'seam & more' * 20}"[:190] in rows  # the end of a long line is left out
    gone = set(plain.splitlines()[8:]) - set(few.splitlines())
    assert sorted(line.partition(" class=")[0] for line in gone) == ["<rect", "<text"]  # the paper, and what it is


def test_fixed_frames_of_the_part_are_drawn_where_they_are(plan: FloorPlan) -> None:
    framed = with_frames(plan, 4)
    sheet, root = laid_out(framed), ET.fromstring(floor_plan_svg(framed))  # noqa: S314 - our own text

    labels = {entry.text: (float(entry.get("x")), float(entry.get("y"))) for entry in root.iter(f"{NS}text")}
    for names, place in (("UFRAME 1, UFRAME 3", (500.0, 250.0)), ("UFRAME 2, UFRAME 4", (0.0, 250.0))):
        x, y = sheet.place(np.array(place))
        assert labels[names] == pytest.approx((x, y - 72.0), abs=0.1)
        turned = f"M{x:.1f} {y - 60.0:.1f}L{x:.1f} {y:.1f}L{x - 36.0:.1f} {y:.1f}"  # x axes point to +y, y axes to -x
        assert sum(path.get("d") == turned for path in root.iter(f"{NS}path")) == 2


def test_the_drawing_has_the_frames_to_type_as_texts(plan: FloorPlan) -> None:
    document = drawing(with_frames(plan, 2))

    texts = [entry.dxf.text for entry in document.modelspace().query("TEXT")]
    assert [text.strip() for text in texts if text.startswith(("kuka", "  "))][-4:] == [
        "kuka",
        f"UFRAME 1 in base  X 1.000  {'seam & more' * 20}",
        f"UFRAME 2 in base  X 2.000  {'seam & more' * 20}",
        "mind this",
    ]
    lines = document.modelspace().query("LINE[layer=='part']")
    assert {(round(line.dxf.start.x), round(line.dxf.start.y)) for line in lines} == {(500, 250), (0, 250)}


REACTIONS = ("Fv N", "Fh N", "Mk Nm", "Mr Nm")


def lines_of(plan: FloorPlan) -> list[tuple[float, str]]:
    """Texts of the sheet with their heights from its upper edge."""
    lines = re.findall(r'<text class="[^"]*" x="[^"]*" y="([^"]*)"[^>]*>([^<]*)</text>', floor_plan_svg(plan))
    return [(float(y), text) for y, text in lines]


def with_reactions(plan: FloorPlan, *names: str) -> FloorPlan:
    """The plan with base reactions of some robots."""
    reaction = BaseReaction(
        robot="",
        weight=2000.0,
        vertical=PeakLoad(2345.6, 0.1),
        horizontal=PeakLoad(678.9, 0.2),
        tilting=PeakLoad(1234.5, 0.3),
        turning=PeakLoad(432.1, 0.4),
        tilting_at_rest=PeakLoad(900.0, 0.5),
    )
    robots = tuple(replace(it, reaction=reaction if it.name in names else None) for it in plan.robots)
    return replace(plan, robots=robots)


def test_base_reactions_stand_below_the_legend_and_robots_without_masses_in_one_line(plan: FloorPlan) -> None:
    texts = [text for _, text in lines_of(with_reactions(plan, "kuka"))]
    at = texts.index("Base reactions in the motion")
    unknown = [robot.name for robot in plan.robots if robot.name != "kuka"]
    assert texts[at + 1 : at + 11] == [
        *REACTIONS, "kuka", "2346", "679", "1234", "432", f"not stated: masses of {', '.join(unknown)}"
    ]  # fmt: skip


def test_without_any_masses_the_plan_says_so_in_one_line(plan: FloorPlan) -> None:
    texts = [text for _, text in lines_of(plan)]
    assert not set(REACTIONS) & set(texts)
    assert sum("not stated: masses of" in text for text in texts) == 1


def test_base_reactions_that_do_not_fit_on_the_paper_are_counted(plan: FloorPlan) -> None:
    first = with_reactions(plan, plan.robots[0].name).robots[0]
    lines = lines_of(replace(plan, robots=(*plan.robots, *(replace(first, name=f"r{k}") for k in range(60)))))
    assert max(y for y, _ in lines) <= UNIT * 210
    assert any(re.fullmatch(r"and \d+ more in the report", text) for _, text in lines)


def test_the_drawing_has_the_base_reactions_as_texts(plan: FloorPlan) -> None:
    texts = [text.dxf.text for text in drawing(with_reactions(plan, "kuka")).modelspace().query("TEXT")]
    assert "  kuka: vertical 2346 N, horizontal 679 N, tilting 1234 Nm, turning 432 Nm" in texts
    assert any(text.startswith("  not stated: masses of") for text in texts)
