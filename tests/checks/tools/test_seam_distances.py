"""Rods beside walls: distances by closed forms, and verdicts on both sides of a limit."""

import numpy as np
import pytest
import trimesh
from builders.roller_paths import EX, EY, EZ, clocked, part_of, task_on

from cellplan.checks.tools.seam_distances import tip_check, tool_solids, wall_check, wall_distances
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamAngles, SeamLine
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Cylinder, Solid
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Tool
from cellplan.model.cell.rod import Rod
from cellplan.model.report.report import Check
from cellplan.model.robot.robot import BASE, Body
from cellplan.model.task.clocked_path import seam_at
from cellplan.model.task.seam import Seam, Stretch, Weave, WeaveForm
from cellplan.model.task.task import SpacePolylinePath
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks

WIRE = Rod(length=0.3, tilt=0.0, roll=0.0, radius=0.008, stick_out=0.015)
LINE = SpacePolylinePath(points=((-0.1, 0.0, 0.05), (0.1, 0.0, 0.05)), is_closed=False)
WALLS = {"floor": EZ, "web": -EY}
PLATE = part_of(Box((0.6, 0.6, 0.1)))


def solids_of(rod: Rod) -> list[tuple[Solid, Array]]:
    return tool_solids(Tool(X_FT=rod.X_FT, bodies=rod.bodies(), rod=rod), is_demanded=False)


def distances(work: float, *, standoff: float = 0.0, rod: Rod = WIRE) -> dict[str, Array]:
    angles = SeamAngles(face="floor", work=np.deg2rad(work), standoff=standoff)
    X_PT = build_toolpath(task_on(LINE, seam=Seam(walls=WALLS, angles=angles)), PLATE).spread(5)
    points = np.linspace(-0.1, 0.1, 5)[:, None] * EX + 0.05 * EZ
    return wall_distances(solids_of(rod), line_of(points), X_PT)


def line_of(points: Array) -> SeamLine:
    walls = {name: np.tile(normal, (len(points), 1)) for name, normal in WALLS.items()}
    behind = points[:, 0] - points[0, 0]
    return SeamLine(
        source="p", points=points, tangents=np.tile(EX, (len(points), 1)), behind=behind, walls=walls, is_closed=False
    )


@pytest.mark.parametrize("work", [30.0, 45.0, 60.0])
@pytest.mark.parametrize("standoff", [0.0, 0.01])
def test_round_end_of_a_rod_is_as_far_from_both_walls_as_its_angles_say(work: float, standoff: float) -> None:
    from_walls = distances(work, standoff=standoff)
    middle = 0.015 + 0.008 + standoff  # of the round end, along the axis

    assert from_walls["floor"] == pytest.approx(middle * np.cos(np.deg2rad(work)) - 0.008, abs=1e-12)
    assert from_walls["web"] == pytest.approx(middle * np.sin(np.deg2rad(work)) - 0.008, abs=1e-12)


def test_rod_that_leans_into_a_wall_is_nearest_at_its_far_end() -> None:
    from_walls = distances(-10.0)

    assert from_walls["web"] == pytest.approx(-np.sin(np.deg2rad(10.0)) * (0.3 - 0.008) - 0.008, abs=1e-12)


def test_tools_without_a_rod_are_as_far_from_walls_as_their_nearest_points() -> None:
    """A cylinder, a box and their meshes, 20 mm behind the tip of a tool at 45 degrees between both walls."""
    shift = pose((0.0, 0.0, 0.28 - 0.05))  # of a solid of 100 mm length, from the flange
    X_FT = pose((0.0, 0.0, 0.3))
    X_PT = build_toolpath(
        task_on(LINE, seam=Seam(walls=WALLS, angles=SeamAngles(face="floor", work=np.pi / 4.0))), PLATE
    ).spread(5)
    line = line_of(np.linspace(-0.1, 0.1, 5)[:, None] * EX + 0.05 * EZ)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * (0.01, 0.01, 0.05)
    mesh = make_mesh(corners, trimesh.convex.convex_hull(corners).faces, source="box")
    for shape, width in ((Cylinder(0.01, 0.1), 0.01), (Box((0.02, 0.02, 0.1)), None), (mesh, None)):
        tool = Tool(X_FT=X_FT, bodies=(Body(name="tool", link=BASE, shape=shape, X_BS=shift),))
        solids = tool_solids(tool, is_demanded=True)
        spun = X_PT[0, :3, :3].T @ EZ  # the normal of the floor in the tool, to which the box may be turned
        reach = width if width is not None else 0.01 * np.abs(spun[:2]).sum() / np.hypot(*spun[:2])
        got = wall_distances(solids, line, X_PT)

        assert got["floor"] == pytest.approx((0.02 - reach) * np.sqrt(0.5), abs=1e-9)
        assert not tool_solids(tool, is_demanded=False)


def checks_at(least: float, *, off: float = 0.0, **words: object) -> tuple[Check, Check]:
    """Checks of a tool that is off its path by a distance along the floor, away from the web."""
    angles = SeamAngles(face="floor", work=np.pi / 4.0, standoff=0.01)
    task = task_on(LINE, seam=Seam(walls=WALLS, angles=angles, rod_clearance=least), **words)
    cell = clocked(task, step=0.01)
    schedule = schedule_tasks(cell, [build_toolpath(task, PLATE)])
    (scheduled,), (path,) = schedule.tasks, schedule.paths
    line = seam_at(path, scheduled.travelled)
    assert line is not None
    X_PT = scheduled.X_PT.copy()
    X_PT[:, :3, 3] -= off * EY
    tip = tip_check(scheduled, line, X_PT, desired=scheduled.X_PT, times=schedule.times)
    return tip, wall_check(scheduled, wall_distances(solids_of(WIRE), line, X_PT), schedule.times)


def test_tip_farther_from_its_seam_than_its_standoff_fails() -> None:
    tip, _ = checks_at(0.0)
    away, _ = checks_at(0.0, off=0.001)

    assert tip.passed
    assert tip.value == pytest.approx(10.0, abs=1e-9)
    assert tip.limit == pytest.approx(10.1, abs=1e-9)
    assert not away.passed
    assert away.value == pytest.approx(1e3 * np.hypot(0.01 * np.sqrt(0.5), 0.01 * np.sqrt(0.5) + 0.001), abs=1e-9)


def test_weave_and_way_back_count_in_the_distance_of_the_tip() -> None:
    woven, wall = checks_at(
        0.0, weave=Weave(form=WeaveForm.SINE, side=0.003, wavelength=0.01), stretch=Stretch(back=0.01)
    )

    assert woven.passed
    assert woven.value == pytest.approx(1e3 * np.hypot(0.01, 0.003), rel=1e-3)
    assert wall.value == pytest.approx(1e3 * (0.033 * np.sqrt(0.5) - 0.008 - 0.003 * np.sqrt(0.5)), abs=0.02)


def test_rod_is_judged_by_the_distance_that_its_path_demands() -> None:
    present = 1e3 * (0.033 * np.sqrt(0.5) - 0.008)
    _, near = checks_at(0.0150)
    _, too_near = checks_at(0.0155)

    assert near.value == pytest.approx(present, abs=1e-9)
    assert near.passed
    assert not too_near.passed
    assert too_near.message.endswith("give it a stick-out or a standoff, another work angle, or a slimmer tool")
